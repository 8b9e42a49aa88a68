#include "collision/narrow_phase/gjk.hpp"

namespace cairn {
namespace {

struct Simplex {
    std::array<Vec3d, 4> w;  // a - b
    std::array<Vec3d, 4> a;
    std::array<double, 4> weight{};
    int count = 0;
};

struct Near {
    Vec3d point = Vec3d::Zero();
    std::array<int, 3> which{};
    std::array<double, 3> weight{};
    int count = 0;
};

Near nearOnSegment(const Simplex& s, int i, int j) {
    const Vec3d& p = s.w[static_cast<std::size_t>(i)];
    const Vec3d& q = s.w[static_cast<std::size_t>(j)];
    const Vec3d d = q - p;
    const double t = -p.dot(d);
    const double length2 = d.squaredNorm();
    if (t <= 0 || length2 == 0) {
        return {p, {i}, {1}, 1};
    }
    if (t >= length2) {
        return {q, {j}, {1}, 1};
    }
    const double u = t / length2;
    return {p + u * d, {i, j}, {1 - u, u}, 2};
}

// Ericson, Real-Time Collision Detection, 5.1.5, with the query point at the origin.
Near nearOnTriangle(const Simplex& s, int i, int j, int k) {
    const Vec3d& a = s.w[static_cast<std::size_t>(i)];
    const Vec3d& b = s.w[static_cast<std::size_t>(j)];
    const Vec3d& c = s.w[static_cast<std::size_t>(k)];
    const Vec3d ab = b - a;
    const Vec3d ac = c - a;
    const double d1 = -ab.dot(a);
    const double d2 = -ac.dot(a);
    if (d1 <= 0 && d2 <= 0) {
        return {a, {i}, {1}, 1};
    }
    const double d3 = -ab.dot(b);
    const double d4 = -ac.dot(b);
    if (d3 >= 0 && d4 <= d3) {
        return {b, {j}, {1}, 1};
    }
    const double d5 = -ab.dot(c);
    const double d6 = -ac.dot(c);
    if (d6 >= 0 && d5 <= d6) {
        return {c, {k}, {1}, 1};
    }
    // The areas that the origin spans with the sides, from the normal: a sliver of height h and length L keeps them to
    // 1e-16 L / h, where products of the six dot products keep 1e-16 (L / h)^2.
    const Vec3d normal = ab.cross(ac);
    const double va = normal.dot(b.cross(c));
    const double vb = normal.dot(c.cross(a));
    const double vc = normal.dot(a.cross(b));
    const double area2 = va + vb + vc;
    if (vc <= 0 || vb <= 0 || va <= 0 || !(area2 > 0)) {
        // On an edge, or the triangle is a sliver: the nearest of its edges.
        Near best = nearOnSegment(s, i, j);
        for (const auto& [p, q] : {std::pair(j, k), std::pair(i, k)}) {
            const Near other = nearOnSegment(s, p, q);
            if (other.point.squaredNorm() < best.point.squaredNorm()) {
                best = other;
            }
        }
        return best;
    }
    // The plane's nearest point by its normal: exact where the weights would cancel.
    const double v = vb / area2;
    const double w = vc / area2;
    return {normal * (normal.dot(a) / normal.squaredNorm()), {i, j, k}, {1 - v - w, v, w}, 3};
}

// False: the origin is inside the tetrahedron.
bool nearOnTetrahedron(const Simplex& s, Near& best) {
    bool outside = false;
    double bestSquared = 1e300;
    static constexpr std::array<std::array<int, 4>, 4> faces{{{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}}};
    for (const auto& f : faces) {
        const Vec3d& p = s.w[static_cast<std::size_t>(f[0])];
        const Vec3d n = (s.w[static_cast<std::size_t>(f[1])] - p).cross(s.w[static_cast<std::size_t>(f[2])] - p);
        const double origin = -p.dot(n);
        const double opposite = (s.w[static_cast<std::size_t>(f[3])] - p).dot(n);
        if (origin * opposite > 0) {
            continue;
        }
        outside = true;
        const Near candidate = nearOnTriangle(s, f[0], f[1], f[2]);
        const double squared = candidate.point.squaredNorm();
        if (squared < bestSquared) {
            bestSquared = squared;
            best = candidate;
        }
    }
    return outside;
}

}  // namespace

GjkAnswer gjk(const Convex& a, const Convex& b, const Vec3d& start, const Vec3d& shift, double bound) {
    // Below this distance, m, the difference of two supports is round-off and says nothing about a direction.
    constexpr double touching = 1e-7;
    // Relative gap between the distance and its lower bound at which to stop: the normal is then good to about 1e-4.
    constexpr double enough = 1e-8;
    GjkAnswer answer;
    Simplex s;
    int hintA = 0;
    int hintB = 0;
    Vec3d v = start.squaredNorm() > 1e-24 ? Vec3d(-start) : Vec3d(0, -1, 0);  // towards B - A seen from the difference
    double squared = 1e300;
    for (int iteration = 0; iteration < 48; ++iteration) {
        const Vec3d pa = supportCore(a, -v, hintA);
        const Vec3d w = pa - supportCore(b, v, hintB) - shift;
        const double vw = v.dot(w);
        if (vw > 0 && vw * vw > bound * bound * v.squaredNorm()) {
            answer.state = GjkAnswer::State::Beyond;
            answer.distance = vw / v.norm();
            return answer;
        }
        if (iteration > 0 && squared - vw <= enough * squared) {
            break;
        }
        bool known = false;
        for (int i = 0; i < s.count; ++i) {
            known = known || s.w[static_cast<std::size_t>(i)] == w;
        }
        if (known) {
            break;
        }
        // Beyond the simplex until it is known to be nearer.
        s.w[static_cast<std::size_t>(s.count)] = w;
        s.a[static_cast<std::size_t>(s.count)] = pa;
        Near near{w, {0, 0, 0}, {1, 0, 0}, 1};
        switch (s.count) {
            case 0:
                break;
            case 1:
                near = nearOnSegment(s, 0, 1);
                break;
            case 2:
                near = nearOnTriangle(s, 0, 1, 2);
                break;
            default:
                if (!nearOnTetrahedron(s, near)) {
                    return answer;
                }
                break;
        }
        const double nearSquared = near.point.squaredNorm();
        if (nearSquared < touching * touching) {
            return answer;
        }
        if (nearSquared >= squared) {
            break;  // round-off: no nearer point can be told
        }
        squared = nearSquared;
        v = near.point;
        for (int i = 0; i < near.count; ++i) {
            const auto n = static_cast<std::size_t>(i);
            const auto k = static_cast<std::size_t>(near.which[n]);  // rising, so that none is overwritten before
            s.w[n] = s.w[k];
            s.a[n] = s.a[k];
            s.weight[n] = near.weight[n];
        }
        s.count = near.count;
    }
    answer.state = GjkAnswer::State::Apart;
    answer.distance = std::sqrt(squared);
    answer.normal = -v / answer.distance;
    for (int i = 0; i < s.count; ++i) {
        answer.onA += s.weight[static_cast<std::size_t>(i)] * s.a[static_cast<std::size_t>(i)];
    }
    answer.onB = answer.onA - v - shift;
    return answer;
}

}  // namespace cairn
