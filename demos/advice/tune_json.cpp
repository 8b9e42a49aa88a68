#include <cairn/demos/advice/tune.hpp>

#include <cinttypes>
#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

constexpr int stateVersion = 1;

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

Json entryJson(const TuneEntry& entry) {
    return {{"label", entry.setting.label()},
            {"ms_a_frame", number(entry.ms)},
            {"error_m", number(entry.error())},
            {"distance_m", number(entry.distance)},
            {"step_error_m", number(entry.step)},
            {"worst_at_s", number(entry.worstAt)},
            {"finite", entry.finite},
            {"flags", entry.flags}};
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
        entry["flags"] = flagNames(result.entries[i].flags);
        entry["front"] = std::find(front.begin(), front.end(), i) != front.end();
        entry.update(settingJson(result.entries[i].setting, scene));
        json["entries"].push_back(std::move(entry));
    }
    const std::optional<std::size_t> choice = tuneChoice(result);
    json["chosen"] = choice ? Json(result.entries[*choice].setting.label()) : Json(nullptr);
    return json;
}

nlohmann::ordered_json tuneState(const Scene& scene, const TuneResult& result) {
    Json json = {{"cairn_tune", stateVersion}, {"made_for", purpose(scene, result.request)}};
    Json positions = Json::array();
    for (const Vec3d& p : result.truth.positions) {
        positions.push_back({number(p.x()), number(p.y()), number(p.z())});
    }
    json["truth"] = {{"divisor", result.truth.divisor},
                     {"doubt_m", number(result.truth.doubt)},
                     {"flags", result.truth.flags},
                     {"positions_m", std::move(positions)}};
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
                throw InputError("--state", file,
                                 "it was made for another " + key + "; ask the same again, or give another file");
            }
        }
        const nlohmann::json& truth = state.at("truth");
        result.truth = {.positions = {},
                        .divisor = truth.at("divisor"),
                        .doubt = numberOf(truth.at("doubt_m")),
                        .flags = truth.at("flags")};
        for (const nlohmann::json& p : truth.at("positions_m")) {
            result.truth.positions.emplace_back(numberOf(p.at(0)), numberOf(p.at(1)), numberOf(p.at(2)));
        }
        const std::vector<TuneSetting> settings = tuneSettings(scene, result.request);
        for (const nlohmann::json& one : state.at("finished")) {
            const auto setting = std::find_if(settings.begin(), settings.end(),
                                              [&](const TuneSetting& s) { return s.label() == one.at("label"); });
            // A quick sweep after a full one leaves the others out.
            if (setting != settings.end()) {
                result.entries.push_back({.setting = *setting,
                                          .ms = numberOf(one.at("ms_a_frame")),
                                          .distance = numberOf(one.at("distance_m")),
                                          .step = numberOf(one.at("step_error_m")),
                                          .worstAt = numberOf(one.at("worst_at_s")),
                                          .finite = one.at("finite"),
                                          .flags = one.at("flags")});
            }
        }
    } catch (const nlohmann::json::exception& error) {
        throw InputError("--state", file, std::string("it is no state of cairn tune: ") + error.what());
    }
}

}  // namespace cairn
