#pragma once
// A recording: a scene, and what each step of its run made of it. With the choices that a clock made (of a budget)
// written down, the same run can be made again, bit for bit, and compared.
#include "command/recording/pose_track.hpp"
#include "demos/run.hpp"

#include <functional>
#include <string_view>

namespace cairn {

struct RecordedStep {
    std::uint64_t hash = 0;   // stateHash() after the step
    double penetration = 0;   // m, StepError::maxPenetration; infinity for what is not finite
    double jointGap = 0;      // m, StepError::maxJointGap; the same
    std::uint32_t flags = 0;  // StepFlag bits
    int qualityLevel = -1;    // StepReport::qualityLevel; -1: no budget
    double maxWork = 0;       // StepReport::maxWork of a budget; 0: none
    int contacts = 0;
    int awake = 0;
    // Whom to look at: the two of Simulation's bodies whose contact is deepest, and the place in Scene::joints of the
    // joint that is widest open. -1: none, or inside a deformable.
    std::array<int, 2> deepest = {-1, -1};
    int widest = -1;
    friend bool operator==(const RecordedStep&, const RecordedStep&) = default;
};

struct Recording {
    std::string version = {};  // of the engine
    std::string build = {};    // compiler and processor: other ones may round differently
    Precision precision = Precision::Double;
    int threads = 1;
    Scene scene = {};
    std::vector<RecordedStep> steps = {};
    // Poses are kept of the start, after every so many steps, and of the end: "frames".
    int every = 1;
    // A PoseTrack each of Simulation's bodies.
    std::vector<std::string> tracks = {};

    int frameCount() const;
    int stepOfFrame(int frame) const;  // 0: the start
};

// How many frames so many steps have.
int framesOf(int steps, int every);

// Some steps of a recording, and the bytes that they add to its tracks.
struct RecordingPart {
    std::vector<RecordedStep> steps;
    std::vector<std::string> tracks;
};

// The version and the build of this program.
std::string engineVersion();
std::string engineBuild();

// The scene as its own file gives it back: what is recorded is then what will be read.
Scene asRead(const Scene& scene);

// 64 bits of all poses and velocities of all bodies, particles included.
std::uint64_t stateHash(const Simulation& simulation);

// What is recorded of the step just made.
RecordedStep recordedStep(const Scene& scene, const Simulation& simulation);

// Keeps a run. The scene, the run and its simulation must outlive it.
class Recorder {
public:
    // The run must be at its start. `fps`: frames a second, at most one a step.
    Recorder(const Scene& scene, const SceneRun& run, double fps);
    // To be called after each step of the run.
    void take();
    // How much it holds, and what that is: it forgets it then, and goes on after it.
    std::size_t bytes() const;
    RecordingPart part();
    // All that it holds. Nothing may be taken after.
    Recording finish();

    // What runs, without steps.
    const Recording& header() const { return recording_; }

private:
    void takePoses();

    const SceneRun& run_;
    Recording recording_;
    std::vector<PoseTrackWriter> tracks_;
    int taken_ = 0;   // steps
    int framed_ = 0;  // the step that the last frame shows
};

// Writes a recording as it is made, so that a long one takes no more memory than a short one. Throws InputError where
// toJson(Scene) does.
class RecordingWriter {
public:
    // Of the recording, what is no step and no pose.
    RecordingWriter(const Recording& header, std::function<void(std::string_view)> write);
    void add(const RecordingPart& part);
    void finish(const RecordingPart& rest);

    int steps() const { return steps_; }
    int frames() const;
    std::size_t bytes() const { return bytes_; }
    std::size_t poseBytes() const { return poseBytes_; }

private:
    void write(const std::string& text);

    std::function<void(std::string_view)> write_;
    int every_;
    int steps_ = 0;
    int parts_ = 0;
    std::size_t bytes_ = 0;
    std::size_t poseBytes_ = 0;
};

// One file.
std::string toText(const Recording& recording);
// Whether a text claims to be a recording.
bool isRecording(const std::string& text);
// The scene of a recording, without its run. Throws as parseRecording does.
Scene recordedScene(const std::string& text, const std::string& file);
// Throws InputError whose field is "file:/json/pointer" for what is torn, of another format, or does not fit together;
// unless `anyVersion`, for another version of the engine too.
Recording parseRecording(const std::string& text, const std::string& file, bool anyVersion = false);

}  // namespace cairn
