#pragma once
// What the files of the single engines share. Private to reference_engines/.
#include "command/compare/reference_engine.hpp"

namespace cairn {

Engine cairnEngine(bool isFloat);
Engine bulletEngine();
Engine odeEngine();
Engine mujocoEngine();

[[noreturn]] void noCounterpart(const std::string& engine, const std::string& what);

// What no engine but Cairn takes: throws as noCounterpart does.
void refuseDeformables(const std::string& engine, const Scene& scene);

// Mass, centre and inertia in the body's frame as World::add finds them; all zero for what is not dynamic.
MassProperties massOf(const BodyDef& body);

// A shape's triangles in the shape's own frame.
TriangleMesh bareSurface(Shape shape);

// The bodies of a pair, by their place in the scene, lower first.
using BodyPair = std::pair<std::size_t, std::size_t>;
// Pairs that a joint keeps from colliding; sorted.
std::vector<BodyPair> joinedPairs(const Scene& scene);
// By the filters and `joined`, and one of them dynamic.
bool mayCollide(const Scene& scene, const std::vector<BodyPair>& joined, std::size_t a, std::size_t b);

// A linear motor at the world's end of a dynamic body, with a speed beyond reach, is a constant force (N, world):
// scenes push bodies so. Of any other joint nothing.
struct Push {
    std::size_t body;
    Vec3d force;
};
std::optional<Push> pushOf(const Scene& scene, const SceneJoint& joint);

// No engine here gives way as a soft joint says. Throws as noCounterpart does.
template <class Def>
void refuseSoft(const std::string& engine, const Def& def) {
    if (def.softness.frequency > 0 || def.softness.compliance > 0) {
        noCounterpart(engine, std::string("a soft joint ") + Def::typeName);
    }
}

// Cairn's law of a pair of materials: the root of the product.
double frictionOf(const Material& a, const Material& b);

}  // namespace cairn
