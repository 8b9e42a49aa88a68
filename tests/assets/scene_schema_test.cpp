// The published schema and the loader agree: on every field's name, and on what they refuse.
#include <cairn/assets.hpp>

#include "assets/scene_file.hpp"
#include "tests/assets/temp_dir.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

namespace cairn::test {
namespace {

using nlohmann::json;

// The part of JSON Schema 2020-12 that our schema uses; any other keyword fails the test. Collects the properties met.
class Validator {
public:
    bool accepts(const json& schema, const json& value, const std::string& path = "") {
        bool ok = true;
        for (const auto& [keyword, rule] : schema.items()) {
            ok = check(schema, keyword, rule, value, path) && ok;
        }
        return ok;
    }
    const std::set<std::string>& met() const { return met_; }

private:
    static bool hasType(const std::string& type, const json& value) {
        return (type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
               (type == "string" && value.is_string()) || (type == "boolean" && value.is_boolean()) ||
               (type == "number" && value.is_number()) || (type == "null" && value.is_null()) ||
               (type == "integer" && value.is_number() && std::floor(value.get<double>()) == value.get<double>());
    }

    bool check(const json& schema, const std::string& keyword, const json& rule, const json& value,
               const std::string& path) {
        const double number = value.is_number() ? value.get<double>() : 0;
        if (keyword == "$schema" || keyword == "title" || keyword == "description" || keyword == "default") {
            return true;
        }
        if (keyword == "type") {
            const json types = rule.is_array() ? rule : json::array({rule});
            return std::any_of(types.begin(), types.end(),
                               [&](const json& type) { return hasType(type.get<std::string>(), value); });
        }
        if (keyword == "const") {
            return rule == value;
        }
        if (keyword == "enum") {
            return std::find(rule.begin(), rule.end(), value) != rule.end();
        }
        if (keyword == "minimum") {
            return !value.is_number() || number >= rule.get<double>();
        }
        if (keyword == "exclusiveMinimum") {
            return !value.is_number() || number > rule.get<double>();
        }
        if (keyword == "maximum") {
            return !value.is_number() || number <= rule.get<double>();
        }
        if (keyword == "exclusiveMaximum") {
            return !value.is_number() || number < rule.get<double>();
        }
        if (keyword == "minItems") {
            return !value.is_array() || value.size() >= rule.get<std::size_t>();
        }
        if (keyword == "maxItems") {
            return !value.is_array() || value.size() <= rule.get<std::size_t>();
        }
        if (keyword == "items") {
            return !value.is_array() || std::all_of(value.begin(), value.end(),
                                                    [&](const json& element) { return accepts(rule, element, path); });
        }
        if (keyword == "required") {
            return !value.is_object() || std::all_of(rule.begin(), rule.end(), [&](const json& name) {
                return value.contains(name.get<std::string>());
            });
        }
        if (keyword == "dependentRequired") {
            bool ok = true;
            for (const auto& [name, others] : rule.items()) {
                for (const json& other : others) {
                    ok = ok && (!value.contains(name) || value.contains(other.get<std::string>()));
                }
            }
            return ok;
        }
        if (keyword == "oneOf") {
            return std::count_if(rule.begin(), rule.end(),
                                 [&](const json& option) { return accepts(option, value, path); }) == 1;
        }
        if (keyword == "properties") {
            bool ok = true;
            for (const auto& [name, property] : rule.items()) {
                if (value.is_object() && value.contains(name)) {
                    met_.insert(path + "/" + name);
                    ok = accepts(property, value[name], path + "/" + name) && ok;
                }
            }
            return ok;
        }
        if (keyword == "additionalProperties") {
            bool ok = true;
            for (const auto& [name, element] : value.items()) {
                const bool isKnown = schema.contains("properties") && schema["properties"].contains(name);
                ok = ok && (isKnown || (rule.is_object() && accepts(rule, element, path + "/*")));
            }
            return ok;
        }
        ADD_FAILURE() << "keyword " << keyword << " is not known to this test";
        return false;
    }

    std::set<std::string> met_;
};

json published() {
    return json::parse(readAll(std::filesystem::path(CAIRN_SOURCE_DIR) / "docs" / "scene.schema.json"));
}

bool loads(const json& scene) {
    try {
        parseScene(scene.dump(), dataFile(""), "test");
        return true;
    } catch (const InputError&) {
        return false;
    }
}

// Every property's path, and whether each object refuses others.
void collect(const json& schema, const std::string& path, std::set<std::string>& names) {
    if (schema.contains("properties")) {
        EXPECT_EQ(schema["additionalProperties"], json(false)) << path;
        for (const auto& [name, property] : schema["properties"].items()) {
            names.insert(path + "/" + name);
            EXPECT_TRUE(property.contains("description") || property.contains("const")) << path << "/" << name;
            collect(property, path + "/" + name, names);
        }
    }
    if (schema.contains("items")) {
        collect(schema["items"], path, names);
    }
    if (schema.contains("additionalProperties") && schema["additionalProperties"].is_object()) {
        collect(schema["additionalProperties"], path + "/*", names);
    }
    if (schema.contains("oneOf")) {
        for (const json& option : schema["oneOf"]) {
            collect(option, path, names);
        }
    }
}

// A file in docs that is made from the table.
void expectMade(const char* name, const std::string& made) {
    if (readAll(std::filesystem::path(CAIRN_SOURCE_DIR) / "docs" / name) != made) {
        const std::filesystem::path fresh = std::filesystem::path(CAIRN_BINARY_DIR) / name;
        std::ofstream(fresh, std::ios::binary) << made;
        FAIL() << "docs/" << name << " is out of date; copy " << fresh << " over it";
    }
}

TEST(SceneSchema, FilesAreThoseMadeFromTheTable) {
    expectMade("scene.schema.json", sceneSchema());
    expectMade("fields.md", scene_file::fieldsPage());
    EXPECT_EQ(published()["$schema"], "https://json-schema.org/draft/2020-12/schema");
}

TEST(SceneSchema, AcceptsTheDataScenes) {
    const json schema = published();
    for (const char* name : {"crate.json", "everything.json", "meshes.json", "arch.json"}) {
        const json scene = json::parse(readAll(dataFile(name)));
        Validator validator;
        EXPECT_TRUE(validator.accepts(schema, scene)) << name;
        EXPECT_TRUE(loads(scene)) << name;
        EXPECT_TRUE(validator.accepts(schema, json::parse(toJson(loadScene(dataFile(name)))))) << name;
    }
}

// A scene for each solver, with every field that it takes away from its default.
std::vector<json> solverScenes() {
    const json values = json::parse(R"({"iterations": 4, "substeps": 3, "relaxation": 1.2, "relaxationRule": "optimal",
        "massSplitting": false, "chebyshev": true, "stiffness": 0.9, "postStabilise": false, "refreshRows": false,
        "penalty": 3, "geometricStiffness": true, "clusterSize": 16, "warmStart": 0.9, "tolerance": 1e-6,
        "linearSolver": "conjugate_gradients", "directWork": 1e6, "gyroscopicInertia": true})");
    std::vector<json> scenes;
    for (const SolverInfo& info : solverList()) {
        json solver = {{"name", info.name}};
        for (const auto& [field, value] : values.items()) {
            if (info.takes(field)) {
                solver[field] = value;
            }
        }
        scenes.push_back({{"cairn", 1}, {"bodies", json::array()}, {"world", {{"solver", solver}}}});
    }
    return scenes;
}

TEST(SceneSchema, SolversTakeTheirFieldsAndNoOther) {
    const json schema = published();
    for (const json& scene : solverScenes()) {
        EXPECT_TRUE(Validator().accepts(schema, scene)) << scene;
        EXPECT_TRUE(loads(scene)) << scene;
        const json& solver = scene["world"]["solver"];
        json written = json::parse(toJson(parseScene(scene.dump(), {}, "test")))["world"]["solver"];
        written["name"] = written.value("name", "auto");
        EXPECT_EQ(written, solver);
        for (const json& other : solverScenes()) {
            for (const auto& [field, value] : other["world"]["solver"].items()) {
                json mixed = scene;
                if (field == "name") {
                    continue;
                }
                mixed["world"]["solver"][field] = value;
                EXPECT_EQ(loads(mixed), solver.contains(field)) << mixed;
                EXPECT_EQ(Validator().accepts(schema, mixed), solver.contains(field)) << mixed;
            }
        }
    }
}

// So that each name in the schema has been read by the loader, and the mutations below reach all of them.
TEST(SceneSchema, DataScenesUseEveryField) {
    const json schema = published();
    Validator validator;
    for (const char* name : {"everything.json", "meshes.json"}) {
        validator.accepts(schema, json::parse(readAll(dataFile(name))));
    }
    for (const json& scene : solverScenes()) {
        validator.accepts(schema, scene);
    }
    std::set<std::string> names;
    collect(schema, "", names);
    EXPECT_GT(names.size(), 100U);
    for (const std::string& name : names) {
        EXPECT_TRUE(validator.met().contains(name)) << name << " is in the schema and in no data scene";
    }
}

std::vector<json::json_pointer> places(const json& scene) {
    std::vector<json::json_pointer> out;
    const json flat = scene.flatten();
    for (const auto& [path, value] : flat.items()) {
        for (json::json_pointer at(path); !at.empty(); at = at.parent_pointer()) {
            out.push_back(at);
        }
    }
    return out;
}

TEST(SceneSchema, WhatItRefusesTheLoaderRefuses) {
    const json schema = published();
    const json good = json::parse(readAll(dataFile("everything.json")));
    const std::vector<json::json_pointer> all = places(good);
    std::mt19937 chance(3);
    int refusedByBoth = 0;
    for (int round = 0; round < 1500; ++round) {
        json scene = good;
        const json::json_pointer at = all[chance() % all.size()];
        json& parent = scene[at.parent_pointer()];
        switch (chance() % 5) {
            case 0:
                scene[at] = -1.5;
                break;
            case 1:
                scene[at] = json::parse(R"(["word", null, {}, [], true, 1e9, 0, "dynamic"])")[chance() % 8];
                break;
            case 2:  // rename
                if (parent.is_object()) {
                    parent[at.back() + "x"] = scene[at];
                    parent.erase(at.back());
                }
                break;
            case 3:  // leave out
                parent.is_object() ? static_cast<void>(parent.erase(at.back()))
                                   : parent.erase(static_cast<std::size_t>(std::stoi(at.back())));
                break;
            default:  // a field from elsewhere
                if (parent.is_object()) {
                    parent[all[chance() % all.size()].back()] = 0.5;
                }
                break;
        }
        Validator validator;
        if (!validator.accepts(schema, scene)) {
            ++refusedByBoth;
            EXPECT_FALSE(loads(scene)) << at << " " << scene[at.parent_pointer()].dump().substr(0, 300);
        }
    }
    EXPECT_GT(refusedByBoth, 700);
}

}  // namespace
}  // namespace cairn::test
