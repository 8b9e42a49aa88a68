// How many sub-steps auto takes of what hangs together and touches something: as many as its contacts ask for.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Chains of eight bars, let go askew over a floor, each across the one below: too much for exact solutions as they
// land.
struct Fall {
    Worldd world{{.sleep = {.enabled = false}}};
    std::vector<BodyId> bars;

    Fall() {
        world.add({.type = BodyType::Static, .shapes = {box({20, 1, 20})}, .position = {0, -1, 0}});
        for (int k = 0; k < 6; ++k) {
            hang({0, 0.8 + 0.5 * k, 0}, Quatd(Eigen::AngleAxisd(0.6 * k, Vec3d::UnitY())) *
                                            Quatd(Eigen::AngleAxisd(0.2, Vec3d(0.2, 0.3, 1).normalized())));
        }
    }
    void hang(const Vec3d& middle, const Quatd& rotation) {
        for (int k = 0; k < 8; ++k) {
            const auto at = [&](double along) { return Vec3d(middle + rotation * Vec3d(along, 0, 0)); };
            bars.push_back(world.add({.shapes = {box({0.2, 0.07, 0.05})},
                                      .position = at(0.44 * (k - 3.5)),
                                      .rotation = rotation,
                                      .angularDamping = 1}));
            if (k > 0) {
                world.add(BallDef{.a = bars[bars.size() - 2], .b = bars.back(), .anchor = at(0.44 * (k - 4))});
            }
        }
    }
    // m/s: no point of a bar is faster.
    double fastest() const {
        double most = 0;
        for (const BodyId bar : bars) {
            const double radius = Vec3d(0.2, 0.07, 0.05).norm();
            most = std::max(most, world.linearVelocity(bar).norm() + radius * world.angularVelocity(bar).norm());
        }
        return most;
    }
    double fastestCentre() const {  // m/s
        double most = 0;
        for (const BodyId bar : bars) {
            most = std::max(most, world.linearVelocity(bar).norm());
        }
        return most;
    }
    double deepest() const {  // m, by the poses, in the floor
        double lowest = 0;
        for (const BodyId bar : bars) {
            const Posed pose = world.pose(bar);
            const Vec3d reach = pose.rotation.toRotationMatrix().row(1).cwiseAbs();
            lowest = std::min(lowest, pose.position.y() - reach.dot(Vec3d(0.2, 0.07, 0.05)));
        }
        return -lowest;
    }
};

// One for each 45 mm that a point goes at or along what it touches, and for each 10 mm that one is deep. And
// where an exact solution has failed none is tried before it rests.
TEST(TouchingSubsteps, AreAsManyAsContactsAskFor) {
    Fall fall;
    int lying = 0;
    int notByDepth = 0;
    int landing = 0;
    int tooFew = 0;
    bool hasFailed = false;
    int moving = 0;
    int notInMotion = 0;
    double deepest = 0;
    double atRest = 0;
    for (int i = 0; i < 600; ++i) {
        const double speed = fall.fastest();
        const bool moves = fall.fastestCentre() > 0.05;  // as DirectTuning::movingSpeed
        double approach = 0;                             // m/s
        double depth = 0;
        for (const ContactView& contact : fall.world.contacts()) {
            approach = std::max(approach, contact.approachSpeed);
            depth = std::max(depth, -contact.separation);
        }
        const bool isTouching = !fall.world.contacts().empty();
        const StepReport& report = fall.world.step(dt);
        deepest = std::max(deepest, fall.deepest());
        atRest = i < 300 ? 0 : std::max(atRest, fall.deepest());
        const IslandReport& island = report.islands.front();
        hasFailed = hasFailed || island.reason == PlanReason::InMotion;
        if (hasFailed && moves && report.islands.size() == 1 && isTouching) {
            ++moving;
            notInMotion += island.reason == PlanReason::InMotion ? 0 : 1;
        }
        if (!island.swept || island.halvings > 0) {
            continue;
        }
        if (speed < 0.1) {
            ++lying;
            notByDepth += island.substeps == std::clamp(static_cast<int>(std::ceil(depth / 0.01)), 1, 4) ? 0 : 1;
        }
        if (const int asked = static_cast<int>(std::ceil(approach * dt / 0.045)); asked > 1) {
            ++landing;
            tooFew += island.substeps < std::min(asked, 4) ? 1 : 0;
        }
    }
    expectBelow("deepest in the floor, m", deepest, 0.032);
    expectBelow("of what lies, m", atRest, 0.0115);
    EXPECT_GT(lying, 300);
    EXPECT_EQ(notByDepth, 0);
    EXPECT_GT(landing, 20);
    EXPECT_EQ(tooFew, 0);
    EXPECT_GT(moving, 40);
    EXPECT_EQ(notInMotion, 0);
}

}  // namespace
}  // namespace cairn
