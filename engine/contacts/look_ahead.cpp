#include "engine/contacts/look_ahead.hpp"

#include "base/parallel.hpp"
#include "engine/contacts/internal_edges.hpp"

#include <algorithm>

namespace cairn {
namespace {

// m: what gets as deep in another that no contact told of is worth one: less than continuous collision would hold back.
template <class S>
S surprise(const Body<S>& a, const Body<S>& b) {
    double depth = 0.01;
    for (const Body<S>* body : {&a, &b}) {
        constexpr double share = 0.2;
        const double thick = body->kind->innerRadius;  // m; 0 of a surface
        depth = thick > 0 ? std::min(depth, share * thick) : depth;
    }
    return static_cast<S>(depth);
}

// Whether a manifold found farther on the way of a pair is deep there, at points that the pair does not know.
template <class S>
bool isSurprise(const PairContacts<S>& pair, const ContactManifold<S>& manifold, const Body<S>& a, const Body<S>& b) {
    const S depth = surprise(a, b);
    const auto points = manifold.inForce();
    return std::any_of(points.begin(), points.end(),
                       [&](const ContactPointState<S>& point) { return point.separation < -depth; }) &&
           std::any_of(points.begin(), points.end(), [&](const ContactPointState<S>& point) {
               return point.separation < S(0) && !pair.knows(manifold, point);
           });
}

// Times surprise(), how deep bodies must be headed for to be asked. Piles of 2000 mixed bodies and of 1280 hulls have
// 365 and 4 pairs deeper than 5 cm in a run at 1, which is 7 % of their steps; 247 and 8 at 2.5, for 1 and 6 %; without
// a look 1014 and 68.
constexpr double worthALook = 2.5;

// m: how far the points that matter of the smaller body go against the other one in dt.
template <class S>
double displacement(const Body<S>& a, const Body<S>& b, S dt) {
    const bool isA = a.kind->radius < b.kind->radius;
    const Body<S>& small = isA ? a : b;
    const Body<S>& other = isA ? b : a;
    const Vec3<S> along = other.v + other.w.cross(small.pose.position - other.pose.position);
    return static_cast<double>(dt) * (static_cast<double>((small.v - along).norm()) +
                                      static_cast<double>((small.w - other.w).norm()) * small.kind->turningRadius);
}

template <class S>
bool mayMeet(const PairContacts<S>& pair, const Body<S>& a, const Body<S>& b, S dt) {
    const double distance = displacement(a, b, dt);
    // How thin the ground is does not matter: of one body all its pieces are looked at, or none.
    const bool isOfGround = a.isDynamic() != b.isDynamic();
    const Body<S>& mover = a.isDynamic() ? a : b;
    const S enough = isOfGround ? surprise(mover, mover) : surprise(a, b);
    return distance > worthALook * static_cast<double>(enough) && !(pair.manifolds.empty() && distance <= pair.apart);
}

// Where its own motion leads in dt.
template <class S>
PairSide<S> sideAfter(const Body<S>& body, S dt) {
    PairSide<S> side = presentSide(body);
    side.pose.position += dt * body.v;
    side.pose.rotation = rotated<S>(body.pose.rotation, dt * body.w);
    return side;
}

// Whether the known normal, as either body carries it, tells that neither gets deep in the other there.
template <class S>
bool staysOut(const PairContacts<S>& pair, const Body<S>& a, const Body<S>& b, const Posed& aFromB) {
    const std::vector<Shape>& shapesA = a.kind->def.shapes;
    const std::vector<Shape>& shapesB = b.kind->def.shapes;
    if (pair.manifolds.size() != 1 || shapesA.size() != 1 || shapesB.size() != 1 || !isConvex(shapesA[0].kind) ||
        !isConvex(shapesB[0].kind)) {
        return false;
    }
    const ContactManifold<S>& manifold = pair.manifolds[0];
    const auto overlap = [&](const Vec3d& normal) { return projectedOverlap(shapesA[0], shapesB[0], aFromB, normal); };
    const double deep = worthALook * static_cast<double>(surprise(a, b));
    return overlap(manifold.normal) <= deep || overlap(turned(aFromB.rotation, manifold.normalInB)) <= deep;
}

// Takes what is deep there over into the pair, but for points that lie deeper where the bodies are than the pair does:
// they tell of what would have gone through to the other side.
template <class S>
void takeOver(const PairContacts<S>& there, PairContacts<S>& pair, const Body<S>& a, const Body<S>& b) {
    const S deepest = static_cast<S>(-pair.depth());
    for (const ContactManifold<S>& manifold : there.manifolds) {
        if (!isSurprise(pair, manifold, a, b)) {
            continue;
        }
        foreseeManifold(pair, manifold, presentSide(a), presentSide(b));
        ContactManifold<S>& taken = pair.manifolds.back();
        const auto points = taken.inForce();
        const auto end = std::remove_if(points.begin(), points.end(),
                                        [&](const ContactPointState<S>& point) { return point.separation < deepest; });
        taken.count = static_cast<std::uint8_t>(end - points.begin());
        taken.known = taken.count;
        if (taken.count == 0) {
            pair.manifolds.pop_back();
        }
    }
}

}  // namespace

template <class S>
void foreseeContacts(ContactTable<S>& contacts, std::span<const std::uint32_t> pairs, const BodyTable<S>& bodies, S dt,
                     NarrowPhase narrowPhase, JobSystem& jobs, NarrowCounts& counts) {
    // Kept by the thread that leads, and filled by all.
    static thread_local std::vector<std::uint32_t> askedRoom;
    static thread_local std::vector<std::uint8_t> isAskedRoom;
    static thread_local std::vector<PairContacts<S>> foundRoom;
    static thread_local std::vector<NarrowCounts> countsRoom;
    static thread_local std::vector<GroundPair<S>> ground;
    std::vector<std::uint32_t>& asked = askedRoom;
    std::vector<std::uint8_t>& isAsked = isAskedRoom;
    std::vector<PairContacts<S>>& found = foundRoom;
    std::vector<NarrowCounts>& countsOf = countsRoom;
    constexpr std::size_t grain = 64;
    const auto there = [&](std::uint32_t body) { return sideAfter(bodies[body], dt); };
    isAsked.resize(pairs.size());
    parallelFor(jobs, pairs.size(), grain, [&](std::size_t k) {
        const PairContacts<S>& pair = contacts.pairs()[pairs[k]];
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        isAsked[k] = mayMeet(pair, a, b, dt) &&
                     !staysOut(pair, a, b, relativePose(there(pair.pair.a).frame(), there(pair.pair.b).frame()));
    });
    asked.clear();
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        if (isAsked[k] != 0) {
            asked.push_back(pairs[k]);
        }
    }
    found.resize(asked.size());
    countsOf.assign(asked.size(), {});
    parallelFor(jobs, asked.size(), grain, [&](std::size_t k) {
        const PairContacts<S>& pair = contacts.pairs()[asked[k]];
        PairContacts<S>& met = found[k];
        met.pair = pair.pair;
        met.cache = pair.cache;
        met.manifolds.clear();
        met.made = false;
        collidePair<S>(met, there(pair.pair.a), there(pair.pair.b), {.narrowPhase = narrowPhase}, countsOf[k]);
    });
    ground.clear();
    for (std::size_t k = 0; k < asked.size(); ++k) {
        counts += countsOf[k];
        addGroundPair(ground, found[k], bodies[found[k].pair.a], bodies[found[k].pair.b]);
    }
    cullInternalEdges<S>(ground, there);
    for (std::size_t k = 0; k < asked.size(); ++k) {
        takeOver(found[k], contacts.pairs()[asked[k]], bodies[found[k].pair.a], bodies[found[k].pair.b]);
    }
}

template void foreseeContacts(ContactTable<float>&, std::span<const std::uint32_t>, const BodyTable<float>&, float,
                              NarrowPhase, JobSystem&, NarrowCounts&);
template void foreseeContacts(ContactTable<double>&, std::span<const std::uint32_t>, const BodyTable<double>&, double,
                              NarrowPhase, JobSystem&, NarrowCounts&);

}  // namespace cairn
