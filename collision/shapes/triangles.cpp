#include "collision/shapes/triangles.hpp"
#include "collision/shapes/box_walk.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

std::array<Vec3d, 3> cornersOf(const Shape& s, int index) {
    if (s.kind == ShapeKind::HeightField) {
        const auto v = s.field->vertices(index);
        return {s.field->vertex(v[0]), s.field->vertex(v[1]), s.field->vertex(v[2])};
    }
    const auto& v = s.mesh->triangles().triangles[static_cast<std::size_t>(index)];
    const auto at = [&](int i) -> Vec3d {
        return s.mesh->triangles().vertices[static_cast<std::size_t>(i)].cwiseProduct(s.size);
    };
    return {at(v[0]), at(v[1]), at(v[2])};
}

Triangle triangleOf(const Shape& s, int index) {
    Triangle t;
    t.index = index;
    t.corners = cornersOf(s, index);
    if (s.kind == ShapeKind::HeightField) {
        t.vertices = s.field->vertices(index);
        t.active = s.field->activeEdges(index);
        t.sharp = s.field->sharpCorners(index);
        t.face = (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).normalized();
        return t;
    }
    t.vertices = s.mesh->triangles().triangles[static_cast<std::size_t>(index)];
    t.sharp = s.mesh->sharpCorners(index);
    for (int k = 0; k < 3; ++k) {
        t.active |= s.mesh->edgeIsActive(index, k) ? 1u << k : 0u;
    }
    const Vec3d& normal = s.mesh->normal(index);
    t.face = s.size == Vec3d::Ones() ? normal : Vec3d(normal.cwiseQuotient(s.size).normalized());
    return t;
}

void findTriangles(const Shape& s, const Aabb& region, std::vector<int>& out) {
    if (s.kind == ShapeKind::HeightField) {
        s.field->find(region, out);
    } else {
        s.mesh->find({region.min.cwiseQuotient(s.size), region.max.cwiseQuotient(s.size)}, out);
    }
}

void castBoxAtTriangles(const Shape& s, const Vec3d& origin, const Vec3d& motion, const Vec3d& half, double limit,
                        FunctionRef<double(int, double)> visit) {
    if (s.kind == ShapeKind::HeightField) {
        s.field->castBox(origin, motion, half, limit, visit);
    } else {
        s.mesh->castBox(origin, motion, half, s.size, limit, visit);
    }
}

void nearTriangles(const Shape& s, const Aabb& box, double limit, FunctionRef<double(int, double)> visit) {
    if (s.kind == ShapeKind::Mesh) {
        s.mesh->near(box, s.size, limit, visit);
        return;
    }
    // Without a tree: look ever farther, so that what is found near bounds how far to look.
    const Aabb& all = s.field->bounds();
    const double nearest = boxDistance(box, all.min, all.max);
    const double whole = (all.max - all.min).norm() + (box.max - box.min).norm() + nearest;
    std::vector<int> found;
    std::vector<int> seen;
    for (double radius = nearest + 2 * s.field->cellSize();; radius *= 2) {
        radius = std::min(radius, limit);
        found.clear();
        s.field->find(box.grown(radius), found);
        for (const int index : found) {
            if (std::binary_search(seen.begin(), seen.end(), index)) {
                continue;
            }
            const auto c = cornersOf(s, index);
            if (boxDistance(box, c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])) <= limit) {
                limit = visit(index, limit);
            }
        }
        if (radius >= limit || radius >= whole) {
            return;
        }
        std::swap(seen, found);
    }
}

int edgeToward(const Triangle& t, const Vec3d& n) {
    int best = 0;
    double largest = -1e300;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d outward = (t.corners[(k + 1) % 3] - t.corners[k]).cross(t.face).normalized();
        const double dot = outward.dot(n);
        if (dot > largest) {
            largest = dot;
            best = static_cast<int>(k);
        }
    }
    return best;
}

// Ericson, Real-Time Collision Detection, 5.1.5.
Vec3d nearestOfTriangle(const std::array<Vec3d, 3>& c, const Vec3d& p, unsigned& edges) {
    const Vec3d ab = c[1] - c[0];
    const Vec3d ac = c[2] - c[0];
    const Vec3d ap = p - c[0];
    const double d1 = ab.dot(ap);
    const double d2 = ac.dot(ap);
    edges = 0;
    if (d1 <= 0 && d2 <= 0) {
        edges = 0b101;
        return c[0];
    }
    const Vec3d bp = p - c[1];
    const double d3 = ab.dot(bp);
    const double d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) {
        edges = 0b011;
        return c[1];
    }
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        edges = 0b001;
        return c[0] + ab * (d1 / (d1 - d3));
    }
    const Vec3d cp = p - c[2];
    const double d5 = ab.dot(cp);
    const double d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) {
        edges = 0b110;
        return c[2];
    }
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        edges = 0b100;
        return c[0] + ac * (d2 / (d2 - d6));
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        edges = 0b010;
        return c[1] + (c[2] - c[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    const double sum = va + vb + vc;
    return c[0] + ab * (vb / sum) + ac * (vc / sum);
}

}  // namespace cairn
