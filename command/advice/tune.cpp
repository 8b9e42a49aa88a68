#include "command/advice/tune.hpp"
#include "command/advice/measure.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

constexpr double frame = 1.0 / 60;  // s, that costs are stated for

// Truth: where it begins, and where it is given up that shorter steps change less than a quarter of the error asked.
constexpr int firstDivisor = 2;
constexpr int plainDivisor = 8;
constexpr int maxDivisor = 64;

// Runs shorter than this are run again: the clock would be all one sees. s
constexpr double clockLimit = 0.005;
constexpr int maxRuns = 10;

int stepsOf(const Scene& scene, double seconds) {
    return static_cast<int>(std::lround(seconds / scene.dt));
}

// A simulation of another precision, or in which nothing sleeps, is put where the plain one got to.
void putWhere(const Simulation& from, Simulation& to, const Scene& scene) {
    for (std::size_t i = 0; i < from.bodyCount(); ++i) {
        if (i < scene.bodies.size() && scene.bodies[i].type == BodyType::Static) {
            continue;
        }
        to.setPose(i, from.pose(i));
        to.setVelocity(i, from.linearVelocity(i), from.angularVelocity(i));
    }
}

// The state that all settings start from, with the forces that its solver had found, to be gone on with by another. The
// same steps of the same solver give the same bits, so that it is run anew each time.
std::unique_ptr<Simulation> settle(const Scene& scene, double at, Precision precision, bool sleepless = false) {
    const Scene plain = withoutBudget(scene);
    const auto run = [&](const Scene& which, Precision how) {
        std::unique_ptr<Simulation> simulation = makeSimulation(which, how);
        for (int i = 0; i < stepsOf(scene, at); ++i) {
            simulation->step(scene.dt);
        }
        return simulation;
    };
    if (precision == Precision::Double && !sleepless) {
        return run(plain, precision);
    }
    Scene changed = plain;
    changed.world.sleep.enabled = plain.world.sleep.enabled && !sleepless;
    std::unique_ptr<Simulation> simulation = run(changed, precision);
    if (stepsOf(scene, at) > 0) {
        putWhere(*run(plain, Precision::Double), *simulation, scene);
    }
    return simulation;
}

std::unique_ptr<Simulation> begin(const Scene& scene, const TuneRequest& request, const TuneSetting& setting) {
    std::unique_ptr<Simulation> simulation = settle(scene, request.at, setting.precision);
    const Scene changed = setting.apply(scene);
    simulation->setSolver(changed.world.solver);
    simulation->setAccuracy(changed.world.accuracy);
    return simulation;
}

// What turns about a body's centre of mass is worth a displacement at its radius of gyration. m
struct Extent {
    Vec3d centre = Vec3d::Zero();  // of mass, body frame
    double gyration = 0;
};

Extent extentOf(const BodyDef& body) {
    if (body.type == BodyType::Static || body.particle) {
        return {};
    }
    Extent extent;
    if (!body.shapes.empty()) {
        const MassProperties mass = massProperties(body.shapes);
        if (mass.mass > 0) {
            extent = {mass.centre, std::sqrt(mass.inertia.diagonal().maxCoeff() / mass.mass)};
        }
    }
    if (body.mass > 0 && body.inertia.maxCoeff() > 0) {
        extent.gyration = std::sqrt(body.inertia.maxCoeff() / body.mass);
    }
    return extent;
}

// rad
double turnBetween(const Quatd& a, const Quatd& b) {
    const Quatd turn = a.conjugate() * b;
    return 2 * std::atan2(turn.vec().norm(), std::abs(turn.w()));
}

std::vector<Posed> posesOf(const Simulation& simulation) {
    std::vector<Posed> poses;
    for (std::size_t i = 0; i < simulation.bodyCount(); ++i) {
        poses.push_back(simulation.pose(i));
    }
    return poses;
}

using Path = std::vector<std::vector<Posed>>;  // by step of the scene, then by body

// To steps of no length: what errs in proportion to the step's length is gone.
Path drawnOut(const Path& coarse, const Path& fine) {
    Path path = fine;
    for (std::size_t k = 0; k < fine.size(); ++k) {
        for (std::size_t i = 0; i < fine[k].size(); ++i) {
            const Posed& from = coarse[k][i];
            Posed& to = path[k][i];
            to.position += to.position - from.position;
            to.rotation = (to.rotation * (from.rotation.conjugate() * to.rotation)).normalized();
        }
    }
    return path;
}

double farthest(const Scene& scene, const Path& a, const Path& b) {
    double worst = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        for (const double distance : distances(scene, a[k], b[k])) {
            worst = std::isnan(distance) ? std::numeric_limits<double>::infinity() : std::max(worst, distance);
        }
    }
    return worst;
}

TuneTruth findTruth(const Scene& scene, const TuneRequest& request) {
    TuneTruth truth;
    Path before;
    for (int divisor = firstDivisor; divisor <= maxDivisor; divisor *= 2) {
        const std::unique_ptr<Simulation> simulation = settle(scene, request.at, Precision::Double, true);
        simulation->setSolver(DirectDef{});
        simulation->setAccuracy({});
        truth.flags = 0;
        Path path;
        for (int i = 1; i <= divisor * stepsOf(scene, request.horizon); ++i) {
            truth.flags |= simulation->step(scene.dt / divisor).flags;
            if (i % divisor == 0) {
                path.push_back(posesOf(*simulation));
            }
        }
        if (!before.empty()) {
            Path drawn = drawnOut(before, path);
            truth.doubt =
                truth.poses.empty() ? std::numeric_limits<double>::infinity() : farthest(scene, truth.poses, drawn);
            truth.poses = std::move(drawn);
        }
        before = std::move(path);
        truth.divisor = divisor;
        if (divisor >= plainDivisor && truth.doubt <= request.error / 4) {
            break;
        }
    }
    return truth;
}

// Once more, with an eye on what comes out.
void follow(TuneEntry& entry, const Scene& scene, const std::vector<Posed>& should, const Simulation& simulation,
            double time) {
    TuneMoment& moment = entry.moments.back();
    const std::vector<double> apart = distances(scene, posesOf(simulation), should);
    for (std::size_t i = 0; i < apart.size(); ++i) {
        const double distance = std::isnan(apart[i]) ? std::numeric_limits<double>::infinity() : apart[i];
        moment.distance = std::max(moment.distance, distance);
        if (distance > entry.distance) {
            entry.distance = distance;
            entry.farthest = i;
            entry.farthestAt = time;
        }
    }
}

TuneEntry measure(const Scene& scene, const TuneRequest& request, const TuneSetting& setting, const TuneTruth& truth) {
    TuneEntry entry{.setting = setting};
    const double dt = scene.dt / setting.divisor;
    const int steps = setting.divisor * stepsOf(scene, request.horizon);
    double smallest = std::numeric_limits<double>::infinity();
    double spent = 0;
    for (int run = 0; run < request.repeats || (spent < clockLimit && run < maxRuns); ++run) {
        const std::unique_ptr<Simulation> simulation = begin(scene, request, setting);
        double seconds = 0;
        for (int i = 1; i <= steps; ++i) {
            const double start = cpuSeconds();
            const StepReport& report = simulation->step(dt);
            seconds += cpuSeconds() - start;
            // Steps are the same bits in every run.
            if (run > 0) {
                continue;
            }
            if (i % setting.divisor == 1 || setting.divisor == 1) {
                entry.moments.emplace_back();
            }
            entry.flags |= report.flags;
            entry.energy += report.error.energyGained;
            entry.moments.back().step = std::max(entry.moments.back().step, report.error.position);
            if (report.error.position > entry.step) {
                entry.step = report.error.position;
                entry.worstAt = i * dt;
            }
            if (i % setting.divisor == 0) {
                follow(entry, scene, truth.poses[entry.moments.size() - 1], *simulation, i * dt);
            }
        }
        spent += seconds;
        smallest = std::min(smallest, seconds);
    }
    entry.finite = (entry.flags & FlagNonFinite) == 0 && std::isfinite(entry.distance) && std::isfinite(entry.step);
    entry.ms = 1e3 * smallest * frame / (steps * dt);
    return entry;
}

void require(const TuneRequest& request, const Scene& scene) {
    const auto positive = [](const char* field, double value) {
        if (!(value > 0) || !std::isfinite(value)) {
            throw InputError(field, std::to_string(value), "give a number above 0");
        }
    };
    positive("tune.error", request.error);
    if (request.budget) {
        positive("tune.budget", *request.budget);
    }
    if (!(request.at >= 0) || !std::isfinite(request.at)) {
        throw InputError("tune.at", std::to_string(request.at), "give seconds of 0 or more");
    }
    if (stepsOf(scene, request.horizon) < 1) {
        throw InputError("tune.horizon", std::to_string(request.horizon),
                         "give at least one step of the scene, " + std::to_string(scene.dt) + " s");
    }
}

}  // namespace

std::vector<double> distances(const Scene& scene, const std::vector<Posed>& is, const std::vector<Posed>& should) {
    std::vector<double> all(is.size(), 0);
    for (std::size_t i = 0; i < is.size(); ++i) {
        const Extent extent = i < scene.bodies.size() ? extentOf(scene.bodies[i]) : Extent{};
        all[i] = (is[i] * extent.centre - should[i] * extent.centre).norm() +
                 extent.gyration * turnBetween(is[i].rotation, should[i].rotation);
    }
    return all;
}

void tune(const Scene& scene, TuneResult& result, const std::function<void(int, int)>& finished) {
    require(result.request, scene);
    const std::vector<TuneSetting> settings = tuneSettings(scene, result.request);
    const int total = static_cast<int>(settings.size()) + 1;
    int done = 0;
    const auto tell = [&] {
        if (finished) {
            finished(++done, total);
        }
    };
    if (result.truth.poses.empty()) {
        result.truth = findTruth(scene, result.request);
    }
    tell();
    for (const TuneSetting& setting : settings) {
        const auto known = [&](const TuneEntry& entry) { return entry.setting.label() == setting.label(); };
        if (std::none_of(result.entries.begin(), result.entries.end(), known)) {
            result.entries.push_back(measure(scene, result.request, setting, result.truth));
        }
        tell();
    }
}

std::unique_ptr<Simulation> tuneReplay(const Scene& scene, const TuneRequest& request, const TuneSetting& setting,
                                       double time) {
    std::unique_ptr<Simulation> simulation = begin(scene, request, setting);
    const double dt = scene.dt / setting.divisor;
    for (int i = 0; i < static_cast<int>(std::lround(time / dt)); ++i) {
        simulation->step(dt);
    }
    return simulation;
}

}  // namespace cairn
