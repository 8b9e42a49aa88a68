// What should stand stands, and what should slide slides, whichever narrow phase finds the contacts: our own, or FCL's
// by its closed forms (boxes) and its search (cylinders, capsules, rocks).
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace cairn {
namespace {

class NarrowPhases : public testing::TestWithParam<NarrowPhase> {
protected:
    Scene scene(const std::string& name, const SceneOverrides& overrides) const {
        Scene made = makeScene(name, overrides);
        made.world.sleep.enabled = false;
        made.world.narrowPhase = GetParam();
        return made;
    }

    void expectAsked(const SceneRun& run) const {
        EXPECT_EQ(run.result().narrow.throughFcl > 0, GetParam() == NarrowPhase::Fcl);
        EXPECT_EQ(run.result().flags & (FlagNonFinite | FlagRepaired), 0U);
    }
};

void expectBelow(const std::string& what, double value, double bound) {
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        std::printf("    %-50s %12.5g  (bound %g)\n", what.c_str(), value, bound);
    }
    EXPECT_LE(std::abs(value), bound) << what;
}

TEST_P(NarrowPhases, TowersStand) {
    constexpr std::array kinds = {"boxes", "cylinders", "capsules", "rocks", "compounds"};
    constexpr std::array bounds = {4e-7, 8e-7, 5e-5, 1.3e-6, 4e-7};  // m
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        const Scene tower = scene("tower", {{"n", 10}, {"kind", static_cast<double>(kind)}});
        SceneRun run(tower);
        run.advanceTo(2);
        expectBelow(std::string(kinds[kind]) + ", displacement", run.result().worst.displacement, bounds[kind]);
        expectAsked(run);
    }
}

TEST_P(NarrowPhases, APyramidStandsUnderBothFamilies) {
    for (const auto& [solver, bound] : {std::pair("auto", 5e-7), std::pair("gauss_seidel", 1.3e-3)}) {
        Scene pyramid = scene("pyramid", {{"rows", 10}});
        pyramid.world.solver = solverNamed(solver);
        SceneRun run(pyramid);
        run.advanceTo(2);
        expectBelow(std::string("pyramid, ") + solver, run.result().worst.displacement, bound);
        expectAsked(run);
    }
}

Shape boxAsHull(const Shape& of) {
    const Vec3d h = of.size;
    std::vector<Vec3d> corners;
    for (int i = 0; i < 8; ++i) {
        corners.emplace_back((i & 1) != 0 ? h.x() : -h.x(), (i & 2) != 0 ? h.y() : -h.y(),
                             (i & 4) != 0 ? h.z() : -h.z());
    }
    Shape made = hull(corners, {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}});
    made.material = of.material;
    return made;
}

Shape boxAsCylinder(const Shape& of) {
    Shape made = cylinder(of.size.x(), of.size.y());
    made.material = of.material;
    return made;
}

// On lanes of 30 degrees, of friction 0 to 1 by tenths: what is below tan 30 slides down s = a t (t + dt) / 2 with
// a = g sin - mu g cos, where dt is symplectic Euler's: each step moves by the speed at its end.
TEST_P(NarrowPhases, FrictionAnglePartsWhatSlidesFromWhatSticks) {
    const std::array<std::pair<const char*, Shape (*)(const Shape&)>, 3> kinds = {
        {{"box", [](const Shape& s) { return s; }}, {"hull", boxAsHull}, {"cylinder", boxAsCylinder}}};
    for (const auto& [kind, made] : kinds) {
        Scene slope = scene("slope", {{"lanes", 11}});
        std::vector<std::size_t> blocks;
        for (std::size_t i = 0; i < slope.bodies.size(); ++i) {
            if (slope.bodies[i].type == BodyType::Dynamic) {
                blocks.push_back(i);
                slope.bodies[i].shapes = {made(slope.bodies[i].shapes[0])};
            }
        }
        ASSERT_EQ(blocks.size(), 11u);
        SceneRun run(slope);
        run.advanceTo(1);
        double slid = 0;
        double stuck = 0;
        for (std::size_t k = 0; k < blocks.size(); ++k) {
            const double mu = 0.1 * static_cast<double>(k);
            const double pull = 9.81 * (std::sin(M_PI / 6) - mu * std::cos(M_PI / 6));
            const double moved = (run.simulation().pose(blocks[k]).position - slope.bodies[blocks[k]].position).norm();
            double& off = pull > 0 ? slid : stuck;
            off = std::max(off, std::abs(moved - std::max(pull, 0.0) * (1 + slope.dt) / 2));
        }
        expectBelow(std::string(kind) + ", slid off by", slid, 1e-4);
        expectBelow(std::string(kind) + ", stuck off by", stuck, 4e-9);
        expectAsked(run);
    }
}

INSTANTIATE_TEST_SUITE_P(Both, NarrowPhases, testing::Values(NarrowPhase::Own, NarrowPhase::Fcl),
                         [](const auto& tested) { return tested.param == NarrowPhase::Own ? "own" : "fcl"; });

}  // namespace
}  // namespace cairn
