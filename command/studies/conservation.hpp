#pragma once
// What each solver conserves: linear and angular momentum per iteration and per step, energy per step (theory sections
// 3.4 and 7.2). Small scenes without gravity, so that every change is the solver's.
#include <cairn/assets.hpp>

#include <nlohmann/json.hpp>

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

struct FreeScene {
    std::string name = {};
    Scene scene = {};
    // The last body is moved by this after its joints were made: a gap that they start with.
    Vec3d displaced = Vec3d::Zero();
    bool conservesEnergy = false;  // whether its motion, exactly followed, would
};
// Jointed pairs, with a gap as a point constraint and as a scalar distance, a chain in flight, colliding boxes.
std::vector<FreeScene> momentumScenes();
// Pairs, chains and pendulums that swing on, and collisions.
std::vector<FreeScene> energyScenes();

// Sums over the bodies of a world.
struct MotionSum {
    Vec3d momentum = Vec3d::Zero();         // N s
    Vec3d angularMomentum = Vec3d::Zero();  // N m s, about the origin
    double energy = 0;                      // J, kinetic and of gravity
    double momentumSize = 0;                // N s, sum of lengths
    double angularSize = 0;                 // N m s, sum of lengths
};
MotionSum motionSum(const Worldd& world);

struct Defect {
    double linear = 0;   // change of momentum over the sum of the bodies' own at the start
    double angular = 0;  // the same of angular momentum
    double energy = 0;  // change of energy over that at the start; of scenes with gravity: over the peak of the kinetic
    bool finite = true;
};

struct IterationDefect {
    std::string solver = {};
    std::string scene = {};
    int iterations = 0;
    Defect defect = {};  // after one step of one sub-step
};
struct RunDefect {
    std::string solver = {};
    std::string scene = {};
    Defect worst = {};                  // of the run; energy: gain
    double finalEnergy = 0;             // change at the end, as Defect::energy
    double lost = 0;                    // most that was lost, >= 0
    std::vector<double> energies = {};  // change after each sample
    double samplePeriod = 0;            // s
};

struct ConservationStudy {
    std::vector<std::string> solvers = {};
    std::vector<std::string> scenes = {};
    std::vector<IterationDefect> byIteration = {};
    std::vector<RunDefect> byRun = {};

    const IterationDefect& at(const std::string& solver, const std::string& scene, int iterations) const;
    const RunDefect& run(const std::string& solver, const std::string& scene) const;
};

// One step of one sub-step of 1/60 s with so many iterations.
Defect stepDefect(const FreeScene& scene, const SolverDef& solver);
// Iterations 1, 2, 4 .. 128, and `seconds` with each solver's defaults.
ConservationStudy momentumStudy(bool full, const Tell& tell = {});
ConservationStudy energyStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const ConservationStudy& study);

}  // namespace cairn
