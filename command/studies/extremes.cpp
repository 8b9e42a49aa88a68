#include "command/studies/extremes.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

// J, of the scene before its first step, gravity's share included.
double startEnergy(const Scene& scene, const Simulation& simulation) {
    double energy = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& def = scene.bodies[i];
        const double mass = simulation.mass(i);
        if (mass == 0) {
            continue;
        }
        const MassProperties own = massProperties(def.shapes);
        const Vec3d w = def.rotation.conjugate() * def.angularVelocity;
        energy += 0.5 * mass * (def.linearVelocity.squaredNorm() + w.dot(own.inertia * w) / own.mass);
        energy -= mass * scene.world.gravity.dot(def.position);
    }
    return energy;
}

class Judge {
public:
    Judge(const ExtremeScene& what, Precision precision)
        : what_(what), simulation_(makeSimulation(what.scene, precision)) {
        start_ = startEnergy(what_.scene, *simulation_);
        for (std::size_t i = 0; i < simulation_->bodyCount(); ++i) {
            weight_ += simulation_->mass(i) * what_.scene.world.gravity.norm();
        }
        peak_ = startKinetic();
    }

    // False where the run is over: refused or failed.
    bool step(ExtremeEntry& entry, int index, int steps) {
        const StepReport& report = simulation_->step(what_.scene.dt);
        entry.flags |= report.flags;
        if ((report.flags & FlagRefused) != 0) {
            entry.verdict = Verdict::Refused;
            entry.words = "the step is refused";
            return false;
        }
        if ((report.flags & FlagNonFinite) != 0) {
            return fail(entry, "a body went non-finite and was put back");
        }
        double momentum = 0;  // N s, sum of the sizes
        for (std::size_t i = 0; i < simulation_->bodyCount(); ++i) {
            const Posed pose = simulation_->pose(i);
            if (!pose.isFinite() || !simulation_->linearVelocity(i).allFinite()) {
                return fail(entry, "a body went non-finite");
            }
            const double mass = simulation_->mass(i);
            const bool outside =
                (pose.position.array() < what_.min.array()).any() || (pose.position.array() > what_.max.array()).any();
            if (mass > 0 && outside) {
                return fail(entry, "\"" + what_.scene.bodies[i].name + "\" is lost");
            }
            momentum += mass * simulation_->linearVelocity(i).norm();
        }
        // Symplectic Euler takes velocities up to half a step later than positions.
        const double late = 0.5 * what_.scene.dt * momentum * what_.scene.world.gravity.norm();
        peak_ = std::max(peak_, report.kineticEnergy);
        const double gained = report.kineticEnergy + report.potentialEnergy - start_ - late - what_.allowed;
        const double inPlay = peak_ + weight_ * what_.size;
        entry.energyGained = std::max(entry.energyGained, inPlay > 0 ? gained / inPlay : 0);
        const double time = what_.scene.dt * (index + 1);
        if (time >= what_.settled) {
            entry.error = std::max(
                {entry.error, report.error.maxPenetration, report.error.maxJointGap, targetError(index + 1 == steps)});
        }
        return true;
    }

    // Of the energy in play.
    static constexpr double maxGained = 1e-3;

private:
    static bool fail(ExtremeEntry& entry, const std::string& words) {
        entry.verdict = Verdict::Fails;
        entry.words = words;
        return false;
    }

    double startKinetic() const {
        double energy = start_;
        for (std::size_t i = 0; i < what_.scene.bodies.size(); ++i) {
            energy += simulation_->mass(i) * what_.scene.world.gravity.dot(what_.scene.bodies[i].position);
        }
        return energy;
    }

    double targetError(bool last) const {
        double worst = 0;
        for (const ExtremeTarget& target : what_.targets) {
            if (last || !target.atEnd) {
                const double off = (simulation_->pose(target.body).position - target.position).norm();
                worst = std::max(worst, off - target.slack);
            }
        }
        return worst;
    }

    const ExtremeScene& what_;
    std::unique_ptr<Simulation> simulation_;
    double start_ = 0;   // J
    double weight_ = 0;  // N
    double peak_ = 0;    // J, of kinetic energy
};

}  // namespace

const char* name(Verdict verdict) {
    switch (verdict) {
        case Verdict::Holds:
            return "holds";
        case Verdict::Soft:
            return "soft";
        case Verdict::Refused:
            return "refused";
        default:
            return "fails";
    }
}

ExtremeEntry tryExtreme(const ExtremeAxis& axis, double value, const std::string& solver, Precision precision) {
    ExtremeEntry entry{.axis = axis.name, .value = value, .solver = solver, .precision = precision};
    try {
        ExtremeScene what = axis.make(value);
        what.scene.world.solver = solverNamed(solver, what.scene.world.solver);
        entry.tolerance = what.tolerance;
        Judge judge(what, precision);
        const int steps = stepCount(what.scene);
        for (int i = 0; i < steps; ++i) {
            if (!judge.step(entry, i, steps)) {
                return entry;
            }
        }
    } catch (const InputError& error) {
        entry.verdict = Verdict::Refused;
        entry.words = error.what();
        return entry;
    }
    if (entry.energyGained > Judge::maxGained) {
        entry.verdict = Verdict::Fails;
        entry.words = "energy from nothing";
    } else {
        entry.verdict = entry.error <= entry.tolerance ? Verdict::Holds : Verdict::Soft;
    }
    return entry;
}

const ExtremeEntry& ExtremeStudy::at(const std::string& axis, double value, const std::string& solver,
                                     Precision precision) const {
    for (const ExtremeEntry& e : entries) {
        if (e.axis == axis && e.value == value && e.solver == solver && e.precision == precision) {
            return e;
        }
    }
    throw InputError("study", axis + ", " + solver, "not measured");
}

ExtremeStudy extremeStudy(const std::vector<std::string>& solvers, const Tell& tell) {
    ExtremeStudy study{.solvers = solvers};
    std::size_t all = 0;
    for (const ExtremeAxis& axis : extremeAxes()) {
        all += 2 * axis.values.size() * solvers.size();
    }
    for (const ExtremeAxis& axis : extremeAxes()) {
        for (const double value : axis.values) {
            for (const std::string& solver : solvers) {
                for (const Precision precision : {Precision::Double, Precision::Float}) {
                    study.entries.push_back(tryExtreme(axis, value, solver, precision));
                    if (tell) {
                        tell(static_cast<double>(study.entries.size()) / static_cast<double>(all));
                    }
                }
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const ExtremeStudy& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "extremes";
    json["entries"] = Json::array();
    for (const ExtremeEntry& e : study.entries) {
        json["entries"].push_back({{"axis", e.axis},
                                   {"value", e.value},
                                   {"solver", e.solver},
                                   {"precision", name(e.precision)},
                                   {"verdict", name(e.verdict)},
                                   {"error_m", e.error},
                                   {"tolerance_m", e.tolerance},
                                   {"energy_gained", e.energyGained},
                                   {"flags", flagNames(e.flags)},
                                   {"words", e.words}});
    }
    return json;
}

}  // namespace cairn
