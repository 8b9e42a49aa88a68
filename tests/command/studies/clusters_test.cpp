// What the study of clusters measures is what it says: one cluster of all bodies is Newton's answer, and every method
// comes nearer to it.
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

TEST(ClusterStudyTest, MethodsComeToNewtonsAnswerOnANet) {
    const ClusterCase net = clusterCase("net", netScene(5), 0.5, 1);
    EXPECT_EQ(net.bodies, 20);
    EXPECT_EQ(net.rows, 36);
    EXPECT_GT(net.startError, 1e-4);
    EXPECT_LT(net.referenceResidual, 1e-7);
    EXPECT_LT(net.curve("cluster", net.bodies).points.front().error, 1e-5 * net.startError);
    for (const ClusterCurve& curve : net.curves) {
        EXPECT_LT(curve.points.back().error, curve.points.front().error + 1e-7) << curve.method << " " << curve.size;
        EXPECT_LT(curve.points.back().error, 0.5 * net.startError) << curve.method << " " << curve.size;
    }
    for (const ClusterRun& run : net.runs) {
        EXPECT_LT(run.worstError, 0.02) << run.method << " " << run.size;
    }
}

TEST(ClusterStudyTest, CurvesAreReadBetweenTheirPoints) {
    const ClusterCurve curve{.method = "nncg", .points = {{1, 0.1, 0.1, 1, 1}, {4, 0.001, 0.001, 4, 100}}};
    EXPECT_EQ(curve.at(0.5, &ClusterPoint::error, 7), 7);
    EXPECT_NEAR(curve.at(10, &ClusterPoint::error, 7), 0.01, 1e-12);
    EXPECT_EQ(curve.at(1000, &ClusterPoint::error, 7), 0.001);
}

}  // namespace
}  // namespace cairn
