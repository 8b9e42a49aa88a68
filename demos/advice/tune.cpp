#include <cairn/demos/advice/measure.hpp>
#include <cairn/demos/advice/tune.hpp>

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

constexpr double frame = 1.0 / 60;  // s, that costs are stated for

// Truth: where it begins, and where it is given up that shorter steps change less than a quarter of the error asked.
constexpr int firstDivisor = 4;
constexpr int plainDivisor = 8;
constexpr int mostDivisor = 64;

// Runs shorter than this are run again: the clock would be all one sees. s
constexpr double clockLimit = 0.005;
constexpr int mostRuns = 10;

int stepsOf(const Scene& scene, double seconds) {
    return static_cast<int>(std::lround(seconds / scene.dt));
}

Scene withoutBudget(const Scene& scene) {
    Scene copy = scene;
    copy.world.accuracy.budget = 0;
    return copy;
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

double farthest(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double distance = (a[i] - b[i]).norm();
        worst = std::isnan(distance) ? std::numeric_limits<double>::infinity() : std::max(worst, distance);
    }
    return worst;
}

// Of bodies that no force moves too: they are where they are said to be.
std::vector<Vec3d> positionsOf(const Simulation& simulation) {
    std::vector<Vec3d> positions;
    for (std::size_t i = 0; i < simulation.bodyCount(); ++i) {
        positions.push_back(simulation.pose(i).position);
    }
    return positions;
}

TuneTruth findTruth(const Scene& scene, const TuneRequest& request) {
    TuneTruth truth;
    for (int divisor = firstDivisor; divisor <= mostDivisor; divisor *= 2) {
        const std::unique_ptr<Simulation> simulation = settle(scene, request.at, Precision::Double, true);
        simulation->setSolver({.name = "direct"});
        simulation->setAccuracy({});
        truth.flags = 0;
        for (int i = 0; i < divisor * stepsOf(scene, request.horizon); ++i) {
            truth.flags |= simulation->step(scene.dt / divisor).flags;
        }
        const std::vector<Vec3d> before = std::exchange(truth.positions, positionsOf(*simulation));
        truth.divisor = divisor;
        truth.doubt = farthest(before, truth.positions);
        if (divisor >= plainDivisor && truth.doubt <= request.error / 4) {
            break;
        }
    }
    return truth;
}

TuneEntry measure(const Scene& scene, const TuneRequest& request, const TuneSetting& setting, const TuneTruth& truth) {
    TuneEntry entry{.setting = setting};
    const double dt = scene.dt / setting.divisor;
    const int steps = setting.divisor * stepsOf(scene, request.horizon);
    double least = std::numeric_limits<double>::infinity();
    double spent = 0;
    for (int run = 0; run < request.repeats || (spent < clockLimit && run < mostRuns); ++run) {
        const std::unique_ptr<Simulation> simulation = begin(scene, request, setting);
        double seconds = 0;
        for (int i = 1; i <= steps; ++i) {
            const double start = cpuSeconds();
            const StepReport& report = simulation->step(dt);
            seconds += cpuSeconds() - start;
            entry.flags |= report.flags;
            if (report.error.position > entry.step) {
                entry.step = report.error.position;
                entry.worstAt = i * dt;
            }
        }
        spent += seconds;
        least = std::min(least, seconds);
        if (run == 0) {
            entry.distance = farthest(positionsOf(*simulation), truth.positions);
        }
    }
    entry.finite = (entry.flags & FlagNonFinite) == 0 && std::isfinite(entry.distance) && std::isfinite(entry.step);
    entry.ms = 1e3 * least * frame / (steps * dt);
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

double TuneEntry::error() const {
    return finite ? std::max(distance, step) : std::numeric_limits<double>::infinity();
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
    if (result.truth.positions.empty()) {
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

std::vector<std::size_t> tuneFront(const TuneResult& result) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        if (result.entries[i].finite) {
            order.push_back(i);
        }
    }
    const auto at = [&](std::size_t i) -> const TuneEntry& { return result.entries[i]; };
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(at(a).ms, at(a).error()) < std::pair(at(b).ms, at(b).error());
    });
    std::vector<std::size_t> front;
    for (const std::size_t i : order) {
        if (front.empty() || at(i).error() < at(front.back()).error()) {
            front.push_back(i);
        }
    }
    return front;
}

std::optional<std::size_t> tuneChoice(const TuneResult& result) {
    const std::vector<std::size_t> front = tuneFront(result);
    std::optional<std::size_t> choice;
    for (const std::size_t i : front) {
        const TuneEntry& entry = result.entries[i];
        if (result.request.budget) {
            if (entry.ms <= 1e3 * *result.request.budget) {
                choice = i;  // the last that is cheap enough is the best of them
            }
        } else if (entry.error() <= result.request.error) {
            return i;
        }
    }
    return choice;
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

Figure tuneFigure(const Scene& scene, const TuneResult& result) {
    // A solver that exploded would stretch the axis: it is drawn at the edge.
    constexpr double most = 1e4;    // mm
    constexpr double least = 1e-6;  // mm
    Panel panel{.title = "",
                .x = {.label = "CPU ms for 1/60 s of the scene", .logarithmic = true},
                .y = {.label = "error, mm", .logarithmic = true}};
    Series front{.label = "measured front"};
    double lowest = std::numeric_limits<double>::infinity();
    double highest = 0;
    double cheapest = lowest;
    double dearest = 0;
    for (const TuneEntry& entry : result.entries) {
        const double error = std::clamp(1e3 * entry.error(), least, most);
        lowest = std::min(lowest, error);
        highest = std::max(highest, error);
        cheapest = std::min(cheapest, entry.ms);
        dearest = std::max(dearest, entry.ms);
    }
    for (const std::size_t i : tuneFront(result)) {
        front.points.push_back({result.entries[i].ms, std::clamp(1e3 * result.entries[i].error(), least, most)});
    }
    panel.series.push_back(std::move(front));
    if (result.request.budget) {
        const double x = 1e3 * *result.request.budget;
        panel.series.push_back({.label = "asked", .points = {{x, lowest}, {x, highest}}, .kind = SeriesKind::Dashed});
    } else {
        const double y = 1e3 * result.request.error;
        panel.series.push_back({.label = "asked", .points = {{cheapest, y}, {dearest, y}}, .kind = SeriesKind::Dashed});
    }
    for (const TuneEntry& entry : result.entries) {
        const auto place = std::find_if(panel.series.begin(), panel.series.end(), [&](const Series& series) {
            return series.label == entry.setting.solver.name;
        });
        Series& series =
            place != panel.series.end()
                ? *place
                : panel.series.emplace_back(Series{.label = entry.setting.solver.name, .kind = SeriesKind::Marks});
        series.points.push_back({entry.ms, std::clamp(1e3 * entry.error(), least, most)});
    }
    return {.title = "Settings of " + scene.name,
            .note = "error: the worse of the distance to a converged run and of any step's own error",
            .panels = {std::move(panel)}};
}

}  // namespace cairn
