#pragma once
// The built-in scenes: what the command, the tests and the benchmarks run. One file a scene; scenes.cpp lists them all.
#include <cairn/assets.hpp>

#include <map>

namespace cairn {

struct SceneParameter {
    std::string name;
    double standard = 0;  // what it is when nobody says otherwise
    double min = 0;
    double max = 1;
    std::string help;
    bool whole = false;                     // whole numbers only
    std::vector<std::string> choices = {};  // words for the values 0, 1, 2, ...
};

// Values by name, each already checked against its range.
class SceneParameters {
public:
    explicit SceneParameters(std::map<std::string, double> values) : values_(std::move(values)) {}
    double number(const std::string& name) const;
    int count(const std::string& name) const;
    bool on(const std::string& name) const { return number(name) != 0; }

private:
    std::map<std::string, double> values_;
};

struct BuiltinScene {
    std::string name;
    std::string help;
    std::vector<SceneParameter> parameters;
    Scene (*make)(const SceneParameters&);
};

// In the order of the list that `cairn list` prints.
const std::vector<BuiltinScene>& builtinScenes();

// Throws InputError naming the nearest known scene.
const BuiltinScene& builtinScene(const std::string& name);

using SceneOverrides = std::map<std::string, double>;

// A built-in scene with some of its parameters changed. Throws InputError for an unknown scene or parameter (naming the
// nearest known one) and for a value out of range (naming the range).
Scene makeScene(const std::string& name, const SceneOverrides& overrides = {});

// Reads "n=30" or "kind=hull" for a scene. Throws InputError as makeScene does, and for text that is no number.
std::pair<std::string, double> parseOverride(const BuiltinScene& scene, const std::string& text);

// The known name that takes the fewest single-letter changes to get to; empty if there is none.
std::string nearestName(const std::string& name, const std::vector<std::string>& known);

}  // namespace cairn
