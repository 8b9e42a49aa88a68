#include <cairn/demos/advice/bench.hpp>
#include <cairn/demos/advice/measure.hpp>
#include <cairn/demos/run.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cairn {

double BenchEntry::meanMs() const {
    return stepMs.empty() ? 0 : std::accumulate(stepMs.begin(), stepMs.end(), 0.0) / static_cast<double>(stepMs.size());
}

double BenchEntry::percentileMs(double share) const {
    return percentile(stepMs, share);
}

double BenchEntry::error() const {
    return stepError.empty() ? 0 : *std::max_element(stepError.begin(), stepError.end());
}

double BenchEntry::errorAt() const {
    const auto worst = std::max_element(stepError.begin(), stepError.end());
    return dt * static_cast<double>(worst - stepError.begin() + 1);
}

BenchEntry bench(const Scene& given, Precision precision, double seconds, int repeats,
                 const std::function<void()>& tell) {
    const Scene scene = withoutBudget(given);
    const auto steps = static_cast<std::size_t>(std::max(1L, std::lround(seconds / scene.dt)));
    BenchEntry entry{.scene = scene.name, .dt = scene.dt, .stepMs = std::vector(steps, 1e300)};
    for (int run = 0; run < repeats; ++run) {
        const std::unique_ptr<Simulation> simulation = makeSimulation(scene, precision);
        entry.bodies = static_cast<int>(simulation->bodyCount());
        for (std::size_t i = 0; i < steps; ++i) {
            const double start = cpuSeconds();
            const StepReport& report = simulation->step(scene.dt);
            entry.stepMs[i] = std::min(entry.stepMs[i], 1e3 * (cpuSeconds() - start));
            if (run == 0) {
                entry.stepError.push_back(report.error.position);
                entry.penetration = std::max(entry.penetration, report.error.maxPenetration);
                entry.jointGap = std::max(entry.jointGap, report.error.maxJointGap);
                entry.rows += report.counts.rows;
                entry.looks += report.counts.pairs - report.counts.carriedPairs;
                entry.flags |= report.flags;
            }
            if (tell) {
                tell();
            }
        }
    }
    entry.rows /= static_cast<double>(steps);
    entry.looks /= static_cast<double>(steps);
    return entry;
}

nlohmann::ordered_json benchJson(const std::vector<BenchEntry>& entries) {
    nlohmann::ordered_json json = {{"cairn_bench", 1}, {"scenes", nlohmann::ordered_json::array()}};
    for (const BenchEntry& entry : entries) {
        json["scenes"].push_back({{"scene", entry.scene},
                                  {"bodies", entry.bodies},
                                  {"steps", entry.stepMs.size()},
                                  {"dt", entry.dt},
                                  {"ms_per_step",
                                   {{"mean", entry.meanMs()},
                                    {"p50", entry.percentileMs(0.5)},
                                    {"p99", entry.percentileMs(0.99)},
                                    {"max", entry.percentileMs(1)}}},
                                  {"error_m", entry.error()},
                                  {"max_penetration_m", entry.penetration},
                                  {"max_joint_gap_m", entry.jointGap},
                                  {"rows", entry.rows},
                                  {"looks", entry.looks},
                                  {"flags", flagNames(entry.flags)}});
    }
    return json;
}

std::optional<BenchBefore> benchBefore(const nlohmann::json& baseline, const std::string& file,
                                       const BenchEntry& entry) {
    try {
        if (baseline.at("cairn_bench") != 1) {
            throw InputError("--baseline", file, "it is of another version; measure it anew");
        }
        for (const nlohmann::json& one : baseline.at("scenes")) {
            if (one.at("scene") == entry.scene) {
                return BenchBefore{.ms = one.at("ms_per_step").at("mean"),
                                   .error = one.at("error_m"),
                                   .same = one.at("steps") == entry.stepMs.size() && one.at("rows") == entry.rows &&
                                           one.at("looks") == entry.looks};
            }
        }
        return {};
    } catch (const nlohmann::json::exception& error) {
        throw InputError("--baseline", file, std::string("it is no JSON of cairn bench: ") + error.what());
    }
}

}  // namespace cairn
