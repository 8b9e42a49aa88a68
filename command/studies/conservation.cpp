#include "command/studies/conservation.hpp"
#include "engine/model/solver_numbers.hpp"

#include "base/so3.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

constexpr double dt = 1.0 / 60;  // s

Shape rough(Shape shape, double friction, double restitution = 0) {
    shape.material.friction = friction;
    shape.material.restitution = restitution;
    return shape;
}

Scene weightless(const std::string& name) {
    Scene scene = {};
    scene.name = name;
    scene.world.gravity = Vec3d::Zero();
    scene.world.sleep.enabled = false;
    scene.dt = dt;
    return scene;
}

// Two boxes of 1 and 3 kg side by side, the anchor of their joint between them.
struct Pair {
    Scene scene = {};
    BodyId a = {};
    BodyId b = {};
};
Pair pair(const std::string& name) {
    Pair p{.scene = weightless(name)};
    const Filter apart{.group = -1};
    p.a = p.scene.add({.name = "light",
                       .shapes = {box({0.5, 0.2, 0.3})},
                       .position = {-0.6, 0.1, 0},
                       .linearVelocity = {0.5, 1, -0.3},
                       .angularVelocity = {1, -2, 3},
                       .mass = 1,
                       .filter = apart});
    p.b = p.scene.add({.name = "heavy",
                       .shapes = {box({0.4, 0.3, 0.2})},
                       .position = {0.6, -0.1, 0.2},
                       .linearVelocity = {-0.4, 0.2, 0.6},
                       .angularVelocity = {-2, 1, 0.5},
                       .mass = 3,
                       .filter = apart});
    return p;
}

// Links of 1 m in a zigzag; `spin` turns the whole about its middle, `jerk` makes the joints disagree at the start.
Scene chain(const std::string& name, int links, const Vec3d& spin, double jerk) {
    Scene scene = weightless(name);
    BodyId last;
    Vec3d end(0, 0, 0);
    std::vector<Vec3d> centres;
    for (int i = 0; i < links; ++i) {
        const double angle = (i % 2 == 0 ? 0.35 : -0.35) + 0.1 * i;
        const Vec3d along(std::cos(angle), std::sin(angle), 0.2 * (i % 3 - 1));
        const Vec3d unit = along.normalized();
        const BodyId link = scene.add({.name = "link " + std::to_string(i),
                                       .shapes = {capsule(0.1, 0.4)},
                                       .position = end + 0.5 * unit,
                                       .rotation = turnBetween<double>(Vec3d::UnitY(), unit),
                                       .mass = i + 1 == links ? 3.0 : 1.0,
                                       .filter = {.group = -1}});
        if (i > 0) {
            scene.add("joint " + std::to_string(i), BallDef{.a = last, .b = link, .anchor = end});
        }
        last = link;
        end += unit;
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        BodyDef& body = scene.bodies[i];
        const double phase = static_cast<double>(i);
        body.linearVelocity = spin.cross(body.position - 0.5 * end) +
                              jerk * Vec3d(std::sin(phase), std::cos(2 * phase), std::sin(3 * phase));
        body.angularVelocity = spin + jerk * Vec3d(std::cos(phase), std::sin(2 * phase), std::cos(3 * phase));
    }
    return scene;
}

Scene colliding(const std::string& name, double restitution) {
    Scene scene = weightless(name);
    scene.add({.name = "left",
               .shapes = {rough(box({0.5, 0.5, 0.5}), 0.5, restitution)},
               .position = {-0.52, 0.2, 0.1},
               .linearVelocity = {3, 0.5, 0},
               .angularVelocity = {0.5, 0, 0.3},
               .mass = 1});
    scene.add({.name = "right",
               .shapes = {rough(box({0.5, 0.5, 0.5}), 0.5, restitution)},
               .position = {0.52, -0.1, 0},
               .linearVelocity = {-1, 0, 0.4},
               .mass = 4});
    return scene;
}

struct Populated {
    Worldd world;
    PopulatedScene<double> placed;
    explicit Populated(const FreeScene& free, const SolverDef& solver)
        : world([&] {
              WorldDef def = free.scene.world;
              def.solver = solver;
              return def;
          }()) {
        placed = populate(world, free.scene);
        if (!free.displaced.isZero()) {
            const BodyId last = placed.bodies.back();
            Posed pose = world.pose(last);
            pose.position += free.displaced;
            world.setPose(last, pose);
        }
    }
};

// `energyScale`: J
Defect between(const MotionSum& start, const MotionSum& now, double energyScale) {
    Defect d;
    // What is at rest at the start has no momentum to compare with.
    const auto share = [](double change, double size) { return size > 0 ? change / size : 0; };
    d.linear = share((now.momentum - start.momentum).norm(), start.momentumSize);
    d.angular = share((now.angularMomentum - start.angularMomentum).norm(), start.angularSize);
    d.energy = (now.energy - start.energy) / energyScale;
    d.finite = now.momentum.allFinite() && now.angularMomentum.allFinite() && std::isfinite(now.energy);
    return d;
}

RunDefect runDefect(const FreeScene& free, const SolverDef& solver, double seconds) {
    Populated p(free, solver);
    RunDefect run{.solver = solverName(solver), .scene = free.scene.name};
    const MotionSum start = motionSum(p.world);
    const int steps = static_cast<int>(std::lround(seconds / free.scene.dt));
    const int every = std::max(1, steps / 150);
    run.samplePeriod = every * free.scene.dt;
    // Under gravity the energy at the start may be nothing: then the fall of a metre of all that moves is the scale.
    double scale = start.energy;
    if (free.scene.world.gravity.norm() > 0) {
        scale = 0;
        for (const BodyId id : p.world.bodies()) {
            scale += p.world.mass(id) * free.scene.world.gravity.norm();
        }
    }
    run.energies.push_back(0);
    for (int i = 1; i <= steps; ++i) {
        const StepReport& report = p.world.step(free.scene.dt);
        const Defect d = between(start, motionSum(p.world), scale);
        const bool finite = d.finite && (report.flags & FlagNonFinite) == 0;
        run.worst.linear = std::max(run.worst.linear, d.linear);
        run.worst.angular = std::max(run.worst.angular, d.angular);
        run.worst.energy = std::max(run.worst.energy, d.energy);
        run.worst.finite = run.worst.finite && finite;
        run.lost = std::max(run.lost, -d.energy);
        run.finalEnergy = d.energy;
        if (i % every == 0) {
            run.energies.push_back(d.energy);
        }
    }
    return run;
}

ConservationStudy studyOf(const std::vector<FreeScene>& scenes, const std::vector<int>& iterations, double seconds,
                          const Tell& tell) {
    ConservationStudy study;
    for (const SolverInfo& info : solverList()) {
        study.solvers.push_back(info.name);
    }
    for (const FreeScene& scene : scenes) {
        study.scenes.push_back(scene.scene.name);
    }
    const double parts = static_cast<double>(scenes.size() * study.solvers.size());
    for (std::size_t s = 0; s < scenes.size(); ++s) {
        for (std::size_t k = 0; k < study.solvers.size(); ++k) {
            const std::string& name = study.solvers[k];
            for (const int n : iterations) {
                const SolverDef solver = solverWith(name, {.substeps = 1, .iterations = n});
                study.byIteration.push_back({name, study.scenes[s], n, stepDefect(scenes[s], solver)});
            }
            study.byRun.push_back(runDefect(scenes[s], solverNamed(name), seconds));
            if (tell) {
                tell(static_cast<double>(s * study.solvers.size() + k + 1) / parts);
            }
        }
    }
    return study;
}

}  // namespace

std::vector<FreeScene> momentumScenes() {
    std::vector<FreeScene> scenes;
    {
        Pair p = pair("pair, ball joint");
        p.scene.add("joint", BallDef{.a = p.a, .b = p.b, .anchor = {0, 0, 0.1}});
        scenes.push_back({.name = "pair, ball joint", .scene = p.scene});
    }
    const Vec3d gap(0.06, 0.08, 0);  // 0.1 m
    {
        Pair p = pair("pair 0.1 m apart, point constraint (3 rows)");
        p.scene.add("joint", BallDef{.a = p.a, .b = p.b, .anchor = {0, 0, 0.1}});
        scenes.push_back({.name = p.scene.name, .scene = p.scene, .displaced = gap});
    }
    {
        Pair p = pair("pair 0.1 m apart, scalar |dp| (1 row)");
        p.scene.add(
            "joint",
            DistanceDef{.a = p.a, .b = p.b, .anchorA = {0, 0, 0.1}, .anchorB = {0, 0, 0.1}, .lower = 0, .upper = 0});
        scenes.push_back({.name = p.scene.name, .scene = p.scene, .displaced = gap});
    }
    scenes.push_back({.name = "chain of 5", .scene = chain("chain of 5", 5, {0.5, 0, 2}, 0.7)});
    scenes.push_back({.name = "colliding boxes", .scene = colliding("colliding boxes", 0)});
    return scenes;
}

std::vector<FreeScene> energyScenes() {
    std::vector<FreeScene> scenes;
    scenes.push_back(
        {.name = "pair in flight", .scene = chain("pair in flight", 2, {0.5, 1, 2}, 0), .conservesEnergy = true});
    scenes.push_back({.name = "chain of 8 in flight",
                      .scene = chain("chain of 8 in flight", 8, {0.3, 0, 2}, 0),
                      .conservesEnergy = true});
    {
        Scene scene = weightless("pendulum of 5 links");
        scene.world.gravity = Vec3d(0, -9.81, 0);
        BodyId last = scene.add({.name = "hook", .type = BodyType::Static, .filter = {.group = -1}});
        for (int i = 0; i < 5; ++i) {
            const BodyId link = scene.add({.name = "link " + std::to_string(i),
                                           .shapes = {capsule(0.1, 0.4)},
                                           .position = {i + 0.5, 0, 0},
                                           .rotation = turnBetween<double>(Vec3d::UnitY(), Vec3d::UnitX()),
                                           .mass = 1,
                                           .filter = {.group = -1}});
            scene.add("joint " + std::to_string(i), BallDef{.a = last, .b = link, .anchor = Vec3d(i, 0, 0)});
            last = link;
        }
        scenes.push_back({.name = scene.name, .scene = scene, .conservesEnergy = true});
    }
    {
        Scene scene = weightless("elastic balls");
        scene.add({.name = "left",
                   .shapes = {rough(sphere(0.5), 0, 1)},
                   .position = {-2, 0, 0},
                   .linearVelocity = {3, 0, 0},
                   .mass = 1});
        scene.add({.name = "right", .shapes = {rough(sphere(0.5), 0, 1)}, .position = {1, 0.2, 0}, .mass = 2});
        scenes.push_back({.name = scene.name, .scene = scene, .conservesEnergy = true});
    }
    scenes.push_back({.name = "colliding boxes", .scene = colliding("colliding boxes", 0)});
    return scenes;
}

MotionSum motionSum(const Worldd& world) {
    MotionSum sum;
    for (const BodyId id : world.bodies()) {
        const double m = world.mass(id);
        if (m == 0) {
            continue;
        }
        const Vec3d x = world.centre(id);
        const Vec3d v = world.linearVelocity(id);
        const Vec3d w = world.angularVelocity(id);
        const Mat3d R = world.pose(id).rotation.toRotationMatrix();
        const Vec3d spun = R * world.inertia(id) * R.transpose() * w;
        const Vec3d angular = m * x.cross(v) + spun;
        sum.momentum += m * v;
        sum.angularMomentum += angular;
        sum.momentumSize += m * v.norm();
        sum.angularSize += angular.norm();
        sum.energy += 0.5 * (m * v.squaredNorm() + w.dot(spun)) - m * world.worldDef().gravity.dot(x);
    }
    return sum;
}

Defect stepDefect(const FreeScene& free, const SolverDef& solver) {
    Populated p(free, solver);
    const MotionSum start = motionSum(p.world);
    p.world.step(free.scene.dt);
    return between(start, motionSum(p.world), start.energy);
}

const IterationDefect& ConservationStudy::at(const std::string& solver, const std::string& scene,
                                             int iterations) const {
    for (const IterationDefect& d : byIteration) {
        if (d.solver == solver && d.scene == scene && d.iterations == iterations) {
            return d;
        }
    }
    throw InputError("study", solver + ", " + scene, "not measured");
}

const RunDefect& ConservationStudy::run(const std::string& solver, const std::string& scene) const {
    for (const RunDefect& d : byRun) {
        if (d.solver == solver && d.scene == scene) {
            return d;
        }
    }
    throw InputError("study", solver + ", " + scene, "not measured");
}

ConservationStudy momentumStudy(bool full, const Tell& tell) {
    return studyOf(momentumScenes(), {1, 2, 4, 8, 16, 32, 64, 128}, full ? 20 : 4, tell);
}

ConservationStudy energyStudy(bool full, const Tell& tell) {
    return studyOf(energyScenes(), {}, full ? 30 : 5, tell);
}

nlohmann::ordered_json toJson(const ConservationStudy& study) {
    using Json = nlohmann::ordered_json;
    const auto defect = [](const Defect& d) {
        return Json{{"linear", d.linear}, {"angular", d.angular}, {"energy", d.energy}, {"finite", d.finite}};
    };
    Json json;
    json["solvers"] = study.solvers;
    json["scenes"] = study.scenes;
    json["by_iteration"] = Json::array();
    for (const IterationDefect& d : study.byIteration) {
        json["by_iteration"].push_back(
            {{"solver", d.solver}, {"scene", d.scene}, {"iterations", d.iterations}, {"defect", defect(d.defect)}});
    }
    json["by_run"] = Json::array();
    for (const RunDefect& d : study.byRun) {
        json["by_run"].push_back({{"solver", d.solver},
                                  {"scene", d.scene},
                                  {"worst", defect(d.worst)},
                                  {"final_energy", d.finalEnergy},
                                  {"max_energy_lost", d.lost},
                                  {"sample_period_s", d.samplePeriod},
                                  {"energies", d.energies}});
    }
    return json;
}

}  // namespace cairn
