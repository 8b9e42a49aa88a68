#include "command/compare/truths.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

std::size_t firstDynamic(const Scene& scene) {
    const auto found = std::find_if(scene.bodies.begin(), scene.bodies.end(),
                                    [](const BodyDef& body) { return body.type == BodyType::Dynamic; });
    return static_cast<std::size_t>(found - scene.bodies.begin());
}

double frictionAt(const Scene& scene, std::size_t body) {
    return scene.bodies[body].shapes[0].material.friction;  // that of the floor is the same
}

// Slows down at mu g until a share of its speed is gone, and keeps the rest.
TruePoint braked(const Scene& scene, double share) {
    const std::size_t body = firstDynamic(scene);
    const BodyDef& def = scene.bodies[body];
    const double slowing = frictionAt(scene, body) * scene.world.gravity.norm();
    const double speed = def.linearVelocity.norm();
    const Vec3d along = def.linearVelocity.normalized();
    return {body, Vec3d::Zero(), [=, from = def.position](double t) -> Vec3d {
                const double until = slowing > 0 ? std::min(t, share * speed / slowing) : t;
                return from + (speed * t - slowing * until * (t - until / 2)) * along;
            }};
}

TruePoint sliding(const Scene& scene) {
    return braked(scene, 1);
}

// A ball thrown without spin rolls at 5/7 of its speed (moment of inertia 2/5 m r^2).
TruePoint rolling(const Scene& scene) {
    return braked(scene, 2.0 / 7);
}

// The height over its tile of a ball that falls from h and keeps a share e of its speed at each bounce.
double bouncedHeight(double h, double g, double e, double t) {
    double left = t - std::sqrt(2 * h / g);
    if (left < 0) {
        return h - g * t * t / 2;
    }
    double speed = e * std::sqrt(2 * g * h);
    constexpr double still = 1e-6;  // m/s
    while (speed > still && left > 2 * speed / g) {
        left -= 2 * speed / g;
        speed *= e;
    }
    return speed > still ? left * (speed - g * left / 2) : 0;
}

std::vector<TruePoint> bouncing(const Scene& scene) {
    std::vector<TruePoint> points;
    const double g = scene.world.gravity.norm();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& def = scene.bodies[i];
        if (def.type == BodyType::Dynamic) {
            const double radius = def.shapes[0].size.x();
            const double e = def.shapes[0].material.restitution;
            const double drop = def.position.y() - radius;  // the tiles' tops are at 0
            points.push_back({i, Vec3d::Zero(), [=, from = def.position](double t) {
                                  return Vec3d(from.x(), radius + bouncedHeight(drop, g, e, t), from.z());
                              }});
        }
    }
    return points;
}

// Turns of a free body about its centre, by Runge-Kutta of fourth order on Euler's equations in steps so fine that only
// round-off is left; kept at the ends of the scene's steps.
std::vector<TruePoint> spinning(const Scene& scene) {
    const std::size_t body = firstDynamic(scene);
    const BodyDef& def = scene.bodies[body];
    const Vec3d inertia = def.inertia;
    const auto steps = static_cast<int>(std::ceil(scene.seconds / scene.dt)) + 1;
    const int parts = std::max(1, static_cast<int>(std::ceil(scene.dt * def.angularVelocity.norm() / 1e-3)));
    const double h = scene.dt / parts;
    struct State {
        Eigen::Vector4d q;  // x, y, z, w
        Vec3d omega;        // rad/s, body axes
    };
    const auto rate = [&](const State& s) {
        const Quatd q(s.q);
        const Quatd half(0, s.omega.x() / 2, s.omega.y() / 2, s.omega.z() / 2);
        const Vec3d momentum = inertia.cwiseProduct(s.omega);
        return State{(q * half).coeffs(), momentum.cross(s.omega).cwiseQuotient(inertia)};
    };
    const auto moved = [](const State& s, const State& by, double t) {
        return State{s.q + t * by.q, s.omega + t * by.omega};
    };
    const auto turns = std::make_shared<std::vector<Quatd>>();
    const Quatd start = def.rotation.normalized();
    State s{start.coeffs(), start.conjugate() * def.angularVelocity};
    for (int i = 0; i <= steps; ++i) {
        turns->push_back(Quatd(s.q).normalized());
        for (int k = 0; k < parts; ++k) {
            const State a = rate(s);
            const State b = rate(moved(s, a, h / 2));
            const State c = rate(moved(s, b, h / 2));
            const State d = rate(moved(s, c, h));
            s = {s.q + h / 6 * (a.q + 2 * b.q + 2 * c.q + d.q),
                 s.omega + h / 6 * (a.omega + 2 * b.omega + 2 * c.omega + d.omega)};
        }
    }
    std::vector<TruePoint> points;
    for (const int axis : {0, 1}) {
        const Vec3d onBody = Vec3d::Unit(axis);
        points.push_back({body, onBody, [=, at = def.position, dt = scene.dt](double t) -> Vec3d {
                              const auto i = static_cast<std::size_t>(std::lround(t / dt));
                              return at + turns->at(i) * onBody;
                          }});
    }
    return points;
}

// Balls on a pushed box (SimBenchmark): the box slides, the balls roll on it without slipping.
std::function<Vec3d(std::size_t, double)> pushedBox(const Scene& scene) {
    const std::size_t box = firstDynamic(scene);
    const LinearMotorDef& push = std::get<LinearMotorDef>(scene.joints[0].def);
    const Material& floor = scene.bodies[0].shapes[0].material;
    const double n = static_cast<double>(scene.bodies.size() - box - 1);
    const double boxMass = scene.bodies[box].mass;
    const double ballMass = scene.bodies[box + 1].mass;
    const double mu = std::sqrt(floor.friction * scene.bodies[box].shapes[0].material.friction);
    const double ground = mu * (boxMass + n * ballMass) * scene.world.gravity.norm();
    const double perBall = (push.motorForce - ground) / boxMass / (3.5 / ballMass + n / boxMass);  // N, on a ball
    const double boxRate = (push.motorForce - ground - n * perBall) / boxMass;                     // m/s2
    const double ballRate = perBall / ballMass;
    return [=, along = Vec3d(push.axis.normalized())](std::size_t body, double t) -> Vec3d {
        return (body == box ? boxRate : ballRate) * t * along;
    };
}

}  // namespace

Known knownOf(const Scene& scene) {
    Known known;
    const std::string& name = scene.name;
    if (name == "slide") {
        known.points = {sliding(scene)};
    } else if (name == "roll") {
        known.points = {rolling(scene)};
    } else if (name == "bounce") {
        known.points = bouncing(scene);
    } else if (name == "spin") {
        known.points = spinning(scene);
    } else if (name == "simbench_rolling") {
        known.simBenchmark = SimBenchmark::Rolling;
        known.velocity = pushedBox(scene);
    } else if (name == "simbench_bouncing") {
        known.simBenchmark = SimBenchmark::Bouncing;
    } else if (name == "simbench_666") {
        known.simBenchmark = SimBenchmark::Balls666;
    }
    for (const char* const still : {"tower", "heavy", "pyramid", "card_house", "arch", "joint_grid"}) {
        known.rests = known.rests || name == still;
    }
    return known;
}

}  // namespace cairn
