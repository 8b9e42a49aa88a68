#include <cairn/engine/contacts.hpp>

namespace cairn {
namespace {

// A pair whose bodies moved less than this against each other, m and rad, since its manifold was made keeps it;
// separations are carried by the anchors, so that the error is of second order in it.
constexpr double stillMotion = 1e-6;

bool isStill(const Posed& before, const Posed& now) {
    return (before.position - now.position).cwiseAbs().maxCoeff() < stillMotion &&
           (before.rotation.coeffs() - now.rotation.coeffs()).cwiseAbs().maxCoeff() < stillMotion;
}

template <class S>
S combined(double a, double b) {
    return static_cast<S>(std::sqrt(a * b));
}

double staticFriction(const Material& m) {
    return std::max(m.friction, m.staticFriction);
}

// The part of a contact point's arm that does not turn with a shape which rolls over it (ContactGeometry): along the
// normal, from the centre or the axis of the round; 0 where the surface is flat. Body frame; the normal of either
// sense.
Vec3d roundPart(const Shape& shape, const Vec3d& point, const Vec3d& normal) {
    const Vec3d axis = shape.pose.rotation * Vec3d::UnitY();
    const Vec3d arm = point - shape.pose.position;
    switch (shape.kind) {
        case ShapeKind::Sphere:
        case ShapeKind::Ellipsoid:
            return arm.dot(normal) * normal;
        case ShapeKind::Capsule: {
            const double halfHeight = shape.size.y();
            return (arm - std::clamp(arm.dot(axis), -halfHeight, halfHeight) * axis).dot(normal) * normal;
        }
        case ShapeKind::Cylinder:
        case ShapeKind::Cone: {
            const Vec3d across = normal - normal.dot(axis) * axis;
            // Under this it stands on its flat end.
            return across.squaredNorm() > 0.19 ? Vec3d(arm.dot(across) / across.squaredNorm() * normal)
                                               : Vec3d(Vec3d::Zero());
        }
        default:
            return Vec3d::Zero();
    }
}

template <class S>
ContactPatch<S> makePatch(const Manifold& manifold, const Body<S>& a, const Body<S>& b, const Vec3d& normalInB,
                          const ContactPatch<S>* before) {
    ContactPatch<S> patch;
    patch.manifold = manifold;
    const Material& materialA = a.def.shapes[manifold.shapeA].material;
    const Material& materialB = b.def.shapes[manifold.shapeB].material;
    patch.friction = combined<S>(materialA.friction, materialB.friction);
    patch.staticFriction = combined<S>(staticFriction(materialA), staticFriction(materialB));
    patch.restitution = static_cast<S>(std::max(materialA.restitution, materialB.restitution));
    const std::array<int, 4> match =
        before != nullptr ? matchPoints(before->manifold, manifold) : std::array<int, 4>{-1, -1, -1, -1};
    for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.count); ++k) {
        const ContactPoint& point = manifold.points[k];
        ContactPointState<S>& state = patch.points[k];
        if (match[k] >= 0) {
            state = before->points[static_cast<std::size_t>(match[k])];
        }
        state.geometry.onA = point.onA.cast<S>() - a.localCentre;
        state.geometry.onB = point.onB.cast<S>() - b.localCentre;
        state.geometry.particleA = a.def.particle;
        state.geometry.particleB = b.def.particle;
        state.geometry.roundA = roundPart(a.def.shapes[manifold.shapeA], point.onA, manifold.normal).template cast<S>();
        state.geometry.roundB = roundPart(b.def.shapes[manifold.shapeB], point.onB, normalInB).template cast<S>();
        state.geometry.normal = (state.geometry.carriedByB() ? normalInB : manifold.normal).template cast<S>();
        state.separation = static_cast<S>(point.separation);
    }
    return patch;
}

// The gap that a and b can close within dt; spins count by the smaller body's size, so that a spinning floor reaches no
// further than what stands on it.
template <class S>
double closing(const PairSide<S>& a, const PairSide<S>& b, double dt) {
    const double radius = std::min(a.body->radius, b.body->radius);
    const double spin = static_cast<double>(a.w.norm() + b.w.norm());
    return dt * (static_cast<double>((a.v - b.v).norm()) + (std::isfinite(radius) ? spin * radius : 0));
}

}  // namespace

template <class S>
void collidePair(PairContacts<S>& pair, const PairSide<S>& a, const PairSide<S>& b, const ContactReach& reach,
                 NarrowCounts& counts) {
    const Posed frameA = a.frame();
    const Posed frameB = b.frame();
    const Posed aFromB = relativePose(frameA, frameB);
    const double margin = reach.margin + closing(a, b, reach.dt);
    // What stands still but is about to be thrown must be looked for further out.
    const bool reached = margin <= pair.margin + 0.1 * reach.margin;
    if (pair.made && reached && isStill(pair.aFromB, aFromB)) {
        return;
    }
    static thread_local std::vector<Manifold> manifolds;
    manifolds.clear();
    collide(a.body->def.shapes, b.body->def.shapes, aFromB, margin, pair.cache, manifolds, counts);
    std::vector<ContactPatch<S>> patches;
    patches.reserve(manifolds.size());
    for (const Manifold& manifold : manifolds) {
        const ContactPatch<S>* before = nullptr;
        for (const ContactPatch<S>& old : pair.patches) {
            if (old.manifold.shapeA == manifold.shapeA && old.manifold.shapeB == manifold.shapeB &&
                old.manifold.patch == manifold.patch) {
                before = &old;
            }
        }
        const Vec3d normalInB = relativePose(frameB, frameA).rotation * manifold.normal;
        patches.push_back(makePatch(manifold, *a.body, *b.body, normalInB, before));
    }
    pair.patches = std::move(patches);
    pair.aFromB = aFromB;
    pair.margin = margin;
    pair.made = true;
}

template <class S>
void ContactTable<S>::update(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, const ContactReach& reach,
                             JobSystem& jobs) {
    next_.clear();
    next_.reserve(near.size());
    auto old = pairs_.begin();
    for (const ProxyPair& pair : near) {
        while (old != pairs_.end() && old->pair < pair) {
            ++old;
        }
        if (old != pairs_.end() && old->pair == pair) {
            next_.push_back(std::move(*old));
        } else {
            next_.emplace_back().pair = pair;
        }
    }
    pairs_.swap(next_);

    std::vector<NarrowCounts> counts(pairs_.size());
    parallelFor(jobs, pairs_.size(), 32, [&](std::size_t i) {
        PairContacts<S>& pair = pairs_[i];
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        const bool moves = (a.awake && a.def.type != BodyType::Static) || (b.awake && b.def.type != BodyType::Static);
        if (moves || !pair.made) {
            collidePair<S>(pair, {&a, a.pose, a.v, a.w}, {&b, b.pose, b.v, b.w}, reach, counts[i]);
        }
    });
    counts_ = {};
    for (const NarrowCounts& c : counts) {
        counts_ += c;
    }
}

template <class S>
void ContactTable<S>::forget(ProxyId body) {
    std::erase_if(pairs_, [&](const PairContacts<S>& p) { return p.pair.a == body || p.pair.b == body; });
}

template void collidePair(PairContacts<float>&, const PairSide<float>&, const PairSide<float>&, const ContactReach&,
                          NarrowCounts&);
template void collidePair(PairContacts<double>&, const PairSide<double>&, const PairSide<double>&, const ContactReach&,
                          NarrowCounts&);
template class ContactTable<float>;
template class ContactTable<double>;

}  // namespace cairn
