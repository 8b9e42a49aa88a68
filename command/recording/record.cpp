#include "command/recording/record.hpp"

#include <bit>
#include <cmath>
#include <limits>

namespace cairn {

namespace {

constexpr const char* processor() {
#if defined(__x86_64__)
    return "x86-64";
#elif defined(__aarch64__)
    return "aarch64";
#else
    return "another processor";
#endif
}

// Each word changes all bits after it, so that no two differences cancel.
class Hash {
public:
    void add(double x) {
        hash_ = std::rotl(hash_ ^ std::bit_cast<std::uint64_t>(x), 29) * 0x9e3779b97f4a7c15u;
        hash_ ^= hash_ >> 32;
    }
    template <class Vector>
    void add(const Vector& v) {
        for (Eigen::Index k = 0; k < v.size(); ++k) {
            add(static_cast<double>(v[k]));
        }
    }
    std::uint64_t value() const { return hash_; }

private:
    std::uint64_t hash_ = 0;
};

// What is not finite has one name in files, and is equal to itself.
double orInfinity(double x) {
    return std::isfinite(x) ? x : std::numeric_limits<double>::infinity();
}

// Whom the errors of the last step belong to.
void findWorst(const Simulation& simulation, const Scene& scene, RecordedStep& step) {
    double depth = 0;
    if (step.penetration > 0) {
        for (const ContactView& contact : simulation.contacts()) {
            const std::array bodies = {simulation.indexOf(contact.a), simulation.indexOf(contact.b)};
            const bool awake = simulation.awake(bodies[0]) || simulation.awake(bodies[1]);
            if (awake && -contact.separation > depth) {
                depth = -contact.separation;
                step.deepest = {static_cast<int>(bodies[0]), static_cast<int>(bodies[1])};
            }
        }
    }
    double gap = 0;
    if (step.jointGap > 0) {
        for (const JointView& joint : simulation.jointViews()) {
            if (joint.gap > gap) {
                const std::size_t index = simulation.indexOf(joint.id);
                gap = joint.gap;
                step.widest = index < scene.joints.size() ? static_cast<int>(index) : -1;
            }
        }
    }
}

}  // namespace

int framesOf(int steps, int every) {
    return 1 + (steps + every - 1) / every;
}

int Recording::frameCount() const {
    return framesOf(static_cast<int>(steps.size()), every);
}

int Recording::stepOfFrame(int frame) const {
    return std::min(frame * every, static_cast<int>(steps.size()));
}

std::string engineVersion() {
    return version;
}

std::string engineBuild() {
#if defined(__clang__)
    return std::string("clang ") + __clang_version__ + ", " + processor();
#elif defined(__GNUC__)
    return std::string("g++ ") + __VERSION__ + ", " + processor();
#else
    return std::string("another compiler, ") + processor();
#endif
}

Scene asRead(const Scene& scene) {
    return parseScene(toJson(scene), ".", scene.name);
}

std::uint64_t stateHash(const Simulation& simulation) {
    Hash hash;
    for (std::size_t i = 0; i < simulation.bodyCount(); ++i) {
        const Posed pose = simulation.pose(i);
        hash.add(pose.position);
        hash.add(pose.rotation.coeffs());
        hash.add(simulation.linearVelocity(i));
        hash.add(simulation.angularVelocity(i));
    }
    return hash.value();
}

RecordedStep recordedStep(const Scene& scene, const Simulation& simulation) {
    const StepReport& report = simulation.report();
    RecordedStep step = {.hash = stateHash(simulation),
                         .penetration = orInfinity(report.error.maxPenetration),
                         .jointGap = orInfinity(report.error.maxJointGap),
                         .flags = report.flags,
                         .qualityLevel = report.qualityLevel,
                         .maxWork = report.qualityLevel >= 0 ? report.maxWork : 0,
                         .contacts = report.counts.contacts,
                         .awake = report.counts.awake};
    findWorst(simulation, scene, step);
    return step;
}

Recorder::Recorder(const Scene& scene, const SceneRun& run, double fps) : run_(run) {
    recording_ = {.version = engineVersion(),
                  .build = engineBuild(),
                  .precision = run.result().precision,
                  .threads = run.result().threads,
                  .scene = scene};
    recording_.every = std::max(1, static_cast<int>(std::lround(std::min(1e6, 1 / (fps * scene.dt)))));
    tracks_.resize(run.simulation().bodyCount());
    takePoses();
}

void Recorder::takePoses() {
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
        tracks_[i].add(run_.simulation().pose(i));
    }
    framed_ = taken_;
}

void Recorder::take() {
    recording_.steps.push_back(recordedStep(recording_.scene, run_.simulation()));
    ++taken_;
    if (taken_ % recording_.every == 0) {
        takePoses();
    }
}

std::size_t Recorder::bytes() const {
    std::size_t sum = recording_.steps.size() * sizeof(RecordedStep);
    for (const PoseTrackWriter& track : tracks_) {
        sum += track.size();
    }
    return sum;
}

RecordingPart Recorder::part() {
    RecordingPart out;
    out.steps.swap(recording_.steps);
    for (PoseTrackWriter& track : tracks_) {
        out.tracks.push_back(track.take());
    }
    return out;
}

Recording Recorder::finish() {
    if (framed_ != taken_) {
        takePoses();
    }
    for (PoseTrackWriter& track : tracks_) {
        recording_.tracks.push_back(track.finish());
    }
    return std::move(recording_);
}

}  // namespace cairn
