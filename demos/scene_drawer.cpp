#include "demos/scene_drawer.hpp"

#include <charconv>
#include <numbers>
#include <sstream>

namespace cairn {

namespace {

Posef toFloat(const Posed& pose) {
    return pose.cast<float>();
}

// Each body's worst error, m: the deepest of its contacts or the widest of its joints.
std::vector<double> worstErrors(const Simulation& simulation) {
    std::vector<double> worst(simulation.bodyCount(), 0);
    const auto keep = [&](BodyId id, double error) {
        double& known = worst[simulation.indexOf(id)];
        known = std::max(known, error);
    };
    for (const ContactView& contact : simulation.contacts()) {
        keep(contact.a, -contact.separation);
        keep(contact.b, -contact.separation);
    }
    for (const JointView& joint : simulation.jointViews()) {
        keep(joint.a, joint.gap);
        keep(joint.b, joint.gap);
    }
    return worst;
}

// Strings and rods have no body of their own: without a line they would not be seen.
void addStrings(const Simulation& simulation, const Scene& scene, DrawScene& drawing) {
    for (const SceneJoint& joint : scene.joints) {
        if (const auto* string = std::get_if<DistanceDef>(&joint.def)) {
            const auto end = [&](BodyId id, const Vec3d& anchor) -> Vec3f {
                const BodyDef& body = scene.bodies[id.index];
                const Posed start{body.position, body.rotation};
                return (simulation.pose(id.index) * (start.inverse() * anchor)).cast<float>();
            };
            drawing.lines.push_back(
                {end(string->a, string->anchorA), end(string->b, string->anchorB), {0.15f, 0.15f, 0.17f, 1}, 2, false});
        }
    }
}

void addContacts(const Simulation& simulation, bool normals, DrawScene& drawing) {
    const Colour red{0.85f, 0.1f, 0.1f, 1};
    for (const ContactView& contact : simulation.contacts()) {
        if (normals) {
            addContact(drawing, contact.point.cast<float>(), contact.normal.cast<float>(), 0.25f, red);
        } else {
            drawing.points.push_back({contact.point.cast<float>(), red});
        }
    }
}

void addJoints(const Simulation& simulation, const Scene& scene, DrawScene& drawing) {
    const Colour blue{0.1f, 0.25f, 0.8f, 1};
    for (const JointView& joint : simulation.jointViews()) {
        if (simulation.indexOf(joint.id) >= scene.joints.size()) {
            continue;  // the inside of a deformable
        }
        const Vec3d a = joint.frameA.position;
        const Vec3d b = joint.frameB.position;
        const Vec3d axis = 0.1 * (joint.frameA.rotation * Vec3d::UnitX());
        drawing.points.push_back({a.cast<float>(), blue});
        drawing.lines.push_back({(a - axis).cast<float>(), (a + axis).cast<float>(), blue});
        // A string's two ends are meant to be apart.
        if (!std::holds_alternative<DistanceDef>(scene.joints[simulation.indexOf(joint.id)].def)) {
            drawing.lines.push_back({a.cast<float>(), b.cast<float>(), {0.9f, 0.2f, 0.7f, 1}, 3});
        }
    }
}

}  // namespace

Overlay parseOverlay(const std::vector<std::string>& words) {
    Overlay overlay;
    const std::map<std::string, bool Overlay::*> known = {{"contacts", &Overlay::contacts},
                                                          {"normals", &Overlay::normals},
                                                          {"joints", &Overlay::joints},
                                                          {"heat", &Overlay::heat}};
    for (const std::string& word : words) {
        const auto found = known.find(word);
        if (found == known.end()) {
            std::vector<std::string> names;
            names.reserve(known.size());
            for (const auto& entry : known) {
                names.push_back(entry.first);
            }
            throw InputError(
                "overlay", word,
                "unknown; did you mean '" + nearestName(word, names) + "'? Known: contacts, normals, joints, heat");
        }
        overlay.*found->second = true;
    }
    return overlay;
}

PictureSize parsePictureSize(const std::string& text) {
    PictureSize size;
    const char* const end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size.width);
    if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
        const auto height = std::from_chars(width.ptr + 1, end, size.height);
        if (height.ec == std::errc() && height.ptr == end && size.width >= 16 && size.height >= 16 &&
            size.width <= 8192 && size.height <= 8192) {
            return size;
        }
    }
    throw InputError("size", text, "write WIDTHxHEIGHT in pixels, 16 to 8192 each, for example 1280x720");
}

MeshHandle SceneDrawer::meshOf(const Shape& shape) {
    const ShapeKey key = drawnKey(shape);
    const auto found = meshes_.find(key);
    if (found != meshes_.end()) {
        return found->second;
    }
    const MeshHandle handle = renderer_.addMesh(drawnMesh(shape));
    meshes_.emplace(key, handle);
    return handle;
}

DrawScene SceneDrawer::draw(const Simulation& simulation, const Scene& scene, const Overlay& overlay,
                            const PictureSize& size) {
    DrawScene drawing;
    drawing.width = size.width;
    drawing.height = size.height;
    drawing.camera = {scene.view.eye.cast<float>(), scene.view.target.cast<float>(), Vec3f::UnitY(),
                      static_cast<float>(scene.view.fov * std::numbers::pi / 180)};
    drawing.ground.visible = false;

    std::vector<double> heat;
    if (overlay.heat) {
        heat = overlay.errors.empty() ? worstErrors(simulation) : overlay.errors;
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& body = scene.bodies[i];
        const Posed pose = simulation.pose(i);
        Colour colour = body.type == BodyType::Static ? staticColour() : palette(i);
        if (overlay.heat && body.type != BodyType::Static) {
            colour = heatColour(static_cast<float>(heat[i] / overlay.heatScale));
        }
        for (const Shape& shape : body.shapes) {
            const Posed placed = pose * shape.pose;
            if (isGround(shape, pose)) {
                drawing.ground.visible = true;
                drawing.ground.height = static_cast<float>(placed.position.y() + shape.offset);
                continue;
            }
            const bool castsShadow = shape.kind != ShapeKind::HalfSpace;
            drawing.instances.push_back({meshOf(shape), toFloat(placed), colour, drawnScale(shape), castsShadow});
        }
    }

    for (const MeshHandle mesh : surfaces_) {
        renderer_.removeMesh(mesh);
    }
    surfaces_.clear();
    for (std::size_t i = 0; i < simulation.deformableCount(); ++i) {
        Colour colour = palette(scene.bodies.size() + i);
        if (overlay.heat) {
            const auto first = heat.begin() + static_cast<std::ptrdiff_t>(simulation.firstParticle(i));
            const auto last = first + static_cast<std::ptrdiff_t>(simulation.particleCount(i));
            colour = heatColour(static_cast<float>(*std::max_element(first, last) / overlay.heatScale));
        }
        // Folds are smooth, the edges of a box are not.
        const float crease = static_cast<float>(std::numbers::pi / 3);
        surfaces_.push_back(renderer_.addMesh(simulation.surface(i), crease));
        drawing.instances.push_back({surfaces_.back(), Posef(), colour});
    }

    addStrings(simulation, scene, drawing);
    if (overlay.contacts || overlay.normals) {
        addContacts(simulation, overlay.normals, drawing);
    }
    if (overlay.joints) {
        addJoints(simulation, scene, drawing);
    }
    return drawing;
}

Image SceneDrawer::picture(const Simulation& simulation, const Scene& scene, const Overlay& overlay,
                           const PictureSize& size) {
    Image image = renderer_.render(draw(simulation, scene, overlay, size));
    if (overlay.heat) {
        std::ostringstream hottest;
        hottest << 1e3 * overlay.heatScale << " mm";
        drawLegend(image, overlay.errors.empty() ? "worst penetration or joint gap" : overlay.errorName, "0",
                   hottest.str());
    }
    return image;
}

}  // namespace cairn
