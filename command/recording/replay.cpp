#include "command/recording/replay.hpp"
#include "command/advice/advice.hpp"

namespace cairn {

namespace {

// What of a step is not as recorded; empty if all of it is.
std::string differing(const RecordedStep& was, const RecordedStep& is) {
    if (was.hash != is.hash) {
        return "state";
    }
    if (was.penetration != is.penetration) {
        return "penetration";
    }
    if (was.jointGap != is.jointGap) {
        return "joint gap";
    }
    if (was.flags != is.flags) {
        return "flags";
    }
    if (was.contacts != is.contacts || was.awake != is.awake || was.qualityLevel != is.qualityLevel ||
        was.maxWork != is.maxWork) {
        return "counts";
    }
    return was == is ? "" : "worst pair or joint";
}

// Goes through the recorded frames along with the run.
class Frames {
public:
    explicit Frames(const Recording& recording) : before_(recording.tracks.size()) {
        for (const std::string& track : recording.tracks) {
            readers_.emplace_back(track);
        }
    }

    // The next frame against the run as it is now, after `step`.
    PoseDifference compare(const Scene& scene, const Simulation& simulation, int step) {
        PoseDifference worst{.step = step};
        for (std::size_t i = 0; i < readers_.size(); ++i) {
            const PoseValues was = readers_[i].next().value_or(PoseValues{});
            const Posed pose = simulation.pose(i);
            worst.differing += roundedPose(pose, before_[i]) != was ? 1 : 0;
            before_[i] = was;
            const Posed recorded = poseOf(was);
            const double distance = (pose.position - recorded.position).norm();
            if (worst.body < 0 || distance > worst.distance) {
                worst.body = static_cast<int>(i);
                worst.distance = distance;
                worst.angle = pose.rotation.angularDistance(recorded.rotation);
            }
        }
        if (worst.body >= 0) {
            worst.name = bodyName(scene, simulation, static_cast<std::size_t>(worst.body));
        }
        return worst;
    }

private:
    std::vector<PoseTrackReader> readers_;
    std::vector<PoseValues> before_;
};

}  // namespace

ReplayResult replay(const Recording& recording, int threads, int steps, const std::function<void(int)>& progress) {
    Scene scene = recording.scene;
    scene.world.threads = threads;
    SceneRun run(scene, recording.precision);
    Frames frames(recording);
    ReplayResult result;
    const auto differs = [&](int step, const std::string& what) {
        if (!result.firstStep) {
            result.firstStep = step;
            result.what = what;
        }
    };
    const auto compareFrame = [&](int step) {
        const PoseDifference now = frames.compare(scene, run.simulation(), step);
        if (now.differing > 0) {
            differs(step, "poses");
        }
        if (result.firstStep) {
            result.first = result.first ? result.first : now;
            if (!result.visible && now.distance > positionRounding) {
                result.visible = now;
            }
            result.last = now;
        }
    };
    compareFrame(0);
    for (int i = 1; i <= steps; ++i) {
        const RecordedStep& was = recording.steps[static_cast<std::size_t>(i - 1)];
        if (was.qualityLevel >= 0) {
            AccuracyDef accuracy = scene.world.accuracy;
            accuracy.qualityLevel = was.qualityLevel;
            accuracy.maxWork = was.maxWork;
            run.simulation().setAccuracy(accuracy);
        }
        run.step();
        ++result.steps;
        if (const std::string what = differing(was, recordedStep(scene, run.simulation())); !what.empty()) {
            differs(i, what);
        }
        if (i % recording.every == 0 || i == static_cast<int>(recording.steps.size())) {
            compareFrame(i);
        }
        result.agreed += result.firstStep ? 0 : 1;
        if (progress) {
            progress(i);
        }
    }
    return result;
}

}  // namespace cairn
