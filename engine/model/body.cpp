#include "engine/model/body.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/validate.hpp"
#include "engine/model/describe.hpp"
#include "engine/model/gyroscopics.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace cairn {

std::string label(const std::string& name) {
    return name.empty() ? std::string("body") : "body \"" + name + "\"";
}

template <class S>
void requireSpeed(const std::string& name, const Vec3<S>& linear, const Vec3<S>& angular) {
    const std::string body = label(name);
    const FieldCheck given(body);
    given.field("linearVelocity", Vec3d(linear.template cast<double>()), bodySpeedRule);
    given.field("angularVelocity", Vec3d(angular.template cast<double>()), bodySpinRule);
}

template void requireSpeed(const std::string&, const Vec3<float>&, const Vec3<float>&);
template void requireSpeed(const std::string&, const Vec3<double>&, const Vec3<double>&);

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

// Mass, centre and inertia of a dynamic body. name: for errors.
template <class S>
void weigh(BodyKind<S>& kind, const std::string& name) {
    const BodyDef& def = kind.def;
    kind.givenMass = def.mass;
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
            label(name) + ".mass", std::to_string(properties.mass),
            "a dynamic body needs mass: give it a shape with density > 0, or a mass > 0, or make it static");
    }
    if (properties.mass < lightestMass || properties.mass > heaviestMass) {
        throw InputError(label(name) + ".mass", numberText(properties.mass),
                         "give a mass from " + numberText(lightestMass) + " to " + numberText(heaviestMass) +
                             " kg, or shapes whose densities make one");
    }
    kind.givenMass = properties.mass;
    kind.mass = static_cast<S>(properties.mass);
    kind.localCentre = properties.centre.cast<S>();
    if (def.particle) {
        return;
    }
    if (!(properties.inertia.determinant() > 0)) {
        throw InputError(label(name) + ".inertia", "singular",
                         "give it a shape with volume, or an inertia > 0 about every axis");
    }
    const Vec3d moments =
        Eigen::SelfAdjointEigenSolver<Mat3d>(properties.inertia, Eigen::EigenvaluesOnly).eigenvalues();
    if (!(moments.maxCoeff() <= widestInertiaRatio * moments.minCoeff())) {
        throw InputError(label(name) + ".inertia",
                         numberText(moments.minCoeff()) + " to " + numberText(moments.maxCoeff()) + " kg m2",
                         "give moments of which the largest is at most " + numberText(widestInertiaRatio) +
                             " times the smallest, or less slender shapes");
    }
    kind.inertia = properties.inertia.cast<S>();
    kind.inverseInertia = inverseOf(kind.inertia);
    // A ball or a cube has no gyroscopic term; nothing is paid for it there.
    const double mean = properties.inertia.trace() / 3;
    kind.gyroscopic = (properties.inertia - mean * Mat3d::Identity()).cwiseAbs().maxCoeff() > 1e-9 * mean;
}

// m3, of shapes that have one; where they overlap that counts twice.
double volumeOf(std::vector<Shape> shapes) {
    std::erase_if(shapes, [](const Shape& shape) { return !isConvex(shape.kind); });
    for (Shape& shape : shapes) {
        shape.material.density = 1;
    }
    return shapes.empty() ? 0 : massProperties(shapes).mass;
}

template <class S>
void measureShapes(BodyKind<S>& kind, double continuousShare) {
    const BodyDef& def = kind.def;
    const Vec3d centre = kind.localCentre.template cast<double>();
    kind.radius = boundingRadius(def.shapes, centre);
    kind.parts = partsOf(def.shapes);
    kind.partTree = PartTree(kind.parts);
    double inner = std::numeric_limits<double>::infinity();
    for (const Shape& shape : def.shapes) {
        inner = std::min(inner, innerRadius(shape));
    }
    kind.coreRadius = std::isfinite(inner) ? inner : 0;
    if (def.type != BodyType::Dynamic) {
        return;
    }
    kind.turningRadius = def.particle ? 0 : turningRadius(def.shapes, centre);
    kind.innerRadius = inner;
    const double reach = 2 * kind.radius;
    kind.room = 4.0 / 3.0 * std::numbers::pi * reach * reach * reach / volumeOf(def.shapes);
    if (def.continuous == Continuous::Always) {
        kind.ccdDistance = 0;
    } else if (def.continuous == Continuous::Auto && !def.particle) {
        kind.ccdDistance = continuousShare * kind.innerRadius;
    }
}

}  // namespace

template <class S>
const std::string& Body<S>::name() const {
    static const std::string none;
    return extra ? extra->name : none;
}

template <class S>
BodyDef Body<S>::def() const {
    BodyDef def = kind->def;
    def.name = name();
    def.position = startPosition;
    def.rotation = Quatd(startRotation.data());
    def.mass = kind->givenMass;
    return def;
}

template <class S>
std::shared_ptr<const BodyKind<S>> BodyMaker<S>::kindOf(const BodyDef& def) {
    auto kind = std::make_shared<BodyKind<S>>();
    kind->def = def;
    kind->def.name.clear();
    kind->def.position.setZero();
    kind->def.rotation.setIdentity();
    for (const std::shared_ptr<const BodyKind<S>>& known : last_) {
        if (known && known->def == kind->def) {
            return known;
        }
    }
    weigh(*kind, def.name);
    const auto any = [](const std::array<bool, 3>& flags) { return flags[0] || flags[1] || flags[2]; };
    kind->locked = def.type == BodyType::Dynamic && (any(def.lockLinear) || any(def.lockAngular));
    if (!def.shapes.empty()) {
        measureShapes(*kind, continuousShare_);
    }
    last_[next_] = kind;
    next_ = (next_ + 1) % last_.size();
    return kind;
}

template <class S>
Body<S> BodyMaker<S>::make(const BodyDef& def) {
    const std::string name = label(def.name);
    for (std::size_t i = 0; i < def.shapes.size(); ++i) {
        validate(def.shapes[i], [&] { return name + ".shapes[" + std::to_string(i) + "]"; });
    }
    check(def, name);
    Body<S> body;
    body.type = def.type;
    if (!def.name.empty()) {
        body.extra.make().name = def.name;
    }
    body.startPosition = def.position;
    const Quatd rotation = def.rotation.normalized();
    body.startRotation = {rotation.x(), rotation.y(), rotation.z(), rotation.w()};
    body.kind = kindOf(def);
    const BodyKind<S>& kind = *body.kind;
    body.pose = body.home();
    if (!body.pose.isFinite() ||
        (body.isDynamic() && !(kind.mass > S(0) && std::isfinite(kind.mass) && kind.inverseInertia.allFinite()))) {
        throw InputError(name, "a position, mass or inertia beyond the range of this world's numbers",
                         "use World<double>, or metres and kilograms");
    }
    if (def.type != BodyType::Static) {
        body.v = def.linearVelocity.cast<S>();
        body.w = def.angularVelocity.cast<S>();
    }
    body.awake = body.isDynamic() ? def.awake : def.type == BodyType::Kinematic;
    body.beginRest();
    return body;
}

template struct Body<float>;
template struct Body<double>;
template class BodyMaker<float>;
template class BodyMaker<double>;

}  // namespace cairn
