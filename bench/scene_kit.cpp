#include "scene_kit.hpp"

#include <cmath>
#include <numbers>

namespace cairn::bench {
namespace {

// Heights and half widths in m, of a doll that stands on y = 0.
struct Limb {
    int parent;    // place in the table; -1: none
    double joint;  // height of its ball joint to the parent
    double x, low, high, halfWidth, halfDepth;
    double share;  // of the doll's 75 kg
};

constexpr Limb limbs[] = {
    {-1, 0.00, 0, 0.93, 1.05, 0.15, 0.09, 0.112},        // pelvis
    {0, 1.05, 0, 1.05, 1.22, 0.14, 0.09, 0.163},         // belly
    {1, 1.22, 0, 1.22, 1.49, 0.16, 0.10, 0.160},         // chest
    {2, 1.49, 0, 1.49, 1.75, 0.08, 0.09, 0.069},         // head
    {2, 1.43, -0.226, 1.11, 1.43, 0.045, 0.045, 0.027},  // right arm
    {4, 1.11, -0.226, 0.85, 1.11, 0.038, 0.038, 0.016},  //
    {5, 0.85, -0.226, 0.66, 0.85, 0.020, 0.042, 0.006},  //
    {0, 0.93, -0.087, 0.50, 0.93, 0.075, 0.075, 0.142},  // right leg
    {7, 0.50, -0.087, 0.07, 0.50, 0.055, 0.055, 0.043},  //
    {8, 0.07, -0.087, 0.00, 0.07, 0.045, 0.133, 0.014},  //
    {2, 1.43, 0.226, 1.11, 1.43, 0.045, 0.045, 0.027},   // left arm
    {10, 1.11, 0.226, 0.85, 1.11, 0.038, 0.038, 0.016},  //
    {11, 0.85, 0.226, 0.66, 0.85, 0.020, 0.042, 0.006},  //
    {0, 0.93, 0.087, 0.50, 0.93, 0.075, 0.075, 0.142},   // left leg
    {13, 0.50, 0.087, 0.07, 0.50, 0.055, 0.055, 0.043},  //
    {14, 0.07, 0.087, 0.00, 0.07, 0.045, 0.133, 0.014},  //
};

}  // namespace

Vec3d onSquare(int i, int n, double pitch) {
    const int side = static_cast<int>(std::ceil(std::sqrt(n)));
    return pitch * Vec3d(i % side - 0.5 * (side - 1), 0, i / side - 0.5 * (side - 1));
}

void addDoll(Filler& world, const Vec3d& middle, const Quatd& rotation) {
    std::vector<BodyId> ids;
    for (const Limb& limb : limbs) {
        const auto at = [&](double height) -> Vec3d { return middle + rotation * Vec3d(limb.x, height - 0.9, 0); };
        ids.push_back(world.add({.shapes = {box({limb.halfWidth, 0.5 * (limb.high - limb.low), limb.halfDepth})},
                                 .position = at(0.5 * (limb.low + limb.high)),
                                 .rotation = rotation,
                                 .mass = 75 * limb.share}));
        if (limb.parent >= 0) {
            world.add(
                BallDef{.a = ids[static_cast<std::size_t>(limb.parent)], .b = ids.back(), .anchor = at(limb.joint)});
        }
    }
}

void addTied(Filler& world, int side, const std::function<BodyDef(int)>& def) {
    std::vector<BodyId> ids;
    for (int i = 0; i < side * side; ++i) {
        const BodyDef one = def(i);
        ids.push_back(world.add(one));
        const auto tie = [&](int other) {
            const BodyDef before = def(other);
            if (one.type == BodyType::Dynamic || before.type == BodyType::Dynamic) {
                world.add(BallDef{.a = ids[static_cast<std::size_t>(other)],
                                  .b = ids.back(),
                                  .anchor = 0.5 * (before.position + one.position)});
            }
        };
        if (i % side > 0) {
            tie(i - 1);
        }
        if (i >= side) {
            tie(i - side);
        }
    }
}

std::vector<Vec3d> spiral(int points, double radius) {
    std::vector<Vec3d> places;
    for (int i = 0; i < points; ++i) {
        const double z = 1 - (2 * i + 1.0) / points;
        const double angle = 2 * std::numbers::pi * i / std::numbers::phi;
        const double across = std::sqrt(1 - z * z);
        places.emplace_back(radius * Vec3d(across * std::cos(angle), across * std::sin(angle), z));
    }
    return places;
}

// Three points are a face where all others are on one side of their plane.
Shape hullOnSphere(const std::vector<Vec3d>& points) {
    const int n = static_cast<int>(points.size());
    const auto at = [&](int i) -> const Vec3d& { return points[static_cast<std::size_t>(i)]; };
    std::vector<std::vector<int>> faces;
    for (int a = 0; a < n; ++a) {
        for (int b = a + 1; b < n; ++b) {
            for (int c = b + 1; c < n; ++c) {
                const Vec3d normal = (at(b) - at(a)).cross(at(c) - at(a));
                int above = 0;
                for (int other = 0; other < n; ++other) {
                    above += other != a && other != b && other != c && normal.dot(at(other) - at(a)) > 0;
                }
                if (above == 0) {
                    faces.push_back({a, b, c});
                } else if (above == n - 3) {
                    faces.push_back({a, c, b});
                }
            }
        }
    }
    return hull(points, faces);
}

Shape prism(const std::vector<Vec3d>& front, const std::vector<Vec3d>& back) {
    const int n = static_cast<int>(front.size());
    std::vector<Vec3d> vertices = front;
    vertices.insert(vertices.end(), back.begin(), back.end());
    std::vector<std::vector<int>> faces(2);
    for (int i = 0; i < n; ++i) {
        const int next = (i + 1) % n;
        faces[0].push_back(i);
        faces[1].push_back(2 * n - 1 - i);
        faces.push_back({next, i, n + i, n + next});
    }
    return hull(vertices, faces);
}

}  // namespace cairn::bench
