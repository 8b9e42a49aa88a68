// How many sub-steps auto takes of what swings by joints alone: as many as its turning asks for, most of which its pins
// know of.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace cairn {
namespace {

constexpr int netSide = 8;

// Knots of 1 kg, .5 m apart, pinned to their neighbours halfway, hung by two corners and let go flat.
struct Net {
    struct End {
        int a, b;
        Vec3d half;  // m, from a to the anchor, and from there to b
    };
    Worldd world;
    std::vector<BodyId> knots;
    std::vector<End> ends;

    explicit Net(const WorldDef& def) : world(def) {
        for (int i = 0; i < netSide * netSide; ++i) {
            const bool hung = i == 0 || i == netSide - 1;
            knots.push_back(world.add(BodyDef{.type = hung ? BodyType::Static : BodyType::Dynamic,
                                              .shapes = {box(Vec3d::Constant(0.08))},
                                              .position = Vec3d(0.5 * (i % netSide), 10, 0.5 * (i / netSide)),
                                              .mass = hung ? 0.0 : 1.0,

                                              .filter = {.mask = 0}}));
        }
        for (int i = 0; i < netSide * netSide; ++i) {
            if (i % netSide + 1 < netSide) {
                pin(i, i + 1, Vec3d(0.25, 0, 0));
            }
            if (i + netSide < netSide * netSide) {
                pin(i, i + netSide, Vec3d(0, 0, 0.25));
            }
        }
    }
    void pin(int a, int b, const Vec3d& half) {
        const Vec3d from = world.pose(knots[static_cast<std::size_t>(a)]).position;
        world.add(BallDef{
            .a = knots[static_cast<std::size_t>(a)], .b = knots[static_cast<std::size_t>(b)], .anchor = from + half});
        ends.push_back({a, b, half});
    }

    double energy() const {
        double sum = 0;
        for (std::size_t i = 0; i < knots.size(); ++i) {
            if (i != 0 && i != netSide - 1) {
                const BodyId id = knots[i];
                const double inertia = 2.0 / 3 * 0.08 * 0.08;  // kg m2, of a cube of 1 kg about any axis
                sum += standardGravity * world.pose(id).position.y() + 0.5 * world.linearVelocity(id).squaredNorm() +
                       0.5 * inertia * world.angularVelocity(id).squaredNorm();
            }
        }
        return sum;
    }
    // m: by how much the anchors of a pin part in a sub-step of h, since both bodies turn: half the difference of the
    // centripetal accelerations, times h^2. Of all pins.
    double openedByTurning(double h) const {
        double most = 0;
        for (const End& end : ends) {
            const auto bend = [&](int knot, const Vec3d& arm) -> Vec3d {
                const BodyId id = knots[static_cast<std::size_t>(knot)];
                const Vec3d w = world.angularVelocity(id);
                return w.cross(w.cross(world.pose(id).rotation * arm));
            };
            most = std::max(most, 0.5 * h * h * (bend(end.a, end.half) - bend(end.b, -end.half)).norm());
        }
        return most;
    }
    double gap() const {
        double most = 0;
        for (const End& end : ends) {
            const Pose<double> a = world.pose(knots[static_cast<std::size_t>(end.a)]);
            const Pose<double> b = world.pose(knots[static_cast<std::size_t>(end.b)]);
            most = std::max(most, (a.position + a.rotation * end.half - b.position + b.rotation * end.half).norm());
        }
        return most;
    }
};

}  // namespace

TEST(NetSubsteps, AreAsManyAsTurningAsksFor) {
    WorldDef def;
    def.sleep.enabled = false;
    Net net(def);
    const double begun = net.energy();
    double highest = begun;
    double widest = 0;
    std::vector<double> ratios;
    std::array<int, 5> taken{};
    for (int i = 0; i < 600; ++i) {
        const double expected = net.openedByTurning(dt);
        const StepReport& report = net.world.step(dt);
        widest = std::max(widest, net.gap());
        highest = std::max(highest, net.energy());
        const IslandReport& island = report.islands.front();
        if (i > 10 && island.swept && island.halvings == 0 && expected > 1e-4) {
            ++taken.at(static_cast<std::size_t>(std::min(island.substeps, 4)));
            ratios.push_back(net.gap() * island.substeps * island.substeps / expected);
        }
    }
    std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
    // Off the tangent, it would be 1.
    expectBelow("gap over what turning opens, median", ratios[ratios.size() / 2], 0.14);
    expectBelow("widest gap, m", widest, 5e-3);
    expectBelow("energy gained, of the peak of what moves", (highest - begun) / begun, 1e-3);
    const int steps = std::accumulate(taken.begin(), taken.end(), 0);
    expectBelow("of the swept steps, those of more than one sub-step", 1 - static_cast<double>(taken[1]) / steps, 0.3);
    EXPECT_GT(taken[2] + taken[3] + taken[4], 5);
    EXPECT_GT(steps, 300);
}

// The knee's own solution with the step divided is enough, and is tried before exact ones, which cost a net a hundred
// times as much.
TEST(NetSubsteps, AnAskedErrorIsReachedByDividingTheStep) {
    constexpr double asked = 2e-4;  // m; 6e-4 where nothing is asked
    WorldDef def;
    def.sleep.enabled = false;
    def.accuracy.position = asked;
    Net net(def);
    double widest = 0;
    int divided = 0;
    int exact = 0;
    int solves = 0;
    for (int i = 0; i < 300; ++i) {
        const StepReport& report = net.world.step(dt);
        const IslandReport& island = report.islands.front();
        widest = std::max(widest, net.gap());
        divided += island.subdivisions > 1 ? 1 : 0;
        exact += island.swept ? 0 : 1;
        solves += island.solves;
    }
    expectBelow("widest gap, m", widest, asked);
    EXPECT_GT(divided, 30);
    expectBelow("exact solutions", exact, 10);
    expectBelow("solutions a step", solves / 300.0, 1.2);
}

}  // namespace cairn
