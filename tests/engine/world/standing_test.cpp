// What stands as it was put up and is too large to be solved in one step is left standing until it is.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

// Courses of bricks in running bond on a floor, awake for ever. tilt: rad, of gravity, along the wall.
template <class S>
struct Wall {
    World<S> world;
    BodyId floor;
    std::vector<BodyId> bricks;
    std::vector<Vec3d> places;

    Wall(int courses, int length, int threads = 1, double tilt = 0, const Vec3d& at = Vec3d::Zero(),
         const AccuracyDef& accuracy = {})
        : world({.gravity = standardGravity * Vec3d(std::sin(tilt), -std::cos(tilt), 0),
                 .accuracy = accuracy,
                 .sleep = {.enabled = false},
                 .threads = threads}) {
        floor = world.add({.type = BodyType::Static, .shapes = {box({500, 1, 500})}, .position = {0, -1, 0}});
        build(courses, length, at);
    }
    void build(int courses, int length, const Vec3d& at) {
        for (int course = 0; course < courses; ++course) {
            for (int i = 0; i < length; ++i) {
                places.push_back(at + Vec3d(i + 0.5 * (course % 2), 0.25 + 0.5 * course, 0));
                bricks.push_back(world.add({.shapes = {box({0.5, 0.25, 0.25})}, .position = places.back(), .mass = 2}));
            }
        }
    }
    // Of the islands of the last step, those that are left standing.
    int standing() const {
        const auto& islands = world.report().islands;
        return static_cast<int>(std::count_if(islands.begin(), islands.end(), [](const IslandReport& island) {
            return island.reason == PlanReason::Standing;
        }));
    }
    // Steps until none is, that one included.
    int stepUntilSolved(int most = 130) {
        int steps = 1;
        for (world.step(S(dt)); standing() > 0 && steps < most; world.step(S(dt))) {
            ++steps;
        }
        return steps;
    }
    double moved() const {
        double most = 0;
        for (std::size_t i = 0; i < bricks.size(); ++i) {
            most = std::max(most, (world.pose(bricks[i]).position.template cast<double>() - places[i]).norm());
        }
        return most;
    }
    // N, of the floor on all bricks.
    double onFloor() const {
        double sum = 0;
        for (const ContactView& contact : world.contacts()) {
            sum += contact.a == floor || contact.b == floor ? contact.normalForce : 0;
        }
        return sum;
    }
    double weight() const { return 2 * standardGravity * static_cast<double>(bricks.size()); }
};

TEST(Standing, IsSolvedOverSeveralStepsAndThenSettled) {
    Wall<double> wall(20, 20);
    const StepReport& first = wall.world.step(dt);
    EXPECT_EQ(wall.standing(), 1);
    EXPECT_EQ(first.counts.truncated, 1);
    EXPECT_EQ(first.counts.directIslands + first.counts.sweptIslands, 0);
    EXPECT_NE(first.summary().find("truncated"), std::string::npos);
    // What gravity would have given them, sqrt(J).
    expectClose("residual", first.error.residualMomentum,
                std::sqrt(2.0 * static_cast<double>(wall.bricks.size())) * standardGravity * dt, 1e-12);
    EXPECT_EQ(wall.moved(), 0);
    const int steps = 1 + wall.stepUntilSolved();
    EXPECT_GE(steps, 3);
    EXPECT_LE(steps, 8);
    EXPECT_EQ(wall.world.report().counts.directIslands, 1);
    EXPECT_TRUE(wall.world.report().ok());
    expectClose("N on the floor", wall.onFloor(), wall.weight(), 1e-9 * wall.weight());
    const StepReport& next = wall.world.step(dt);
    EXPECT_EQ(next.counts.settledIslands, 1);
    expectBelow("m moved", wall.moved(), 1e-9);
}

TEST(Standing, TakesTheMoreStepsTheLargerItIs) {
    EXPECT_EQ(Wall<double>(8, 10).stepUntilSolved(), 1);
    const int small = Wall<double>(16, 16).stepUntilSolved();
    const int large = Wall<double>(32, 32).stepUntilSolved();
    EXPECT_GT(small, 1);
    EXPECT_GT(large, small);
    EXPECT_LT(large, 40);
}

TEST(Standing, IsTheSameForAnyNumberOfThreads) {
    const auto after = [](int threads) {
        Wall<double> wall(22, 22, threads);
        wall.build(14, 14, Vec3d(0, 0, 10));
        const int steps = wall.stepUntilSolved();
        std::vector<Vec3d> poses;
        for (const BodyId brick : wall.bricks) {
            poses.push_back(wall.world.pose(brick).position);
        }
        return std::pair(steps, poses);
    };
    const auto one = after(1);
    EXPECT_GT(one.first, 2);
    EXPECT_EQ(one, after(1));
    EXPECT_EQ(one, after(2));
    EXPECT_EQ(one, after(4));
}

TEST(Standing, WorksInFloatToo) {
    Wall<float> wall(20, 20);
    EXPECT_GT(wall.stepUntilSolved(), 1);
    expectClose("N on the floor", wall.onFloor(), wall.weight(), 2e-5 * wall.weight());
    wall.world.step(float(dt));
    expectBelow("m moved", wall.moved(), 2e-6);
}

TEST(Standing, StructuresShareWhatAStepMayTake) {
    Wall<double> wall(20, 20);
    for (int i = 1; i < 4; ++i) {
        wall.build(20, 20, Vec3d(0, 0, 10 * i));
    }
    wall.world.step(dt);
    EXPECT_EQ(wall.standing(), 4);
    const int one = Wall<double>(20, 20).stepUntilSolved();
    const int all = 1 + wall.stepUntilSolved();
    EXPECT_GT(all, 2 * one);
    EXPECT_LE(all, 4 * one);
    expectClose("N on the floor", wall.onFloor(), wall.weight(), 1e-9 * wall.weight());
}

TEST(Standing, ManySmallStructuresTakeTurns) {
    constexpr int walls = 40;
    Wall<double> wall(6, 6);
    for (int i = 1; i < walls; ++i) {
        wall.build(6, 6, Vec3d(0, 0, 4 * i));
    }
    double work = 0;
    int steps = 0;
    do {
        const StepReport& report = wall.world.step(dt);
        work = std::max(work, report.counts.work);
        ++steps;
        EXPECT_EQ(report.counts.truncated, wall.standing());
    } while (wall.standing() > 0 && steps < 100);
    EXPECT_EQ(steps, 7);
    expectBelow("visits of a step", work, 1e6);  // 2.6e6 where all are solved in one step
    wall.world.step(dt);
    EXPECT_EQ(wall.world.step(dt).counts.settledIslands, walls);
    expectClose("N on the floor", wall.onFloor(), wall.weight(), 1e-9 * wall.weight());
    expectBelow("m moved", wall.moved(), 1e-9);
}

TEST(Standing, WhatSlidesOffOrFallsWaitsForNothing) {
    Wall<double> wall(1, 1);
    for (int i = 0; i < 1000; ++i) {
        wall.build(1, 1, Vec3d(2 * (i % 40), 0, 2 + 2 * (i / 40)));
    }
    constexpr double slope = 0.9;  // rad
    const Quatd tilted(Eigen::AngleAxisd(slope, Vec3d::UnitZ()));
    const Vec3d up(0, 20, 0);
    wall.world.add({.type = BodyType::Static, .shapes = {box({5, 1, 5})}, .position = up, .rotation = tilted});
    const BodyId slides = wall.world.add(
        {.shapes = {box({0.5, 0.5, 0.5})}, .position = up + tilted * Vec3d(0, 1.5, 0), .rotation = tilted});
    const BodyId hangs = wall.world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = up + Vec3d(30, -1.5, 0)});
    wall.world.add({.type = BodyType::Static, .shapes = {box({5, 1, 5})}, .position = up + Vec3d(30, 0, 0)});
    const BodyId flies = wall.world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = up + Vec3d(40, 0, 0)});
    wall.world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = up + Vec3d(41, 0, 0)});
    const BodyId rolls = wall.world.add({.shapes = {sphere(0.5)}, .position = up + tilted * Vec3d(0, 1.5, 3)});
    wall.world.step(dt);
    EXPECT_GT(wall.standing(), 500);
    const double friction = Material{}.friction;
    expectClose("m/s", wall.world.linearVelocity(slides).norm(),
                standardGravity * (std::sin(slope) - friction * std::cos(slope)) * dt, 1e-9);
    EXPECT_GT(wall.world.linearVelocity(rolls).norm(), 0);
    for (const BodyId falls : {hangs, flies}) {
        expectClose("m/s, down", -wall.world.linearVelocity(falls).y(), standardGravity * dt, 1e-9);
    }
}

TEST(Standing, WhatWokeUpWaitsForNothing) {
    WorldDef def{.sleep = {.time = 0.1}};
    Worldd world(def);
    addFloor(world);
    std::vector<BodyId> cubes;
    for (int i = 0; i < 800; ++i) {
        cubes.push_back(world.add({.shapes = {box({0.2, 0.2, 0.2})}, .position = Vec3d(i % 40, 0.2, i / 40)}));
    }
    for (int k = 0; k < 40; ++k) {
        world.step(dt);
    }
    EXPECT_EQ(world.report().counts.awake, 0);
    for (const BodyId cube : cubes) {
        world.wake(cube);
    }
    EXPECT_EQ(world.step(dt).counts.truncated, 0);
}

// Friction of .6 holds up to 31 degrees.
TEST(Standing, WhatDoesNotStandFallsOnceItIsKnown) {
    const double tilt = 40 * pi / 180;
    Wall<double> wall(14, 14, 1, tilt);
    const int steps = wall.stepUntilSolved();
    EXPECT_GT(steps, 1);
    EXPECT_LT(steps, 60);
    for (int k = 0; k < 6; ++k) {
        wall.world.step(dt);
    }
    Vec3d mean = Vec3d::Zero();
    for (const BodyId brick : wall.bricks) {
        mean += wall.world.linearVelocity(brick) / static_cast<double>(wall.bricks.size());
    }
    // Seven steps down the slope, against friction on the floor, which bears what does not fall. Sweeps err by .011, as
    // much as where a wall is not left standing first.
    const double given = 7 * dt * standardGravity;
    const double borne = given * std::cos(tilt) + mean.y();
    expectClose("m/s of all together", mean.x(), given * std::sin(tilt) - 0.6 * borne, 0.023);
}

TEST(Standing, WhatIsAskedForOrMovesIsSolvedAtOnce) {
    EXPECT_EQ(Wall<double>(20, 20, 1, 0, Vec3d::Zero(), {.position = 1e-4}).stepUntilSolved(), 1);
    EXPECT_EQ(Wall<double>(20, 20, 1, 0, Vec3d(0, 0.005, 0)).stepUntilSolved(), 1) << "above the floor";
    Wall<double> pushed(20, 20);
    pushed.world.setVelocity(pushed.bricks.back(), Vec3d(0, 0, 0.1), Vec3d::Zero());
    EXPECT_EQ(pushed.stepUntilSolved(), 1);
}

// disturb() is called while the wall is left standing.
template <class Disturb>
void whileStanding(const Disturb& disturb) {
    Wall<double> wall(20, 20);
    for (int k = 0; k < 2; ++k) {
        wall.world.step(dt);
        ASSERT_EQ(wall.standing(), 1);
    }
    disturb(wall);
}

TEST(Standing, IsSolvedAsAnyOnceItIsTouched) {
    whileStanding([](Wall<double>& wall) {
        wall.world.add({.shapes = {sphere(0.25)}, .position = {10, 5, -1}, .linearVelocity = {0, 0, 20}, .mass = 1});
        for (int k = 0; k < 5; ++k) {
            wall.world.step(dt);
        }
        EXPECT_EQ(wall.standing(), 0);
        EXPECT_GT(wall.moved(), 0.01);
        EXPECT_LT(wall.moved(), 2);
    });
}

TEST(Standing, IsSolvedAtOnceWithWhatIsTakenAwayOrAdded) {
    const auto isSolvedAtOnce = [](Wall<double>& wall) {
        EXPECT_EQ(wall.stepUntilSolved(), 1);
        EXPECT_EQ(wall.world.report().counts.directIslands, 1);
        for (int k = 0; k < 3; ++k) {
            wall.world.step(dt);
        }
        expectClose("N on the floor", wall.onFloor(), wall.weight(), 1e-9 * wall.weight());
        expectBelow("m moved", wall.moved(), 1e-8);
    };
    whileStanding([&](Wall<double>& wall) {
        wall.world.remove(wall.bricks.back());
        wall.bricks.pop_back();
        wall.places.pop_back();
        isSolvedAtOnce(wall);
    });
    whileStanding([&](Wall<double>& wall) {
        // The one on which all others of its end stand, whose place another takes.
        wall.world.remove(wall.bricks.front());
        wall.bricks.front() =
            wall.world.add({.shapes = {box({0.5, 0.25, 0.25})}, .position = wall.places.front(), .mass = 2});
        isSolvedAtOnce(wall);
    });
    whileStanding([&](Wall<double>& wall) {
        wall.places.emplace_back(10, 10.25, 0);
        wall.bricks.push_back(
            wall.world.add({.shapes = {box({0.5, 0.25, 0.25})}, .position = wall.places.back(), .mass = 2}));
        isSolvedAtOnce(wall);
    });
}

// A pyramid struck before it is solved sags no more than one that is struck as soon as it is: it has the forces of what
// is solved by then. Without them it sinks by millimetres a row.
TEST(Standing, WhatIsStruckBeforeItIsSolvedHasItsForces) {
    const auto sunkAfterStrike = [](int atStep) {
        Worldd world({.sleep = {.enabled = false}});
        addFloor(world);
        std::vector<BodyId> boxes;
        for (int row = 0; row < 60; ++row) {
            for (int i = 0; i < 60 - row; ++i) {
                boxes.push_back(addBox(world, Vec3d((i + 0.5 * row) * 1.05, 0.5 + row, 0)));
            }
        }
        for (int k = 0; k < atStep; ++k) {
            world.step(dt);
        }
        EXPECT_EQ(world.report().islands.front().reason == PlanReason::Standing, atStep < 5);
        world.add({.shapes = {sphere(0.25)}, .position = {30, 0.5, -0.8}, .linearVelocity = {0, 0, 5}, .mass = 1});
        for (int k = 0; k < 30; ++k) {
            world.step(dt);
        }
        return 59.5 - world.pose(boxes.back()).position.y();
    };
    const double solved = sunkAfterStrike(15);
    expectBelow("m sunk, solved", solved, 7e-4);
    expectClose("m sunk, not solved yet", sunkAfterStrike(3), solved, 1e-6);
}

TEST(Standing, KnowsWhatTheGameSetsMeanwhile) {
    whileStanding([](Wall<double>& wall) {
        wall.world.setSolver(GaussSeidelDef{});
        wall.world.step(dt);
        EXPECT_EQ(wall.standing(), 0);
        EXPECT_EQ(wall.world.report().counts.sweptIslands, 1);
    });
    whileStanding([](Wall<double>& wall) {
        wall.world.setAccuracy({.position = 1e-4});
        wall.world.step(dt);
        EXPECT_EQ(wall.standing(), 0);
        EXPECT_EQ(wall.world.report().counts.directIslands, 1);
    });
    whileStanding([](Wall<double>& wall) {
        wall.world.applyForce(wall.bricks.back(), Vec3d(0, 100, 0));
        wall.world.step(dt);
        EXPECT_EQ(wall.standing(), 0);
        EXPECT_GT(wall.world.linearVelocity(wall.bricks.back()).y(), 0.1);
    });
    whileStanding([](Wall<double>& wall) {
        wall.world.step(dt / 2);
        EXPECT_EQ(wall.standing(), 0);
        wall.world.step(dt / 2);
        wall.world.step(dt / 2);
        expectClose("N on the floor", wall.onFloor(), wall.weight(), 1e-8 * wall.weight());
    });
    whileStanding([](Wall<double>& wall) {
        wall.world.setSolver(AutoDef{});
        EXPECT_LE(wall.stepUntilSolved(), 6) << "the same solver goes on";
        const Worldd moved = std::move(wall.world);
        EXPECT_EQ(moved.report().counts.directIslands, 1);
    });
}

// Neither a world that ends nor one that goes elsewhere leaves anything behind: what memory checkers look at.
TEST(Standing, MayBeLeftInTheMiddle) {
    whileStanding([](Wall<double>& wall) {
        Worldd moved = std::move(wall.world);
        moved.step(dt);
        EXPECT_EQ(moved.report().islands.front().reason, PlanReason::Standing);
    });
}

TEST(Standing, NeverFallsAsleepUnsolved) {
    WorldDef def{.sleep = {.time = 0.02}};
    Worldd world(def);
    addFloor(world);
    std::vector<BodyId> bricks;
    for (int course = 0; course < 20; ++course) {
        for (int i = 0; i < 20; ++i) {
            bricks.push_back(world.add({.shapes = {box({0.5, 0.25, 0.25})},
                                        .position = Vec3d(i + 0.5 * (course % 2), 0.25 + 0.5 * course, 0)}));
        }
    }
    world.step(dt);
    for (int k = 0; world.report().islands.front().reason == PlanReason::Standing && k < 100; ++k) {
        EXPECT_TRUE(world.awake(bricks.front()));
        world.step(dt);
    }
    EXPECT_EQ(world.report().counts.directIslands, 1);
}

// A pyramid through whose lowest row a ball has gone.
struct ShotPyramid {
    Worldd world{{.sleep = {.enabled = false}}};
    std::vector<BodyId> boxes;

    explicit ShotPyramid(int rows, double friction = 0.6) {
        addFloor(world);
        Shape shape = box({0.5, 0.5, 0.5});
        shape.material.friction = friction;
        for (int row = 0; row < rows; ++row) {
            for (int i = 0; i < rows - row; ++i) {
                boxes.push_back(world.add(
                    {.shapes = {shape}, .position = Vec3d((i + 0.5 * row) * 1.05, 0.5 + row, 0), .mass = 1000}));
            }
        }
        world.add({.shapes = {sphere(0.25)},
                   .position = {1.05 * (rows / 2), 0.5, -1.5},
                   .linearVelocity = {0, 0, 10},
                   .mass = 1000});
    }
    double fastest() const {
        double speed = 0;
        for (const BodyId body : boxes) {
            speed = std::max(speed, world.linearVelocity(body).norm());
        }
        return speed;
    }
};

// Swept, 20 rows go on swaying by 2 cm/s, and 40 by 30: on the springs of sweeps.
TEST(Standing, WhatSwaysComesToRest) {
    for (const int rows : {20, 30, 40}) {
        SCOPED_TRACE(rows);
        ShotPyramid pyramid(rows);
        bool hasStood = false;
        for (int i = 0; i < 200; ++i) {
            for (const IslandReport& island : pyramid.world.step(dt).islands) {
                hasStood = hasStood || island.reason == PlanReason::Standing;
            }
        }
        EXPECT_TRUE(hasStood);
        expectBelow("m/s of the fastest", pyramid.fastest(), 1e-4);
    }
}

// A sledge on ice with a wall on it. Friction would stop every brick, and the sledge under the bricks, but not all
// together. A ball is thrown at the wall, so that it is swept.
TEST(Standing, WhatSlidesTogetherIsNotStopped) {
    const double speed = 0.15;
    const auto withFriction = [](Shape shape, double friction) {
        shape.material.friction = friction;
        return shape;
    };
    Worldd world({.sleep = {.enabled = false}});
    world.add({.type = BodyType::Static, .shapes = {withFriction(box({50, 1, 50}), 0)}, .position = {0, -1, 0}});
    Shape runner = withFriction(box({12, 0.1, 2}), 0);
    runner.pose.position = {0, -0.1, 0};
    Shape deck = withFriction(box({12, 0.1, 2}), 0.6);
    deck.pose.position = {0, 0.1, 0};
    std::vector<BodyId> bodies{
        world.add({.shapes = {runner, deck}, .position = {10, 0.2, 0}, .linearVelocity = {speed, 0, 0}, .mass = 500})};
    for (int course = 0; course < 20; ++course) {
        for (int i = 0; i < 20; ++i) {
            bodies.push_back(world.add({.shapes = {box({0.5, 0.25, 0.25})},
                                        .position = Vec3d(i + 0.5 * (course % 2), 0.65 + 0.5 * course, 0),
                                        .linearVelocity = {speed, 0, 0},
                                        .mass = 2}));
        }
    }
    world.add({.shapes = {sphere(0.25)}, .position = {10, 9, -2}, .linearVelocity = {0, 0, 5}, .mass = 0.2});
    int swept = 0;
    const double start = world.pose(bodies.front()).position.x();
    double gone = 0;
    for (int i = 0; i < 400; ++i) {
        const double before = world.linearVelocity(bodies.front()).x();
        swept += world.step(dt).counts.sweptIslands > 0 ? 1 : 0;
        gone += 0.5 * dt * (before + world.linearVelocity(bodies.front()).x());
    }
    EXPECT_GT(swept, 350);
    double momentum = 0;
    double mass = 0;
    for (const BodyId body : bodies) {
        momentum += world.mass(body) * world.linearVelocity(body).x();
        mass += world.mass(body);
    }
    // Nothing pushes along the ice.
    expectClose("m/s of all together", momentum / mass, speed, 2e-5);
    expectClose("m that the sledge has gone", world.pose(bodies.front()).position.x() - start, gone, 5e-4);
}

// What friction does not stop within a tenth of a second goes on, however slow: a row of boxes on ice.
TEST(Standing, WhatSlidesOnIsNotStopped) {
    Worldd world({.sleep = {.enabled = false}});
    Shape ice = box({50, 1, 50});
    ice.material.friction = 0.001;
    world.add({.type = BodyType::Static, .shapes = {ice}, .position = {0, -1, 0}});
    std::vector<BodyId> boxes;
    for (int i = 0; i < 30; ++i) {
        Shape shape = box({0.5, 0.5, 0.5});
        shape.material.friction = 0.001;
        boxes.push_back(
            world.add({.shapes = {shape}, .position = Vec3d(i, 0.5, 0), .linearVelocity = {0, 0, 0.1}, .mass = 1}));
    }
    for (int i = 0; i < 120; ++i) {
        world.step(dt);
    }
    // 2 s of friction at most.
    for (const BodyId body : boxes) {
        EXPECT_GT(world.linearVelocity(body).z(), 0.1 - 2 * 0.001 * standardGravity - 1e-3);
    }
}

}  // namespace
}  // namespace cairn
