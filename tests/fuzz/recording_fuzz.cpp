// Recordings: a file or an InputError; and the bytes of a track of poses, which are numbers or end.
#include "command/recording/record.hpp"
#include "tests/fuzz/input.hpp"

#include <string>

namespace cairn::fuzz {
namespace {

void readTrack(const std::string& bytes) {
    PoseTrackReader reader(bytes);
    for (int k = 0; k < 1000 && !reader.done(); ++k) {
        const std::optional<PoseValues> values = reader.next();
        if (!values) {
            return;
        }
        claim(poseOf(*values).position.allFinite(), "a pose is somewhere");
    }
}

void readRecording(const std::string& text) {
    recordedScene(text, "fuzz");
    const Recording recording = parseRecording(text, "fuzz", true);
    claim(recording.frameCount() > 0, "a recording has a start");
    const std::string written = toText(recording);
    claim(toText(parseRecording(written, "fuzz", true)) == written, "a recording survives a file");
}

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    cairn::fuzz::readTrack(text);
    try {
        cairn::fuzz::readRecording(text);
    } catch (const cairn::InputError&) {
        // What a damaged recording is answered with.
    }
    return 0;
}
