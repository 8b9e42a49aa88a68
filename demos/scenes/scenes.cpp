#include "demos/scenes/scenes.hpp"
#include "base/check.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <sstream>

namespace cairn {

BuiltinScene towerScene();
BuiltinScene pyramidScene();
BuiltinScene wallScene();
BuiltinScene cardHouseScene();
BuiltinScene dominoScene();
BuiltinScene archScene();
BuiltinScene heavyScene();
BuiltinScene chainScene();
BuiltinScene netScene();
BuiltinScene jointGridScene();
BuiltinScene bridgeScene();
BuiltinScene ragdollScene();
BuiltinScene ragdollPileScene();
BuiltinScene rainScene();
BuiltinScene pileScene();
BuiltinScene topsScene();
BuiltinScene slopeScene();
BuiltinScene bounceScene();
BuiltinScene cradleScene();
BuiltinScene spinScene();
BuiltinScene slideScene();
BuiltinScene rollScene();
BuiltinScene struckTowerScene();
BuiltinScene meshScene();
BuiltinScene ropeScene();
BuiltinScene clothScene();
BuiltinScene jellyScene();
BuiltinScene stairsScene();
BuiltinScene terrainScene();
BuiltinScene bowlScene();
BuiltinScene simbenchRollingScene();
BuiltinScene simbenchBouncingScene();
BuiltinScene simbench666Scene();

namespace {

std::string shortNumber(double x) {
    std::ostringstream out;
    out << x;
    return out.str();
}

const SceneParameter& findParameter(const BuiltinScene& scene, const std::string& name) {
    std::vector<std::string> known;
    for (const SceneParameter& parameter : scene.parameters) {
        if (parameter.name == name) {
            return parameter;
        }
        known.push_back(parameter.name);
    }
    const std::string nearest = nearestName(name, known);
    throw InputError("parameter of scene " + scene.name, name,
                     nearest.empty() ? "this scene has no parameters"
                                     : "unknown; did you mean '" + nearest + "'? `cairn list` shows all");
}

std::string rangeInWords(const SceneParameter& parameter) {
    if (!parameter.choices.empty()) {
        std::string words;
        for (const std::string& choice : parameter.choices) {
            words += (words.empty() ? "" : ", ") + choice;
        }
        return "give one of " + words;
    }
    return std::string(parameter.whole ? "give a whole number" : "give a number") + " in [" +
           shortNumber(parameter.min) + ", " + shortNumber(parameter.max) + "]";
}

}  // namespace

const std::vector<BuiltinScene>& builtinScenes() {
    static const std::vector<BuiltinScene> scenes = {
        towerScene(),
        pyramidScene(),
        wallScene(),
        cardHouseScene(),
        dominoScene(),
        archScene(),
        heavyScene(),
        chainScene(),
        netScene(),
        jointGridScene(),
        bridgeScene(),
        ragdollScene(),
        ragdollPileScene(),
        rainScene(),
        pileScene(),
        topsScene(),
        slopeScene(),
        bounceScene(),
        cradleScene(),
        spinScene(),
        slideScene(),
        rollScene(),
        struckTowerScene(),
        meshScene(),
        ropeScene(),
        clothScene(),
        jellyScene(),
        stairsScene(),
        terrainScene(),
        bowlScene(),
        simbenchRollingScene(),
        simbenchBouncingScene(),
        simbench666Scene(),
    };
    return scenes;
}

const BuiltinScene& builtinScene(const std::string& name) {
    std::vector<std::string> known;
    for (const BuiltinScene& scene : builtinScenes()) {
        if (scene.name == name) {
            return scene;
        }
        known.push_back(scene.name);
    }
    throw InputError("scene", name, "unknown; did you mean '" + nearestName(name, known) + "'? `cairn list` shows all");
}

double SceneParameters::number(const std::string& name) const {
    const auto found = values_.find(name);
    CAIRN_CHECK(found != values_.end(), "a scene asks for a parameter that it does not declare");
    return found->second;
}

int SceneParameters::count(const std::string& name) const {
    return static_cast<int>(std::lround(number(name)));
}

Scene makeScene(const std::string& name, const SceneOverrides& overrides) {
    const BuiltinScene& builtin = builtinScene(name);
    std::map<std::string, double> values;
    for (const SceneParameter& parameter : builtin.parameters) {
        values[parameter.name] = parameter.standard;
    }
    for (const auto& [key, value] : overrides) {
        const SceneParameter& parameter = findParameter(builtin, key);
        const bool inRange = value >= parameter.min && value <= parameter.max;  // false for NaN
        if (!inRange || (parameter.whole && value != std::round(value))) {
            throw InputError("parameter " + key + " of scene " + name, shortNumber(value), rangeInWords(parameter));
        }
        values[key] = value;
    }
    Scene scene = builtin.make(SceneParameters(std::move(values)));
    scene.name = builtin.name;
    scene.description = builtin.help;
    return scene;
}

std::pair<std::string, double> parseOverride(const BuiltinScene& scene, const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
        throw InputError(
            "--set", text,
            "write NAME=VALUE, for example " + (scene.parameters.empty() ? "n=10" : scene.parameters[0].name + "=10"));
    }
    const std::string key = text.substr(0, equals);
    const std::string value = text.substr(equals + 1);
    const SceneParameter& parameter = findParameter(scene, key);
    const auto choice = std::find(parameter.choices.begin(), parameter.choices.end(), value);
    if (choice != parameter.choices.end()) {
        return {key, static_cast<double>(choice - parameter.choices.begin())};
    }
    double number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size()) {
        throw InputError("parameter " + key + " of scene " + scene.name, value, rangeInWords(parameter));
    }
    return {key, number};
}

std::string nearestName(const std::string& name, const std::vector<std::string>& known) {
    std::string best;
    std::size_t smallest = SIZE_MAX;
    for (const std::string& candidate : known) {
        // Levenshtein distance, one row of the table at a time.
        std::vector<std::size_t> row(candidate.size() + 1);
        std::iota(row.begin(), row.end(), std::size_t{0});
        for (std::size_t i = 1; i <= name.size(); ++i) {
            std::size_t diagonal = row[0];
            row[0] = i;
            for (std::size_t j = 1; j <= candidate.size(); ++j) {
                const std::size_t replaced = diagonal + (name[i - 1] == candidate[j - 1] ? 0 : 1);
                diagonal = row[j];
                row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
            }
        }
        if (row.back() < smallest) {
            smallest = row.back();
            best = candidate;
        }
    }
    return best;
}

}  // namespace cairn
