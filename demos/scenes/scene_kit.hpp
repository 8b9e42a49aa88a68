#pragma once
// What the scene files share. Private to scenes/.
#include "demos/scenes/scenes.hpp"

#include <algorithm>
#include <cmath>

#include <numbers>

namespace cairn {

inline constexpr double pi = std::numbers::pi;

// Numbers that are the same on every machine and standard library: a linear congruential generator (Knuth's MMIX
// constants), of which the upper 53 bits are used.
class SceneRandom {
public:
    explicit SceneRandom(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ull + 1) { next(); }
    double uniform(double low, double high) { return low + (high - low) * next(); }
    int whole(int low, int high);  // both included
    Quatd rotation();              // uniform over SO(3)
    Vec3d direction();             // uniform over the unit sphere

private:
    double next();  // in [0, 1)
    std::uint64_t state_;
};

// "link", 7 -> "link 7"
std::string numbered(const std::string& name, int number);

Shape withFriction(Shape shape, double friction);
Shape withMaterial(Shape shape, double friction, double restitution);
Shape at(Shape shape, const Vec3d& position, const Quatd& rotation = Quatd::Identity());

Quatd turned(double angle, const Vec3d& unitAxis);  // rad

// The ground: a half-space with its surface at world height y (m).
BodyId addFloor(Scene& scene, double friction, double restitution = 0, double y = 0);
BodyId addStatic(Scene& scene, const std::string& name, Shape shape, const Vec3d& position,
                 const Quatd& rotation = Quatd::Identity());

SceneParameter wholeParameter(std::string name, double standard, double min, double max, std::string help);
SceneParameter choiceParameter(std::string name, std::vector<std::string> choices, std::string help);

// A humanoid of 16 bodies, 1.75 m and 75 kg, standing upright with its soles at root.position, facing root's +z.
// Names start with `prefix`. Limbs of one doll collide with each other unless a joint holds them together.
void addRagdoll(Scene& scene, const std::string& prefix, const Posed& root, const Vec3d& velocity = Vec3d::Zero());

// A rock with a flat top at y = halfHeight and a flat bottom at y = -halfHeight, so that it stands; about 0.5 m in
// radius; 12 to 40 vertices.
Shape standingRock(SceneRandom& random, double halfHeight);
// A rock of 12 to 24 vertices about `radius` (m) from its middle.
Shape looseRock(SceneRandom& random, double radius);

}  // namespace cairn
