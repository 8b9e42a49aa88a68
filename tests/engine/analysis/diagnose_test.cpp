// What a world foretells of itself: predicted sweeps against those that a step needs, and findings with their figures.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

namespace cairn {
namespace {

struct Trial {
    int kind;  // tower, alternating tower, hanging chain, wall
    std::vector<double> masses;
    double position;  // m

    void build(Worldd& world) const {
        const int n = static_cast<int>(masses.size());
        const auto mass = [&](int i) { return masses[static_cast<std::size_t>(i % n)]; };
        if (kind == 2) {
            BodyId above = world.add({.type = BodyType::Static, .position = {0, 20, 0}});
            for (int i = 0; i < n; ++i) {
                const BodyId link =
                    world.add({.shapes = {box({0.1, 0.5, 0.1})}, .position = {0, 19.5 - i, 0}, .mass = mass(i)});
                world.add(BallDef{.a = above, .b = link, .anchor = {0, 20.0 - i, 0}});
                above = link;
            }
            return;
        }
        addFloor(world);
        const int rows = kind == 3 ? 2 + n / 3 : n;
        int next = 0;
        for (int r = 0; r < rows; ++r) {
            for (int c = 0; c < (kind == 3 ? rows - r : 1); ++c) {
                addBox(world, Vec3d(kind == 3 ? c - 0.5 * (rows - r - 1) : 0, 0.5 + r, 0), mass(next++));
            }
        }
    }
};

Trial makeTrial(int index, std::mt19937& random) {
    std::uniform_real_distribution<double> share(0, 1);
    Trial trial{index % 4, {}, std::pow(10, -4 - share(random))};
    const int n = 2 + static_cast<int>(4 * share(random));
    const double ratio = std::pow(10, 1.3 * share(random));
    for (int i = 0; i < n; ++i) {
        trial.masses.push_back(trial.kind == 1 ? (i % 2 == 0 ? 1 : ratio) : std::pow(ratio, share(random)));
    }
    return trial;
}

double stepError(const Trial& trial, const std::vector<Vec3d>& exact, const char* solver, int iterations) {
    Worldd world({.solver = solverWith(solver, {.substeps = 1, .iterations = iterations})});
    trial.build(world);
    world.step(dt);
    double worst = 0;
    std::size_t k = 0;
    for (const BodyId id : world.bodies()) {
        worst = std::max(worst, dt * (world.linearVelocity(id) - exact[k++]).norm());
    }
    return worst;
}

// Sweeps, two an iteration, after which one step from rest is within the trial's error of the exact one.
double measuredSweeps(const Trial& trial, const char* solver) {
    Worldd world({.solver = DirectDef{}});
    trial.build(world);
    world.step(dt);
    std::vector<Vec3d> exact;
    for (const BodyId id : world.bodies()) {
        exact.push_back(world.linearVelocity(id));
    }
    int enough = 1;
    while (enough < 1 << 14 && stepError(trial, exact, solver, enough) > trial.position) {
        enough *= 2;
    }
    for (int less = enough / 2; enough - less > std::max(1, enough / 20);) {
        const int middle = (less + enough) / 2;
        (stepError(trial, exact, solver, middle) > trial.position ? less : enough) = middle;
    }
    return 2.0 * enough;
}

TEST(Forecast, SweepsOfTwoHundredScenes) {
    std::mt19937 random(3);
    std::array<int, 3> within = {0, 0, 0};
    const int trials = 200;
    for (int k = 0; k < trials; ++k) {
        const Trial trial = makeTrial(k, random);
        Worldd world({.solver = GaussSeidelDef{.substeps = 1}});
        trial.build(world);
        const IslandForecast one = world.diagnose(dt, trial.position).islands.at(0);
        const std::array<double, 3> told = {one.sweeps, one.jacobiSweeps, one.conjugateSweeps};
        const std::array<const char*, 3> solvers = {"gauss_seidel", "jacobi", "nncg"};
        for (std::size_t s = 0; s < 3; ++s) {
            const double found = measuredSweeps(trial, solvers[s]);
            // Fewer than two sweeps cannot be asked for; two off is nothing.
            const bool good = std::abs(told[s] - found) <= 3 || (told[s] <= 2 * found && found <= 2 * told[s]);
            within[s] += good ? 1 : 0;
            if (!good && std::getenv("CAIRN_TEST_PRINT") != nullptr) {
                std::printf("    %s, kind %d, %zu masses: told %.0f, found %.0f\n", solvers[s], trial.kind,
                            trial.masses.size(), told[s], found);
            }
        }
    }
    // The few beyond lie within a factor of 3.3: their error dips below what is asked and rises again on the way.
    expectBelow("Gauss-Seidel, beyond a factor of two", trials - within[0], 12);
    expectBelow("Jacobi, beyond a factor of two", trials - within[1], 0);
    expectBelow("nncg, beyond a factor of two", trials - within[2], 7);
}

// Ten equal bodies in a row: the square of the Jacobi radius, cos^2(pi / 10) (theory 9.8).
TEST(Forecast, RadiusOfTheStraightChain) {
    Worldd world({.gravity = {1, 0, 0}});
    BodyId before;
    for (int i = 0; i < 10; ++i) {
        const BodyId body = world.add(
            {.shapes = {sphere(0.1)}, .position = {1.0 * i, 0, 0}, .linearVelocity = {1.0 * i * i, 0, 0}, .mass = 1});
        if (i > 0) {
            world.add(DistanceDef{.a = before, .b = body, .anchorA = {i - 1.0, 0, 0}, .anchorB = {1.0 * i, 0, 0}});
        }
        before = body;
    }
    const Diagnosis diagnosis = world.diagnose(dt);
    ASSERT_EQ(diagnosis.islands.size(), 1U);
    expectClose("radius", diagnosis.islands[0].radius, std::pow(std::cos(pi / 10), 2), 1e-6);
    expectClose("dominance", diagnosis.islands[0].dominance, 0.5, 1e-12);
}

const Finding* found(const Diagnosis& diagnosis, FindingKind kind) {
    for (const Finding& finding : diagnosis.findings) {
        if (finding.kind == kind) {
            return &finding;
        }
    }
    return nullptr;
}

void expectFinding(Worldd& world, FindingKind kind, double figure, const std::vector<std::string>& words) {
    const Diagnosis diagnosis = world.diagnose(dt);
    const Finding* const finding = found(diagnosis, kind);
    ASSERT_NE(finding, nullptr);
    EXPECT_NEAR(finding->figure, figure, 1e-6 * figure);
    for (const std::string& word : words) {
        EXPECT_NE(finding->text.find(word), std::string::npos) << finding->text;
    }
}

TEST(Diagnose, AnEasySceneHasNoFindings) {
    Worldd world;
    addFloor(world);
    addBox(world, {0, 0.5, 0}, 700);
    addBox(world, {0, 1.5, 0}, 700);
    const Diagnosis diagnosis = world.diagnose(dt);
    EXPECT_TRUE(diagnosis.findings.empty()) << diagnosis.findings[0].text;
    EXPECT_EQ(diagnosis.islands.size(), 1U);
}

TEST(Diagnose, HeavyOnLight) {
    Worldd world;
    addFloor(world);
    world.add({.name = "egg", .shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 0.5, 0}, .mass = 1});
    world.add({.name = "safe", .shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 1.5, 0}, .mass = 1000});
    expectFinding(world, FindingKind::MassRatio, 1000, {"safe", "egg", "1000 to 1", "auto"});
    world.setSolver(GaussSeidelDef{});
    expectFinding(world, FindingKind::MassRatio, 1000, {"use the solver auto"});
}

TEST(Diagnose, ASpringFasterThanTheStep) {
    Worldd world;
    const BodyId a = world.add({.name = "ceiling", .type = BodyType::Static, .position = {0, 3, 0}});
    const BodyId b = world.add({.name = "bell", .shapes = {sphere(0.5)}, .position = {0, 2, 0}, .mass = 1});
    const double stiffness = 1e4;
    world.add(SpringDef{.a = a,
                        .b = b,
                        .anchorA = {0, 3, 0},
                        .anchorB = {0, 2, 0},
                        .restLength = 0,
                        .softness = {.compliance = 1 / stiffness}});
    expectFinding(world, FindingKind::StiffSpring, std::sqrt(stiffness) * dt / (2 * pi), {"ceiling", "bell"});
}

TEST(Diagnose, WhatIsFast) {
    Worldd world;
    world.add({.name = "bullet", .shapes = {sphere(0.05)}, .position = {0, 5, 0}, .linearVelocity = {100, 0, 0}});
    expectFinding(world, FindingKind::FastBody, 100 * dt / 0.1, {"bullet", "1.67 m", "0.1 m"});
}

TEST(Diagnose, BornInsideOneAnother) {
    Worldd world;
    addFloor(world);
    world.add({.name = "crate", .shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 0.45, 0}, .mass = 1});
    expectFinding(world, FindingKind::Overlap, 0.05, {"crate", "50 mm"});
}

TEST(Diagnose, OddUnits) {
    Worldd world({.gravity = {0, -981, 0}});
    world.add({.name = "crate", .shapes = {box({50, 50, 50})}, .position = {0, 500, 0}, .mass = 20});
    const Diagnosis diagnosis = world.diagnose(dt);
    int units = 0;
    for (const Finding& finding : diagnosis.findings) {
        units += finding.kind == FindingKind::Units ? 1 : 0;
    }
    EXPECT_EQ(units, 3);  // gravity, size, density
}

TEST(Diagnose, AFlatInertia) {
    Worldd world;
    world.add({.name = "needle", .shapes = {box({2, 0.01, 0.01})}, .position = {0, 5, 0}});
    const double ratio = (4.0 + 1e-4) / 2e-4;
    expectFinding(world, FindingKind::FlatInertia, ratio, {"needle"});
}

// A door on two hinges: of ten rows five say the same.
TEST(Diagnose, ADoorOnTwoHinges) {
    Worldd world;
    const BodyId frame = world.add({.name = "frame", .type = BodyType::Static});
    const BodyId door = world.add({.name = "door", .shapes = {box({0.5, 1, 0.05})}, .position = {0.5, 1, 0}});
    for (const double y : {0.2, 1.8}) {
        world.add(HingeDef{.a = frame, .b = door, .anchor = {0, y, 0}, .axis = {0, 1, 0}});
    }
    expectFinding(world, FindingKind::RedundantJoints, 5, {"5 of 10", "frame", "door"});
}

TEST(Diagnose, LooksAndDoesNotTouch) {
    const auto run = [](bool looks) {
        Worldd world;
        addFloor(world);
        for (int i = 0; i < 4; ++i) {
            addBox(world, {0.1 * i, 0.6 + 1.05 * i, 0});
        }
        for (int i = 0; i < 60; ++i) {
            if (looks && i % 7 == 0) {
                world.diagnose(dt);
            }
            world.step(dt);
        }
        std::vector<Vec3d> places;
        for (const BodyId id : world.bodies()) {
            places.push_back(world.centre(id));
        }
        return places;
    };
    EXPECT_EQ(run(false), run(true));
}

TEST(Diagnose, BadQuestionsAreRefusedByName) {
    Worldd world;
    EXPECT_THROW(world.diagnose(0), InputError);
    EXPECT_THROW(world.diagnose(dt, 0), InputError);
}

}  // namespace
}  // namespace cairn
