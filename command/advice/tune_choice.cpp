// Of what was measured: the front, the choice, and what to say about it.
#include "command/advice/measure.hpp"
#include "command/advice/tune.hpp"
#include "engine/model/solver_numbers.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

// Costs that differ by less are the same.
constexpr double sameCost = 1.1;

}  // namespace

bool tuneByStep(const TuneResult& result) {
    return result.request.by == TuneBy::Step || result.truth.doubt > result.request.error;
}

double tuneError(const TuneResult& result, const TuneEntry& entry) {
    if (!entry.finite) {
        return std::numeric_limits<double>::infinity();
    }
    return tuneByStep(result) ? entry.step : std::max(entry.distance, entry.step);
}

std::vector<std::size_t> tuneFront(const TuneResult& result) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        if (result.entries[i].finite) {
            order.push_back(i);
        }
    }
    const auto key = [&](std::size_t i) {
        return std::pair(result.entries[i].ms, tuneError(result, result.entries[i]));
    };
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    std::vector<std::size_t> front;
    for (const std::size_t i : order) {
        if (front.empty() || key(i).second < key(front.back()).second) {
            front.push_back(i);
        }
    }
    return front;
}

std::optional<std::size_t> tuneOwn(const TuneResult& result) {
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        if (result.entries[i].setting.given) {
            return i;
        }
    }
    return {};
}

std::optional<std::size_t> tuneChoice(const TuneResult& result) {
    std::optional<std::size_t> choice;
    const std::vector<std::size_t> front = tuneFront(result);
    const auto errorOf = [&](std::size_t i) { return tuneError(result, result.entries[i]); };
    if (result.request.budget) {
        for (const std::size_t i : front) {
            if (result.entries[i].ms <= 1e3 * *result.request.budget) {
                choice = i;  // the last that is cheap enough is the best of them
            }
        }
        return choice;
    }
    const auto within = [&](std::size_t i) { return errorOf(i) <= result.request.error; };
    const auto cheapest = std::find_if(front.begin(), front.end(), within);
    if (cheapest == front.end()) {
        return {};
    }
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        if (within(i) && result.entries[i].ms <= sameCost * result.entries[*cheapest].ms) {
            if (result.entries[i].setting.given) {
                return i;
            }
            choice = !choice || errorOf(i) < errorOf(*choice) ? i : choice;
        }
    }
    return choice;
}

std::vector<std::string> tuneNotes(const Scene& scene, const TuneResult& result) {
    const TuneRequest& request = result.request;
    std::vector<std::string> notes;
    if (request.by == TuneBy::Both && tuneByStep(result)) {
        notes.push_back(
            "The truth is known to " + brief(1e3 * result.truth.doubt) + " mm alone: steps of " +
            brief(1e3 * scene.dt / std::max(1, result.truth.divisor)) +
            " ms still change where bodies go, as impacts and what topples do, and no setting is at fault. "
            "Settings are judged by their steps' own errors; with a shorter --horizon the distance may count.");
    }
    const std::optional<std::size_t> own = tuneOwn(result);
    if (own && !tuneByStep(result)) {
        // A body that joints or locks guide and that falls for T is off by g T h / 2 for sub-steps of h, whatever the
        // solver.
        const TuneEntry& entry = result.entries[*own];
        const double h = scene.dt / std::max(1, numbersOf(entry.setting.solver).substeps);
        const double fall = scene.world.gravity.norm() * request.horizon * h / 2;
        if (fall > request.error && std::abs(entry.distance - fall) < 0.02 * fall) {
            notes.push_back(
                "The scene's own setting is " + brief(1e3 * entry.distance) +
                " mm off because a body that is jointed or guided falls freely: in steps of " + brief(1e3 * h) +
                " ms that is g T h / 2 for any solver, and shorter steps or sub-steps alone take it "
                "away. To judge contacts and joints, begin when bodies touch (--at), or judge by the steps' own "
                "errors (--by step).");
        }
    }
    if (const auto choice = tuneChoice(result)) {
        std::string flags;
        for (const std::string& flag : flagNames(result.entries[*choice].flags)) {
            flags += (flags.empty() ? "" : ", ") + flag;
        }
        if (!flags.empty()) {
            notes.push_back("Steps of the setting that was found were flagged: " + flags + ".");
        }
    }
    return notes;
}

Figure tuneFigure(const Scene& scene, const TuneResult& result) {
    // A solver that exploded would stretch the axis: it is drawn at the edge.
    constexpr double maxError = 1e4;   // mm
    constexpr double minError = 1e-6;  // mm
    Panel panel{.title = "",
                .x = {.label = "CPU ms for 1/60 s of the scene", .logarithmic = true},
                .y = {.label = "error, mm", .logarithmic = true}};
    Series front{.label = "measured front"};
    double lowest = std::numeric_limits<double>::infinity();
    double highest = 0;
    double cheapest = lowest;
    double dearest = 0;
    for (const TuneEntry& entry : result.entries) {
        const double error = std::clamp(1e3 * tuneError(result, entry), minError, maxError);
        lowest = std::min(lowest, error);
        highest = std::max(highest, error);
        cheapest = std::min(cheapest, entry.ms);
        dearest = std::max(dearest, entry.ms);
    }
    for (const std::size_t i : tuneFront(result)) {
        front.points.push_back(
            {result.entries[i].ms, std::clamp(1e3 * tuneError(result, result.entries[i]), minError, maxError)});
    }
    panel.series.push_back(std::move(front));
    if (result.request.budget) {
        const double x = 1e3 * *result.request.budget;
        panel.series.push_back({.label = "asked", .points = {{x, lowest}, {x, highest}}, .kind = SeriesKind::Dashed});
    } else {
        const double y = 1e3 * result.request.error;
        panel.series.push_back({.label = "asked", .points = {{cheapest, y}, {dearest, y}}, .kind = SeriesKind::Dashed});
    }
    if (const auto own = tuneOwn(result)) {
        const TuneEntry& entry = result.entries[*own];
        panel.series.push_back({.label = "the scene's own",
                                .points = {{entry.ms, std::clamp(1e3 * tuneError(result, entry), minError, maxError)}},
                                .kind = SeriesKind::Marks});
    }
    for (const TuneEntry& entry : result.entries) {
        if (entry.setting.given) {
            continue;
        }
        const auto place = std::find_if(panel.series.begin(), panel.series.end(), [&](const Series& series) {
            return series.label == solverName(entry.setting.solver);
        });
        Series& series = place != panel.series.end()
                             ? *place
                             : panel.series.emplace_back(
                                   Series{.label = solverName(entry.setting.solver), .kind = SeriesKind::Marks});
        series.points.push_back({entry.ms, std::clamp(1e3 * tuneError(result, entry), minError, maxError)});
    }
    return {.title = "Settings of " + scene.name,
            .note = tuneByStep(result)
                        ? "error: of the worst step"
                        : "error: the worse of the distance to a converged run and of any step's own error",
            .panels = {std::move(panel)}};
}

}  // namespace cairn
