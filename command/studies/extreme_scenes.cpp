// The scenes of the study of extremes: small, each one quantity taken far out.
#include "command/studies/extremes.hpp"

#include <cmath>

namespace cairn {

namespace {

constexpr double gravity = 9.81;  // m/s2

Shape rubbed(Shape shape, double friction, double restitution = 0) {
    shape.material.friction = friction;
    shape.material.restitution = restitution;
    return shape;
}

BodyId addStill(ExtremeScene& s, BodyDef def) {
    const BodyId id = s.scene.add(std::move(def));
    s.targets.push_back({.body = id.index, .position = s.scene.bodies[id.index].position});
    return id;
}

ExtremeScene start(double seconds) {
    ExtremeScene s;
    s.scene.seconds = seconds;
    s.scene.world.sleep.enabled = false;
    return s;
}

BodyId addFloor(ExtremeScene& s, double friction = 0.6, double restitution = 0) {
    s.min.y() = std::max(s.min.y(), -0.5 * s.size);
    return s.scene.add({.name = "floor",
                        .type = BodyType::Static,
                        .shapes = {rubbed(halfSpace(Vec3d::UnitY(), 0), friction, restitution)}});
}

// A tower of three boxes, a pendulum let go from level, a ball that drops, and a block that slides, at a
// scale of `size`. `offset` moves all but the floor.
struct Mixed {
    double size = 1;           // m
    Vec3d offset = {0, 0, 0};  // m
    double gravity = cairn::gravity;
    double friction = 0.6;
    double restitution = 0;
    double dt = 1.0 / 60;  // s
    double seconds = 1;
};

ExtremeScene mixed(const Mixed& m) {
    ExtremeScene s = start(m.seconds);
    s.size = m.size;
    s.tolerance = 1e-3 * m.size;
    s.scene.dt = m.dt;
    s.scene.world.gravity = {0, -m.gravity, 0};
    addFloor(s, m.friction, m.restitution);
    const double half = 0.5 * m.size;
    const auto at = [&](double x, double y) { return Vec3d(m.offset + m.size * Vec3d(x, y, 0)); };
    for (int i = 0; i < 3; ++i) {
        addStill(s, {.name = "box " + std::to_string(i),
                     .shapes = {rubbed(box(Vec3d::Constant(half)), m.friction, m.restitution)},
                     .position = at(0, 0.5 + i)});
    }
    const BodyId hook = s.scene.add({.name = "hook", .type = BodyType::Static, .position = at(-5, 4)});
    const BodyId bob = s.scene.add({.name = "bob", .shapes = {sphere(0.3 * m.size)}, .position = at(-3, 4)});
    s.scene.add("pin", BallDef{.a = hook, .b = bob, .anchor = at(-5, 4)});
    s.scene.add({.name = "ball", .shapes = {rubbed(sphere(half), m.friction, m.restitution)}, .position = at(3, 1.5)});
    // It does not turn: v^2 / (2 mu g) by Coulomb's law, whatever its shape.
    const double speed = 2 * std::sqrt(m.size);  // m/s
    const BodyId slider = s.scene.add({.name = "slider",
                                       .shapes = {rubbed(box(Vec3d::Constant(half)), m.friction, m.restitution)},
                                       .position = at(6, 0.5),
                                       .linearVelocity = {speed, 0, 0},
                                       .lockAngular = {true, true, true}});
    const double brake = m.friction * m.gravity;  // m/s2
    const double t = brake > 0 ? std::min(m.seconds, speed / brake) : m.seconds;
    s.targets.push_back({.body = slider.index,
                         .position = at(6, 0.5) + Vec3d(speed * t - 0.5 * brake * t * t, 0, 0),
                         .slack = speed * m.dt,
                         .atEnd = true});
    return s;
}

ExtremeScene massRatio(double ratio) {
    ExtremeScene s = start(1);
    addFloor(s);
    const Shape cube = rubbed(box(Vec3d::Constant(0.5)), 0.6);
    addStill(s, {.name = "light", .shapes = {cube}, .position = {0, 0.5, 0}, .mass = 1});
    addStill(s, {.name = "heavy", .shapes = {cube}, .position = {0, 1.5, 0}, .mass = ratio});
    const BodyId hook = s.scene.add({.name = "hook", .type = BodyType::Static, .position = {5, 5, 0}});
    const BodyId link = s.scene.add({.name = "link", .shapes = {sphere(0.2)}, .position = {5.5, 5, 0}, .mass = 1});
    const BodyId load = s.scene.add({.name = "load", .shapes = {sphere(0.2)}, .position = {6.5, 5, 0}, .mass = ratio});
    s.scene.add("upper", BallDef{.a = hook, .b = link, .anchor = {5, 5, 0}});
    s.scene.add("lower", BallDef{.a = link, .b = load, .anchor = {6, 5, 0}});
    return s;
}

ExtremeScene stack(double boxes) {
    ExtremeScene s = start(0.5);
    addFloor(s);
    for (int i = 0; i < static_cast<int>(boxes); ++i) {
        addStill(s, {.shapes = {rubbed(box(Vec3d::Constant(0.5)), 0.6)}, .position = {0, 0.5 + i, 0}});
    }
    return s;
}

ExtremeScene chain(double links) {
    ExtremeScene s = start(0.5);
    s.size = 0.2;
    const double reach = 0.2 * links + 1;  // m
    s.min = Vec3d::Constant(-reach);
    s.max = Vec3d::Constant(reach);
    const Filter filter{.group = -1};
    BodyId last = s.scene.add({.name = "hook", .type = BodyType::Static, .filter = filter});
    for (int i = 0; i < static_cast<int>(links); ++i) {
        const BodyId link = s.scene.add({.shapes = {sphere(0.1)}, .position = {0.2 * i + 0.1, 0, 0}, .filter = filter});
        s.scene.add("joint " + std::to_string(i), BallDef{.a = last, .b = link, .anchor = {0.2 * i, 0, 0}});
        last = link;
    }
    return s;
}

ExtremeScene stepLength(double dt) {
    return mixed({.dt = dt});
}

ExtremeScene spin(double w) {
    ExtremeScene s = start(1);
    addFloor(s);
    // Free flight about the middle axis: the centre falls as if it did not spin.
    s.scene.add({.name = "brick",
                 .shapes = {box({0.2, 0.3, 0.6})},
                 .position = {0, 10, 0},
                 .angularVelocity = {0.01 * w, w, 0}});
    s.scene.add(
        {.name = "ball", .shapes = {rubbed(sphere(0.5), 0.6)}, .position = {4, 0.5, 0}, .angularVelocity = {0, 0, -w}});
    addStill(s, {.name = "top",
                 .shapes = {rubbed(cylinder(0.5, 0.2), 0.6)},
                 .position = {-4, 0.2, 0},
                 .angularVelocity = {0, w, 0}});
    return s;
}

ExtremeScene speed(double v) {
    ExtremeScene s = start(1);
    addFloor(s);
    s.scene.add({.name = "wall",
                 .type = BodyType::Static,
                 .shapes = {rubbed(box({0.1, 10, 10}), 0.6)},
                 .position = {10, 10, 0}});
    const Shape ball = rubbed(sphere(0.3), 0.3);
    s.scene.add({.name = "at wall", .shapes = {ball}, .position = {0, 5, 0}, .linearVelocity = {v, 0, 0}});
    s.scene.add({.name = "at floor", .shapes = {ball}, .position = {0, 5, 5}, .linearVelocity = {0, -v, 0}});
    const Shape cube = rubbed(box(Vec3d::Constant(0.5)), 0.6);
    s.scene.add({.name = "lower", .shapes = {cube}, .position = {-5, 0.5, -5}});
    s.scene.add({.name = "upper", .shapes = {cube}, .position = {-5, 1.5, -5}});
    s.scene.add({.name = "at boxes", .shapes = {ball}, .position = {0, 1.2, -5}, .linearVelocity = {-v, 0, 0}});
    s.max.x() = 10;
    return s;
}

ExtremeScene size(double metres) {
    return mixed({.size = metres});
}

ExtremeScene gravityOf(double g) {
    return mixed({.gravity = g});
}

ExtremeScene friction(double mu) {
    return mixed({.friction = mu});
}

ExtremeScene restitution(double e) {
    ExtremeScene s = mixed({.restitution = e, .seconds = 2});
    s.scene.add({.name = "crate",
                 .shapes = {rubbed(box(Vec3d::Constant(0.5)), 0.6, e)},
                 .position = {-9, 2, 0},
                 .rotation = Quatd(Eigen::AngleAxisd(0.4, Vec3d(1, 2, 3).normalized()))});
    return s;
}

// The swing of a load let go on an undamped spring stays within 0 and 2 m g / k.
ExtremeScene stiffness(double k) {
    ExtremeScene s = start(1);
    constexpr double mass = 1;  // kg
    const BodyId hook = s.scene.add({.name = "hook", .type = BodyType::Static});
    const auto hang = [&](double x) {
        const double deep = std::min(mass * gravity / k, 0.25 * gravity);  // m, of the middle of the swing in 1 s
        const BodyId load =
            s.scene.add({.name = "load", .shapes = {sphere(0.2)}, .position = {x, -2, 0}, .mass = mass});
        s.targets.push_back({.body = load.index, .position = Vec3d(x, -2 - deep, 0), .slack = deep});
        return load;
    };
    const BodyId one = hang(0);
    s.scene.add(
        "spring",
        SpringDef{
            .a = hook, .b = one, .anchorA = Vec3d::Zero(), .anchorB = {0, -2, 0}, .softness = {.compliance = 1 / k}});
    const BodyId other = hang(5);
    s.scene.add("soft ball", BallDef{.a = hook, .b = other, .anchor = {5, -2, 0}, .softness = {.compliance = 1 / k}});
    return s;
}

ExtremeScene distance(double metres) {
    return mixed({.offset = Vec3d(metres, 0, -0.5 * metres)});
}

ExtremeScene overlap(double share) {
    ExtremeScene s = start(2);
    s.settled = 1.5;
    addFloor(s);
    const Shape cube = rubbed(box(Vec3d::Constant(0.5)), 0.6);
    s.scene.add({.name = "lower", .shapes = {cube}, .position = {0, 0.5, 0}});
    s.scene.add({.name = "upper", .shapes = {cube}, .position = {0, 1.5 - share, 0}});
    s.scene.add({.name = "sunk box", .shapes = {cube}, .position = {5, 0.5 - share, 0}});
    s.scene.add({.name = "sunk ball", .shapes = {rubbed(sphere(0.5), 0.6)}, .position = {-5, 0.5 - share, 0}});
    s.min.y() = -0.5 - share;
    // J, to lift what was born too deep: 1000 kg each; the ball less.
    s.allowed = 4 * 1000 * gravity * share;
    return s;
}

ExtremeScene thinness(double thickness) {
    ExtremeScene s = start(1);
    addFloor(s);
    const double t = 0.5 * thickness;
    const auto lay = [&](const char* called, const Shape& shape, double x, double y) {
        addStill(s, {.name = called, .shapes = {rubbed(shape, 0.6)}, .position = {x, y, 0}, .mass = 1});
    };
    lay("plate", box({0.5, t, 0.5}), 0, t);
    lay("on plate", box(Vec3d::Constant(0.5)), 0, 2 * t + 0.5);
    lay("needle", box({0.5, t, t}), 3, t);
    lay("coin", cylinder(0.5, t), 6, t);
    lay("sliver",
        hull({{-0.5, -t, -0.5},
              {0.5, -t, -0.5},
              {0.5, -t, 0.5},
              {-0.5, -t, 0.5},
              {-0.5, t, -0.5},
              {0.5, t, -0.5},
              {0.5, t, 0.5},
              {-0.5, t, 0.5}},
             {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}}),
        9, t);
    return s;
}

}  // namespace

const std::vector<ExtremeAxis>& extremeAxes() {
    static const std::vector<ExtremeAxis> axes = {
        {"mass ratio", "", {10, 1e3, 1e5, 1e7, 1e9}, massRatio},
        {"stack", "boxes", {5, 10, 20, 50, 100}, stack},
        {"chain", "links", {5, 20, 100, 500}, chain},
        {"step", "s", {0.001, 1.0 / 240, 1.0 / 60, 1.0 / 30, 0.1, 0.2}, stepLength},
        {"spin", "rad/s", {1, 10, 100, 1e3, 1e4}, spin},
        {"speed", "m/s", {1, 10, 100, 1e3, 1e4}, speed},
        {"size", "m", {1e-4, 1e-2, 1, 1e2, 1e4}, size},
        {"gravity", "m/s2", {0, 0.01, 1, 10, 100, 1e3}, gravityOf},
        {"friction", "", {0, 0.01, 0.5, 1, 30, 1e3}, friction},
        {"restitution", "", {0, 0.25, 0.5, 0.75, 1}, restitution},
        {"stiffness", "N/m", {1, 1e3, 1e6, 1e9, 1e12}, stiffness},
        {"distance", "m", {0, 1e2, 1e4, 1e6, 1e7}, distance},
        {"overlap", "of a body", {0.01, 0.1, 0.3, 0.6, 0.9}, overlap},
        {"thickness", "m", {1, 0.1, 1e-2, 1e-3, 1e-4, 1e-6}, thinness},
    };
    return axes;
}

}  // namespace cairn
