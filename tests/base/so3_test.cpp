#include "base/base.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace cairn {
namespace {

// Rotation vectors of every size that matters: none, far under, at and over the change of branch, ordinary, near pi.
template <class S>
std::vector<Vec3<S>> rotationVectors() {
    const S pi = std::numbers::pi_v<S>;
    const S change = smallAngle<S>();
    std::vector<S> angles = {
        S(0), S(1e-12), S(1e-6), S(0.1) * change, S(0.99) * change, change, S(1.01) * change, S(3) * change, S(0.1),
        S(1), S(2),     S(3),    pi - S(1e-3),    pi - S(1e-5)};
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<Vec3<S>> vectors;
    for (const S angle : angles) {
        for (int k = 0; k < 5; ++k) {
            const Vec3d axis = Vec3d(normal(random), normal(random), normal(random)).normalized();
            vectors.push_back(angle * axis.cast<S>());
        }
        vectors.push_back(angle * Vec3<S>::UnitX());
    }
    return vectors;
}

// exp([theta]x) summed as a power series of matrices in long double: knows nothing of quaternions or sines.
using Mat3l = Eigen::Matrix<long double, 3, 3>;
template <class S>
Mat3l seriesExp(const Vec3<S>& theta) {
    const Mat3l k = hat<long double>(theta.template cast<long double>());
    Mat3l sum = Mat3l::Identity();
    Mat3l term = Mat3l::Identity();
    for (int n = 1; n < 60; ++n) {
        term = term * k / static_cast<long double>(n);
        sum += term;
    }
    return sum;
}

template <class A, class B>
double difference(const A& a, const B& b) {
    return static_cast<double>((a.template cast<long double>() - b.template cast<long double>()).cwiseAbs().maxCoeff());
}

template <class S>
class So3 : public testing::Test {
protected:
    static constexpr double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(So3, Scalars);

TYPED_TEST(So3, hatIsTheCrossProduct) {
    using S = TypeParam;
    const Vec3<S> v(S(1), S(-2), S(3));
    const Vec3<S> w(S(0.5), S(4), S(-1));
    EXPECT_EQ(Vec3<S>(hat(v) * w), Vec3<S>(v.cross(w)));
    EXPECT_EQ(Mat3<S>(hat(v).transpose()), Mat3<S>(-hat(v)));
}

TYPED_TEST(So3, expIsTheMatrixExponential) {
    using S = TypeParam;
    double worst = 0;
    double worstNorm = 0;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        worst = std::max(worst, difference(expMatrix(theta), seriesExp(theta)));
        worstNorm = std::max(worstNorm, std::abs(static_cast<double>(expQuat(theta).norm()) - 1));
    }
    EXPECT_LT(worst, 6 * this->epsilon);
    EXPECT_LT(worstNorm, 3 * this->epsilon);
}

TYPED_TEST(So3, logUndoesExp) {
    using S = TypeParam;
    double worst = 0;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        const Quat<S> q = expQuat(theta);
        worst = std::max(worst, difference(logQuat(q), theta) / std::max(1e-12, static_cast<double>(theta.norm())));
        const Quat<S> opposite(-q.w(), -q.x(), -q.y(), -q.z());
        EXPECT_EQ(logQuat(q), logQuat(opposite)) << theta.transpose();
    }
    EXPECT_LT(worst, 2 * this->epsilon);
}

TYPED_TEST(So3, logIsAtMostPi) {
    using S = TypeParam;
    const S pi = std::numbers::pi_v<S>;
    // A turn of pi + d is one of pi - d the other way.
    const S d = S(0.25);
    const Vec3<S> axis = Vec3<S>(S(1), S(2), S(-2)) / S(3);
    EXPECT_LT(difference(logQuat<S>(expQuat<S>((pi + d) * axis)), Vec3<S>((d - pi) * axis)), 10 * this->epsilon);
    EXPECT_NEAR(static_cast<double>(logQuat<S>(Quat<S>(S(0), S(0), S(1), S(0))).norm()), std::numbers::pi,
                4 * this->epsilon);
}

TYPED_TEST(So3, branchesMeetWithoutAStep) {
    using S = TypeParam;
    const Vec3<S> axis = Vec3<S>(S(2), S(-1), S(2)) / S(3);
    const S below = smallAngle<S>() * (S(1) - S(4) * std::numeric_limits<S>::epsilon());
    const S above = smallAngle<S>() * (S(1) + S(4) * std::numeric_limits<S>::epsilon());
    ASSERT_LT(below, smallAngle<S>());
    const Vec3<S> lo = below * axis;
    const Vec3<S> hi = above * axis;
    // The arguments themselves differ by 8 epsilon of the angle.
    EXPECT_LT(difference(expQuat(lo).coeffs(), expQuat(hi).coeffs()), 3 * this->epsilon);
    EXPECT_LT(difference(leftJacobian(lo), leftJacobian(hi)), 3 * this->epsilon);
    EXPECT_LT(difference(leftJacobianInverse(lo), leftJacobianInverse(hi)), 3 * this->epsilon);
    // log changes branch where sin(angle / 2) = smallAngle.
    const Vec3<S> half = S(2) * std::asin(smallAngle<S>()) * axis;
    const S shift = S(8) * std::numeric_limits<S>::epsilon();
    const Vec3<S> logLo = logQuat<S>(expQuat<S>(half * (S(1) - shift)));
    const Vec3<S> logHi = logQuat<S>(expQuat<S>(half * (S(1) + shift)));
    EXPECT_LT(difference(logLo, logHi), 30 * this->epsilon * static_cast<double>(half.norm()));
}

// exp(theta + d) = exp(J_L d) exp(theta) to first order: the columns of J_L by central differences in double. The
// differences leave h^2 / 6 of truncation and eps / h of round-off.
TYPED_TEST(So3, leftJacobianIsTheDerivativeOfExp) {
    using S = TypeParam;
    constexpr double h = 1e-5;
    double worst = 0;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        const Vec3d at = theta.template cast<double>();
        Mat3d numeric;
        for (int k = 0; k < 3; ++k) {
            const Vec3d step = h * Vec3d::Unit(k);
            numeric.col(k) =
                logQuat<double>(expQuat<double>(at + step) * expQuat<double>(at - step).conjugate()) / (2 * h);
        }
        worst = std::max(worst, difference(leftJacobian(theta), numeric));
    }
    EXPECT_LT(worst, std::max(4e-11, 3 * this->epsilon));
}

TYPED_TEST(So3, leftJacobianInverseIsItsInverse) {
    using S = TypeParam;
    double worst = 0;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        worst = std::max(
            worst, difference(Mat3<S>(leftJacobian(theta) * leftJacobianInverse(theta)), Mat3<S>(Mat3<S>::Identity())));
    }
    EXPECT_LT(worst, 5 * this->epsilon);
}

TYPED_TEST(So3, leftJacobianKeepsTheAxis) {
    using S = TypeParam;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        EXPECT_LT(difference(Vec3<S>(leftJacobian(theta) * theta), theta), 8 * this->epsilon);
    }
}

// A body turning at omega for t: the quaternion updated in many steps against exp([omega]x t) of matrices.
TYPED_TEST(So3, rotatedIsTheMatrixExponentialTimesTheMatrix) {
    using S = TypeParam;
    const Quat<S> start = expQuat<S>(Vec3<S>(S(0.3), S(-1.2), S(0.7)));
    double worst = 0;
    for (const Vec3<S>& theta : rotationVectors<S>()) {
        const Mat3l expected = seriesExp(theta) * start.toRotationMatrix().template cast<long double>();
        worst = std::max(worst, difference(rotated(start, theta).toRotationMatrix(), expected));
    }
    EXPECT_LT(worst, 8 * this->epsilon);

    constexpr int steps = 240;
    const Vec3<S> omega(S(1), S(-3), S(2));
    const S dt = S(1) / S(steps);
    Quat<S> q = start;
    for (int k = 0; k < steps; ++k) {
        q = rotated<S>(q, dt * omega);
    }
    const Mat3l expected = seriesExp(omega) * start.toRotationMatrix().template cast<long double>();
    const double error = difference(q.toRotationMatrix(), expected);
    EXPECT_LT(error, 20 * this->epsilon);
    EXPECT_NEAR(static_cast<double>(q.norm()), 1, 2 * this->epsilon);
}

TYPED_TEST(So3, completeBasisIsOrthonormalAndRightHanded) {
    using S = TypeParam;
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<Vec3<S>> normals = {Vec3<S>::UnitX(),  Vec3<S>::UnitY(),  Vec3<S>::UnitZ(),
                                    -Vec3<S>::UnitX(), -Vec3<S>::UnitY(), -Vec3<S>::UnitZ()};
    for (int k = 0; k < 100; ++k) {
        normals.push_back(Vec3d(normal(random), normal(random), normal(random)).normalized().cast<S>());
    }
    for (const Vec3<S>& n : normals) {
        Vec3<S> t1;
        Vec3<S> t2;
        completeBasis(n, t1, t2);
        Mat3<S> frame;
        frame << n, t1, t2;
        EXPECT_LT(difference(Mat3<S>(frame.transpose() * frame), Mat3<S>(Mat3<S>::Identity())), 6 * this->epsilon);
        EXPECT_GT(frame.determinant(), S(0));
    }
}

TYPED_TEST(So3, turnBetweenIsTheShortest) {
    using S = TypeParam;
    std::mt19937 random(8);
    std::normal_distribution<double> normal;
    const auto draw = [&] { return Vec3d(normal(random), normal(random), normal(random)).normalized(); };
    for (int k = 0; k < 100; ++k) {
        const Vec3d from = draw();
        const Vec3d aside = 3.0 * draw();
        // From the same direction to the opposite one.
        for (const double share : {0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0}) {
            for (const double sense : {1.0, -1.0}) {
                const Vec3<S> a = from.cast<S>();
                const Vec3<S> b = (sense * from + share * aside).cast<S>();
                const Quat<S> turn = turnBetween<S>(a, b);
                const double angle = std::atan2(static_cast<double>(a.cross(b).norm()), static_cast<double>(a.dot(b)));
                EXPECT_NEAR(static_cast<double>(turn.norm()), 1, 6 * this->epsilon);
                EXPECT_LT(static_cast<double>((turn * a - b.normalized()).norm()), 20 * this->epsilon);
                EXPECT_NEAR(static_cast<double>(turn.angularDistance(Quat<S>::Identity())), angle, 20 * this->epsilon);
            }
        }
    }
}

}  // namespace
}  // namespace cairn
