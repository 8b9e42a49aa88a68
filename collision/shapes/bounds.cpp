#include <cairn/shapes.hpp>

#include "base/base.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/parts.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

Aabb around(const Vec3d& centre, const Vec3d& halfExtents) {
    return {centre - halfExtents, centre + halfExtents};
}

Aabb merged(const Aabb& a, const Aabb& b) {
    return {a.min.cwiseMin(b.min), a.max.cwiseMax(b.max)};
}

Aabb boundsOfBox(const Aabb& local, const Mat3d& rotation, const Vec3d& position) {
    const Vec3d half = 0.5 * (local.max - local.min);
    return around(position + rotation * Vec3d(local.min + half), rotation.cwiseAbs() * half);
}

// Of a mesh or height field, in its own frame.
Aabb localBounds(const Shape& shape) {
    if (shape.kind == ShapeKind::HeightField) {
        return shape.field->bounds();
    }
    const Aabb& box = shape.mesh->bounds();
    return {box.min.cwiseProduct(shape.size), box.max.cwiseProduct(shape.size)};
}

Aabb boundsOfHull(const Hull& hull, const Mat3d& rotation, const Vec3d& position) {
    Aabb box;
    if (isScanned(hull)) {
        box = hull.vertexGroups.extents(rotation);  // its rows are the world's axes in the shape's frame
    } else {
        int low = 0;
        int high = 0;
        for (int i = 0; i < 3; ++i) {
            const Vec3d axis = rotation.row(i).transpose();
            low = supportVertex(hull, -axis, low);
            high = supportVertex(hull, axis, high);
            box.min[i] = axis.dot(hull.vertices[static_cast<std::size_t>(low)]);
            box.max[i] = axis.dot(hull.vertices[static_cast<std::size_t>(high)]);
        }
    }
    return {position + box.min, position + box.max};
}

// A half-space has an end only along a world axis that its normal lies along exactly: ground planes do, and need not
// meet every body in the sky.
Aabb boundsOfHalfSpace(const Vec3d& normal, double offset) {
    Aabb box{Vec3d::Constant(-infinity), Vec3d::Constant(infinity)};
    for (int i = 0; i < 3; ++i) {
        if (normal[(i + 1) % 3] == 0 && normal[(i + 2) % 3] == 0) {
            (normal[i] > 0 ? box.max : box.min)[i] = offset / normal[i];
        }
    }
    return box;
}

Aabb boundsOfShape(const Shape& shape, const Posed& worldFromShape) {
    const Vec3d& p = worldFromShape.position;
    const Mat3d rotation = worldFromShape.rotation.toRotationMatrix();
    const double r = shape.size.x();
    const double h = shape.size.y();
    const Vec3d axis = rotation.col(1);
    // Half extents of a disc of radius r whose normal is the axis.
    const auto disc = [&]() -> Vec3d { return r * (1 - axis.array().square()).max(0.0).sqrt(); };
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return around(p, Vec3d::Constant(r));
        case ShapeKind::Capsule:
            return around(p, (h * axis.cwiseAbs()).array() + r);
        case ShapeKind::Box:
            return around(p, rotation.cwiseAbs() * shape.size);
        case ShapeKind::Cylinder:
            return around(p, h * axis.cwiseAbs() + disc());
        case ShapeKind::Cone: {
            const Vec3d apex = p + h * axis;
            return merged({apex, apex}, around(p - h * axis, disc()));
        }
        case ShapeKind::Ellipsoid:
            return around(p, (rotation * shape.size.asDiagonal()).rowwise().norm());
        case ShapeKind::Hull:
            return boundsOfHull(*shape.hull, rotation, p);
        case ShapeKind::HalfSpace: {
            const Vec3d normal = rotation * shape.size;
            return boundsOfHalfSpace(normal, shape.offset + normal.dot(p));
        }
        case ShapeKind::Mesh:
        case ShapeKind::HeightField:
            return boundsOfBox(localBounds(shape), rotation, p);
    }
    return {p, p};
}

double farthestVertex(const std::vector<Vec3d>& vertices, const Vec3d& centre, const Vec3d& scale = Vec3d::Ones()) {
    double squared = 0;
    for (const Vec3d& vertex : vertices) {
        squared = std::max(squared, (vertex.cwiseProduct(scale) - centre).squaredNorm());
    }
    return std::sqrt(squared);
}

// The farthest point x of an ellipsoid with semi-axes a from c has x - c along the outward normal, stretched by t:
// x_i = -a_i^2 c_i / (t - a_i^2) with t >= max a^2, and t makes x a surface point (a secular equation, falling in t).
double farthestOnEllipsoid(const Vec3d& a, const Vec3d& c) {
    int longest = 0;
    a.maxCoeff(&longest);
    const Vec3d squared = a.cwiseAbs2();
    // The excess of t over max a^2 is the unknown, so that it keeps its digits when it is small.
    const double largest = squared[longest];
    const Vec3d gap = (largest - squared.array()).matrix();
    const auto pointAt = [&](double excess) {
        Vec3d x = Vec3d::Zero();
        for (int i = 0; i < 3; ++i) {
            const double divisor = gap[i] + excess;
            if (c[i] != 0 && divisor > 0) {
                x[i] = -squared[i] * c[i] / divisor;
            }
        }
        return x;
    };
    const auto level = [&](const Vec3d& x) { return x.cwiseQuotient(a).squaredNorm(); };
    double low = 0;
    double high = a.cwiseProduct(c).norm();  // there the level is at most 1
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) {
            break;
        }
        (level(pointAt(middle)) > 1 ? low : high) = middle;
    }
    Vec3d x = pointAt(high);
    // Where c has no part along the longest axis t reaches its bound and that axis takes what is left.
    const double left = 1 - level(x);
    if (left > 0) {
        const double along = x[longest] / a[longest];
        x[longest] = std::copysign(a[longest] * std::sqrt(along * along + left), -c[longest]);
    }
    return (x - c).norm();
}

double farthest(const Shape& shape, const Vec3d& c) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    const double aside = std::hypot(c.x(), c.z());
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return c.norm() + r;
        case ShapeKind::Capsule:
            return std::hypot(aside, std::abs(c.y()) + h) + r;
        case ShapeKind::Box:
            return (c.cwiseAbs() + shape.size).norm();
        case ShapeKind::Cylinder:
            return std::hypot(aside + r, std::abs(c.y()) + h);
        case ShapeKind::Cone:
            return std::max(std::hypot(aside, h - c.y()), std::hypot(aside + r, c.y() + h));
        case ShapeKind::Ellipsoid:
            return farthestOnEllipsoid(shape.size, c);
        case ShapeKind::Hull:
            return farthestVertex(shape.hull->vertices, c);
        case ShapeKind::HalfSpace:
            return infinity;
        case ShapeKind::Mesh:
            return farthestVertex(shape.mesh->triangles().vertices, c, shape.size);
        case ShapeKind::HeightField: {
            double largest = 0;
            for (int id = 0; id < shape.field->columns() * shape.field->rows(); ++id) {
                largest = std::fmax(largest, (shape.field->vertex(id) - c).norm());
            }
            return largest;
        }
    }
    return infinity;
}

}  // namespace

Aabb bounds(std::span<const Shape> shapes, const Posed& worldFromBody) {
    if (shapes.empty()) {
        return {worldFromBody.position, worldFromBody.position};
    }
    // Most bodies are one shape in its own frame.
    const auto boundsOf = [&](const Shape& shape) {
        return boundsOfShape(shape, frameOf(shape.pose).isIdentity ? worldFromBody : worldFromBody * shape.pose);
    };
    Aabb box = boundsOf(shapes.front());
    for (const Shape& shape : shapes.subspan(1)) {
        box = merged(box, boundsOf(shape));
    }
    return box;
}

double boundingRadius(std::span<const Shape> shapes, const Vec3d& centre) {
    double radius = 0;
    for (const Shape& shape : shapes) {
        radius = std::max(radius, farthest(shape, shape.pose.inverse() * centre));
    }
    return radius;
}

double innerRadius(const Shape& shape) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    switch (shape.kind) {
        case ShapeKind::Sphere:
        case ShapeKind::Capsule:
            return r;
        case ShapeKind::Box:
        case ShapeKind::Ellipsoid:
            return shape.size.minCoeff();
        case ShapeKind::Cylinder:
            return std::min(r, h);
        case ShapeKind::Cone:
            // The circle inscribed in the triangle with base 2r and height 2h: twice the area over the perimeter.
            return 2 * r * h / (r + std::hypot(r, 2 * h));
        case ShapeKind::Hull: {
            double smallest = infinity;
            for (const Hull::Face& face : shape.hull->faces) {
                smallest = std::min(smallest, face.offset - face.normal.dot(shape.hull->centre));
            }
            return smallest;
        }
        case ShapeKind::HalfSpace:
            return infinity;
        case ShapeKind::Mesh:
        case ShapeKind::HeightField:
            return 0;
    }
    return 0;
}

}  // namespace cairn
