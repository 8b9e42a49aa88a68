#include "demos/run.hpp"
#include "base/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cairn {

namespace {

void keepWorst(std::optional<double>& worst, const std::optional<double>& now) {
    if (now && (!worst || *now > *worst)) {
        worst = now;
    }
}

}  // namespace

double RunResult::meanMs() const {
    if (stepSeconds.empty()) {
        return 0;
    }
    return 1e3 * std::accumulate(stepSeconds.begin(), stepSeconds.end(), 0.0) / static_cast<double>(stepSeconds.size());
}

double RunResult::maxMs() const {
    return percentileMs(1);
}

double RunResult::percentileMs(double share) const {
    return 1e3 * percentile(stepSeconds, share);
}

double percentile(std::vector<double> values, double share) {
    if (values.empty()) {
        return 0;
    }
    std::sort(values.begin(), values.end());
    const double place = std::ceil(share * static_cast<double>(values.size())) - 1;
    return values[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(values.size() - 1)))];
}

std::optional<double> energyDrift(const RunResult& result) {
    const double speed = 1e-6;  // m/s
    if (!(result.peakKineticEnergy > 0.5 * result.mass * speed * speed)) {
        return {};
    }
    return result.energyGained / result.peakKineticEnergy;
}

SceneRun::SceneRun(const Scene& scene, Precision precision)
    : scene_(scene), simulation_(makeSimulation(scene, precision)) {
    result_.scene = scene.name;
    result_.solver = solverName(scene.world.solver);
    result_.precision = precision;
    result_.threads = scene.world.jobs ? scene.world.jobs->threadCount() : scene.world.threads;
    result_.dt = scene.dt;
    for (std::size_t i = 0; i < simulation_->bodyCount(); ++i) {
        result_.mass += simulation_->mass(i);
    }
}

void SceneRun::step() {
    double seconds = 0;
    {
        const StageTimer timer(seconds);
        simulation_->step(scene_.dt);
    }
    const StepReport& report = simulation_->report();
    RunResult& r = result_;
    ++r.steps;
    r.stepSeconds.push_back(seconds);
    r.last = {report.error.maxPenetration, report.error.maxJointGap, report.error.maxJointAngle, displacement(),
              report.error.position,       report.error.velocity};
    r.worst.position = std::max(r.worst.position, r.last.position);
    r.worst.velocity = std::max(r.worst.velocity, r.last.velocity);
    r.worst.penetration = std::max(r.worst.penetration, r.last.penetration);
    r.worst.jointGap = std::max(r.worst.jointGap, r.last.jointGap);
    r.worst.jointAngle = std::max(r.worst.jointAngle, r.last.jointAngle);
    r.worst.displacement = std::max(r.worst.displacement, r.last.displacement);
    if (report.counts.contacts > 0) {
        penetrationSum_ += report.error.meanPenetration;
        ++touchingSteps_;
        r.meanPenetration = penetrationSum_ / touchingSteps_;
    }
    keepWorst(r.residualConstraint, report.error.residualConstraint);
    keepWorst(r.residualMomentum, report.error.residualMomentum);
    keepWorst(r.coneViolation, report.error.coneViolation);
    keepWorst(r.residualCoulomb, report.error.residualCoulomb);
    r.energyGained += report.error.energyGained;
    r.momentumDefect = std::max(r.momentumDefect, report.error.momentumDefect);
    r.peakKineticEnergy = std::max(r.peakKineticEnergy, report.kineticEnergy);
    r.finalKineticEnergy = report.kineticEnergy;
    r.flags |= report.flags;
    r.counts = report.counts;
    r.peakContacts = std::max(r.peakContacts, report.counts.contacts);
    r.directIslands += report.counts.directIslands;
    r.sweptIslands += report.counts.sweptIslands;
    r.newtonIterations += report.counts.newtonIterations;
    r.factorisations += report.counts.factorisations;
    r.unconverged += report.counts.unconverged;
    r.narrow += report.counts.narrow;
    r.solves += report.counts.solves;
    for (const IslandReport& island : report.islands) {
        r.subdivisions += island.subdivisions;
        r.rows += static_cast<std::int64_t>(island.rows) * island.subdivisions;
    }
    if (report.qualityLevel >= 0) {
        r.qualityLevels.push_back(report.qualityLevel);
        r.maxWork.push_back(report.maxWork);
    }
}

void SceneRun::advanceTo(double time) {
    while (this->time() + 0.5 * scene_.dt <= time) {
        step();
    }
}

double SceneRun::displacement() const {
    double worst = 0;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        if (scene_.bodies[i].type == BodyType::Dynamic) {
            worst = std::max(worst, (simulation_->pose(i).position - scene_.bodies[i].position).norm());
        }
    }
    return worst;
}

int stepCount(const Scene& scene) {
    return std::max(1, static_cast<int>(std::lround(scene.seconds / scene.dt)));
}

}  // namespace cairn
