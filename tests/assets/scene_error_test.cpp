// Each way to get a scene file wrong: the error names place, value and remedy.
#include <cairn/assets.hpp>

#include "tests/assets/temp_dir.hpp"

#include <random>

namespace cairn::test {
namespace {

std::string errorOf(const std::string& json, std::string* field = nullptr) {
    try {
        parseScene(json, dataFile(""), "bad.json");
    } catch (const InputError& error) {
        if (field != nullptr) {
            *field = error.field();
        }
        return error.what();
    }
    return "(accepted)";
}

struct Case {
    const char* json;
    const char* field;  // as in the error: file and place
    const char* value;
    const char* remedy;
};

void PrintTo(const Case& c, std::ostream* out) {
    *out << c.field;
}

class SceneErrors : public testing::TestWithParam<Case> {};

TEST_P(SceneErrors, NamePlaceValueAndRemedy) {
    const Case& c = GetParam();
    std::string field;
    const std::string what = errorOf(c.json, &field);
    EXPECT_EQ(field.substr(0, std::string(c.field).size()), c.field) << what;
    EXPECT_NE(what.find(c.value), std::string::npos) << what;
    EXPECT_NE(what.find(c.remedy), std::string::npos) << what;
}

// clang-format off
#define BODY(text) R"({"cairn": 1, "bodies": [{"shapes": [{"sphere": {"radius": 1}}], )" text "}]}"
#define SHAPE(text) R"({"cairn": 1, "materials": {"wood": {"friction": 0.5}}, "bodies": [{"type": "static", "shapes": [)" text "]}]}"
#define WORLD(text) R"({"cairn": 1, "bodies": [], "world": {)" text "}}"
#define SOFT(text) R"({"cairn": 1, "bodies": [], "deformables": [{)" text "}]}"
#define JOINT(text) R"({"cairn": 1, "bodies": [{"name": "floor", "type": "static"}, {"name": "wall", "type": "static"}, {"name": "crate", "shapes": [{"sphere": {"radius": 1}}]}], "joints": [{)" text "}]}"

const Case cases[] = {
    // Syntax.
    {"{\n  \"cairn\": 1,\n  \"bodies\": [,]\n}", "bad.json:3:14", "bodies", "syntax error"},
    {"", "bad.json:1:1", "end of file", "syntax error"},
    {"{\"cairn\": 1, \"bodies\": [", "bad.json:1:25", "end of file", "syntax error"},
    {"{\"cairn\": 1,\n \"seconds\": 1e999, \"bodies\": []}", "bad.json:2:13", "1e999", "beyond what a double holds"},
    {"{\"cairn\": 1, \"bodies\": [], \"seconds\": NaN}", "bad.json:1:39", "seconds", "syntax error"},
    {R"({"cairn": 1, "bodies": [{"mass": 1, "mass": 2}]})", "bad.json:/bodies/0/mass", "given twice", "keep one"},
    {R"([1, 2])", "bad.json:", "[1,2]", "give an object"},
    // Unknown and missing fields.
    {R"({"cairn": 1, "bodys": []})", "bad.json:/bodys", "[]", "did you mean \"bodies\"?"},
    {BODY(R"("mas": 3)"), "bad.json:/bodies/0/mas", "3", "did you mean \"mass\"?"},
    {BODY(R"("linear_velocity": [0, 0, 0])"), "bad.json:/bodies/0/linear_velocity", "[0,0,0]", "did you mean \"linearVelocity\"?"},
    {BODY(R"("a/b~c": 0)"), "bad.json:/bodies/0/a~1b~0c", "0", "there is no such field; known: name"},
    {SHAPE(R"({"box": {"halfExtent": [1, 1, 1]}})"), "bad.json:/bodies/0/shapes/0/box/halfExtent", "[1,1,1]", "did you mean \"halfExtents\"?"},
    {SHAPE(R"({"shpere": {"radius": 1}})"), "bad.json:/bodies/0/shapes/0/shpere", "radius", "did you mean \"sphere\"?"},
    {JOINT(R"("type": "ball", "a": "floor", "b": "crate", "anchor": [0, 0, 0], "axis": [1, 0, 0])"), "bad.json:/joints/0/axis", "[1,0,0]", "there is no such field"},
    {R"({"cairn": 1})", "bad.json:/bodies", "(missing)", "required"},
    {R"({"bodies": []})", "bad.json:/cairn", "(missing)", "version of this format"},
    {R"({"cairn": 2, "bodies": []})", "bad.json:/cairn", "2", "at most 1"},
    {SHAPE(R"({"capsule": {"radius": 1}})"), "bad.json:/bodies/0/shapes/0/capsule/halfHeight", "(missing)", "required"},
    {SHAPE(R"({"position": [0, 0, 0]})"), "bad.json:/bodies/0/shapes/0", "position", "give exactly one of: box sphere"},
    {SHAPE(R"({"box": {"halfExtents": [1, 1, 1]}, "sphere": {"radius": 1}})"), "bad.json:/bodies/0/shapes/0", "box and sphere", "give exactly one of"},
    {SHAPE(R"({"mesh": {}})"), "bad.json:/bodies/0/shapes/0/mesh", "{}", "give exactly one of: file vertices"},
    {SHAPE(R"({"mesh": {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}})"), "bad.json:/bodies/0/shapes/0/mesh/triangles", "(missing)", "vertices and triangles go together"},
    // Wrong types.
    {BODY(R"("mass": "heavy")"), "bad.json:/bodies/0/mass", "\"heavy\"", "give a number (kg"},
    {BODY(R"("mass": null)"), "bad.json:/bodies/0/mass", "null", "give a number"},
    {BODY(R"("position": [0, 1])"), "bad.json:/bodies/0/position", "[0,1]", "give a list of 3 numbers"},
    {BODY(R"("position": [0, "up", 0])"), "bad.json:/bodies/0/position/1", "\"up\"", "give a number"},
    {BODY(R"("rotation": [0, 0, 0])"), "bad.json:/bodies/0/rotation", "[0,0,0]", "give a list of 4 numbers"},
    {BODY(R"("lockLinear": [0, 0, 0])"), "bad.json:/bodies/0/lockLinear/0", "0", "true or false"},
    {BODY(R"("canSleep": 1)"), "bad.json:/bodies/0/canSleep", "1", "true or false"},
    {BODY(R"("name": 3)"), "bad.json:/bodies/0/name", "3", "text in quotes"},
    {BODY(R"("filter": 3)"), "bad.json:/bodies/0/filter", "3", "give an object"},
    {WORLD(R"("solver": {"iterations": 1.5})"), "bad.json:/world/solver/iterations", "1.5", "whole number"},
    {R"({"cairn": 1, "bodies": {}})", "bad.json:/bodies", "{}", "give a list"},
    {R"({"cairn": 1, "bodies": [3]})", "bad.json:/bodies/0", "3", "give an object"},
    // Out of range.
    {BODY(R"("mass": -1)"), "bad.json:/bodies/0/mass", "-1", "at least 0"},
    {BODY(R"("inertia": [1, -2, 1])"), "bad.json:/bodies/0/inertia/1", "-2", "at least 0"},
    {BODY(R"("linearDamping": -0.5)"), "bad.json:/bodies/0/linearDamping", "-0.5", "at least 0"},
    {BODY(R"("rotation": [0, 0, 0, 0])"), "bad.json:/bodies/0/rotation", "[0,0,0,0]", "no turn is [0, 0, 0, 1]"},
    {BODY(R"("filter": {"mask": 4294967296})"), "bad.json:/bodies/0/filter/mask", "4294967296", "at most"},
    {BODY(R"("filter": {"category": -1})"), "bad.json:/bodies/0/filter/category", "-1", "at least 0"},
    {WORLD(R"("dt": 0)"), "bad.json:/world/dt", "0", "above 0"},
    {WORLD(R"("dt": 2)"), "bad.json:/world/dt", "2", "at most 1"},
    {WORLD(R"("threads": 0)"), "bad.json:/world/threads", "0", "at least 1"},
    {WORLD(R"("solver": {"relaxation": 2})"), "bad.json:/world/solver/relaxation", "2", "below 2"},
    {WORLD(R"("solver": {"relaxationRule": "optimum"})"), "bad.json:/world/solver/relaxationRule", "optimum", "optimal"},
    {WORLD(R"("solver": {"name": "nonlinear_gs", "stiffness": 0})"), "bad.json:/world/solver/stiffness", "0", "above 0"},
    {WORLD(R"("solver": {"name": "vbd", "penalty": -1})"), "bad.json:/world/solver/penalty", "-1", "at least 0"},
    {WORLD(R"("solver": {"name": "gaus_seidel"})"), "bad.json:/world/solver/name", "gaus_seidel", "did you mean \"gauss_seidel\"?"},
    {WORLD(R"("solver": {"name": 3})"), "bad.json:/world/solver/name", "3", "name a solver; known: auto"},
    {WORLD(R"("solver": {"name": "direct", "tolerence": 1})"), "bad.json:/world/solver/tolerence", "1", "did you mean \"tolerance\"?"},
    {WORLD(R"("solver": {"name": "direct", "chebyshev": false})"), "bad.json:/world/solver/chebyshev", "false with the solver \"direct\", which does not take it", "leave it out, or use one that does: jacobi"},
    {WORLD(R"("solver": {"penalty": 1})"), "bad.json:/world/solver/penalty", "1 with the solver \"auto\"", "vbd, avbd"},
    {WORLD(R"("gyroscopic": "midpiont")"), "bad.json:/world/gyroscopic", "midpiont", "midpoint"},
    {WORLD(R"("narrowPhase": "flc")"), "bad.json:/world/narrowPhase", "flc", "fcl"},
    {WORLD(R"("solver": {"warmStart": 1.1})"), "bad.json:/world/solver/warmStart", "1.1", "at most 1"},
    {SHAPE(R"({"sphere": {"radius": 0}})"), "bad.json:/bodies/0/shapes/0/sphere/radius", "0", "at least 0.0005"},
    {SHAPE(R"({"sphere": {"radius": -1}})"), "bad.json:/bodies/0/shapes/0/sphere/radius", "-1", "at least 0.0005"},
    {SHAPE(R"({"box": {"halfExtents": [1, 1e-5, 1]}})"), "bad.json:/bodies/0/shapes/0/box/halfExtents/1", "1e-05", "at least 0.0005"},
    {SHAPE(R"({"sphere": {"radius": 1}, "restitution": 1.5})"), "bad.json:/bodies/0/shapes/0/restitution", "1.5", "at most 1"},
    {SHAPE(R"({"sphere": {"radius": 1}, "density": 0})"), "bad.json:/bodies/0/shapes/0/density", "0", "above 0"},
    {SHAPE(R"({"sphere": {"radius": 1}, "friction": 0.5, "staticFriction": 0.4})"), "bad.json:/bodies/0/shapes/0/staticFriction", "0.4", "at least friction, which is 0.5"},
    {SHAPE(R"({"halfspace": {"normal": [0, 0, 0]}})"), "bad.json:/bodies/0/shapes/0/halfspace", "(0, 0, 0)", "not zero"},
    {R"({"cairn": 1, "bodies": [], "view": {"fov": 180}})", "bad.json:/view/fov", "180", "below 180"},
    {R"({"cairn": 1, "bodies": [], "view": {"eye": [1, 1, 1], "target": [1, 1, 1]}})", "bad.json:/view/target", "same point", "move one"},
    {R"({"cairn": 1, "bodies": [], "materials": {"ice": {"friction": -1}}})", "bad.json:/materials/ice/friction", "-1", "at least 0"},
    // Names.
    {SHAPE(R"({"sphere": {"radius": 1}, "material": "wod"})"), "bad.json:/bodies/0/shapes/0/material", "\"wod\"", "did you mean \"wood\"?"},
    {BODY(R"("type": "dynamyc")"), "bad.json:/bodies/0/type", "\"dynamyc\"", "did you mean \"dynamic\"?"},
    {JOINT(R"("type": "hinje", "a": "floor", "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/type", "\"hinje\"", "did you mean \"hinge\"?"},
    {JOINT(R"("a": "floor", "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/type", "(missing)", "known: ball"},
    {JOINT(R"("type": "ball", "a": "flor", "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/a", "\"flor\"", "did you mean \"floor\"?"},
    {JOINT(R"("type": "ball", "a": 9, "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/a", "9", "an index below 3"},
    {JOINT(R"("type": "ball", "a": "crate", "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/b", "same body", "two different bodies"},
    {JOINT(R"("type": "ball", "a": "floor", "b": "wall", "anchor": [0, 0, 0])"), "bad.json:/joints/0", "not dynamic", "make one of them dynamic"},
    {R"({"cairn": 1, "bodies": [{"name": "a", "type": "static"}, {"name": "a", "type": "static"}]})", "bad.json:/bodies/1/name", "\"a\"", "number 0 in this list has it already"},
    {BODY(R"("name": "a\u001b[2J")"), "bad.json:/bodies/0/name", "\\u001b[2J", "without control characters"},
    {BODY(R"("name": "a\u0000b")"), "bad.json:/bodies/0/name", "a\\u0000b", "without control characters"},
    {BODY(R"("name": "\u009b2J")"), "bad.json:/bodies/0/name", "\\u009b2J", "without control characters"},
    {BODY(R"("\u009b2J\u001b": 1)"), "bad.json:/bodies/0/\\x9b2J\\x1b", "1", "there is no such field"},
    {R"({"cairn": 1, "bodies": [], "name": "two\nlines"})", "bad.json:/name", "\"two\\nlines\"", "without control characters"},
    {R"({"cairn": 1, "bodies": [], "materials": {"a\u007f": {}}})", "bad.json:/materials", "a\\u007f", "without control characters"},
    {SHAPE(R"({"mesh": {"file": "rock.obj\u0000.glb"}})"), "bad.json:/bodies/0/shapes/0/mesh/file", "rock.obj\\u0000.glb", "without control characters"},
    // Joints.
    {JOINT(R"("type": "hinge", "a": "floor", "b": "crate", "anchor": [0, 0, 0], "axis": [0, 0, 0])"), "bad.json:/joints/0/axis", "[0,0,0]", "give a direction"},
    {JOINT(R"("type": "hinge", "a": "floor", "b": "crate", "anchor": [0, 0, 0])"), "bad.json:/joints/0/axis", "(missing)", "required"},
    {JOINT(R"("type": "slider", "a": "floor", "b": "crate", "anchor": [0, 0, 0], "axis": [1, 0, 0], "lower": 2, "upper": 1)"), "bad.json:/joints/0/lower", "2", "at most upper, which is 1"},
    {JOINT(R"("type": "distance", "a": "floor", "b": "crate", "anchorA": [0, 0, 0], "anchorB": [0, 1, 0], "lower": -1)"), "bad.json:/joints/0/lower", "-1", "at least 0"},
    {JOINT(R"("type": "cone_twist", "a": "floor", "b": "crate", "anchor": [0, 0, 0], "axis": [1, 0, 0], "swing": 4)"), "bad.json:/joints/0/swing", "4", "below 3.14"},
    {JOINT(R"("type": "ball", "a": "floor", "b": "crate", "anchor": [0, 0, 0], "softness": {"compliance": -1})"), "bad.json:/joints/0/softness/compliance", "-1", "at least 0"},
    // More than memory holds.
    {SOFT(R"("cloth": {"grid": {"corner": [0, 0, 0], "u": [1, 0, 0], "v": [0, 0, 1], "cells": [10000, 10000]}})"), "bad.json:/deformables/0/cloth/grid/cells", "[10000,10000]", "100020001 particles, and all ropes, cloth and soft bodies of a scene may have 1000000 together"},
    {SOFT(R"("rope": {"from": [0, 0, 0], "to": [1, 0, 0], "segments": 1000000})"), "bad.json:/deformables/0/rope/segments", "1000000", "1000001 particles"},
    {SOFT(R"("rope": {"from": [0, 0, 0], "to": [1, 0, 0], "segments": 600000}}, {"rope": {"from": [0, 0, 0], "to": [1, 0, 0], "segments": 600000})"), "bad.json:/deformables/1/rope/segments", "600000", "600001 particles"},
    {SOFT(R"("soft": {"surface": {"file": "cube.glb"}, "cell": 0.002, "radius": 0.0005})"), "bad.json:/deformables/0/soft/cell", "0.002", "125000000 particles"},
    // Bodies and shapes that cannot be.
    {R"({"cairn": 1, "bodies": [{"name": "ghost"}]})", "bad.json:/bodies/0/mass", "0", "give it a shape"},
    {R"({"cairn": 1, "bodies": [{"shapes": [{"halfspace": {"normal": [0, 1, 0]}}]}]})", "bad.json:/bodies/0/type", "dynamic with a halfspace", "make the body static"},
    {SHAPE(R"({"hull": {"points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}})"), "bad.json:/bodies/0/shapes/0/hull", "in one plane", "four points that are not in one plane"},
    {SHAPE(R"({"hull": {"points": [[0, 0, 0]]}})"), "bad.json:/bodies/0/shapes/0/hull/points", "[[0,0,0]]", "at least 4"},
    {SHAPE(R"({"hull": {"file": "nothing.obj"}})"), "bad.json:/bodies/0/shapes/0/hull", "no such file", "check the path"},
    {SHAPE(R"({"mesh": {"file": "crate.json"}})"), "bad.json:/bodies/0/shapes/0/mesh", ".json", "obj, stl, glb or gltf"},
    {SHAPE(R"({"mesh": {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 7]]}})"), "bad.json:/bodies/0/shapes/0/mesh", "7", "there are 3 vertices"},
    {SHAPE(R"({"heightfield": {"heights": [[0, 1], [0]]}})"), "bad.json:/bodies/0/shapes/0/heightfield/heights/1", "1 heights", "as many as the first one has: 2"},
    {SHAPE(R"({"heightfield": {"file": "rock.obj"}})"), "bad.json:/bodies/0/shapes/0/heightfield/file", "# a rock", "finite number"},
};
// clang-format on

INSTANTIATE_TEST_SUITE_P(All, SceneErrors, testing::ValuesIn(cases));

TEST(SceneFileErrors, TooDeepIsRefused) {
    EXPECT_NE(errorOf(std::string(100000, '[')).find("nested"), std::string::npos);
}

TEST(SceneFileErrors, MissingFileIsNamed) {
    try {
        loadScene("nowhere/tower.json");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()), "nowhere/tower.json = (no such file): check the path");
    }
}

// Damaged files either load or are refused with the file's name; nothing else comes out.
TEST(SceneFileErrors, MutatedScenesThrowOrLoad) {
    const std::string good = readAll(dataFile("everything.json"));
    std::mt19937 chance(5);
    int refused = 0;
    for (int round = 0; round < 1000; ++round) {
        std::string bad = good;
        for (unsigned edits = 1 + chance() % 3; edits > 0; --edits) {
            const std::size_t at = chance() % bad.size();
            switch (chance() % 4) {
                case 0:
                    bad[at] = static_cast<char>(chance() % 256);
                    break;
                case 1:
                    bad.erase(at, 1 + chance() % 20);
                    break;
                case 2:
                    bad.insert(at, good.substr(chance() % good.size(), chance() % 30));
                    break;
                default:
                    bad[at] = "0123456789-.e[]{},:\""[chance() % 20];
                    break;
            }
        }
        const std::string what = errorOf(bad);
        if (what != "(accepted)") {
            ++refused;
            EXPECT_EQ(what.substr(0, 9), "bad.json:") << what;
        }
    }
    EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace cairn::test
