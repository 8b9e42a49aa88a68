#include "collision/narrow_phase/gjk.hpp"

namespace cairn {
namespace {

// Beyond these the search is given up: 60 supports refine a round pair to 1e-3 of its size.
constexpr int maxVertices = 64;
constexpr int maxFaces = 128;

struct Face3 {
    std::array<int, 3> v{};
    Vec3d n = Vec3d::Zero();  // unit, outward
    double d = 0;             // n . x on the face
};

// A polytope inside the difference of the cores, by its faces.
struct Polytope {
    std::array<Vec3d, maxVertices> w;
    std::array<Face3, maxFaces> faces;
    int vertexCount = 0;
    int faceCount = 0;

    const Vec3d& at(int i) const { return w[static_cast<std::size_t>(i)]; }
    // False: no area, or no room.
    bool add(int i, int j, int k, double minLength) {
        if (faceCount == maxFaces) {
            return false;
        }
        Vec3d n = (at(j) - at(i)).cross(at(k) - at(i));
        const double length = n.norm();
        if (!(length > minLength)) {
            return false;
        }
        n /= length;
        faces[static_cast<std::size_t>(faceCount++)] = {{i, j, k}, n, n.dot(at(i))};
        return true;
    }
};

// The direction of least overlap among those tried so far.
struct Search {
    const Convex& a;
    const Convex& b;
    Vec3d& direction;
    double& depth;
    int hintA = 0;
    int hintB = 0;

    Vec3d support(const Vec3d& n) { return supportCore(a, n, hintA) - supportCore(b, -n, hintB); }
    // The overlap along n, whose support is w.
    double attempt(const Vec3d& n, const Vec3d& w) {
        const double h = n.dot(w);
        if (h < depth) {
            depth = h;
            direction = n;
        }
        return h;
    }
};

// Two ends along the best direction known, then what is farthest from their line and from that plane. False: the
// difference of the cores is flat.
bool firstCorners(Search& search, Polytope& p, double& size) {
    const Vec3d first = search.direction;
    p.w[0] = search.support(first);
    p.w[1] = search.support(-first);
    search.attempt(first, p.w[0]);
    search.attempt(-first, p.w[1]);
    Vec3d u;
    Vec3d v;
    const Vec3d axis = p.w[0] - p.w[1];
    size = axis.norm();
    if (!(size > 1e-9)) {
        return false;
    }
    completeBasis<double>(axis / size, u, v);
    double largest = 0;
    for (const Vec3d& n : {u, v, Vec3d(-u), Vec3d(-v)}) {
        const Vec3d w = search.support(n);
        search.attempt(n, w);
        const double off = (w - p.w[1]).cross(axis).norm() / size;
        if (off > largest) {
            largest = off;
            p.w[2] = w;
        }
    }
    if (!(largest > 1e-6 * size)) {
        return false;
    }
    const Vec3d up = axis.cross(p.w[2] - p.w[1]).normalized();
    const Vec3d above = search.support(up);
    const Vec3d below = search.support(-up);
    search.attempt(up, above);
    search.attempt(-up, below);
    const double rise = up.dot(above - p.w[1]);
    const double fall = -up.dot(below - p.w[1]);
    if (!(std::max(rise, fall) > 1e-6 * size)) {
        return false;
    }
    p.w[3] = rise >= fall ? above : below;
    p.vertexCount = 4;
    return true;
}

bool firstFaces(Polytope& p, double minArea) {
    const Vec3d middle = 0.25 * (p.w[0] + p.w[1] + p.w[2] + p.w[3]);
    for (const auto& f : {std::array{0, 1, 2}, std::array{0, 1, 3}, std::array{0, 2, 3}, std::array{1, 2, 3}}) {
        const bool outward = (p.at(f[1]) - p.at(f[0])).cross(p.at(f[2]) - p.at(f[0])).dot(p.at(f[0]) - middle) > 0;
        if (!p.add(f[0], outward ? f[1] : f[2], outward ? f[2] : f[1], minArea)) {
            return false;
        }
    }
    return true;
}

// Takes a new corner in: the faces seen from it give way to a cone from their rim, the horizon, to it.
bool grow(Polytope& p, const Vec3d& w, double size, double minArea) {
    const int added = p.vertexCount++;
    p.w[static_cast<std::size_t>(added)] = w;
    std::array<std::array<int, 2>, 3 * maxFaces> horizon;
    int edges = 0;
    for (int f = p.faceCount - 1; f >= 0; --f) {
        const Face3& g = p.faces[static_cast<std::size_t>(f)];
        if (g.n.dot(w) - g.d <= 1e-12 * size) {
            continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const std::array<int, 2> edge{g.v[k], g.v[(k + 1) % 3]};
            int twin = 0;
            while (twin < edges && (horizon[static_cast<std::size_t>(twin)][0] != edge[1] ||
                                    horizon[static_cast<std::size_t>(twin)][1] != edge[0])) {
                ++twin;
            }
            if (twin < edges) {
                horizon[static_cast<std::size_t>(twin)] = horizon[static_cast<std::size_t>(--edges)];
            } else {
                horizon[static_cast<std::size_t>(edges++)] = edge;
            }
        }
        p.faces[static_cast<std::size_t>(f)] = p.faces[static_cast<std::size_t>(--p.faceCount)];
    }
    for (int e = 0; e < edges; ++e) {
        const auto& edge = horizon[static_cast<std::size_t>(e)];
        if (!p.add(edge[0], edge[1], added, minArea)) {
            return false;
        }
    }
    return true;
}

}  // namespace

bool minOverlap(const Convex& a, const Convex& b, double tolerance, Vec3d& direction, double& depth) {
    Search search{a, b, direction, depth};
    static thread_local Polytope p;  // too large to be cleared for each pair
    p.vertexCount = 0;
    p.faceCount = 0;
    double size = 0;
    if (!firstCorners(search, p, size)) {
        return false;
    }
    const double minArea = 1e-13 * size * size;
    if (!firstFaces(p, minArea)) {
        return false;
    }
    while (p.vertexCount < maxVertices) {
        int nearest = 0;
        for (int f = 1; f < p.faceCount; ++f) {
            nearest =
                p.faces[static_cast<std::size_t>(f)].d < p.faces[static_cast<std::size_t>(nearest)].d ? f : nearest;
        }
        const Face3 face = p.faces[static_cast<std::size_t>(nearest)];
        // No direction overlaps less than the nearest face of what lies inside.
        if (face.d >= depth - tolerance) {
            return true;
        }
        const Vec3d w = search.support(face.n);
        if (search.attempt(face.n, w) - face.d <= tolerance) {
            return true;
        }
        if (!grow(p, w, size, minArea)) {
            return false;
        }
    }
    return false;
}

}  // namespace cairn
