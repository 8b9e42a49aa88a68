#include "command/compare/reference_engine_kit.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
std::vector<Engine> engines(bool isFloat) {
    std::vector<Engine> list = {cairnEngine(isFloat)};
#if CAIRN_BULLET
    list.push_back(bulletEngine());
#else
    list.push_back(absentEngine("bullet", "libbullet-dev"));
#endif
#if CAIRN_ODE
    list.push_back(odeEngine());
#else
    list.push_back(absentEngine("ode", "libode-dev"));
#endif
#if CAIRN_MUJOCO
    list.push_back(mujocoEngine());
#else
    list.push_back(absentEngine("mujoco", "libmujoco-dev"));
#endif
    return list;
}

Engine absentEngine(const std::string& name, const std::string& package) {
    return {name, "not built in: install Debian's " + package + " and configure anew", {}};
}

std::unique_ptr<ReferenceEngine> makeReferenceEngine(const Engine& engine, const Scene& scene) {
    if (!engine.missing.empty()) {
        throw InputError("engine", engine.name, engine.missing);
    }
    const Dial& dial = engine.dials.front();
    return dial.make(scene, dial.values.front());
}

void noCounterpart(const std::string& engine, const std::string& what) {
    throw InputError("scene", what, "it has no counterpart in " + engine + " here: choose another scene");
}

void refuseDeformables(const std::string& engine, const Scene& scene) {
    if (!scene.deformables.empty()) {
        noCounterpart(engine, "a deformable");
    }
    for (const BodyDef& body : scene.bodies) {
        if (body.particle) {
            noCounterpart(engine, "a particle");
        }
    }
}

MassProperties massOf(const BodyDef& body) {
    if (body.type != BodyType::Dynamic) {
        return {};
    }
    MassProperties properties = massProperties(body.shapes);
    if (body.mass > 0) {
        properties.inertia *= properties.mass > 0 ? body.mass / properties.mass : 0;
        properties.mass = body.mass;
    }
    if (!body.inertia.isZero()) {
        properties.inertia = body.inertia.asDiagonal();
    }
    return properties;
}

TriangleMesh bareSurface(Shape shape) {
    shape.pose = {};
    return surface(shape);
}

std::vector<BodyPair> joinedPairs(const Scene& scene) {
    std::vector<BodyPair> pairs;
    for (const SceneJoint& joint : scene.joints) {
        std::visit(
            [&](const auto& def) {
                if (!def.collide) {
                    pairs.push_back(std::minmax<std::size_t>(def.a.index, def.b.index));
                }
            },
            joint.def);
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

bool mayCollide(const Scene& scene, const std::vector<BodyPair>& joined, std::size_t a, std::size_t b) {
    const BodyDef& one = scene.bodies[a];
    const BodyDef& other = scene.bodies[b];
    return (one.type == BodyType::Dynamic || other.type == BodyType::Dynamic) &&
           filtersAgree(one.filter, other.filter) &&
           !std::binary_search(joined.begin(), joined.end(), BodyPair(std::minmax(a, b)));
}

std::optional<Push> pushOf(const Scene& scene, const SceneJoint& joint) {
    constexpr double beyondReach = 1e3;  // m/s
    const auto* motor = std::get_if<LinearMotorDef>(&joint.def);
    if (motor == nullptr || std::abs(motor->motorSpeed) < beyondReach || !std::isfinite(motor->motorForce) ||
        scene.bodies[motor->a.index].type != BodyType::Static) {
        return {};
    }
    const double sign = motor->motorSpeed < 0 ? -1 : 1;
    return Push{motor->b.index, sign * motor->motorForce * motor->axis.normalized()};
}

double frictionOf(const Material& a, const Material& b) {
    return std::sqrt(a.friction * b.friction);
}

}  // namespace cairn
