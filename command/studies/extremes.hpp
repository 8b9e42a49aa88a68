#pragma once
// Where each solver ends: one quantity at a time is taken far out, in both precisions, and what happens is judged from
// the poses, not from what the solver says. Each cell of the map holds, is soft, is refused, or fails; and says so by a
// flag or does not.
#include "demos/demos.hpp"

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

// Where a body should be.
struct ExtremeTarget {
    std::size_t body = 0;  // in Scene::bodies
    Vec3d position = Vec3d::Zero();
    double slack = 0;    // m, that it may be missed by: what a step cannot resolve
    bool atEnd = false;  // then alone; else at all times
};

// A scene and what may be said of it beforehand.
struct ExtremeScene {
    Scene scene = {};
    double tolerance = 1e-3;  // m, under which it holds
    double size = 1;          // m, of a body: what a fall by it gives is energy in play
    double allowed = 0;       // J, that the scene may gain: what was stored in an overlap
    double settled = 0;       // s, from which on errors count
    // Where the centre of every dynamic body must be: outside, it is lost. Energy bounds the rest.
    Vec3d min = Vec3d::Constant(-unlimited);
    Vec3d max = Vec3d::Constant(unlimited);
    std::vector<ExtremeTarget> targets = {};
};

struct ExtremeAxis {
    std::string name = {};
    std::string unit = {};  // may be empty
    std::vector<double> values = {};
    ExtremeScene (*make)(double value) = nullptr;
};
const std::vector<ExtremeAxis>& extremeAxes();

enum class Verdict {
    Holds,    // the error is under its tolerance
    Soft,     // bounded: the error is stated
    Refused,  // an InputError, or a step that was refused
    Fails,    // a body non-finite or lost, or energy from nothing
};
const char* name(Verdict verdict);

struct ExtremeEntry {
    std::string axis = {};
    double value = 0;
    std::string solver = {};
    Precision precision = Precision::Double;
    Verdict verdict = Verdict::Holds;
    double error = 0;         // m, worst of: depth under the floor, open joints, targets missed
    double tolerance = 0;     // m
    double energyGained = 0;  // of the energy in play, as poses and velocities give it
    std::uint32_t flags = 0;  // StepFlag bits that any step raised
    std::string words = {};   // why it was refused or failed

    bool flagged() const {
        return (flags & (FlagNonFinite | FlagUnconverged | FlagRefused | FlagTolerance | FlagEnergy)) != 0;
    }
    bool failsSilently() const { return verdict == Verdict::Fails && !flagged(); }
};
ExtremeEntry tryExtreme(const ExtremeAxis& axis, double value, const std::string& solver, Precision precision);

struct ExtremeStudy {
    std::vector<std::string> solvers = {};
    std::vector<ExtremeEntry> entries = {};  // by axis, value, solver, precision

    const ExtremeEntry& at(const std::string& axis, double value, const std::string& solver, Precision precision) const;
};
ExtremeStudy extremeStudy(const std::vector<std::string>& solvers, const Tell& tell = {});

nlohmann::ordered_json toJson(const ExtremeStudy& study);
// The map as a whole SVG document: a column a value, a row a solver and a precision.
std::string extremeMap(const ExtremeStudy& study);

}  // namespace cairn
