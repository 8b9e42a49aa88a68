// Pairs of shapes. What is answered for two convex ones is held against their support functions, which say of every
// direction how far the two overlap along it: along the answered normal it is the answered depth, and along no other is
// it less. Balls and half-spaces have closed forms. Which of the two is first, where the pair lies and how large it is
// changes nothing.
#include "command/studies/exact_overlap.hpp"
#include "tests/fuzz/input.hpp"

namespace cairn::fuzz {
namespace {

bool isRound(const Shape& shape) {
    return shape.kind != ShapeKind::Box && shape.kind != ShapeKind::Hull;
}

// m. EPA gives round shapes that overlap deeply up at about 1e-3 of their size (epa.cpp); 1.3e-3 was found.
double toleranceOf(const Shape& a, const Shape& b, double distance, double size) {
    const bool isDeep = distance < -0.05 * size;
    return (isDeep && (isRound(a) || isRound(b)) ? 2.6e-3 : 2e-4) * size;
}

Shape convexShape(Input& input) {
    const Vec3d size(input.within(0.05, 1), input.within(0.05, 1), input.within(0.05, 1));
    switch (input.below(7)) {
        case 0:
            return sphere(size.x());
        case 1:
            return capsule(size.x(), size.y());
        case 2:
            return box(size);
        case 3:
            return cylinder(size.x(), size.y());
        case 4:
            return cone(size.x(), size.y());
        case 5:
            return ellipsoid(size);
        default:
            return truth::wedge();
    }
}

double sizeOf(const Shape& shape) {
    return boundingRadius({&shape, 1}, Vec3d::Zero());
}

Shape scaled(Shape shape, double factor) {
    if (shape.kind == ShapeKind::Hull) {
        std::vector<Vec3d> vertices = shape.hull->vertices;
        std::vector<std::vector<int>> faces;
        for (Vec3d& v : vertices) {
            v *= factor;
        }
        for (const Hull::Face& face : shape.hull->faces) {
            faces.push_back(face.vertices);
        }
        return hull(vertices, faces);
    }
    shape.size *= factor;
    return shape;
}

Closest closest(const Shape& a, const Posed& poseA, const Shape& b, const Posed& poseB) {
    const std::optional<Closest> found = closestPoints({&a, 1}, poseA, {&b, 1}, poseB);
    claim(found.has_value(), "two shapes have a distance");
    claim(std::abs(found->normal.norm() - 1) < 1e-9, "a normal is a unit vector");
    return *found;
}

void requireSame(double distance, double expected, double tolerance, const char* what) {
    if (!(std::abs(distance - expected) <= tolerance)) {
        std::fprintf(stderr, "%.17g against %.17g, allowed %g\n", distance, expected, tolerance);
        claim(false, what);
    }
}

// m: as deep edges of the two may be in each other and still be beside each other, as those of tiles are, and no
// contact (tile_edges.cpp).
double besideEachOther(const Shape& a, const Shape& b, double size) {
    const auto hasFlatSides = [](const Shape& s) {
        return s.kind == ShapeKind::Box || s.kind == ShapeKind::Hull || s.kind == ShapeKind::Cylinder;
    };
    return hasFlatSides(a) && hasFlatSides(b) ? std::min(1e-3, 0.02 * size) : 0;
}

// What collide() finds, against the exact distance of the two.
void checkManifolds(const Shape& a, const Shape& b, const Posed& aFromB, double distance, double size,
                    double tolerance) {
    constexpr double margin = 0.02;
    PairCache cache;
    NarrowCounts counts;
    std::vector<Manifold> found;
    const double least = collide({&a, 1}, {&b, 1}, aFromB, margin, cache, found, counts);
    claim(least <= std::max(0.0, distance) + 1e-9 * size, "they are no nearer than is answered");
    claim(found.empty() ? distance > -tolerance - besideEachOther(a, b, size) : distance < margin + tolerance,
          "contacts are where shapes touch");
    for (const Manifold& manifold : found) {
        claim(manifold.count >= 1 && manifold.count <= 4, "a manifold has one to four points");
        claim(std::abs(manifold.normal.norm() - 1) < 1e-9, "a manifold's normal is a unit vector");
        for (int k = 0; k < manifold.count; ++k) {
            const ContactPoint& point = manifold.points[static_cast<std::size_t>(k)];
            const double apart = manifold.normal.dot(aFromB * point.onB - point.onA);
            claim(std::abs(point.separation - apart) < 1e-9 * size, "a separation is that of its points");
            claim(point.separation <= margin + 1e-9 * size, "a point is within the margin");
            const double most = truth::overlap(a, b, aFromB, manifold.normal);
            claim(-point.separation <= most + tolerance, "no point is deeper than the shapes overlap");
        }
    }
}

void checkConvexPair(Input& input) {
    const Shape a = convexShape(input);
    const Shape b = convexShape(input);
    const double size = sizeOf(a) + sizeOf(b);
    Posed pose{input.vectorWithin(1), input.rotation()};
    // Mostly where they just touch.
    const Vec3d towards = pose.position.norm() > 1e-3 ? pose.position.normalized() : Vec3d(Vec3d::UnitY());
    const double wanted = input.flag() ? input.within(-0.05, 0.05) : input.within(-1, 1);
    pose.position += (truth::overlap(a, b, pose, towards) + wanted * size) * towards;
    const Closest found = closest(a, Posed(), b, pose);
    const double tolerance = toleranceOf(a, b, found.distance, size);
    requireSame(-truth::overlap(a, b, pose, found.normal), found.distance, tolerance,
                "the depth is that along the normal");
    const truth::MinOverlap least = truth::minOverlap(a, b, pose, 60);
    claim(-least.overlap <= found.distance + tolerance, "no direction parts them sooner");
    if (a.kind == ShapeKind::Sphere && b.kind == ShapeKind::Sphere) {
        claim(std::abs(found.distance - (pose.position.norm() - a.size.x() - b.size.x())) < 1e-12 * size,
              "balls are as far apart as their centres less their radii");
    }
    checkManifolds(a, b, pose, found.distance, size, tolerance);

    requireSame(closest(b, pose, a, Posed()).distance, found.distance, tolerance,
                "the order of the two does not matter");
    const Posed moved{input.vectorWithin(100), input.rotation()};
    const Posed there{moved * pose.position, moved.rotation * pose.rotation};
    requireSame(closest(a, moved, b, there).distance, found.distance, tolerance, "where the pair lies does not matter");
    const double factor = std::exp2(input.within(-3, 6));
    const Posed grown{factor * pose.position, pose.rotation};
    requireSame(closest(scaled(a, factor), Posed(), scaled(b, factor), grown).distance / factor, found.distance, size,
                "how large they are does not matter");
}

void checkHalfSpace(Input& input) {
    const Shape a = convexShape(input);
    const Vec3d normal = input.rotation() * Vec3d(Vec3d::UnitY());
    const Shape ground = halfSpace(normal, input.within(-1, 1));
    const Posed pose{input.vectorWithin(2), input.rotation()};
    const double size = sizeOf(a);
    const Vec3d lowest = pose * truth::support(a, pose.rotation.conjugate() * Vec3d(-normal));
    const double expected = normal.dot(lowest) - ground.offset;
    const double found = closest(a, pose, ground, Posed()).distance;
    claim(std::abs(found - expected) < 1e-11 * (size + 4), "the lowest point is as far from a half-space as it is");
}

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    cairn::fuzz::Input input(data, size);
    if (input.byte() % 8 == 0) {
        cairn::fuzz::checkHalfSpace(input);
    } else {
        cairn::fuzz::checkConvexPair(input);
    }
    return 0;
}
