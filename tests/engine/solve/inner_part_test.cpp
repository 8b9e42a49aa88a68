// Bodies that ask for a tolerance of their own among others that do not: they alone are solved again.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

constexpr double dt = 1.0 / 60;

// Five jointed capsules in a row along x.
std::vector<BodyId> addChain(Worldd& world, const Vec3d& from, double tolerance, const Vec3d& velocity) {
    std::vector<BodyId> links;
    for (int i = 0; i < 5; ++i) {
        links.push_back(world.add({.shapes = {capsule(0.1, 0.15)},
                                   .position = from + Vec3d(0.5 * i, 0, 0),
                                   .rotation = expQuat<double>(Vec3d(0, 0, pi / 2)),
                                   .linearVelocity = velocity,
                                   .mass = 3,
                                   .tolerance = tolerance}));
        if (i > 0) {
            world.add(
                BallDef{.a = links[links.size() - 2], .b = links.back(), .anchor = from + Vec3d(0.5 * i - 0.25, 0, 0)});
        }
    }
    return links;
}

// Boxes of 1 to 7 kg that fall into a bin, and a chain that falls onto them.
std::vector<BodyId> addPile(Worldd& world, double boxes, double chain) {
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    for (const Vec3d& n : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 0, 1), Vec3d(0, 0, -1)}) {
        world.add({.type = BodyType::Static, .shapes = {halfSpace(n, 0)}, .position = -1.5 * n});
    }
    for (int i = 0; i < 24; ++i) {
        world.add({.shapes = {box({0.25, 0.2, 0.3})},
                   .position = Vec3d(-0.9 + 0.6 * (i % 4), 0.4 + 0.6 * (i / 8), -0.5 + 1.0 * (i / 4 % 2)),
                   .rotation = expQuat<double>(Vec3d(0.1 * i, 0.3 * i, 0.2)),
                   .mass = 1.0 + i % 7,
                   .tolerance = boxes});
    }
    return addChain(world, Vec3d(-1, 2.6, 0), chain, Vec3d(0, -3, 0));
}

struct Outcome {
    double worst = 0;  // m, of the chain's bodies, in steps that are not flagged
    int flagged = 0;
    int steps = 0;  // of islands with the chain
    int raised = 0;
    int alone = 0;
    double work = 0;
};

Outcome run(double boxes, double chain) {
    Worldd world;
    const std::vector<BodyId> links = addPile(world, boxes, chain);
    Outcome r;
    for (int i = 0; i < 120; ++i) {
        const StepReport& report = world.step(dt);
        r.work += report.counts.work;
        for (const IslandReport& island : report.islands) {
            r.raised += island.pieces > 1 ? 1 : 0;
            r.alone += island.ownPieces > 0 ? 1 : 0;
            ++r.steps;
        }
        if ((report.flags & FlagTolerance) != 0) {
            ++r.flagged;
            continue;
        }
        for (const BodyErrorView& view : world.bodyErrors()) {
            if (std::find(links.begin(), links.end(), view.id) != links.end()) {
                r.worst = std::max(r.worst, view.position);
            }
        }
    }
    return r;
}

TEST(InnerPart, AChainInAPileDoesNotRaiseThePile) {
    constexpr double asked = 1e-3;
    const Outcome coarse = run(0, 0);
    const Outcome own = run(0, asked);
    const Outcome all = run(asked, asked);
    expectBelow("chain, nothing asked, m", coarse.worst, 0.2);
    EXPECT_GT(coarse.worst, 2 * asked) << "or there is nothing to refine";
    expectBelow("chain, asked for, m", own.worst, asked);
    expectBelow("steps flagged", own.flagged, 3);
    EXPECT_GT(own.alone, 20);
    expectBelow("islands raised as a whole", own.raised, 3);
    expectBelow("work against raising all", own.work / all.work, 0.8);
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        for (const Outcome& r : {coarse, own, all}) {
            std::printf("    worst %.3g flagged %d raised %d alone %d of %d, work %.3g\n", r.worst, r.flagged, r.raised,
                        r.alone, r.steps, r.work);
        }
    }
}

// Nothing but the bodies themselves: what the chain is given anew, the boxes get back.
TEST(InnerPart, MomentumIsKept) {
    Worldd world({.gravity = Vec3d::Zero()});
    std::vector<BodyId> all = addChain(world, Vec3d(-1, 1.2, 0), 1e-5, Vec3d(0, -4, 0.3));
    for (int i = 0; i < 6; ++i) {
        all.push_back(world.add({.shapes = {box({0.3, 0.2, 0.3})},
                                 .position = Vec3d(-1.2 + 0.65 * i, 0.5 - 0.1 * (i % 2), 0.05 * i),
                                 .mass = 1.0 + i}));
    }
    const auto momentum = [&] {
        Vec3d sum = Vec3d::Zero();
        for (const BodyId id : all) {
            sum += world.mass(id) * world.linearVelocity(id);
        }
        return sum;
    };
    const Vec3d before = momentum();
    int alone = 0;
    for (int i = 0; i < 60; ++i) {
        for (const IslandReport& island : world.step(dt).islands) {
            alone += island.ownPieces > 0 ? 1 : 0;
        }
    }
    EXPECT_GT(alone, 3);
    expectBelow("momentum, N s of 60", (momentum() - before).norm(), 1e-11);
}

TEST(InnerPart, GivesTheSameBitsForAnyThreadCount) {
    std::vector<Posed> ends;
    for (const int threads : {1, 3}) {
        Worldd world({.threads = threads});
        const std::vector<BodyId> links = addPile(world, 0, 1e-3);
        for (int i = 0; i < 60; ++i) {
            world.step(dt);
        }
        ends.push_back(world.pose(links.back()));
    }
    EXPECT_EQ(ends[0].position, ends[1].position);
    EXPECT_EQ(ends[0].rotation.coeffs(), ends[1].rotation.coeffs());
}

}  // namespace
}  // namespace cairn
