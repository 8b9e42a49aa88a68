#include "base/base.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace cairn {
namespace {

Posed poseOne() {
    return {{1, -2, 3}, expQuat<double>(Vec3d(0.4, -0.3, 1.1))};
}
Posed poseTwo() {
    return {{-5, 0.5, 2}, expQuat<double>(Vec3d(-2, 0.1, 0.6))};
}

// The 4x4 matrix of a pose: an independent way to the same algebra.
Eigen::Matrix4d matrixOf(const Posed& pose) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = pose.rotation.toRotationMatrix();
    m.topRightCorner<3, 1>() = pose.position;
    return m;
}

TEST(Pose, mapsPointsAsItsMatrix) {
    const Vec3d point(0.3, 7, -1);
    const Eigen::Vector4d expected = matrixOf(poseOne()) * point.homogeneous();
    EXPECT_LT((poseOne() * point - expected.head<3>()).norm(), 1e-14);
}

TEST(Pose, composesAsItsMatrix) {
    const Eigen::Matrix4d expected = matrixOf(poseOne()) * matrixOf(poseTwo());
    EXPECT_LT((matrixOf(poseOne() * poseTwo()) - expected).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Pose, inverseUndoes) {
    const Eigen::Matrix4d left = matrixOf(poseOne().inverse() * poseOne());
    const Eigen::Matrix4d right = matrixOf(poseOne() * poseOne().inverse());
    EXPECT_LT((left - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LT((right - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Pose, relativePoseIsInverseTimesInner) {
    const Eigen::Matrix4d expected = matrixOf(poseOne()).inverse() * matrixOf(poseTwo());
    EXPECT_LT((matrixOf(relativePose(poseOne(), poseTwo())) - expected).cwiseAbs().maxCoeff(), 1e-14);
}

// Positions 16 km out that float holds exactly: their difference must lose nothing, where inverse() * inner would.
TEST(Pose, relativePoseIsExactFarAway) {
    const Vec3f far(16384, -16384, 8192);
    const Quatf turned = expQuat<float>(Vec3f(0.3f, 1.1f, -0.4f));
    const Posef a{far, turned};
    const Posef b{far + Vec3f(0.25f, 0.5f, -0.125f), turned};
    const Vec3f expected = turned.conjugate() * Vec3f(0.25f, 0.5f, -0.125f);
    EXPECT_LT((relativePose(a, b).position - expected).norm(), 1e-7f);
    EXPECT_GT(((a.inverse() * b).position - expected).norm(), 1e-4f);
}

TEST(Pose, castKeepsTheRotationUnit) {
    const Posef narrow = poseOne().cast<float>();
    EXPECT_NEAR(narrow.rotation.norm(), 1.0f, 1e-7f);
    EXPECT_LT((narrow.cast<double>().position - poseOne().position).norm(), 1e-6);
    EXPECT_NEAR(narrow.cast<double>().rotation.norm(), 1.0, 1e-15);
}

TEST(Pose, isFiniteSeesEveryNumber) {
    EXPECT_TRUE(poseOne().isFinite());
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        for (int k = 0; k < 3; ++k) {
            Posed pose;
            pose.position[k] = bad;
            EXPECT_FALSE(pose.isFinite());
        }
        for (int k = 0; k < 4; ++k) {
            Posed pose;
            pose.rotation.coeffs()[k] = bad;
            EXPECT_FALSE(pose.isFinite());
        }
    }
}

}  // namespace
}  // namespace cairn
