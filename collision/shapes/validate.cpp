#include "collision/shapes/validate.hpp"

#include <array>
#include <cmath>

namespace cairn {

namespace {

// m and factors: beyond it squares overflow, and boxes of what is turned there have no order.
constexpr double farthest = 1e150;
// By how much the square of a unit vector's or quaternion's length may be off: what is left of one in float.
constexpr double unitTolerance = 1e-6;

std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", value);
    return buffer;
}

std::string text(const Vec3d& v) {
    return "(" + text(v.x()) + ", " + text(v.y()) + ", " + text(v.z()) + ")";
}

// Written so that NaN fails.
bool isWithin(double value) {
    return std::abs(value) <= farthest;
}

bool isWithin(const Vec3d& v) {
    return isWithin(v.x()) && isWithin(v.y()) && isWithin(v.z());
}

// What messages call a shape and its numbers.
struct Names {
    const Shape& shape;
    const FunctionRef<std::string()>* where;  // null: as the parameters of the function that made it

    std::string of(const char* field) const {
        return where ? (*where)() + "." + field : std::string(name(shape.kind)) + "." + field;
    }
    std::string ofSize(int i, const char* parameter) const {
        return where ? (*where)() + ".size." + "xyz"[i] : of(parameter);
    }
    std::string value(double value, const char* parameter) const {
        return where ? text(value) + " (" + parameter + " of a " + name(shape.kind) + ")" : text(value);
    }
};

void requireLength(const Names& names, int i, const char* parameter, double min) {
    const double value = names.shape.size[i];
    const auto refuse = [&](const std::string& remedy) {
        throw InputError(names.ofSize(i, parameter), names.value(value, parameter), remedy);
    };
    if (!isWithin(value)) {
        refuse("give a finite length in m");
    }
    if (value <= 0) {
        refuse("give a positive length in m");
    }
    if (value > maxShapeSize()) {
        refuse("give at most " + text(maxShapeSize()) + " m, or a half-space");
    }
    if (value < min) {
        refuse("give at least " + text(min) + " m, or scale the scene up: contacts of thinner shapes are not reliable");
    }
}

void requireThere(const Names& names, bool there, const char* field, const char* remedy) {
    if (!there) {
        throw InputError(names.of(field), "null", remedy);
    }
}

void validateSize(const Names& names) {
    const Shape& shape = names.shape;
    const auto lengths = [&](std::initializer_list<const char*> parameters) {
        int i = 0;
        for (const char* parameter : parameters) {
            requireLength(names, i++, parameter, 0.5 * minShapeSize());
        }
    };
    switch (shape.kind) {
        case ShapeKind::Sphere:
            lengths({"radius"});
            return;
        case ShapeKind::Capsule:
        case ShapeKind::Cylinder:
        case ShapeKind::Cone:
            lengths({"radius", "halfHeight"});
            return;
        case ShapeKind::Box:
            lengths({"halfExtents.x", "halfExtents.y", "halfExtents.z"});
            return;
        case ShapeKind::Ellipsoid:
            lengths({"semiAxes.x", "semiAxes.y", "semiAxes.z"});
            return;
        case ShapeKind::Hull:
            requireThere(names, shape.hull != nullptr, "hull", "make the shape with hull() or assets::convexHull()");
            return;
        case ShapeKind::HalfSpace:
            if (!(std::abs(shape.size.squaredNorm() - 1) <= unitTolerance)) {
                throw InputError(names.of(names.where ? "size" : "normal"), text(shape.size),
                                 names.where ? "give a unit normal, or make the shape with halfSpace()"
                                             : "give a finite direction that is not zero");
            }
            if (!isWithin(shape.offset)) {
                throw InputError(names.of("offset"), text(shape.offset), "give a finite distance in m");
            }
            return;
        case ShapeKind::Mesh:
            requireThere(names, shape.mesh != nullptr, "mesh", "make the shape with mesh() or meshInstance()");
            for (int i = 0; i < 3; ++i) {
                if (!isWithin(shape.size[i]) || shape.size[i] <= 0) {
                    throw InputError(names.ofSize(i, "scale"), names.value(shape.size[i], "scale"),
                                     "give positive factors");
                }
            }
            return;
        case ShapeKind::HeightField:
            requireThere(names, shape.field != nullptr, "field", "make the shape with heightField()");
            return;
    }
    throw InputError(names.of("kind"), std::to_string(static_cast<int>(shape.kind)), "give one of ShapeKind");
}

void validateMaterial(const Names& names) {
    const Material& m = names.shape.material;
    const auto require = [&](bool good, const char* field, double value, const char* remedy) {
        if (!good) {
            throw InputError(names.of(field), text(value), remedy);
        }
    };
    require(m.friction >= 0 && m.friction <= roughestFriction, "material.friction", m.friction,
            "give a number in [0, 1e6]");
    require(m.staticFriction < 0 ? std::isfinite(m.staticFriction)
                                 : m.staticFriction >= m.friction && m.staticFriction <= roughestFriction,
            "material.staticFriction", m.staticFriction,
            "give a number from friction to 1e6, or a negative one for the same as friction");
    require(m.restitution >= 0 && m.restitution <= 1, "material.restitution", m.restitution, "give a number in [0, 1]");
    require(m.rollingFriction >= 0 && m.rollingFriction <= roughestFriction, "material.rollingFriction",
            m.rollingFriction, "give a number in [0, 1e6] in m");
    require(m.spinningFriction >= 0 && m.spinningFriction <= roughestFriction, "material.spinningFriction",
            m.spinningFriction, "give a number in [0, 1e6] in m");
    require(m.density > 0 && std::isfinite(m.density), "material.density", m.density,
            "give a finite number > 0 in kg/m3");
}

void check(const Names& names) {
    validateSize(names);
    validateMaterial(names);
    validate(names.shape.pose, [&] { return names.of("pose"); });
}

}  // namespace

void validate(const Posed& pose, FunctionRef<std::string()> where) {
    if (!isWithin(pose.position)) {
        throw InputError(where() + ".position", text(pose.position), "give finite numbers in m");
    }
    const double squared = pose.rotation.squaredNorm();
    if (!(std::abs(squared - 1) <= unitTolerance)) {
        throw InputError(where() + ".rotation", "of length " + text(std::sqrt(squared)),
                         "give a unit quaternion x, y, z, w: normalize() it");
    }
}

void validate(const Shape& shape, FunctionRef<std::string()> where) {
    check(Names{shape, &where});
}

void validate(const Shape& shape) {
    validate(shape, [] { return std::string("shape"); });
}

Shape validMade(Shape shape) {
    check(Names{shape, nullptr});
    return shape;
}

}  // namespace cairn
