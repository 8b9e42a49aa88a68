#include "command/studies/clusters.hpp"
#include "engine/model/solver_numbers.hpp"
#include "engine/solve/newton/newton.hpp"
#include "engine/solve/velocity/impulse_solver.hpp"

#include <ctime>
#include <map>

namespace cairn {

namespace {

using System = RowSystem<double>;

constexpr double hardError = 1e-4;  // m, that a step corrects at most, as `direct` does

const std::vector<int>& clusterSizes() {
    static const std::vector<int> sizes = {1, 2, 4, 8, 16, 32, 64, 128, 256};
    return sizes;
}

// ms of this process's time on processors: what others take of the machine does not count.
double now() {
    return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

SolverDef solverOf(const std::string& name, int size, int iterations) {
    return solverWith(name, {.iterations = iterations, .clusterSize = size});
}

struct Running {
    Worldd world;
    PopulatedScene<double> ids;
    explicit Running(const Scene& scene) : world(scene.world), ids(populate(world, scene)) {}
};

// The scene as it stands after some time under gauss_seidel; nothing sleeps.
Scene settled(Scene scene, double seconds) {
    scene.world.sleep.enabled = false;
    scene.world.solver = solverOf("gauss_seidel", 0, 0);
    Running running(scene);
    for (int i = 0; i < static_cast<int>(std::lround(seconds / scene.dt)); ++i) {
        running.world.step(scene.dt);
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        BodyDef& body = scene.bodies[i];
        const BodyId id = running.ids.bodies[i];
        body.position = running.world.pose(id).position;
        body.rotation = running.world.pose(id).rotation;
        body.linearVelocity = running.world.linearVelocity(id);
        body.angularVelocity = running.world.angularVelocity(id);
    }
    for (SceneJoint& joint : scene.joints) {
        DistanceDef& rod = std::get<DistanceDef>(joint.def);
        rod.anchorA = scene.bodies[rod.a.index].position;
        rod.anchorB = scene.bodies[rod.b.index].position;
    }
    return scene;
}

// Of a settled scene: the steps after which the impulses, which a scene does not hold, are there again.
constexpr int warmSteps = 10;

// The next step of a running scene as one island, and its problem.
struct Step {
    Problem<double> problem;
    System system;
    int moving = 0;

    Step(const Running& running, const Scene& scene) {
        std::map<std::uint32_t, int> placeOf;
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            placeOf[running.ids.bodies[i].index] = static_cast<int>(i);
            addBody(running.world, running.ids.bodies[i], scene);
        }
        for (const JointView& view : running.world.jointViews()) {
            addRod(view, placeOf.at(view.a.index), placeOf.at(view.b.index), scene);
        }
        problem.jointBlocks = static_cast<int>(problem.blocks.size());
        for (const ContactView& view : running.world.contacts()) {
            addContact(view, placeOf.at(view.a.index), placeOf.at(view.b.index), scene);
        }
        problem.respond();
        fillSystem(scene.dt);
    }

private:
    void addBody(const Worldd& world, BodyId id, const Scene& scene) {
        SolverBody<double>& body = problem.bodies.emplace_back();
        const BodyDef& def = world.def(id);
        body.fixed = def.type != BodyType::Dynamic;
        body.particle = def.particle;
        body.pose = {world.centre(id), world.pose(id).rotation};
        body.v << world.linearVelocity(id), world.angularVelocity(id);
        body.vBefore = body.v;
        if (body.fixed) {
            return;
        }
        ++moving;
        body.mass = world.mass(id);
        body.inverseMass = 1 / body.mass;
        if (!body.particle) {
            body.localInertia = world.inertia(id);
            body.localInverseInertia = body.localInertia.inverse();
            body.refreshInertia();
        }
        body.v.head<3>() += scene.dt * scene.world.gravity;
    }

    void addContact(const ContactView& view, int a, int b, const Scene& scene) {
        RowBlock<double>& block = problem.blocks.emplace_back();
        block.a = a;
        block.b = b;
        block.first = static_cast<int>(problem.rows.size());
        block.kind = BlockKind::Contact;
        block.friction = combinedFriction(scene, a, b);
        block.staticFriction = block.friction;
        RowWriter<double> writer(problem.rows, block);
        const Vec3d armA = view.point - centre(a);
        const Vec3d armB = view.point - centre(b);
        const Vec3d across = view.normal.unitOrthogonal();
        const Vec3d force = view.frictionForce;
        writer.point(view.normal, armA, armB, view.separation).lambda = view.normalForce;
        for (const Vec3d& t : {across, Vec3d(view.normal.cross(across))}) {
            writer.point(t, armA, armB, 0).lambda = force.dot(t);
        }
        Row<double>& normal = problem.rows[static_cast<std::size_t>(block.first)];
        normal.lo = 0;
        for (int i = 1; i < 3; ++i) {
            problem.rows[static_cast<std::size_t>(block.first + i)].isVelocity = true;
        }
    }

    void addRod(const JointView& view, int a, int b, const Scene& scene) {
        const double length = std::get<DistanceDef>(scene.joints[problem.blocks.size()].def).upper;
        RowBlock<double>& block = problem.blocks.emplace_back();
        block.a = a;
        block.b = b;
        block.first = static_cast<int>(problem.rows.size());
        RowWriter<double> writer(problem.rows, block);
        const Vec3d gap = centre(b) - centre(a);
        const Vec3d n = gap.normalized();
        writer.particles(gap.norm() - length, -n, n).lambda = view.force.dot(n);
    }

    const Vec3d& centre(int body) const { return problem.bodies[static_cast<std::size_t>(body)].pose.position; }

    static double combinedFriction(const Scene& scene, int a, int b) {
        const auto of = [&](int body) {
            return scene.bodies[static_cast<std::size_t>(body)].shapes.front().material.friction;
        };
        return std::sqrt(of(a) * of(b));
    }

    void fillSystem(double h) {
        system.terms.resize(problem.rows.size());
        system.p.resize(problem.rows.size());
        for (const RowBlock<double>& block : problem.blocks) {
            system.friction.push_back(block.kind == BlockKind::Contact ? block.friction : -1);
            for (int r = block.first; r < block.first + block.count; ++r) {
                const std::size_t i = static_cast<std::size_t>(r);
                const Row<double>& row = problem.rows[i];
                bool hard = false;
                system.terms[i] = rowTerms(row, problem.delassus(row, block), h, hard);
                if (hard) {
                    const bool open = row.lo == 0 && row.C > 0;
                    system.terms[i].bias = open ? row.C / h : std::clamp(row.C, -hardError, hardError) / h;
                }
                system.p[i] = h * row.lambda;
            }
        }
        for (const SolverBody<double>& body : problem.bodies) {
            system.v.push_back(body.v);
        }
    }
};

// sqrt(J)
double distance(const Problem<double>& problem, const std::vector<Vec6<double>>& v,
                const std::vector<Vec6<double>>& w) {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i) {
        if (!problem.bodies[i].fixed) {
            const Vec6<double> d = v[i] - w[i];
            sum += d.dot(problem.bodies[i].applyMass(d));
        }
    }
    return std::sqrt(sum);
}

// How far impulses and velocities are from answering each other (sqrt(J)): the natural map of the cone with De Saxce's
// correction, p - P(p - (u + mu |u_t| n) / A), in the norm of A. Unlike the velocities, which friction does not always
// determine, it is 0 at every answer.
double naturalResidual(const Problem<double>& problem, const System& system) {
    double sum = 0;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<double>& block = problem.blocks[k];
        const std::size_t first = static_cast<std::size_t>(block.first);
        const auto speed = [&](std::size_t i) {
            return system.rowVelocity(problem.rows[i], block) + system.terms[i].bias;
        };
        if (block.kind != BlockKind::Contact) {
            for (std::size_t i = first; i < first + static_cast<std::size_t>(block.count); ++i) {
                sum += speed(i) * speed(i) / system.terms[i].delassus;
            }
            continue;
        }
        const double scale = std::max(
            {system.terms[first].delassus, system.terms[first + 1].delassus, system.terms[first + 2].delassus});
        const Vec2<double> slide(speed(first + 1), speed(first + 2));
        const double mu = block.friction;
        const double normal = system.p[first] - (speed(first) + mu * slide.norm()) / scale;
        const Vec2<double> held(system.p[first + 1], system.p[first + 2]);
        const Vec2<double> across = held - slide / scale;
        const double length = across.norm();
        Vec3d nearest(normal, across.x(), across.y());
        if (length > mu * normal) {
            const double on = std::max(0.0, (normal + mu * length) / (1 + mu * mu));
            nearest << on, (length > 0 ? mu * on / length : 0) * across;
        }
        sum += scale * (nearest - Vec3d(system.p[first], held.x(), held.y())).squaredNorm();
    }
    return std::sqrt(sum);
}

// Leaves in `system` what so many iterations of a solver on impulses make of it.
void iterate(Problem<double>& problem, System& system, const SolverDef& def) {
    const std::unique_ptr<Solver<double>> solver = makeSolver<double>(def);
    auto* const impulses = dynamic_cast<ImpulseSolver<double>*>(solver.get());
    CAIRN_CHECK(impulses != nullptr, "a solver on impulses");
    problem.memory = {};
    system.warmStart(problem);
    impulses->iterate(problem, system, numbersOf(def).iterations);
}

// What Newton on the whole island makes of it, started from sweeps; where its factor is too dear, those sweeps' answer.
System reference(Step& step) {
    constexpr int sweeps = 2000;
    constexpr int turns = 8;            // each with a fresh, loose regularisation
    constexpr double affordable = 1e5;  // block products of a factor
    constexpr double solved = 1e-9;     // sqrt(J)
    System best = step.system;
    iterate(step.problem, best, solverOf("nncg", 0, sweeps));
    ContactNewton<double> newton;
    newton.prepare(step.problem);
    if (newton.work() > affordable) {
        return best;
    }
    newton.system.terms = best.terms;
    newton.system.friction = best.friction;
    newton.system.p = best.p;
    newton.vStar = step.system.v;
    NewtonOptions options;
    options.regularisation = 1e-3;
    options.minRegularisation = 1e-6;
    options.tolerance = 1e-8;
    options.stalled = 1e-7;
    options.deSaxceTolerance = 1e-6;
    options.maxDeSaxceUpdates = 20;
    options.maxIterations = 100;
    options.goesOn = true;
    double smallest = naturalResidual(step.problem, best);
    for (int k = 0; k < turns && smallest > solved; ++k) {
        newton.solve(step.problem, options);
        const double left = naturalResidual(step.problem, newton.system);
        if (left >= 0.9 * smallest) {
            break;
        }
        smallest = left;
        best.p = newton.system.p;
        best.v = newton.system.v;
    }
    return best;
}

ClusterCurve measureCurve(Step& step, const std::vector<Vec6<double>>& answer, const std::string& method, int size,
                          const std::vector<int>& iterations) {
    ClusterCurve curve{.method = method, .size = size};
    constexpr double briefly = 10;  // ms, below which a time is the least of several
    for (const int n : iterations) {
        ClusterPoint point{.iterations = n, .milliseconds = std::numeric_limits<double>::infinity()};
        double spent = 0;
        while (spent < briefly) {
            System system = step.system;
            const double start = now();
            iterate(step.problem, system, solverOf(method, size, n));
            point.milliseconds = std::min(point.milliseconds, now() - start);
            spent += std::max(now() - start, 1e-3);
            point.error = distance(step.problem, system.v, answer);
            point.residual = naturalResidual(step.problem, system);
            point.visits = static_cast<double>(system.visits) / static_cast<double>(step.problem.rows.size());
        }
        curve.points.push_back(point);
    }
    return curve;
}

ClusterRun measureRun(const Scene& scene, const std::string& method, int size, int iterations, int steps) {
    Running running(scene);
    for (int i = 0; i < warmSteps; ++i) {
        running.world.step(scene.dt);
    }
    running.world.setSolver(solverOf(method, size, iterations));
    const double start = now();
    for (int i = 0; i < steps; ++i) {
        running.world.step(scene.dt);
    }
    const StepError& error = running.world.report().error;
    return {.method = method,
            .size = size,
            .iterations = iterations,
            .worstError = std::max(error.maxPenetration, error.maxJointGap),
            .meanError = scene.joints.empty() ? error.meanPenetration : error.maxJointGap,
            .milliseconds = (now() - start) / steps};
}

}  // namespace

double ClusterCurve::at(double milliseconds, double ClusterPoint::*what, double atStart) const {
    double cost = 0;
    double value = atStart;
    for (const ClusterPoint& point : points) {
        if (point.milliseconds >= milliseconds) {
            if (cost == 0) {
                return atStart;
            }
            const double share = std::log(milliseconds / cost) / std::log(point.milliseconds / cost);
            return value * std::pow(point.*what / value, share);
        }
        cost = point.milliseconds;
        value = point.*what;
    }
    return value;
}

const ClusterCurve& ClusterCase::curve(const std::string& method, int size) const {
    for (const ClusterCurve& c : curves) {
        if (c.method == method && c.size == size) {
            return c;
        }
    }
    throw InputError("study", method + " " + std::to_string(size), "not measured");
}

// Rods between particles, pinned along the upper edge; the knot in the middle weighs a hundred others.
Scene netScene(int side) {
    constexpr double rod = 0.1;  // m
    Scene scene;
    scene.name = "net";
    scene.seconds = 2;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const bool middle = row == side / 2 && column == side / 2;
            scene.add({.name = "knot " + std::to_string(row) + " " + std::to_string(column),
                       .type = row == 0 ? BodyType::Static : BodyType::Dynamic,
                       .particle = row > 0,
                       .position = Vec3d(rod * column, -rod * row, 0),
                       .mass = row == 0 ? 0
                               : middle ? 1
                                        : 0.01});
        }
    }
    const auto at = [&](int row, int column) { return static_cast<std::size_t>(row * side + column); };
    const auto join = [&](std::size_t a, std::size_t b) {
        const Vec3d from = scene.bodies[a].position;
        const Vec3d to = scene.bodies[b].position;
        scene.add("rod " + std::to_string(a) + " " + std::to_string(b), DistanceDef{.a = Scene::bodyAt(a),
                                                                                    .b = Scene::bodyAt(b),
                                                                                    .anchorA = from,
                                                                                    .anchorB = to,
                                                                                    .lower = rod,
                                                                                    .upper = rod});
    };
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            if (row > 0 && column + 1 < side) {
                join(at(row, column), at(row, column + 1));
            }
            if (row + 1 < side) {
                join(at(row, column), at(row + 1, column));
            }
        }
    }
    return scene;
}

ClusterCase clusterCase(const std::string& name, const Scene& scene, double seconds, int steps, const Tell& tell) {
    const Scene ready = settled(scene, seconds);
    Running running(ready);
    for (int i = 0; i < warmSteps; ++i) {
        running.world.step(ready.dt);
    }
    Step step(running, ready);
    ClusterCase result{
        .name = name, .bodies = step.moving, .rows = static_cast<int>(step.problem.rows.size()), .steps = steps};
    const System solved = reference(step);
    const std::vector<Vec6<double>>& answer = solved.v;
    result.referenceResidual = naturalResidual(step.problem, solved);
    System start = step.system;
    start.warmStart(step.problem);
    result.startError = distance(step.problem, start.v, answer);
    result.startResidual = naturalResidual(step.problem, start);

    std::vector<int> sizes = clusterSizes();
    std::erase_if(sizes, [&](int size) { return size >= step.moving; });
    sizes.push_back(step.moving);
    const double parts = static_cast<double>(2 * sizes.size() + 8);
    int done = 0;
    const auto told = [&] {
        if (tell) {
            tell(++done / parts);
        }
    };
    const std::vector<int> sweeps = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512};
    for (const char* const method : {"gauss_seidel", "nncg"}) {
        result.curves.push_back(measureCurve(step, answer, method, 0, sweeps));
        told();
    }
    for (const int size : sizes) {
        const bool all = size == step.moving;
        result.curves.push_back(measureCurve(step, answer, "cluster", size,
                                             all ? std::vector<int>{1} : std::vector<int>{1, 2, 4, 8, 16, 32}));
        told();
    }
    for (const int iterations : {0, 12, 24}) {
        result.runs.push_back(measureRun(ready, "nncg", 0, iterations, steps));
        told();
    }
    for (const int iterations : {0, 4, 12}) {
        result.runs.push_back(measureRun(ready, "gauss_seidel", 0, iterations, steps));
        told();
    }
    constexpr int maxInRuns = 1000;  // bodies in a cluster: beyond, a step takes a minute
    for (const int size : sizes) {
        if (size > maxInRuns) {
            continue;
        }
        result.runs.push_back(measureRun(ready, "cluster", size, 0, steps));
        told();
    }
    return result;
}

ClusterStudy clusterStudy(bool full, const Tell& tell) {
    const int heap = full ? 2000 : 200;
    struct Case {
        std::string name;
        Scene scene;
        double seconds;
        int steps;
        double share;  // of the time that all cases take
    };
    const std::vector<Case> cases = {
        {"wall of 210", makeScene("pyramid", {{"rows", 20}}), 1, 6, full ? 0.03 : 0.4},
        {"heap of " + std::to_string(heap), makeScene("pile", {{"n", heap}}), 4, 6, full ? 0.95 : 0.5},
        {"net of 420", netScene(21), 2, 6, full ? 0.02 : 0.1}};
    ClusterStudy study;
    double done = 0;
    for (const Case& c : cases) {
        study.cases.push_back(clusterCase(c.name, c.scene, c.seconds, c.steps, [&](double share) {
            if (tell) {
                tell(done + c.share * share);
            }
        }));
        done += c.share;
    }
    return study;
}

nlohmann::ordered_json toJson(const ClusterStudy& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "clusters";
    json["cases"] = Json::array();
    for (const ClusterCase& c : study.cases) {
        Json one;
        one["case"] = c.name;
        one["bodies"] = c.bodies;
        one["rows"] = c.rows;
        one["start_error_sqrt_J"] = c.startError;
        one["start_residual_sqrt_J"] = c.startResidual;
        one["reference_residual_sqrt_J"] = c.referenceResidual;
        one["curves"] = Json::array();
        for (const ClusterCurve& curve : c.curves) {
            Json points = Json::array();
            for (const ClusterPoint& p : curve.points) {
                points.push_back({{"iterations", p.iterations},
                                  {"error_sqrt_J", p.error},
                                  {"residual_sqrt_J", p.residual},
                                  {"visits_per_row", p.visits},
                                  {"ms", p.milliseconds}});
            }
            one["curves"].push_back({{"method", curve.method}, {"cluster_size", curve.size}, {"points", points}});
        }
        one["steps"] = c.steps;
        one["runs"] = Json::array();
        for (const ClusterRun& r : c.runs) {
            one["runs"].push_back({{"method", r.method},
                                   {"cluster_size", r.size},
                                   {"iterations", r.iterations},
                                   {"worst_error_m", r.worstError},
                                   {"mean_error_m", r.meanError},
                                   {"ms_per_step", r.milliseconds}});
        }
        json["cases"].push_back(one);
    }
    return json;
}

}  // namespace cairn
