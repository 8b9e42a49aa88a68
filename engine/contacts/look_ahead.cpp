#include "engine/contacts/look_ahead.hpp"

#include "engine/contacts/internal_edges.hpp"

#include <algorithm>

namespace cairn {
namespace {

// m: what gets as deep in another without a contact is worth one: less than continuous collision would hold back.
template <class S>
double surprise(const Body<S>& a, const Body<S>& b) {
    double depth = 0.01;
    for (const Body<S>* body : {&a, &b}) {
        constexpr double share = 0.2;
        const double thick = body->kind->innerRadius;  // m; 0 of a surface
        depth = thick > 0 ? std::min(depth, share * thick) : depth;
    }
    return depth;
}

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
    return distance > (isOfGround ? surprise(mover, mover) : surprise(a, b)) &&
           !(pair.manifolds.empty() && distance <= pair.apart);
}

template <class S>
PairSide<S> sideOf(const Body<S>& body, S dt) {
    PairSide<S> side{&body, body.pose, body.v, body.w};
    if (dt > S(0)) {
        side.pose.position += dt * body.v;
        side.pose.rotation = rotated<S>(body.pose.rotation, dt * body.w);
    }
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
    const double deep = surprise(a, b);
    return overlap(manifold.normal) <= deep || overlap(turned(aFromB.rotation, manifold.normalInB)) <= deep;
}

// Takes what is deep there over into the pair.
template <class S>
void takeOver(const PairContacts<S>& there, PairContacts<S>& pair, const Body<S>& a, const Body<S>& b) {
    const S deep = static_cast<S>(surprise(a, b));
    const std::size_t known = pair.manifolds.size();
    for (const ContactManifold<S>& manifold : there.manifolds) {
        const auto points = manifold.inForce();
        const bool isDeep = std::any_of(points.begin(), points.end(), [&](const ContactPointState<S>& point) {
            return point.separation < -deep;
        });
        if (isDeep) {
            foreseeManifold(pair, manifold, known, sideOf(a, S(0)), sideOf(b, S(0)));
        }
    }
}

}  // namespace

template <class S>
void foreseeContacts(ContactTable<S>& contacts, std::span<const std::uint32_t> pairs, const BodyTable<S>& bodies, S dt,
                     NarrowPhase narrowPhase, JobSystem* jobs, NarrowCounts& counts) {
    static thread_local std::vector<std::uint32_t> asked;
    static thread_local std::vector<PairContacts<S>> found;
    static thread_local std::vector<GroundPair<S>> ground;
    asked.clear();
    for (const std::uint32_t p : pairs) {
        const PairContacts<S>& pair = contacts.pairs()[p];
        if (mayMeet(pair, bodies[pair.pair.a], bodies[pair.pair.b], dt)) {
            asked.push_back(p);
        }
    }
    if (asked.empty()) {
        return;
    }
    const auto forEach = [&](auto&& body) {
        constexpr std::size_t grain = 32;
        if (jobs != nullptr) {
            parallelFor(*jobs, asked.size(), grain, body);
        } else {
            for (std::size_t k = 0; k < asked.size(); ++k) {
                body(k);
            }
        }
    };
    found.resize(std::max(found.size(), asked.size()));
    const auto side = [&](std::uint32_t body) { return sideOf(bodies[body], dt); };
    const SpeculativeBounds touching{.narrowPhase = narrowPhase};
    std::vector<NarrowCounts> countsOf(asked.size());
    forEach([&, found = found.data(), asked = asked.data(), countsOf = countsOf.data()](std::size_t k) {
        const PairContacts<S>& pair = contacts.pairs()[asked[k]];
        PairContacts<S>& there = found[k];
        there.pair = pair.pair;
        there.cache = pair.cache;
        there.manifolds.clear();
        there.made = false;
        const PlacedSide<S> a(side(pair.pair.a));
        const PlacedSide<S> b(side(pair.pair.b));
        if (!staysOut(pair, *a.body, *b.body, relativePose(a.place, b.place))) {
            collidePair(there, a, b, touching, countsOf[k]);
        }
    });
    ground.clear();
    for (std::size_t k = 0; k < asked.size(); ++k) {
        counts += countsOf[k];
        addGroundPair(ground, found[k], bodies[found[k].pair.a], bodies[found[k].pair.b]);
    }
    cullInternalEdges<S>(ground, side);
    for (std::size_t k = 0; k < asked.size(); ++k) {
        takeOver(found[k], contacts.pairs()[asked[k]], bodies[found[k].pair.a], bodies[found[k].pair.b]);
    }
}

template void foreseeContacts(ContactTable<float>&, std::span<const std::uint32_t>, const BodyTable<float>&, float,
                              NarrowPhase, JobSystem*, NarrowCounts&);
template void foreseeContacts(ContactTable<double>&, std::span<const std::uint32_t>, const BodyTable<double>&, double,
                              NarrowPhase, JobSystem*, NarrowCounts&);

}  // namespace cairn
