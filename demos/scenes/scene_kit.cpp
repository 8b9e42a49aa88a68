#include "demos/scenes/scene_kit.hpp"
#include "base/so3.hpp"

#include <cmath>

namespace cairn {

double SceneRandom::next() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
}

int SceneRandom::whole(int low, int high) {
    return low + static_cast<int>(next() * (high - low + 1));
}

Quatd SceneRandom::rotation() {
    // Shoemake 1992, Uniform random rotations.
    const double u = next();
    const double a = 2 * pi * next();
    const double b = 2 * pi * next();
    const double s = std::sqrt(1 - u);
    const double c = std::sqrt(u);
    return Quatd(c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b));
}

Vec3d SceneRandom::direction() {
    const double y = uniform(-1, 1);
    const double a = 2 * pi * next();
    const double r = std::sqrt(1 - y * y);
    return Vec3d(r * std::cos(a), y, r * std::sin(a));
}

std::string numbered(const std::string& name, int number) {
    return name + " " + std::to_string(number);
}

Shape withFriction(Shape shape, double friction) {
    shape.material.friction = friction;
    return shape;
}

Shape withMaterial(Shape shape, double friction, double restitution) {
    shape.material.friction = friction;
    shape.material.restitution = restitution;
    return shape;
}

Shape at(Shape shape, const Vec3d& position, const Quatd& rotation) {
    shape.pose = {position, rotation};
    return shape;
}

Quatd turned(double angle, const Vec3d& unitAxis) {
    return expQuat<double>(angle * unitAxis);
}

BodyId addFloor(Scene& scene, double friction, double restitution, double y) {
    return addStatic(scene, "floor", withMaterial(halfSpace(Vec3d::UnitY(), 0), friction, restitution), Vec3d(0, y, 0));
}

BodyId addStatic(Scene& scene, const std::string& name, Shape shape, const Vec3d& position, const Quatd& rotation) {
    return scene.add({.name = name,
                      .type = BodyType::Static,
                      .shapes = {std::move(shape)},
                      .position = position,
                      .rotation = rotation});
}

SceneParameter wholeParameter(std::string name, double standard, double min, double max, std::string help) {
    return {std::move(name), standard, min, max, std::move(help), true, {}};
}

SceneParameter choiceParameter(std::string name, std::vector<std::string> choices, std::string help) {
    const double last = static_cast<double>(choices.size()) - 1;
    return {std::move(name), 0, 0, last, std::move(help), true, std::move(choices)};
}

Shape standingRock(SceneRandom& random, double halfHeight) {
    std::vector<Vec3d> points;
    for (const double y : {-halfHeight, halfHeight}) {
        const int corners = random.whole(4, 9);
        for (int i = 0; i < corners; ++i) {
            const double angle = 2 * pi * (i + random.uniform(-0.2, 0.2)) / corners;
            const double radius = random.uniform(0.36, 0.42);
            points.push_back(Vec3d(radius * std::cos(angle), y, radius * std::sin(angle)));
        }
    }
    const int belt = random.whole(4, 22);
    for (int i = 0; i < belt; ++i) {
        const double angle = 2 * pi * (i + random.uniform(-0.3, 0.3)) / belt;
        const double radius = random.uniform(0.48, 0.56);
        points.push_back(
            Vec3d(radius * std::cos(angle), halfHeight * random.uniform(-0.6, 0.6), radius * std::sin(angle)));
    }
    return convexHull(points);
}

Shape looseRock(SceneRandom& random, double radius) {
    std::vector<Vec3d> points;
    const int count = random.whole(12, 24);
    points.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        points.push_back(radius * random.uniform(0.85, 1.15) * random.direction());
    }
    return convexHull(points);
}

}  // namespace cairn
