#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/narrow_phase/pairs.hpp"
#include "collision/shapes/constants.hpp"

#include <algorithm>
#include <limits>
#include <optional>

namespace cairn {
namespace {

// The shape with the lower rank is the first of its pair: half-spaces and meshes hold the reference, spheres come last.
int rank(ShapeKind kind) {
    switch (kind) {
        case ShapeKind::HalfSpace:
            return 0;
        case ShapeKind::Mesh:
        case ShapeKind::HeightField:
            return 1;
        case ShapeKind::Hull:
            return 2;
        case ShapeKind::Cylinder:
            return 3;
        case ShapeKind::Cone:
            return 4;
        case ShapeKind::Box:
            return 5;
        case ShapeKind::Ellipsoid:
            return 6;
        case ShapeKind::Capsule:
            return 7;
        case ShapeKind::Sphere:
            return 8;
    }
    return 9;
}

Scratch& scratchOfThread() {
    thread_local Scratch scratch;
    return scratch;
}

std::vector<WorkManifold>& manifoldsOfThread() {
    thread_local std::vector<WorkManifold> manifolds;
    return manifolds;
}

// By closed forms and searches of our own.
bool ownPair(const Convex& a, const Convex& b, double margin, const Vec3d& lastNormal, Scratch& scratch,
             NarrowCounts& counts, WorkManifold& out) {
    if (b.kind == ShapeKind::Sphere) {
        return sphereAgainst(a, b, margin, lastNormal, counts, out);
    }
    if (a.kind == ShapeKind::Box && b.kind == ShapeKind::Box) {
        return boxBox(a, b, margin, scratch, counts, out);
    }
    if (a.kind == ShapeKind::Capsule) {
        return capsuleCapsule(a, b, margin, lastNormal, counts, out);
    }
    return convexPair(a, b, margin, scratch, counts, out);
}

// By FCL's direction and depth; by our own where it has none or a wrong one.
bool fclPair(const Convex& a, const Convex& b, double margin, const Vec3d& lastNormal, Scratch& scratch,
             NarrowCounts& counts, WorkManifold& out) {
    ++counts.throughFcl;
    const std::optional<GjkAnswer> said = checkedFcl(a, b, std::min(scaleOf(a), scaleOf(b)), margin, scratch);
    if (!said) {
        ++counts.repairedFcl;
        return ownPair(a, b, margin, lastNormal, scratch, counts, out);
    }
    if (b.kind != ShapeKind::Sphere || said->state == GjkAnswer::State::Beyond) {
        return convexManifold(a, b, *said, margin, scratch, counts, out);
    }
    const Vec3d onA = said->onA + a.radius * said->normal;
    const Vec3d onB = b.position - b.radius * said->normal;
    out.normal = said->normal;
    out.reference = -1;
    out.count = 1;
    out.points[0] = {onA, onB, (onB - onA).dot(out.normal), 1};
    return true;
}

// Asks the pair's method. `first` has the lower rank and stands at the origin of the work frame. Answers how far apart
// they are at least, m, where nothing is within the margin and that is known; else 0.
double ask(const Shape& first, const Shape& second, const Frame& firstFromSecond, double margin, NarrowPhase which,
           const Vec3d& lastNormal, NarrowCounts& counts, std::vector<WorkManifold>& out) {
    Scratch& scratch = scratchOfThread();
    const Convex b = makeConvex(second, firstFromSecond.rotation, firstFromSecond.position);
    // `auto` asks FCL for no pair: for none is it as fast, or nearer to the exact answer (docs/collision.md).
    const bool byFcl = which == NarrowPhase::Fcl;
    if (isSurface(first.kind)) {
        meshAgainst(first, b, margin, byFcl, scratch, counts, out);
        return 0;
    }
    ++counts.shapePairs;
    WorkManifold& manifold = out.emplace_back();
    bool near = false;
    if (first.kind == ShapeKind::HalfSpace) {
        if (byFcl && second.kind != ShapeKind::Hull) {
            ++counts.throughFcl;
            counts.repairedFcl += isFclRightInHalfSpace(first.size, first.offset, b, margin) ? 0 : 1;
        }
        near = halfSpaceAgainst(first.size, first.offset, b, margin, scratch, manifold);
    } else {
        const Convex a = makeConvex(first);
        near = byFcl ? fclPair(a, b, margin, lastNormal, scratch, counts, manifold)
                     : ownPair(a, b, margin, lastNormal, scratch, counts, manifold);
        manifold.apart = near ? 0 : manifold.apart;
        near = near && !isInternalEdge(a, b, scratch, manifold);
    }
    if (near) {
        return 0;
    }
    const double apart = manifold.apart;
    out.pop_back();
    return apart;
}

bool isSound(const WorkManifold& m) {
    bool sound = m.count >= 1 && std::abs(m.normal.squaredNorm() - 1) < 1e-6;
    for (int k = 0; k < m.count; ++k) {
        const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
        sound = sound && p.onA.allFinite() && p.onB.allFinite() && std::isfinite(p.separation);
    }
    return sound;
}

// Where a method's answer is not usable: push along the centre line, or up.
bool repair(const Shape& first, const Shape& second, const Frame& firstFromSecond, double margin, WorkManifold& out) {
    if (!isConvex(first.kind)) {
        return false;
    }
    const Convex a = makeConvex(first);
    const Convex b = makeConvex(second, firstFromSecond.rotation, firstFromSecond.position);
    const Vec3d line = centreOf(b) - centreOf(a);
    const Vec3d n = line.allFinite() && line.norm() > 1e-9 ? Vec3d(line.normalized()) : Vec3d::UnitY();
    int hint = 0;
    const Vec3d pa = supportCore(a, n, hint) + a.radius * n;
    hint = 0;
    const Vec3d pb = supportCore(b, -n, hint) - b.radius * n;
    out = WorkManifold{};
    out.normal = n;
    out.count = 1;
    out.points[0] = {pa, pb, (pb - pa).dot(n), 1};
    return out.points[0].separation <= margin && isSound(out);
}

// The cache entry of a pair of shapes. Pairs are asked in a fixed order, so the next one is mostly beside the last.
PairCache::Entry& entryOf(PairCache& cache, std::uint32_t shapeA, std::uint32_t shapeB, std::size_t& cursor) {
    std::vector<PairCache::Entry>& entries = cache.entries.make();
    const std::size_t count = entries.size();
    for (std::size_t step = 0; step < count; ++step) {
        const std::size_t i = (cursor + step) % count;
        if (entries[i].shapeA == shapeA && entries[i].shapeB == shapeB) {
            cursor = i + 1;
            return entries[i];
        }
    }
    entries.push_back({shapeA, shapeB, Vec3d::Zero()});
    cursor = count + 1;
    return entries.back();
}

// A shape of each body in the order in which their method takes them, and the way from the first one's frame, in which
// it works, to the bodies'.
struct OrderedPair {
    const Shape& first;
    const Shape& second;
    bool swapped;
    const Frame& firstFromSecond;
    const Frame& bodyAFromFirst;
    const Frame& bodyBFromFirst;
};

// outer times inner, in `room` where neither is the identity: a frame is large.
const Frame& product(const Frame& outer, const Frame& inner, Frame& room) {
    if (outer.isIdentity || inner.isIdentity) {
        return outer.isIdentity ? inner : outer;
    }
    return room = {outer.rotation * inner.rotation, outer * inner.position, false};
}

// Whether the centres or the axes of the two may meet, where the poses name no direction. Shapes of one kind are never
// swapped.
bool remembers(const OrderedPair& pair) {
    const ShapeKind kind = pair.first.kind;
    return kind == pair.second.kind && (kind == ShapeKind::Sphere || kind == ShapeKind::Capsule);
}

// The pair's manifolds in its work frame; where its method fails, one that parts the shapes all the same. apart: less
// where they are nearer than that, as ask() says.
const std::vector<WorkManifold>& answer(const OrderedPair& pair, double margin, NarrowPhase which,
                                        const Vec3d& lastNormal, NarrowCounts& counts, double& apart) {
    std::vector<WorkManifold>& manifolds = manifoldsOfThread();
    manifolds.clear();
    bool failed = false;
    try {
        apart = std::min(
            apart, ask(pair.first, pair.second, pair.firstFromSecond, margin, which, lastNormal, counts, manifolds));
    } catch (const std::exception&) {
        failed = true;
    }
    failed = failed || !std::ranges::all_of(manifolds, isSound);
    if (failed) {
        apart = 0;
        ++counts.repairedFailures;
        manifolds.assign(1, WorkManifold{});
        if (!repair(pair.first, pair.second, pair.firstFromSecond, margin, manifolds.front())) {
            manifolds.clear();
        }
    }
    return manifolds;
}

void appendInBodies(const WorkManifold& m, const OrderedPair& pair, std::uint32_t shapeA, std::uint32_t shapeB,
                    std::vector<Manifold>& out) {
    Manifold& made = out.emplace_back();
    made.shapeA = shapeA;
    made.shapeB = shapeB;
    made.id = m.id;
    made.reference = static_cast<std::int8_t>(pair.swapped && m.reference >= 0 ? 1 - m.reference : m.reference);
    made.isReduced = m.isReduced;
    made.deeper = m.deeper;
    made.normal = turned(pair.bodyAFromFirst.rotation, pair.swapped ? Vec3d(-m.normal) : m.normal);
    made.count = m.count;
    for (int k = 0; k < m.count; ++k) {
        const ContactPoint& from = m.points[static_cast<std::size_t>(k)];
        ContactPoint& to = made.points[static_cast<std::size_t>(k)];
        to.onA = pair.bodyAFromFirst * (pair.swapped ? from.onB : from.onA);
        to.onB = pair.bodyBFromFirst * (pair.swapped ? from.onA : from.onB);
        to.separation = from.separation;
        to.feature = from.feature;
    }
}

// Whether a point of the body's frame is within `reach` (m) of the shape's own box along each of its axes.
bool isNear(const Part& s, const Vec3d& point, double reach) {
    const Vec3d p = turnedBack(s.pose.rotation, point - s.pose.position);
    return ((s.low - p).array() <= reach).all() && ((p - s.high).array() <= reach).all();
}

// Of the parts of two bodies, a's and b's: by the boxes of each in its own frame first, then by those along the axes of
// body A, of which b's is made here.
bool mayMeet(const Part& a, const Part& b, const Shape& shapeB, const Frame& aFromB, const Posed& poseOfB,
             double margin) {
    return isNear(a, aFromB * b.middle, b.radius + margin) &&
           isNear(b, turnedBack(aFromB.rotation, a.middle - aFromB.position), a.radius + margin) &&
           a.box.overlaps(bounds(std::span(&shapeB, 1), poseOfB).grown(margin));
}

// Pairs of parts that mayMeet(), and few beside them, in rising order; by the tree of whichever body has more.
void findPairs(const BodyShapes& a, const BodyShapes& b, std::span<const Part> partsA, std::span<const Part> partsB,
               const Frame& bodies, const Frame& bodiesBack, double margin,
               std::vector<std::pair<std::uint32_t, std::uint32_t>>& out) {
    const bool byA = a.tree != nullptr && (b.tree == nullptr || partsA.size() > partsB.size());
    const std::span<const Part> others = byA ? partsB : partsA;
    static thread_local std::vector<std::uint32_t> found;
    for (std::uint32_t i = 0; i < others.size(); ++i) {
        const Vec3d middle = (byA ? bodies : bodiesBack) * others[i].middle;
        // isNear() looks along a part's own axes.
        const double reach = std::sqrt(3.0) * (others[i].radius + margin);
        found.clear();
        (byA ? a : b).tree->find(Aabb{middle, middle}.grown(reach), found);
        for (const std::uint32_t j : found) {
            out.emplace_back(byA ? j : i, byA ? i : j);
        }
    }
    if (byA) {
        std::sort(out.begin(), out.end());
    }
}

}  // namespace

double collide(const BodyShapes& bodyA, const BodyShapes& bodyB, const Posed& aFromB, const Margin& reach,
               PairCache& cache, std::vector<Manifold>& out, NarrowCounts& counts, NarrowPhase which) {
    const std::span<const Shape> a = bodyA.shapes;
    const std::span<const Shape> b = bodyB.shapes;
    const Frame bodies = frameOf(aFromB);
    const Frame bodiesBack = bodies.inverse();
    const bool cull = a.size() > 1 || b.size() > 1;
    const auto partsOfBody = [&](const BodyShapes& body) {
        return cull && body.parts.empty() ? partsOf(body.shapes) : std::vector<Part>();
    };
    const std::vector<Part> madeA = partsOfBody(bodyA);
    const std::vector<Part> madeB = partsOfBody(bodyB);
    const std::span<const Part> partsA = madeA.empty() ? bodyA.parts : madeA;
    const std::span<const Part> partsB = madeB.empty() ? bodyB.parts : madeB;
    double apart = infinity;
    std::size_t cursor = 0;
    const auto askParts = [&](std::uint32_t i, std::uint32_t j) {
        const double margin = reach.of(i, j);
        if (cull && !mayMeet(partsA[i], partsB[j], b[j], bodies, aFromB, margin)) {
            apart = std::min(apart, margin);
            return;
        }
        const bool swapped = rank(b[j].kind) < rank(a[i].kind);
        const Shape& first = swapped ? b[j] : a[i];
        const Shape& second = swapped ? a[i] : b[j];
        if (!isConvex(second.kind)) {
            apart = 0;
            return;  // two static shapes
        }
        const Frame ownA = cull ? Frame{} : frameOf(a[i].pose);
        const Frame ownB = cull ? Frame{} : frameOf(b[j].pose);
        const Frame& poseA = cull ? partsA[i].pose : ownA;
        const Frame& poseB = cull ? partsB[j].pose : ownB;
        Frame roomAFromB, roomBFromA, roomBoth;
        const Frame& bodyAFromB = product(bodies, poseB, roomAFromB);
        const Frame& bodyBFromA = product(bodiesBack, poseA, roomBFromA);
        const Frame back = (swapped ? poseB : poseA).inverse();
        const OrderedPair pair{.first = first,
                               .second = second,
                               .swapped = swapped,
                               .firstFromSecond = product(back, swapped ? bodyBFromA : bodyAFromB, roomBoth),
                               .bodyAFromFirst = swapped ? bodyAFromB : poseA,
                               .bodyBFromFirst = swapped ? poseB : bodyBFromA};
        PairCache::Entry* last = remembers(pair) ? &entryOf(cache, i, j, cursor) : nullptr;
        const Vec3d lastNormal =
            last != nullptr ? Vec3d(pair.bodyAFromFirst.rotation.transpose() * last->normal) : Vec3d(Vec3d::Zero());
        ++counts.calls;
        const std::vector<WorkManifold>& manifolds = answer(pair, margin, which, lastNormal, counts, apart);
        for (const WorkManifold& m : manifolds) {
            appendInBodies(m, pair, i, j, out);
        }
        if (last != nullptr) {
            last->normal = manifolds.empty() ? Vec3d(Vec3d::Zero()) : out.back().normal;
        }
    };
    if (bodyA.tree != nullptr || bodyB.tree != nullptr) {
        static thread_local std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
        pairs.clear();
        findPairs(bodyA, bodyB, partsA, partsB, bodies, bodiesBack, reach.all, pairs);
        // Those that are not found are no nearer.
        apart = pairs.size() < a.size() * b.size() ? reach.leastOfAll() : infinity;
        for (const auto& [i, j] : pairs) {
            askParts(i, j);
        }
        return apart;
    }
    for (std::uint32_t i = 0; i < a.size(); ++i) {
        for (std::uint32_t j = 0; j < b.size(); ++j) {
            askParts(i, j);
        }
    }
    return apart;
}

double projectedOverlap(const Shape& a, const Shape& b, const Posed& aFromB, const Vec3d& n) {
    // How far the shape reaches along a direction of its body's frame.
    const auto reach = [](const Shape& shape, const Vec3d& direction) {
        int hint = 0;
        return direction.dot(shape.pose.position) +
               supportDistance(makeConvex(shape), turned(shape.pose.rotation.conjugate(), direction), hint);
    };
    return reach(a, n) + reach(b, turned(aFromB.rotation.conjugate(), -n)) - n.dot(aFromB.position);
}

std::array<int, 4> matchPoints(const Manifold& before, const Manifold& now, double maxDistance) {
    std::array<int, 4> match{-1, -1, -1, -1};
    std::array<bool, 4> taken{};
    for (int k = 0; k < now.count; ++k) {
        for (int i = 0; i < before.count; ++i) {
            const auto ui = static_cast<std::size_t>(i);
            if (!taken[ui] && before.points[ui].feature == now.points[static_cast<std::size_t>(k)].feature) {
                match[static_cast<std::size_t>(k)] = i;
                taken[ui] = true;
                break;
            }
        }
    }
    // The nearest pair first, so that the answer does not hang on the order of the points.
    for (int pass = 0; pass < 4; ++pass) {
        double nearest = maxDistance * maxDistance;
        int bestNow = -1;
        int bestBefore = -1;
        for (int k = 0; k < now.count; ++k) {
            for (int i = 0; i < before.count; ++i) {
                const auto uk = static_cast<std::size_t>(k);
                const auto ui = static_cast<std::size_t>(i);
                if (match[uk] >= 0 || taken[ui]) {
                    continue;
                }
                const double squared = (now.points[uk].onA - before.points[ui].onA).squaredNorm();
                if (squared <= nearest) {
                    nearest = squared;
                    bestNow = k;
                    bestBefore = i;
                }
            }
        }
        if (bestNow < 0) {
            break;
        }
        match[static_cast<std::size_t>(bestNow)] = bestBefore;
        taken[static_cast<std::size_t>(bestBefore)] = true;
    }
    return match;
}

}  // namespace cairn
