#include "engine/model/body.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/validate.hpp"
#include "engine/model/describe.hpp"
#include "engine/model/gyroscopics.hpp"

#include <cmath>

namespace cairn {

std::string label(const BodyDef& def) {
    return def.name.empty() ? std::string("body") : "body \"" + def.name + "\"";
}

void requireFinite(const BodyDef& def, const char* field, bool finite) {
    if (!finite) {
        throw InputError(label(def) + "." + field, "a non-finite number", "give finite numbers");
    }
}

template <class S>
void requireSpeed(const BodyDef& def, const Vec3<S>& linear, const Vec3<S>& angular) {
    for (const auto& [field, speed] : {std::pair{"linearVelocity", linear}, std::pair{"angularVelocity", angular}}) {
        if (!std::isfinite(speed.squaredNorm())) {
            throw InputError(label(def) + "." + field, "beyond the range of this world's numbers",
                             "give a finite speed whose square is finite");
        }
    }
}

template void requireSpeed(const BodyDef&, const Vec3<float>&, const Vec3<float>&);
template void requireSpeed(const BodyDef&, const Vec3<double>&, const Vec3<double>&);

std::optional<Complaint> validate(const BodyDef& def) {
    if (def.type == BodyType::Dynamic && def.shapes.empty() && def.mass == 0) {
        return Complaint{
            "mass", "0",
            "a dynamic body needs mass: give it a shape with density > 0, or a mass > 0, or make it static"};
    }
    if (def.type == BodyType::Dynamic && def.shapes.empty() && !def.particle && def.inertia.isZero()) {
        return Complaint{"inertia", "0", "give it a shape with volume, or an inertia > 0 about every axis"};
    }
    if (!def.inertia.isZero() &&
        !((def.inertia.array() > 0).all() && 2 * def.inertia.maxCoeff() <= def.inertia.sum() * (1 + 1e-9))) {
        return Complaint{"inertia", "not that of a body",
                         "give three positive moments, each at most the sum of the other two"};
    }
    if (def.particle && (def.type != BodyType::Dynamic || !def.angularVelocity.isZero() || !def.inertia.isZero())) {
        return Complaint{"particle", "true for a body that is fixed, or with a spin or an inertia",
                         "leave type, angularVelocity and inertia out: a particle is dynamic and does not turn"};
    }
    if (def.particle &&
        (def.shapes.size() > 1 || (def.shapes.size() == 1 && (def.shapes[0].kind != ShapeKind::Sphere ||
                                                              !def.shapes[0].pose.position.isZero())))) {
        return Complaint{"shapes", "of a particle, other than one sphere about its centre",
                         "give a particle no shape or one sphere: what does not turn can only be round"};
    }
    for (const Shape& shape : def.shapes) {
        if (def.type == BodyType::Dynamic && !isConvex(shape.kind)) {
            return Complaint{"type", "dynamic with a " + std::string(name(shape.kind)),
                             "make the body static, or give it convex shapes (hulls)"};
        }
    }
    return std::nullopt;
}

namespace {

// Mass, centre and inertia of a dynamic body; fills def.mass in.
template <class S>
void weigh(Body<S>& body) {
    BodyDef& def = body.def;
    if (def.type != BodyType::Dynamic) {
        return;
    }
    MassProperties properties;
    if (!def.shapes.empty()) {
        properties = massProperties(def.shapes);
    }
    if (def.mass > 0 && properties.mass > 0) {
        properties.inertia *= def.mass / properties.mass;
        properties.mass = def.mass;
    } else if (def.mass > 0) {
        properties.mass = def.mass;
    }
    if (!def.inertia.isZero()) {
        properties.inertia = def.inertia.asDiagonal();
    }
    if (!(properties.mass > 0) || !std::isfinite(properties.mass)) {
        throw InputError(
            label(def) + ".mass", std::to_string(properties.mass),
            "a dynamic body needs mass: give it a shape with density > 0, or a mass > 0, or make it static");
    }
    if (def.particle) {
        def.mass = properties.mass;
        body.mass = static_cast<S>(properties.mass);
        body.localCentre = properties.centre.cast<S>();
        return;
    }
    if (!(properties.inertia.determinant() > 0)) {
        throw InputError(label(def) + ".inertia", "singular",
                         "give it a shape with volume, or an inertia > 0 about every axis");
    }
    def.mass = properties.mass;
    body.mass = static_cast<S>(properties.mass);
    body.localCentre = properties.centre.cast<S>();
    body.inertia = properties.inertia.cast<S>();
    // A ball or a cube has no gyroscopic term; nothing is paid for it there.
    const double mean = properties.inertia.trace() / 3;
    body.gyroscopic = (properties.inertia - mean * Mat3d::Identity()).cwiseAbs().maxCoeff() > 1e-9 * mean;
}

template <class S>
void measureShapes(Body<S>& body, double continuousShare) {
    const BodyDef& def = body.def;
    const Vec3d centre = body.localCentre.template cast<double>();
    body.radius = boundingRadius(def.shapes, centre);
    if (!body.isDynamic()) {
        return;
    }
    body.turningRadius = def.particle ? 0 : turningRadius(def.shapes, centre);
    body.innerRadius = std::numeric_limits<double>::infinity();
    for (const Shape& shape : def.shapes) {
        body.innerRadius = std::min(body.innerRadius, innerRadius(shape));
    }
    if (def.continuous == Continuous::Always) {
        body.ccdDistance = 0;
    } else if (def.continuous == Continuous::Auto && !def.particle) {
        body.ccdDistance = continuousShare * body.innerRadius;
    }
}

}  // namespace

template <class S>
Body<S> makeBody(const BodyDef& def, double continuousShare) {
    const std::string name = label(def);
    for (std::size_t i = 0; i < def.shapes.size(); ++i) {
        validate(def.shapes[i], [&] { return name + ".shapes[" + std::to_string(i) + "]"; });
    }
    check(def, name);
    Body<S> body;
    body.def = def;
    body.def.rotation.normalize();
    weigh(body);
    body.pose = {(body.def.position + body.def.rotation * body.localCentre.template cast<double>()).template cast<S>(),
                 body.def.rotation.template cast<S>().normalized()};
    if (!body.pose.isFinite() || (body.isDynamic() && !(body.mass > S(0) && std::isfinite(body.mass) &&
                                                        (def.particle || inverseOf<S>(body.inertia).allFinite())))) {
        throw InputError(label(def), "a position, mass or inertia beyond the range of this world's numbers",
                         "use World<double>, or metres and kilograms");
    }
    body.home = body.pose;
    if (def.type != BodyType::Static) {
        body.v = def.linearVelocity.cast<S>();
        body.w = def.angularVelocity.cast<S>();
        requireSpeed(def, body.v, body.w);
    }
    const auto any = [](const std::array<bool, 3>& flags) { return flags[0] || flags[1] || flags[2]; };
    body.locked = body.isDynamic() && (any(def.lockLinear) || any(def.lockAngular));
    body.awake = body.isDynamic() ? def.awake : def.type == BodyType::Kinematic;
    body.restPose = body.pose;
    if (!def.shapes.empty()) {
        measureShapes(body, continuousShare);
    }
    return body;
}

template Body<float> makeBody<float>(const BodyDef&, double);
template Body<double> makeBody<double>(const BodyDef&, double);

}  // namespace cairn
