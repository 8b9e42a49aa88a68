#include "engine/model/describe.hpp"
#include "engine/world/deformable_parts.hpp"

namespace cairn {

namespace deformables {

void requireMesh(const std::string& field, const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) {
        throw InputError(field, "no triangles", "give a mesh with at least one triangle");
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!mesh.vertices[i].allFinite()) {
            throw InputError(field + ".vertices", "vertex " + std::to_string(i) + ", a non-finite number",
                             "give finite numbers");
        }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const int v : mesh.triangles[t]) {
            if (v < 0 || static_cast<std::size_t>(v) >= mesh.vertices.size()) {
                throw InputError(field + ".triangles",
                                 "triangle " + std::to_string(t) + " with vertex " + std::to_string(v),
                                 "give vertex numbers below " + std::to_string(mesh.vertices.size()));
            }
        }
    }
}

}  // namespace deformables

namespace {

// The particles that an attachment holds.
std::vector<std::size_t> held(const Attachment& attachment, const std::vector<BodyDef>& particles) {
    std::vector<std::size_t> found;
    std::size_t nearest = 0;
    const auto distance = [&](std::size_t i) { return (particles[i].position - attachment.position).norm(); };
    for (std::size_t i = 0; i < particles.size(); ++i) {
        if (distance(i) < distance(nearest)) {
            nearest = i;
        }
        if (distance(i) <= attachment.radius) {
            found.push_back(i);
        }
    }
    if (attachment.radius == 0) {
        return {nearest};
    }
    if (found.empty()) {
        throw InputError("attachments.radius", deformables::text(attachment.radius),
                         "no particle is so near: the nearest is at " + deformables::text(distance(nearest)) + " m");
    }
    return found;
}

}  // namespace

template <class S>
Deformable addDeformable(World<S>& world, const DeformableDef& def) {
    deformables::Parts parts = std::visit([](const auto& d) { return deformables::partsOf(d); }, def);
    const std::vector<Attachment>& attachments =
        std::visit([](const auto& d) -> const std::vector<Attachment>& { return d.attachments; }, def);
    const auto [group, name] = std::visit([](const auto& d) { return std::pair(d.filter.group, d.name); }, def);
    if (group == 0) {
        int lowest = 0;
        for (const BodyId id : world.bodies()) {
            lowest = std::min(lowest, world.def(id).filter.group);
        }
        for (BodyDef& body : parts.particles) {
            body.filter.group = lowest - 1;
        }
    }
    Deformable added;
    try {
        for (const BodyDef& body : parts.particles) {
            added.particles.push_back(world.add(body));
        }
        for (JointDef& joint : parts.joints) {
            std::visit(
                [&](auto& j) {
                    const auto place = [&](BodyId& id) { id = added.particles[id.index]; };
                    place(j.a);
                    place(j.b);
                    if constexpr (requires { j.d; }) {
                        place(j.c);
                        place(j.d);
                    }
                },
                joint);
            added.joints.push_back(world.addJoint(joint));
        }
        for (const Attachment& attachment : attachments) {
            check(attachment, "attachments");
            for (const std::size_t i : held(attachment, parts.particles)) {
                added.attachments.push_back(world.add(
                    BallDef{.a = attachment.body, .b = added.particles[i], .anchor = parts.particles[i].position}));
            }
        }
    } catch (...) {
        for (const BodyId id : added.particles) {
            world.remove(id);
        }
        throw;
    }
    added.skin = std::move(parts.skin);
    return added;
}

template Deformable addDeformable(World<float>&, const DeformableDef&);
template Deformable addDeformable(World<double>&, const DeformableDef&);

}  // namespace cairn
