// What lies: on its side, on its corners, in towers; and pairs that are carried while they stand still.
#include "tests/engine/engine_kit.hpp"

#include <map>

namespace cairn {
namespace {

// A barrel of n rings of `sides` corners each on a ball of radius 0.5 m: a hull of n * sides vertices.
Shape barrel(int rings, int sides) {
    std::vector<Vec3d> corners;
    std::vector<std::vector<int>> faces(2);
    for (int ring = 0; ring < rings; ++ring) {
        const double up = pi * ((ring + 0.7) / (rings + 0.4) - 0.5);
        for (int k = 0; k < sides; ++k) {
            const double around = 2 * pi * k / sides;
            corners.push_back(0.5 *
                              Vec3d(std::cos(up) * std::cos(around), std::sin(up), std::cos(up) * std::sin(around)));
            const int next = (k + 1) % sides;
            if (ring > 0) {
                faces.push_back(
                    {(ring - 1) * sides + k, ring * sides + k, ring * sides + next, (ring - 1) * sides + next});
            }
        }
    }
    for (int k = 0; k < sides; ++k) {
        faces[0].push_back(k);
        faces[1].push_back(rings * sides - 1 - k);
    }
    return hull(corners, faces);
}

// A prism that stands: `sides` corners above and below.
Shape prism(int sides, double radius, double halfHeight) {
    std::vector<Vec3d> corners;
    std::vector<std::vector<int>> faces(2);
    for (int k = 0; k < sides; ++k) {
        const double around = 2 * pi * k / sides;
        for (const double y : {-halfHeight, halfHeight}) {
            corners.push_back({radius * std::cos(around), y, radius * std::sin(around)});
        }
        const int next = (k + 1) % sides;
        faces[0].push_back(2 * k);
        faces[1].push_back(2 * (sides - 1 - k) + 1);
        faces.push_back({2 * k, 2 * k + 1, 2 * next + 1, 2 * next});
    }
    return hull(corners, faces);
}

struct Dropped {
    double spin = 0;   // rad/s, fastest of the last second
    double speed = 0;  // m/s, likewise
    int points = 0;    // that touch, at the end
    bool sleeps = false;
};

Dropped drop(const Shape& shape, const Quatd& turn, double height, bool sleep) {
    Worldd world({.sleep = {.enabled = sleep}});
    addFloor(world);
    const Aabb box = bounds({&shape, 1}, {Vec3d::Zero(), turn});
    const BodyId body = world.add({.shapes = {shape}, .position = Vec3d(0, height - box.min.y(), 0), .rotation = turn});
    Dropped result;
    for (int i = 0; i < 600; ++i) {
        world.step(1.0 / 60);
        if (i >= 540) {
            result.spin = std::max(result.spin, spin(world, body).norm());
            result.speed = std::max(result.speed, velocity(world, body).norm());
        }
    }
    for (const ContactView& contact : world.contacts()) {
        result.points += contact.separation < 1e-4 ? 1 : 0;
    }
    result.sleeps = !world.awake(body);
    return result;
}

// Balls that fall together do not approach each other until the lowest has met the floor, all within one step.
TEST(Landing, AColumnThatFallsTogetherStaysApart) {
    for (const char* const solver : {"auto", "gauss_seidel"}) {
        Worldd world({.solver = solverNamed(solver)});
        addFloor(world);
        for (int i = 0; i < 6; ++i) {
            world.add({.shapes = {withMaterial(sphere(0.1), 0, 0)},
                       .position = Vec3d(0, 0.6 + 0.22 * i, 0),
                       .linearVelocity = Vec3d(0, -7, 0)});
        }
        double worst = 0;
        for (int i = 0; i < 20; ++i) {
            worst = std::max(worst, world.step(0.01).error.maxPenetration);
        }
        expectBelow(std::string(solver) + ", penetration, m", worst, std::string(solver) == "auto" ? 1e-6 : 1e-2);
    }
}

TEST(Resting, CapsuleAndCylinderLieOnTheirSides) {
    for (const Shape& shape : {capsule(0.2, 0.4), cylinder(0.2, 0.4)}) {
        for (const double tilt : {0.0, 0.1}) {
            const Quatd side = expQuat<double>(Vec3d(0, 0, pi / 2 + tilt));
            const std::string what = std::string(name(shape.kind)) + " dropped by 5 cm, tilt " + std::to_string(tilt);
            const Dropped free = drop(shape, side, 0.05, false);
            expectBelow(what + ", speed, m/s", free.speed, 1e-4);
            expectBelow(what + ", spin, rad/s", free.spin, 1e-3);
            EXPECT_GE(free.points, 2) << what;
            EXPECT_TRUE(drop(shape, side, 0.05, true).sleeps) << what;
        }
    }
}

TEST(Resting, HullOf64VerticesDoesNotRock) {
    TestRandom random(2);
    for (int i = 0; i < 20; ++i) {
        const Quatd turn = random.rotation();
        const Dropped free = drop(barrel(8, 8), turn, 0.1, false);
        expectBelow("hull of 64 vertices, speed, m/s", free.speed, 1e-4);
        expectBelow("hull of 64 vertices, spin, rad/s", free.spin, 1e-4);
        EXPECT_GE(free.points, 3);
    }
}

struct Tower {
    const char* name;
    std::vector<Shape> shapes;  // repeated upward; each 2 * half high
    double half;
};

std::vector<Tower> towers() {
    std::vector<Tower> all = {{"boxes", {box({0.5, 0.5, 0.5})}, 0.5},
                              {"cylinders", {cylinder(0.5, 0.5)}, 0.5},
                              {"prisms of 64 vertices", {prism(32, 0.5, 0.5)}, 0.5},
                              {"prisms of 5 sides", {prism(5, 0.5, 0.5)}, 0.5},
                              {"planks of 10 : 1 : 0.2", {box({0.5, 0.01, 0.05})}, 0.01},
                              {"coins", {cylinder(0.1, 0.01)}, 0.01},
                              {"mixed", {}, 0.5}};
    for (std::size_t i = 0; i < 4; ++i) {
        all.back().shapes.push_back(all[i].shapes[0]);
    }
    return all;
}

// At default settings but for sleep, which would stop all watching after half a second.
TEST(Towers, OfTenOfEachShapeStandTwentySeconds) {
    for (const Tower& tower : towers()) {
        Worldd world({.sleep = {.enabled = false}});
        addFloor(world);
        std::map<BodyId, Vec3d> home;
        for (std::size_t i = 0; i < 10; ++i) {
            const Vec3d place(0, tower.half * (2.0 * static_cast<double>(i) + 1), 0);
            home[world.add({.shapes = {tower.shapes[i % tower.shapes.size()]},
                            .position = place,
                            .rotation = expQuat<double>(Vec3d(0, 0.3 * static_cast<double>(i % 2), 0))})] = place;
        }
        double moved = 0;
        for (int i = 0; i < 1200; ++i) {
            world.step(1.0 / 60);
            for (const auto& [id, place] : home) {
                moved = std::max(moved, (position(world, id) - place).norm());
            }
        }
        expectBelow(std::string("tower of 10 ") + tower.name + ", 20 s: moved, m", moved, 1e-3);
    }
}

// Round ones lie in layers of two, crosswise. They could roll without resistance, so that only sleep ends their drift.
TEST(Towers, OfTenLayersOfRoundShapesStandTwentySeconds) {
    for (const Shape& shape : {capsule(0.25, 0.75), cylinder(0.25, 0.75)}) {
        Worldd world;
        addFloor(world);
        std::map<BodyId, Vec3d> home;
        for (int layer = 0; layer < 10; ++layer) {
            for (const double aside : {-0.5, 0.5}) {
                const bool alongX = layer % 2 == 0;
                const Vec3d place(alongX ? 0 : aside, 0.5 * layer + 0.25, alongX ? aside : 0);
                const Vec3d turn = 0.5 * pi * Vec3d(alongX ? Vec3d::UnitZ() : Vec3d::UnitX());
                home[world.add({.shapes = {shape}, .position = place, .rotation = expQuat<double>(turn)})] = place;
            }
        }
        double moved = 0;
        for (int i = 0; i < 1200; ++i) {
            world.step(1.0 / 60);
            for (const auto& [id, place] : home) {
                moved = std::max(moved, (position(world, id) - place).norm());
            }
        }
        expectBelow(std::string("ten layers of ") + name(shape.kind) + "s, 20 s: moved, m", moved, 1e-3);
    }
}

// Boards side by side, each tied to its neighbours, under a heavy box: what joints hold and what lies on a floor are
// one problem of rows by the thousand, and rest as exactly as what is not tied.
TEST(Rest, OfASheetOfTiedBoardsIsExact) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    constexpr int side = 12;
    constexpr double half = 0.05;  // m
    std::vector<BodyId> boards;
    for (int k = 0; k < side * side; ++k) {
        const Vec3d place(2.2 * half * (k % side), half, 2.2 * half * (k / side));
        boards.push_back(world.add({.shapes = {box({half, half, half})}, .position = place, .mass = 1}));
        const auto tie = [&](int other, const Vec3d& between) {
            world.add(BallDef{.a = boards[static_cast<std::size_t>(other)], .b = boards.back(), .anchor = between});
        };
        if (k % side > 0) {
            tie(k - 1, place - Vec3d(1.1 * half, 0, 0));
        }
        if (k >= side) {
            tie(k - side, place - Vec3d(0, 0, 1.1 * half));
        }
    }
    const double middle = 1.1 * half * (side - 1);
    world.add({.shapes = {box({0.3, 0.2, 0.3})}, .position = Vec3d(middle, 2 * half + 0.2, middle), .mass = 100});
    run(world, 1);
    double depth = 0;
    double gap = 0;
    for (int i = 0; i < 60; ++i) {
        const StepReport& report = world.step(1.0 / 60);
        depth = std::max(depth, report.error.maxPenetration);
        gap = std::max(gap, report.error.maxJointGap);
    }
    expectBelow("144 tied boards under 100 kg, in the second second: depth, m", depth, 2.2e-8);
    expectBelow("gap of their joints, m", gap, 4e-9);
}

// A box on a floor that tilts slowly until it slides: every step moves it by less than the bound for a while.
Vec3d tiltedSlide(double manifoldReuseDistance, int& carried) {
    Worldd world({.sleep = {.enabled = false}, .manifoldReuseDistance = manifoldReuseDistance});
    world.add({.type = BodyType::Kinematic,
               .shapes = {withMaterial(box({5, 0.5, 5}), 0.1)},
               .position = Vec3d(0, -0.5, 0),
               .angularVelocity = Vec3d(0.003, 0.001, 0.02)});
    const BodyId crate =
        world.add({.shapes = {withMaterial(box({0.5, 0.3, 0.4}), 0.1)}, .position = Vec3d(1, 0.3, 0.5)});
    carried = 0;
    for (int i = 0; i < 360; ++i) {
        carried += world.step(1.0 / 60).counts.carriedPairs;
    }
    return position(world, crate);
}

TEST(ManifoldReuse, AreCarriedAndChangeLittle) {
    int none = 0;
    int some = 0;
    const Vec3d exact = tiltedSlide(0, none);
    const Vec3d carried = tiltedSlide(1e-4, some);
    EXPECT_EQ(none, 0);
    EXPECT_GT(some, 200) << "while floor and box turn together";
    expectBelow("a carried manifold moves a sliding box by, m", (carried - exact).norm(), 1e-4);
}

// A ball that rolls by less than the bound in a step keeps its speed.
TEST(ManifoldReuse, DoNotDriveWhatRolls) {
    for (const double speed : {1e-3, 3e-3, 3e-2}) {
        Worldd world({.sleep = {.enabled = false}});
        addFloor(world);
        const BodyId ball = world.add({.shapes = {sphere(0.2)},
                                       .position = Vec3d(0, 0.2, 0),
                                       .linearVelocity = Vec3d(speed, 0, 0),
                                       .angularVelocity = Vec3d(0, 0, -speed / 0.2)});
        run(world, 10);
        expectClose("speed after 10 s of slow rolling, m/s", velocity(world, ball).x(), speed, 1e-9);
    }
}

// A still body that is thrown at another is looked for as far as it gets.
TEST(ManifoldReuse, AreAskedAgainWhenThrown) {
    Worldd world({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}});
    const BodyId a = addBox(world, Vec3d::Zero());
    const BodyId b = addBox(world, Vec3d(1.05, 0, 0));
    run(world, 0.1);
    world.setVelocity(a, Vec3d(12, 0, 0), Vec3d::Zero());
    world.step(1.0 / 60);
    expectBelow("overlap after the throw, m", std::max(0.0, 1 - (position(world, b) - position(world, a)).x()), 1e-6);
}

}  // namespace
}  // namespace cairn
