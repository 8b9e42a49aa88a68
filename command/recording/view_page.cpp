#include "command/recording/view_page.hpp"
#include "command/advice/advice.hpp"
#include "command/recording/view_text.hpp"

#include <cmath>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

// To so many significant digits: pages need no more, and are shorter.
double shortened(double x, int digits = 5) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, x);
    return std::strtod(text, nullptr);
}

template <class Vector>
Json numbers(const Vector& v) {
    Json list = Json::array();
    for (Eigen::Index k = 0; k < v.size(); ++k) {
        list.push_back(shortened(static_cast<double>(v[k]), 7));
    }
    return list;
}

Json colourJson(const Colour& colour) {
    const auto linear = [](float part) { return shortened(static_cast<double>(srgbToLinear(part))); };
    return {linear(colour.r), linear(colour.g), linear(colour.b)};
}

// Each index as its distance from the one before: neighbours in a mesh are mostly near in number.
Json trianglesJson(const std::vector<std::array<int, 3>>& triangles) {
    std::string bytes;
    int last = 0;
    for (const auto& triangle : triangles) {
        for (const int corner : triangle) {
            appendNumber(bytes, corner - last);
            last = corner;
        }
    }
    return toBase64(bytes);
}

// Places in the units of poses, each as its distance from the one before.
Json meshJson(const TriangleMesh& mesh, bool oneSided) {
    std::string bytes;
    std::array<std::int64_t, 3> last = {};
    for (const Vec3d& vertex : mesh.vertices) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t whole = std::llround(vertex[static_cast<int>(k)] / positionUnit);
            appendNumber(bytes, whole - last[k]);
            last[k] = whole;
        }
    }
    return {{"vertices", toBase64(bytes)}, {"triangles", trianglesJson(mesh.triangles)}, {"one_sided", oneSided}};
}

// Bodies with their parts, the meshes that these share, and the level ground.
void addBodies(const Scene& scene, const Simulation& simulation, Json& data) {
    std::map<ShapeKey, std::size_t> known;
    Json meshes = Json::array();
    Json bodies = Json::array();
    data["ground"] = nullptr;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& body = scene.bodies[i];
        Json parts = Json::array();
        for (const Shape& shape : body.shapes) {
            const Posed start{body.position, body.rotation};
            if (isGround(shape, start)) {
                data["ground"] = (start * shape.pose).position.y() + shape.offset;
                continue;
            }
            const auto [at, added] = known.emplace(drawnKey(shape), known.size());
            if (added) {
                meshes.push_back(meshJson(drawnMesh(shape), shape.kind == ShapeKind::HalfSpace));
            }
            Json part = Json::array({at->second, numbers(drawnScale(shape))});
            if (!shape.pose.position.isZero() || shape.pose.rotation.angularDistance(Quatd::Identity()) > 0) {
                part.push_back(numbers(shape.pose.position));
                part.push_back(numbers(shape.pose.rotation.coeffs()));
            }
            parts.push_back(std::move(part));
        }
        const bool still = body.type == BodyType::Static;
        bodies.push_back({{"name", bodyName(scene, simulation, i)},
                          {"type", still                              ? "static"
                                   : body.type == BodyType::Kinematic ? "kinematic"
                                                                      : "dynamic"},
                          {"mass", shortened(simulation.mass(i))},
                          {"colour", colourJson(still ? staticColour() : palette(i))},
                          {"parts", std::move(parts)}});
    }
    data["meshes"] = std::move(meshes);
    data["bodies"] = std::move(bodies);
}

void addDeformables(const Scene& scene, const Simulation& simulation, Json& data) {
    data["deformables"] = Json::array();
    for (std::size_t i = 0; i < simulation.deformableCount(); ++i) {
        const Skin& skin = simulation.skin(i);
        Json weights = Json::array();
        for (const std::vector<Skin::Weight>& vertex : skin.vertices) {
            Json one = Json::array();
            for (const Skin::Weight& w : vertex) {
                one.push_back(w.particle);
                one.push_back(shortened(w.weight));
            }
            weights.push_back(std::move(one));
        }
        const std::string given = std::visit([](const auto& def) { return def.name; }, scene.deformables[i]);
        data["deformables"].push_back({{"name", given.empty() ? "deformable " + std::to_string(i) : given},
                                       {"first", simulation.firstParticle(i)},
                                       {"count", simulation.particleCount(i)},
                                       {"colour", colourJson(palette(scene.bodies.size() + i))},
                                       {"thickness", shortened(skin.thickness)},
                                       {"weights", std::move(weights)},
                                       {"triangles", trianglesJson(skin.triangles)}});
    }
}

// Strings and rods are lines; of all joints the name and the two bodies are told.
void addJoints(const Scene& scene, Json& data) {
    data["joints"] = Json::array();
    data["strings"] = Json::array();
    for (std::size_t i = 0; i < scene.joints.size(); ++i) {
        const SceneJoint& joint = scene.joints[i];
        const auto [a, b] = std::visit([](const auto& def) { return std::pair(def.a.index, def.b.index); }, joint.def);
        data["joints"].push_back({joint.name.empty() ? "joint " + std::to_string(i) : joint.name, a, b});
        if (const auto* string = std::get_if<DistanceDef>(&joint.def)) {
            const auto end = [&](BodyId id, const Vec3d& anchor) {
                const BodyDef& body = scene.bodies[id.index];
                return Json::array({id.index, numbers(Posed{body.position, body.rotation}.inverse() * anchor)});
            };
            data["strings"].push_back({end(string->a, string->anchorA), end(string->b, string->anchorB)});
        }
    }
}

void addSteps(const Recording& recording, Json& data) {
    const std::vector<std::string> keys = {"penetration", "gap", "flags", "contacts", "awake", "deepest", "widest"};
    for (const std::string& key : keys) {
        data[key] = Json::array();
    }
    for (const RecordedStep& step : recording.steps) {
        data["penetration"].push_back(shortened(1e3 * step.penetration, 4));
        data["gap"].push_back(shortened(1e3 * step.jointGap, 4));
        data["flags"].push_back(step.flags);
        data["contacts"].push_back(step.contacts);
        data["awake"].push_back(step.awake);
        data["deepest"].push_back(step.deepest);
        data["widest"].push_back(step.widest);
    }
    data["flag_names"] = Json::array();
    for (int bit = 0; bit < 32; ++bit) {
        const std::vector<std::string> names = flagNames(std::uint32_t{1} << bit);
        data["flag_names"].push_back(names.empty() ? "" : names.front());
    }
}

// "201 bodies, 3 joints, a rope"
std::string contents(const Recording& recording) {
    const Scene& scene = recording.scene;
    const auto count = [](std::size_t n, const std::string& what, const std::string& many) {
        return std::to_string(n) + " " + (n == 1 ? what : many);
    };
    std::string words = count(scene.bodies.size(), "body", "bodies");
    if (!scene.joints.empty()) {
        words += ", " + count(scene.joints.size(), "joint", "joints");
    }
    if (!scene.deformables.empty()) {
        words += ", " + count(scene.deformables.size(), "deformable", "deformables");
    }
    return words;
}

std::string headOf(const Recording& recording) {
    const Scene& scene = recording.scene;
    const auto steps = static_cast<double>(recording.steps.size());
    std::string words = contents(recording) + "; " + briefOrBroke(steps * scene.dt) + " s in " +
                        std::to_string(recording.steps.size()) + " steps of " + briefOrBroke(1e3 * scene.dt) +
                        " ms by " + solverName(scene.world.solver) + ", " + name(recording.precision) + " precision";
    if (scene.world.accuracy.budget > 0) {
        words += ", within " + briefOrBroke(1e3 * scene.world.accuracy.budget) + " ms a step";
    }
    if (scene.world.accuracy.position > 0) {
        words += ", asked for " + lengthText(scene.world.accuracy.position);
    }
    return "<header>\n<p class=\"kicker\">cairn view</p>\n<h1>" + escapedHtml(scene.name) +
           "</h1>\n<p class=\"lead\">" + (scene.description.empty() ? "" : escapedHtml(scene.description) + " ") +
           "<span class=\"soft\">" + escapedHtml(words) + ".</span></p>\n</header>\n";
}

}  // namespace

std::string viewPage(const Recording& recording) {
    const Scene& scene = recording.scene;
    const std::unique_ptr<Simulation> simulation = makeSimulation(scene, recording.precision);
    Json data = {{"dt", scene.dt},
                 {"every", recording.every},
                 {"frames", recording.frameCount()},
                 {"steps", recording.steps.size()},
                 {"unit_m", positionUnit},
                 {"unit_rotation", rotationUnit},
                 {"view", {{"eye", numbers(scene.view.eye)}, {"target", numbers(scene.view.target)}}}};
    data["view"]["fov"] = scene.view.fov;
    addBodies(scene, *simulation, data);
    addDeformables(scene, *simulation, data);
    addJoints(scene, data);
    addSteps(recording, data);
    data["tracks"] = Json::array();
    for (const std::string& track : recording.tracks) {
        data["tracks"].push_back(toBase64(track));
    }
    const std::string body = "<style>" + std::string(view_text::style) + "</style>\n" + headOf(recording) +
                             std::string(view_text::elements) + "<p class=\"soft\">Poses are kept to " +
                             lengthText(positionRounding) + ", every " +
                             (recording.every == 1 ? "step" : std::to_string(recording.every) + " steps") +
                             ". Recorded by cairn " + escapedHtml(recording.version) + ".</p>\n";
    std::string script;
    for (const std::string_view part : {view_text::run, view_text::camera, view_text::meshes, view_text::shaders,
                                        view_text::drawing, view_text::pick, view_text::player}) {
        script += part;
    }
    return html(
        {.title = scene.name + " - cairn view", .body = body, .data = std::move(data), .script = std::move(script)});
}

}  // namespace cairn
