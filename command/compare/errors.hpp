#pragma once
// How wrong a world is, from the poses and velocities of its bodies alone, by the same formulas for every engine.
#include "collision/broad_phase/broad_phase.hpp"
#include "command/compare/reference_engine.hpp"
#include "command/compare/truths.hpp"

namespace cairn {

// An error of a whole run.
struct Measure {
    std::string key;         // in JSON
    std::string words;       // in tables, unit last
    double scale = 1;        // from SI to the unit of the words
    double min = 0;          // SI: errors below this count as none when engines are set against each other
    double max = unlimited;  // SI: above this the scene has failed, however cheaply
};

class ErrorMeter {
public:
    // The scene must outlive the meter.
    ErrorMeter(const Scene& scene, Known known);
    explicit ErrorMeter(const Scene& scene) : ErrorMeter(scene, knownOf(scene)) {}

    // What is measured, in order: of a scene that should rest the displacement, else how far it is from its closed form
    // and SimBenchmark's own; the gap where there are joints, the penetration where bodies may collide.
    const std::vector<Measure>& measures() const { return measures_; }
    // After each step of a run; `steps` have passed.
    void look(const ReferenceEngine& reference, int steps);
    // Of the run so far, one for each measure, SI.
    std::vector<double> errors() const;

    // m: the farthest that a dynamic body's frame is from where the scene put it.
    double displacement(const ReferenceEngine& reference) const;
    // m: the deepest point of any two bodies that may collide, by Cairn's narrow phase, which remembers nothing here
    // and looks as far as a world does, so that of the same poses it is StepError::maxPenetration.
    double penetration(const ReferenceEngine& reference);
    // m: the farthest apart that a joint's two anchors are (across its line for a slider; beyond its bounds for a
    // distance).
    double jointGap(const ReferenceEngine& reference) const;
    // m: the farthest that a point is from where its closed form says.
    double offForm(const ReferenceEngine& reference, double seconds) const;

private:
    struct Anchors {
        std::size_t a, b;
        Vec3d onA, onB;  // in the bodies' frames
        const JointDef* def;
        Vec3d axis = Vec3d::Zero();  // of a slider, in a's frame
        double lower = 0;            // m, of a distance
        double upper = 0;
    };
    struct Depths {
        double deepest = 0;       // m
        double sumOfSquares = 0;  // m2, over points
    };

    // None where a joint gives way by its nature.
    void addAnchors(const SceneJoint& joint);
    void listMeasures();
    Depths depths(const ReferenceEngine& reference);
    // SimBenchmark's rolling and bouncing at one step.
    double speedError(const ReferenceEngine& reference, double seconds) const;

    const Scene& scene_;
    Known known_;
    std::vector<std::pair<std::size_t, std::size_t>> joined_;  // that do not collide; sorted
    BroadPhase broadPhase_;
    std::vector<Anchors> anchors_;
    bool touches_ = false;  // whether any two bodies may collide
    std::vector<Measure> measures_;
    double displacement_ = 0;  // worst so far
    double penetration_ = 0;
    double jointGap_ = 0;
    double offForm_ = 0;
    double simBenchmark_ = 0;  // sum over steps
    int steps_ = 0;
};

}  // namespace cairn
