#include "command/advice/tune.hpp"

#include <cinttypes>
#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

constexpr int stateVersion = 2;

// JSON has no infinity: what went non-finite is null.
Json number(double x) {
    return std::isfinite(x) ? Json(x) : Json(nullptr);
}

double numberOf(const nlohmann::json& json) {
    return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

// FNV-1a, 64 bit: the same on every machine.
std::string hashOf(const std::string& text) {
    std::uint64_t hash = 14695981039346656037u;
    for (const char c : text) {
        hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    }
    char words[17];
    std::snprintf(words, sizeof words, "%016" PRIx64, hash);
    return words;
}

// What a state must agree in to be of use.
Json purpose(const Scene& scene, const TuneRequest& request) {
    return {{"scene", hashOf(toJson(scene))},
            {"error_m", request.error},
            {"at_s", request.at},
            {"horizon_s", request.horizon}};
}

// Of a key of purpose().
std::string inWords(const std::string& key) {
    return key == "scene" ? "scene" : key == "error_m" ? "error" : key == "at_s" ? "start (--at)" : "horizon";
}

Json entryJson(const TuneEntry& entry) {
    Json moments = Json::array();
    for (const TuneMoment& moment : entry.moments) {
        moments.push_back({number(moment.distance), number(moment.step)});
    }
    return {{"label", entry.setting.label()},
            {"ms_a_frame", number(entry.ms)},
            {"distance_m", number(entry.distance)},
            {"farthest_body", entry.farthest},
            {"farthest_at_s", entry.farthestAt},
            {"step_error_m", number(entry.step)},
            {"worst_at_s", entry.worstAt},
            {"energy_gained_j", number(entry.energy)},
            {"finite", entry.finite},
            {"flags", entry.flags},
            {"moments_m", std::move(moments)}};
}

TuneEntry entryOf(const nlohmann::json& json, const TuneSetting& setting) {
    TuneEntry entry{.setting = setting,
                    .ms = numberOf(json.at("ms_a_frame")),
                    .distance = numberOf(json.at("distance_m")),
                    .farthest = json.at("farthest_body"),
                    .farthestAt = json.at("farthest_at_s"),
                    .step = numberOf(json.at("step_error_m")),
                    .worstAt = json.at("worst_at_s"),
                    .energy = numberOf(json.at("energy_gained_j")),
                    .finite = json.at("finite"),
                    .flags = json.at("flags")};
    for (const nlohmann::json& moment : json.at("moments_m")) {
        entry.moments.push_back({numberOf(moment.at(0)), numberOf(moment.at(1))});
    }
    return entry;
}

Json settingJson(const TuneSetting& setting, const Scene& scene) {
    Scene carrier;
    carrier.world.solver = setting.solver;
    const Json file = Json::parse(toJson(carrier));
    const Json solver =
        file.contains("world") && file["world"].contains("solver") ? file["world"]["solver"] : Json{{"name", "auto"}};
    return {{"solver", solver},
            {"precision", name(setting.precision)},
            {"dt_s", scene.dt / setting.divisor},
            {"accuracy_m", setting.accuracy}};
}

}  // namespace

nlohmann::ordered_json toJson(const Scene& scene, const TuneResult& result) {
    const TuneRequest& request = result.request;
    Json json = {{"scene", scene.name},
                 {"error_m", request.error},
                 {"budget_ms", request.budget ? Json(1e3 * *request.budget) : Json(nullptr)},
                 {"at_s", request.at},
                 {"horizon_s", request.horizon},
                 {"truth",
                  {{"solver", "direct"},
                   {"dt_s", result.truth.divisor > 0 ? Json(scene.dt / result.truth.divisor) : Json(nullptr)},
                   {"doubt_m", number(result.truth.doubt)},
                   {"flags", flagNames(result.truth.flags)}}},
                 {"entries", Json::array()}};
    const std::vector<std::size_t> front = tuneFront(result);
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        Json entry = entryJson(result.entries[i]);
        entry["error_m"] = number(tuneError(result, result.entries[i]));
        entry["flags"] = flagNames(result.entries[i].flags);
        entry["front"] = std::find(front.begin(), front.end(), i) != front.end();
        entry.update(settingJson(result.entries[i].setting, scene));
        json["entries"].push_back(std::move(entry));
    }
    const std::optional<std::size_t> choice = tuneChoice(result);
    json["judged_by"] = tuneByStep(result) ? "step" : "both";
    json["notes"] = tuneNotes(scene, result);
    json["chosen"] = choice ? Json(result.entries[*choice].setting.label()) : Json(nullptr);
    return json;
}

nlohmann::ordered_json tuneState(const Scene& scene, const TuneResult& result) {
    Json json = {{"cairn_tune", stateVersion}, {"made_for", purpose(scene, result.request)}};
    Json poses = Json::array();
    for (const std::vector<Posed>& moment : result.truth.poses) {
        Json& all = poses.emplace_back(Json::array());
        for (const Posed& pose : moment) {
            for (const double x : {pose.position.x(), pose.position.y(), pose.position.z(), pose.rotation.x(),
                                   pose.rotation.y(), pose.rotation.z(), pose.rotation.w()}) {
                all.push_back(number(x));
            }
        }
    }
    json["truth"] = {{"divisor", result.truth.divisor},
                     {"doubt_m", number(result.truth.doubt)},
                     {"flags", result.truth.flags},
                     {"poses", std::move(poses)}};
    json["finished"] = Json::array();
    for (const TuneEntry& entry : result.entries) {
        json["finished"].push_back(entryJson(entry));
    }
    return json;
}

void resumeTune(const nlohmann::json& state, const std::string& file, const Scene& scene, TuneResult& result) {
    try {
        if (state.at("cairn_tune") != stateVersion) {
            throw InputError("--state", file, "it is of another version; give another file");
        }
        const nlohmann::json wanted = purpose(scene, result.request);
        for (const auto& [key, value] : wanted.items()) {
            if (state.at("made_for").at(key) != value) {
                throw InputError(
                    "--state", file,
                    "it was made for another " + inWords(key) + "; ask the same again, or give another file");
            }
        }
        const nlohmann::json& truth = state.at("truth");
        result.truth = {.poses = {},
                        .divisor = truth.at("divisor"),
                        .doubt = numberOf(truth.at("doubt_m")),
                        .flags = truth.at("flags")};
        for (const nlohmann::json& moment : truth.at("poses")) {
            std::vector<Posed>& poses = result.truth.poses.emplace_back();
            for (std::size_t i = 0; i + 7 <= moment.size(); i += 7) {
                const auto at = [&](std::size_t k) { return numberOf(moment.at(i + k)); };
                poses.push_back({Vec3d(at(0), at(1), at(2)), Quatd(at(6), at(3), at(4), at(5))});
            }
        }
        const std::size_t bodies = makeSimulation(scene)->bodyCount();
        const auto steps = static_cast<std::size_t>(std::lround(result.request.horizon / scene.dt));
        const auto whole = [&](const std::vector<Posed>& poses) { return poses.size() == bodies; };
        if (result.truth.divisor < 1 || result.truth.poses.size() != steps ||
            !std::all_of(result.truth.poses.begin(), result.truth.poses.end(), whole)) {
            throw InputError("--state", file, "its truth has not the scene's steps and bodies; give another file");
        }
        const std::vector<TuneSetting> settings = tuneSettings(scene, result.request);
        for (const nlohmann::json& one : state.at("finished")) {
            const auto setting = std::find_if(settings.begin(), settings.end(),
                                              [&](const TuneSetting& s) { return s.label() == one.at("label"); });
            // A quick sweep after a full one leaves the others out.
            if (setting != settings.end()) {
                result.entries.push_back(entryOf(one, *setting));
            }
        }
    } catch (const nlohmann::json::exception& error) {
        throw InputError("--state", file, std::string("it is no state of cairn tune: ") + error.what());
    }
}

}  // namespace cairn
