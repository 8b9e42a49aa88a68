#include "collision/narrow_phase/manifold.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// A corner this far outside a face, relative to the face's extent, still counts as inside: two equal boxes on each
// other would else exchange corners and crossings at every jitter. 0.1 mm on a metre.
constexpr double rimSlack = 1e-4;
// Candidates whose reach along a diagonal differs by less than this part of the manifold's extent are tied; the lower
// id wins, so that jitter cannot exchange them.
constexpr double tie = 1e-3;

// Keeps the part of a closed loop (or of an open segment: two corners) on the inner side of a plane.
void clipLoop(const std::vector<OutlineVertex>& in, const Vec3d& outward, double offset, double slack,
              std::uint32_t edge, std::vector<OutlineVertex>& out) {
    out.clear();
    const std::size_t count = in.size();
    const auto outside = [&](const OutlineVertex& v) { return outward.dot(v.point) - offset; };
    const auto crossing = [&](const OutlineVertex& p, double dp, const OutlineVertex& q, double dq) {
        OutlineVertex v;
        v.point = p.point + (q.point - p.point) * (dp / (dp - dq));
        v.id = static_cast<std::uint32_t>(mixIds(p.edge, edge)) | 0x40000000u;
        return v;
    };
    if (count == 1) {
        if (outside(in[0]) <= slack) {
            out.push_back(in[0]);
        }
        return;
    }
    if (count == 2) {
        OutlineVertex p = in[0];
        OutlineVertex q = in[1];
        const double dp = outside(p);
        const double dq = outside(q);
        if (dp > slack && dq > slack) {
            return;
        }
        if (dp > slack) {
            const std::uint32_t kept = p.edge;
            p = crossing(p, dp, q, std::min(dq, 0.0));
            p.edge = kept;
        } else if (dq > slack) {
            const std::uint32_t kept = p.edge;
            q = crossing(p, std::min(dp, 0.0), q, dq);
            q.edge = kept;
        }
        out.push_back(p);
        out.push_back(q);
        return;
    }
    double dp = outside(in[0]);
    for (std::size_t i = 0; i < count; ++i) {
        const OutlineVertex& p = in[i];
        const OutlineVertex& q = in[(i + 1) % count];
        const double dq = outside(q);
        const bool keepP = dp <= slack;
        const bool keepQ = dq <= slack;
        if (keepP) {
            out.push_back(p);
            if (!keepQ) {
                if (dp < 0) {
                    OutlineVertex v = crossing(p, dp, q, dq);
                    v.edge = edge;
                    out.push_back(v);
                } else {
                    out.back().edge = edge;
                }
            }
        } else if (keepQ && dq < 0) {
            OutlineVertex v = crossing(p, dp, q, dq);
            v.edge = p.edge;
            out.push_back(v);
        }
        dp = dq;
    }
}

void addCandidate(Scratch& scratch, const Vec3d& point, std::uint64_t feature, double radius, double margin) {
    const Face& face = scratch.face;
    const double height = face.normal.dot(point - face.point);
    const double separation = height - radius;
    if (separation <= margin) {
        scratch.candidates.push_back({point - height * face.normal, point - radius * face.normal, separation, feature});
    }
}

// A disc against an outline: corners inside the rim, sides across it, and the rim's own fixed points inside the loop.
void clipToDisc(Scratch& scratch, double radius, double margin) {
    const Face& face = scratch.face;
    const auto& in = scratch.incident;
    const double slack = rimSlack * face.radius;
    const double inside2 = (face.radius + slack) * (face.radius + slack);
    const double rim2 = face.radius * face.radius;
    const auto flat = [&](const Vec3d& p) {
        const Vec3d d = p - face.point;
        return Vec3d(d - face.normal * face.normal.dot(d));
    };
    const std::size_t sides = in.size() == 2 ? 1 : in.size() == 1 ? 0 : in.size();
    for (const OutlineVertex& v : in) {
        if (flat(v.point).squaredNorm() <= inside2) {
            addCandidate(scratch, v.point, v.id, radius, margin);
        }
    }
    for (std::size_t i = 0; i < sides; ++i) {
        const Vec3d& p = in[i].point;
        const Vec3d& q = in[(i + 1) % in.size()].point;
        const Vec3d fp = flat(p);
        const Vec3d d = flat(q) - fp;
        const double a = d.squaredNorm();
        const double b = fp.dot(d);
        const double c = fp.squaredNorm() - rim2;
        const double discriminant = b * b - a * c;
        if (discriminant <= 0 || a <= 0) {
            continue;
        }
        const double root = std::sqrt(discriminant);
        for (const int which : {0, 1}) {
            const double t = (which == 0 ? -b - root : -b + root) / a;
            if (t <= 0 || t >= 1) {
                continue;
            }
            // Not where the corner at that end is taken already.
            const Vec3d& end = which == 0 ? p : q;
            if (flat(end).squaredNorm() <= inside2) {
                continue;
            }
            addCandidate(scratch, p + t * (q - p), mixIds(in[i].edge, static_cast<std::uint64_t>(0x1000 + which)),
                         radius, margin);
        }
    }
    if (in.size() < 3) {
        return;
    }
    // The incident plane over the rim's points: along the reference normal.
    Vec3d normal = Vec3d::Zero();
    for (std::size_t i = 1; i + 1 < in.size(); ++i) {
        normal += (in[i].point - in[0].point).cross(in[i + 1].point - in[0].point);
    }
    const double slope = normal.dot(face.normal);
    if (std::abs(slope) < 0.1 * normal.norm()) {
        return;
    }
    for (const OutlineVertex& corner : face.loop) {
        bool within = true;
        for (std::size_t i = 0; i < in.size() && within; ++i) {
            const Vec3d& p = in[i].point;
            const Vec3d side = (in[(i + 1) % in.size()].point - p).cross(face.normal);
            within = side.dot(corner.point - p) * (slope > 0 ? 1 : -1) <= 0;
        }
        if (within) {
            const double rise = normal.dot(in[0].point - corner.point) / slope;
            addCandidate(scratch, corner.point + rise * face.normal, mixIds(corner.id, 0x2000), radius, margin);
        }
    }
}

}  // namespace

std::uint64_t mixIds(std::uint64_t a, std::uint64_t b) {
    // The finaliser of splitmix64 over both words.
    std::uint64_t x = a * 0x9e3779b97f4a7c15ull + b + 0x7f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

void clipToFace(Scratch& scratch, double radius, double margin) {
    const Face& face = scratch.face;
    if (face.rim == Face::Rim::Disc) {
        clipToDisc(scratch, radius, margin);
        return;
    }
    const std::vector<OutlineVertex>* from = &scratch.incident;
    if (face.rim == Face::Rim::Loop) {
        std::vector<OutlineVertex>* to = &scratch.clipped;
        std::vector<OutlineVertex>* spare = &scratch.clipping;
        const std::size_t count = face.loop.size();
        for (std::size_t k = 0; k < count && !from->empty(); ++k) {
            const Vec3d& p = face.loop[k].point;
            const Vec3d side = face.loop[(k + 1) % count].point - p;
            const Vec3d outward = side.cross(face.normal);
            const double length = outward.norm();
            // The slack is measured across the face: a side's length stands for its extent.
            clipLoop(*from, outward, outward.dot(p), rimSlack * length * length, face.loop[k].edge, *to);
            from = to;
            std::swap(to, spare);
        }
    }
    for (const OutlineVertex& v : *from) {
        addCandidate(scratch, v.point, v.id, radius, margin);
    }
}

namespace {

// Puts the deepest candidate in the place of the chosen one nearest to it, unless one of them is as deep.
void keepDeepest(const std::vector<Candidate>& candidates, int deepest, double slack, std::span<int> chosen) {
    const auto at = [&](int i) -> const Candidate& { return candidates[static_cast<std::size_t>(i)]; };
    int* place = nullptr;
    double nearest = 1e300;
    for (int& i : chosen) {
        if (at(i).separation <= at(deepest).separation + slack) {
            return;
        }
        const double distance = (at(i).inner - at(deepest).inner).norm();
        if (distance < nearest) {
            nearest = distance;
            place = &i;
        }
    }
    if (place != nullptr) {
        *place = deepest;
    }
}

}  // namespace

int reduceCandidates(const std::vector<Candidate>& candidates, const Vec3d& tangent1, const Vec3d& tangent2,
                     std::array<int, 4>& chosen) {
    const int count = static_cast<int>(candidates.size());
    const auto at = [&](int i) -> const Candidate& { return candidates[static_cast<std::size_t>(i)]; };
    if (count <= 2) {
        chosen = {0, 1, 0, 0};
        return count;
    }
    Vec3d low = at(0).inner;
    Vec3d high = low;
    for (int i = 1; i < count; ++i) {
        low = low.cwiseMin(at(i).inner);
        high = high.cwiseMax(at(i).inner);
    }
    const double slack = tie * (high - low).norm();
    const auto offLine = [&](int i, int from, int to) {
        const Vec3d along = at(to).inner - at(from).inner;
        return (at(i).inner - at(from).inner).cross(along).norm() / std::max(along.norm(), 1e-300);
    };
    if (count <= 4 && (offLine(2, 0, 1) > slack || (count == 4 && offLine(3, 0, 1) > slack))) {
        chosen = {0, 1, 2, 3};
        return count;
    }
    // Of the candidates with nearly the highest value, the one of the lowest id.
    const auto highest = [&](const auto& value) {
        double top = value(0);
        for (int i = 1; i < count; ++i) {
            top = std::max(top, value(i));
        }
        int best = -1;
        for (int i = 0; i < count; ++i) {
            if (value(i) >= top - slack && (best < 0 || at(i).feature < at(best).feature)) {
                best = i;
            }
        }
        return best;
    };
    const int deepest = highest([&](int i) { return -at(i).separation; });
    int used = 0;
    const auto nearestTaken = [&](int i) {
        double nearest = 1e300;
        for (int k = 0; k < used; ++k) {
            nearest = std::min(nearest, (at(i).inner - at(chosen[static_cast<std::size_t>(k)]).inner).norm());
        }
        return nearest;
    };
    for (const auto& [s1, s2] :
         {std::pair(1.0, 1.0), std::pair(-1.0, 1.0), std::pair(-1.0, -1.0), std::pair(1.0, -1.0)}) {
        const Vec3d diagonal = s1 * tangent1 + s2 * tangent2;
        const int best = highest([&](int i) { return diagonal.dot(at(i).inner); });
        if (nearestTaken(best) > slack) {
            chosen[static_cast<std::size_t>(used++)] = best;
        }
    }
    // Two diagonals met in one corner: the point farthest from those taken fills up, if it is a place of its own.
    while (used < 4) {
        // Two points make a line, which a third one on it would not make steadier.
        const auto gain = [&](int i) { return used == 2 ? offLine(i, chosen[0], chosen[1]) : nearestTaken(i); };
        const int best = highest(gain);
        if (gain(best) <= slack) {
            break;
        }
        chosen[static_cast<std::size_t>(used++)] = best;
    }
    keepDeepest(candidates, deepest, slack, std::span(chosen).first(static_cast<std::size_t>(used)));
    return used;
}

int spreadPoints(std::span<const ContactPoint> points, const Vec3d& normal, std::array<int, 4>& chosen) {
    std::vector<Candidate> candidates;
    candidates.reserve(points.size());
    for (const ContactPoint& p : points) {
        candidates.push_back({p.onA, p.onB, p.separation, p.feature});
    }
    int axis = 0;
    normal.cwiseAbs().minCoeff(&axis);
    const Vec3d tangent = (Vec3d::Unit(axis) - normal[axis] * normal).normalized();
    return reduceCandidates(candidates, tangent, normal.cross(tangent), chosen);
}

double leastSeparation(const std::vector<Candidate>& candidates) {
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& c : candidates) {
        least = std::min(least, c.separation);
    }
    return least;
}

void fillManifold(const Scratch& scratch, double least, const Vec3d& outward, int side, WorkManifold& out) {
    std::array<int, 4> chosen{};
    out.count = reduceCandidates(scratch.candidates, scratch.face.tangent1, scratch.face.tangent2, chosen);
    out.isReduced = out.count < static_cast<int>(scratch.candidates.size());
    out.normal = side == 0 ? outward : Vec3d(-outward);
    out.reference = static_cast<std::int8_t>(side);
    double kept = std::numeric_limits<double>::infinity();
    for (int k = 0; k < out.count; ++k) {
        const Candidate& c = scratch.candidates[static_cast<std::size_t>(chosen[static_cast<std::size_t>(k)])];
        ContactPoint& p = out.points[static_cast<std::size_t>(k)];
        p.onA = side == 0 ? c.inner : c.outer;
        p.onB = side == 0 ? c.outer : c.inner;
        p.separation = c.separation;
        p.feature = mixIds(c.feature, static_cast<std::uint64_t>(side) << 32 | scratch.face.id);
        kept = std::min(kept, c.separation);
    }
    out.deeper = kept - least;
}

}  // namespace cairn
