#pragma once
// What ropes, cloth and soft bodies share: each is made into particles, joints between them and a skin.
#include <cairn/deformable.hpp>

namespace cairn::deformables {

// Bodies and joints of a deformable; joints name particles by their place, generation 0.
struct Parts {
    std::vector<BodyDef> particles;
    std::vector<JointDef> joints;
    Skin skin;
};

Parts partsOf(const RopeDef& def);
Parts partsOf(const ClothDef& def);
Parts partsOf(const SoftBodyDef& def);

inline std::string text(double value) {
    return std::to_string(value);
}

inline BodyId at(int particle) {
    return {static_cast<std::uint32_t>(particle), 0};
}

// A spring of `stiffness` (N/m or N m/rad) that relaxes in `time` (s).
inline Softness spring(double stiffness, double time) {
    if (stiffness == unlimited) {
        return {};
    }
    return {.compliance = 1 / stiffness, .damping = time * stiffness};
}

template <class Def>
BodyDef particle(const Def& def, int number, const Vec3d& position, double mass) {
    BodyDef body;
    body.name = def.name.empty() ? std::string() : def.name + " " + std::to_string(number);
    body.particle = true;
    body.shapes = {sphere(def.radius)};
    body.shapes[0].material.friction = def.friction;
    body.position = position;
    body.linearVelocity = def.velocity;
    body.mass = mass;
    body.linearDamping = def.airDamping;
    body.filter = def.filter;
    return body;
}

inline JointDef edge(int a, int b, const Vec3d& atA, const Vec3d& atB, const Softness& softness) {
    return DistanceDef{.a = at(a), .b = at(b), .anchorA = atA, .anchorB = atB, .softness = softness, .collide = true};
}

// Throws InputError for a mesh without triangles, numbers that are not finite, or vertices that are not there.
void requireMesh(const std::string& field, const TriangleMesh& mesh);

inline const Vec3d& corner(const TriangleMesh& mesh, std::size_t triangle, int k) {
    return mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][static_cast<std::size_t>(k % 3)])];
}

}  // namespace cairn::deformables
