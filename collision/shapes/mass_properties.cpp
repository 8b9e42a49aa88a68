#include <cairn/shapes.hpp>

#include "base/base.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/validate.hpp"

#include <cmath>

namespace cairn {

namespace {

// Unit density, in the shape's frame.
struct Solid {
    double volume = 0;
    Vec3d centre = Vec3d::Zero();
    Mat3d inertia = Mat3d::Zero();  // about the centre
};

Solid diagonal(double volume, const Vec3d& perVolume, const Vec3d& centre = Vec3d::Zero()) {
    return {volume, centre, Mat3d((volume * perVolume).asDiagonal())};
}

Solid capsuleSolid(double r, double h) {
    const double straight = pi * r * r * 2 * h;
    const double ends = 4.0 / 3.0 * pi * r * r * r;
    const double axial = straight * r * r / 2 + ends * 0.4 * r * r;
    // A half ball's own centre lies 3/8 r beyond the end of the straight part.
    const double across = straight * (r * r / 4 + h * h / 3) + ends * (0.4 * r * r + h * h + 0.75 * r * h);
    return {straight + ends, Vec3d::Zero(), Vec3d(across, axial, across).asDiagonal()};
}

// Exact integrals over the tetrahedra that each triangle of a face spans with an inner point.
Solid hullSolid(const Hull& hull) {
    double volume = 0;
    Vec3d first = Vec3d::Zero();   // integral of x
    Mat3d second = Mat3d::Zero();  // integral of x x^T
    for (const Hull::Face& face : hull.faces) {
        const auto at = [&](std::size_t i) -> Vec3d {
            return hull.vertices[static_cast<std::size_t>(face.vertices[i])] - hull.centre;
        };
        const Vec3d a = at(0);
        for (std::size_t i = 2; i < face.vertices.size(); ++i) {
            const Vec3d b = at(i - 1);
            const Vec3d c = at(i);
            const double det = a.dot(b.cross(c));
            const Vec3d sum = a + b + c;
            volume += det / 6;
            first += det / 24 * sum;
            second += det / 120 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
        }
    }
    const Vec3d centre = first / volume;
    const Mat3d covariance = second - volume * centre * centre.transpose();
    return {volume, hull.centre + centre, covariance.trace() * Mat3d::Identity() - covariance};
}

Solid solid(const Shape& shape) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    const Vec3d squared = shape.size.cwiseAbs2();
    const Vec3d others(squared.y() + squared.z(), squared.z() + squared.x(), squared.x() + squared.y());
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return diagonal(4.0 / 3.0 * pi * r * r * r, Vec3d::Constant(0.4 * r * r));
        case ShapeKind::Capsule:
            return capsuleSolid(r, h);
        case ShapeKind::Box:
            return diagonal(8 * shape.size.prod(), others / 3);
        case ShapeKind::Cylinder: {
            const double across = r * r / 4 + h * h / 3;
            return diagonal(2 * pi * r * r * h, {across, r * r / 2, across});
        }
        case ShapeKind::Cone: {
            // The centre of mass is a quarter of the height 2h above the base at -h.
            const double across = 0.15 * (r * r + h * h);
            return diagonal(2.0 / 3.0 * pi * r * r * h, {across, 0.3 * r * r, across}, {0, -h / 2, 0});
        }
        case ShapeKind::Ellipsoid:
            return diagonal(4.0 / 3.0 * pi * shape.size.prod(), others / 5);
        case ShapeKind::Hull:
            return hullSolid(*shape.hull);
        case ShapeKind::HalfSpace:
        case ShapeKind::Mesh:
        case ShapeKind::HeightField:
            break;
    }
    throw InputError("shape", name(shape.kind), "it has no mass: use it on static bodies, or give the body a mass");
}

}  // namespace

MassProperties massProperties(std::span<const Shape> shapes) {
    std::vector<MassProperties> parts;
    MassProperties whole;
    for (const Shape& shape : shapes) {
        validate(shape, [&] { return "shapes[" + std::to_string(&shape - shapes.data()) + "]"; });
        const double density = shape.material.density;
        const Solid s = solid(shape);
        const Mat3d rotation = shape.pose.rotation.toRotationMatrix();
        parts.push_back(
            {density * s.volume, shape.pose * s.centre, density * rotation * s.inertia * rotation.transpose()});
        whole.mass += parts.back().mass;
        whole.centre += parts.back().mass * parts.back().centre;
    }
    if (parts.empty()) {
        return whole;
    }
    whole.centre /= whole.mass;
    for (const MassProperties& part : parts) {
        const Vec3d arm = part.centre - whole.centre;
        whole.inertia += part.inertia + part.mass * (arm.squaredNorm() * Mat3d::Identity() - arm * arm.transpose());
    }
    // The products above are symmetric only up to round-off.
    whole.inertia = (0.5 * (whole.inertia + whole.inertia.transpose())).eval();
    return whole;
}

}  // namespace cairn
