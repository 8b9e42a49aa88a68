// Recordings as files: JSON, one top-level field a line.
#include "command/recording/record.hpp"

#include <cairn/assets/scene_files.hpp>

#include "assets/control_characters.hpp"
#include "demos/base64.hpp"

#include <nlohmann/json.hpp>

#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <limits>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

constexpr int formatVersion = 1;
constexpr const char* formatField = "cairn_recording";
constexpr const char* recordAnew = "the file is damaged or was changed by hand: record it anew";

std::string hexOf(std::uint64_t x) {
    char words[17];
    std::snprintf(words, sizeof words, "%016" PRIx64, x);
    return words;
}

// Reads fields, and says where one is amiss.
class Place {
public:
    Place(const Json& json, std::string where) : json_(json), where_(std::move(where)) {}

    Place at(const std::string& key) const {
        if (!json_.is_object() || !json_.contains(key)) {
            fail(where_ + "/" + key, "nothing", recordAnew);
        }
        return {json_.at(key), where_ + "/" + key};
    }
    Place at(std::size_t i) const { return {json_.at(i), where_ + "/" + std::to_string(i)}; }
    // The place of a list of `count` things.
    Place list(const std::string& key, std::size_t count) const {
        Place found = at(key);
        if (!found.json_.is_array() || found.json_.size() != count) {
            found.refuse("it must be a list of " + std::to_string(count) + ": " + recordAnew);
        }
        return found;
    }
    std::size_t size() const { return json_.size(); }
    const Json& json() const { return json_; }

    std::string text() const {
        if (!json_.is_string()) {
            refuse(std::string("it must be a text: ") + recordAnew);
        }
        if (hasControls(json_.get<std::string>())) {
            refuse(std::string("it has control characters: ") + recordAnew);
        }
        return json_.get<std::string>();
    }
    // null stands for infinity, which JSON has not.
    double number() const {
        if (json_.is_null()) {
            return std::numeric_limits<double>::infinity();
        }
        if (!json_.is_number()) {
            refuse(std::string("it must be a number: ") + recordAnew);
        }
        return json_.get<double>();
    }
    int whole(int min, int max) const {
        if (!json_.is_number_integer() || json_ < min || json_ > max) {
            refuse("it must be a whole number from " + std::to_string(min) + " to " + std::to_string(max) + ": " +
                   recordAnew);
        }
        return json_.get<int>();
    }
    std::uint64_t hex() const {
        const std::string words = text();
        std::uint64_t x = 0;
        const char* const end = words.data() + words.size();
        const auto read = std::from_chars(words.data(), end, x, 16);
        if (words.size() != 16 || read.ec != std::errc() || read.ptr != end) {
            refuse(std::string("it must be 16 hexadecimal digits: ") + recordAnew);
        }
        return x;
    }
    [[noreturn]] void refuse(const std::string& remedy) const {
        const std::string value = json_.dump(-1, ' ', true);
        fail(where_, value.size() > 40 ? value.substr(0, 40) + "..." : value, remedy);
    }

private:
    [[noreturn]] static void fail(const std::string& where, const std::string& value, const std::string& remedy) {
        throw InputError(where, value, remedy);
    }

    const Json& json_;
    std::string where_;
};

template <class Get>
Json listOf(const std::vector<RecordedStep>& steps, const Get& get) {
    Json list = Json::array();
    for (const RecordedStep& step : steps) {
        list.push_back(get(step));
    }
    return list;
}

Json stepsJson(const std::vector<RecordedStep>& steps) {
    using Step = const RecordedStep&;
    Json json = {{"hash", listOf(steps, [](Step s) { return hexOf(s.hash); })},
                 {"penetration_m", listOf(steps, [](Step s) { return s.penetration; })},
                 {"joint_gap_m", listOf(steps, [](Step s) { return s.jointGap; })},
                 {"flags", listOf(steps, [](Step s) { return s.flags; })},
                 {"contacts", listOf(steps, [](Step s) { return s.contacts; })},
                 {"awake", listOf(steps, [](Step s) { return s.awake; })},
                 {"deepest", listOf(steps, [](Step s) { return s.deepest; })},
                 {"widest", listOf(steps, [](Step s) { return s.widest; })}};
    if (!steps.empty() && steps.front().qualityLevel >= 0) {
        json["quality_level"] = listOf(steps, [](Step s) { return s.qualityLevel; });
        json["max_work"] = listOf(steps, [](Step s) { return s.maxWork; });
    }
    return json;
}

Json tracksJson(const std::vector<std::string>& tracks, std::size_t& bytes) {
    Json list = Json::array();
    for (const std::string& track : tracks) {
        list.push_back(toBase64(track));
        bytes += list.back().get_ref<const std::string&>().size();
    }
    return list;
}

std::vector<RecordedStep> readSteps(const Place& place, int bodies, int joints) {
    constexpr int max = 1 << 30;
    std::vector<RecordedStep> steps(place.at("hash").size());
    const auto list = [&](const char* key) { return place.list(key, steps.size()); };
    const Place hash = list("hash"), penetration = list("penetration_m"), gap = list("joint_gap_m"),
                flags = list("flags"), contacts = list("contacts"), awake = list("awake"), deepest = list("deepest"),
                widest = list("widest");
    for (std::size_t i = 0; i < steps.size(); ++i) {
        RecordedStep& step = steps[i];
        step.hash = hash.at(i).hex();
        step.penetration = penetration.at(i).number();
        step.jointGap = gap.at(i).number();
        step.flags = static_cast<std::uint32_t>(flags.at(i).whole(0, max));
        step.contacts = contacts.at(i).whole(0, max);
        step.awake = awake.at(i).whole(0, max);
        const Place pair = deepest.at(i);
        if (!pair.json().is_array() || pair.size() != 2) {
            pair.refuse(std::string("it must be two bodies: ") + recordAnew);
        }
        step.deepest = {pair.at(0).whole(-1, bodies - 1), pair.at(1).whole(-1, bodies - 1)};
        step.widest = widest.at(i).whole(-1, joints - 1);
    }
    if (place.json().contains("quality_level")) {
        const Place qualityLevels = list("quality_level");
        const Place maxWork = list("max_work");
        for (std::size_t i = 0; i < steps.size(); ++i) {
            steps[i].qualityLevel = qualityLevels.at(i).whole(0, 11);
            steps[i].maxWork = maxWork.at(i).number();
        }
    }
    return steps;
}

void readTracks(const Place& list, std::vector<std::string>& tracks) {
    for (std::size_t i = 0; i < tracks.size(); ++i) {
        const std::optional<std::string> bytes = fromBase64(list.at(i).text());
        if (!bytes) {
            list.at(i).refuse(std::string("it is no base64: ") + recordAnew);
        }
        tracks[i] += *bytes;
    }
}

void checkTrack(const std::string& bytes, int frames, const Place& place) {
    PoseTrackReader reader(bytes);
    for (int k = 0; k < frames; ++k) {
        if (!reader.next()) {
            place.refuse("it ends after " + std::to_string(k) + " of " + std::to_string(frames) +
                         " poses: " + recordAnew);
        }
    }
    if (!reader.done()) {
        place.refuse("it goes on after its " + std::to_string(frames) + " poses: " + recordAnew);
    }
}

void requireVersion(const Place& place, const std::string& file, bool anyVersion) {
    const Place format = place.at(formatField);
    if (format.json() != formatVersion) {
        format.refuse("this program reads recordings of format " + std::to_string(formatVersion) +
                      "; replay it with the version that recorded it (" +
                      (place.json().contains("version") ? place.json()["version"].dump() : "unknown") + ")");
    }
    if (const std::string made = place.at("version").text(); made != engineVersion() && !anyVersion) {
        throw InputError(file + ":/version", "\"" + made + "\"",
                         "this is version " + engineVersion() +
                             ", which may compute other bits; replay it with the version that recorded it, or add "
                             "--any-version to see what has changed");
    }
}

// Meshes stand in a recording itself: it has no files to name.
Scene sceneIn(const Place& place, const std::string& file) {
    const std::string name = file + ":/scene";
    try {
        return parseScene(place.at("scene").json().dump(), ".", name, {.none = true, .root = {}, .readMesh = {}});
    } catch (const InputError& error) {
        const std::string& field = error.field();
        const std::string own = name + ":";  // a pointer of its own begins there
        throw InputError(field.starts_with(own) ? name + field.substr(own.size()) : field, error.value(),
                         error.remedy());
    }
}

// Throws InputError where it is no recording.
Json parsed(const std::string& text, const std::string& file) {
    Json json;
    try {
        json = Json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        throw InputError(
            file + ":byte " + std::to_string(error.byte), "no whole JSON",
            error.byte >= text.size() ? "the file is cut off: copy it again, or record it anew" : recordAnew);
    } catch (const nlohmann::json::out_of_range& error) {
        // A number that no double holds.
        throw InputError(file, error.what(), recordAnew);
    }
    if (!json.is_object() || !json.contains(formatField)) {
        throw InputError(file, "no recording",
                         json.is_object() && json.contains("cairn")
                             ? "it is a scene: `cairn record` makes a recording of it"
                             : "give a file that `cairn record` wrote");
    }
    return json;
}

}  // namespace

RecordingWriter::RecordingWriter(const Recording& header, std::function<void(std::string_view)> write)
    : write_(std::move(write)), every_(header.every) {
    Json json;
    json[formatField] = formatVersion;
    json["version"] = header.version;
    json["build"] = header.build;
    json["precision"] = name(header.precision);
    json["threads"] = header.threads;
    json["dt"] = header.scene.dt;
    json["scene"] = Json::parse(toJson(header.scene));
    std::string text;
    for (const auto& [key, value] : json.items()) {
        text += (text.empty() ? "{ " : ",\n  ") + Json(key).dump() + ": " + value.dump();
    }
    this->write(text);
}

void RecordingWriter::write(const std::string& text) {
    write_(text);
    bytes_ += text.size();
}

void RecordingWriter::add(const RecordingPart& part) {
    const Json tracks = tracksJson(part.tracks, poseBytes_);
    write((parts_++ == 0 ? ",\n  \"earlier\": [" : ",\n    ") +
          Json({{"steps", stepsJson(part.steps)}, {"bodies", tracks}}).dump());
    steps_ += static_cast<int>(part.steps.size());
}

void RecordingWriter::finish(const RecordingPart& rest) {
    steps_ += static_cast<int>(rest.steps.size());
    const Json poses = {{"every", every_},
                        {"frames", frames()},
                        {"unit_m", positionUnit},
                        {"unit_rotation", rotationUnit},
                        {"bodies", tracksJson(rest.tracks, poseBytes_)}};
    write(std::string(parts_ > 0 ? "]" : "") + ",\n  \"steps\": " + stepsJson(rest.steps).dump() +
          ",\n  \"poses\": " + poses.dump() + " }\n");
}

int RecordingWriter::frames() const {
    return framesOf(steps_, every_);
}

std::string toText(const Recording& recording) {
    std::string text;
    RecordingWriter writer(recording, [&text](std::string_view part) { text += part; });
    writer.finish({recording.steps, recording.tracks});
    return text;
}

bool isRecording(const std::string& text) {
    return text.substr(0, 200).find(std::string("\"") + formatField + "\"") != std::string::npos;
}

Scene recordedScene(const std::string& text, const std::string& file) {
    const Json json = parsed(text, file);
    return sceneIn(Place(json, file + ":"), file);
}

Recording parseRecording(const std::string& text, const std::string& file, bool anyVersion) {
    const Json json = parsed(text, file);
    const Place place(json, file + ":");
    requireVersion(place, file, anyVersion);
    Recording recording;
    recording.version = place.at("version").text();
    recording.build = place.at("build").text();
    const std::string precision = place.at("precision").text();
    if (precision != name(Precision::Float) && precision != name(Precision::Double)) {
        place.at("precision").refuse(std::string("float or double: ") + recordAnew);
    }
    recording.precision = precision == name(Precision::Float) ? Precision::Float : Precision::Double;
    recording.threads = place.at("threads").whole(1, 1 << 20);
    recording.scene = sceneIn(place, file);
    if (place.at("dt").number() != recording.scene.dt) {
        place.at("dt").refuse("its scene says " + Json(recording.scene.dt).dump() + " s: " + recordAnew);
    }
    const Place poses = place.at("poses");
    recording.every = poses.at("every").whole(1, 1 << 30);
    const std::size_t count = makeSimulation(recording.scene, recording.precision)->bodyCount();
    recording.tracks.resize(count);
    const auto addSteps = [&](const Place& part) {
        const std::vector<RecordedStep> steps =
            readSteps(part.at("steps"), static_cast<int>(count), static_cast<int>(recording.scene.joints.size()));
        recording.steps.insert(recording.steps.end(), steps.begin(), steps.end());
    };
    if (json.contains("earlier")) {
        const Place earlier = place.at("earlier");
        for (std::size_t i = 0; i < earlier.size(); ++i) {
            addSteps(earlier.at(i));
            readTracks(earlier.at(i).list("bodies", count), recording.tracks);
        }
    }
    addSteps(place);
    if (recording.scene.world.accuracy.budget > 0 && !recording.steps.empty() &&
        recording.steps.front().qualityLevel < 0) {
        throw InputError(file + ":/steps/quality_level", "nothing",
                         std::string("a run under a budget has one number a step: ") + recordAnew);
    }
    const int frames = recording.frameCount();
    if (poses.at("frames").number() != frames) {
        poses.at("frames").refuse("its steps make " + std::to_string(frames) + ": " + recordAnew);
    }
    if (poses.at("unit_m").number() != positionUnit || poses.at("unit_rotation").number() != rotationUnit) {
        poses.refuse("its units are not those of this version");
    }
    const Place tracks = poses.list("bodies", count);
    readTracks(tracks, recording.tracks);
    for (std::size_t i = 0; i < count; ++i) {
        checkTrack(recording.tracks[i], frames, tracks.at(i));
    }
    return recording;
}

}  // namespace cairn
