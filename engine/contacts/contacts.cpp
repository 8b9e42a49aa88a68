#include "engine/contacts/seams.hpp"

#include <algorithm>

namespace cairn {
namespace {

// How far the smaller of two bodies has moved against the other since their manifold was made: no point of it farther
// than this, m.
template <class S>
double movedSince(const PairContacts<S>& pair, const Posed& aFromB, const Body<S>& a, const Body<S>& b) {
    const bool fromB = a.radius < b.radius;
    const Body<S>& small = fromB ? a : b;
    const Vec3d centre = small.localCentre.template cast<double>();
    const Vec3d way = fromB ? Vec3d(aFromB.inverse() * centre - pair.aFromB.inverse() * centre)
                            : Vec3d(aFromB * centre - pair.aFromB * centre);
    return way.norm() + 2 * (pair.aFromB.rotation.conjugate() * aFromB.rotation).vec().norm() * small.radius;
}

// m. Where something rolls, the point that touches wanders off the known one, and a separation that is too small by the
// square of the way would drive it: such pairs must stand still. Small bodies move less before it counts.
template <class S>
double stillBound(const PairContacts<S>& pair, double wanted, double smallerRadius) {
    constexpr double rolling = 1e-6;
    constexpr double ofRadius = 1e-3;
    double bound = std::min(wanted, ofRadius * smallerRadius);
    for (const ContactPatch<S>& patch : pair.patches) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(patch.manifold.count); ++k) {
            const ContactGeometry<S>& geometry = patch.points[k].geometry;
            if (!geometry.roundA.isZero(S(0)) || !geometry.roundB.isZero(S(0))) {
                bound = std::min(bound, rolling);
            }
        }
    }
    return bound;
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
                          ContactPatch<S>* before) {
    ContactPatch<S> patch;
    patch.manifold = manifold;
    patch.known = manifold.count;
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
            ContactPointState<S>& old = before->points[static_cast<std::size_t>(match[k])];
            state = old;
            old.handedOn = true;
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

// m/s: spins count by the smaller body's size, so that a spinning floor reaches no further than what stands on it.
template <class S>
double turningSpeed(const PairSide<S>& a, const PairSide<S>& b) {
    const double radius = std::min(a.body->radius, b.body->radius);
    return std::isfinite(radius) ? static_cast<double>(a.w.norm() + b.w.norm()) * radius : 0;
}

// The gap that a and b can close within dt, also where something else stops one of them: of two balls that fall
// together the lower one meets the floor first. A fast body is swept: contacts far ahead of it would stop it at what it
// only passes.
template <class S>
double closing(const PairSide<S>& a, const PairSide<S>& b, double dt) {
    const S speed = std::max({(a.v - b.v).norm(), a.v.norm(), b.v.norm()});
    double gap = dt * (static_cast<double>(speed) + turningSpeed(a, b));
    for (const PairSide<S>* side : {&a, &b}) {
        const Body<S>& body = *side->body;
        const double way =
            dt * (static_cast<double>(side->v.norm()) + static_cast<double>(side->w.norm()) * body.turningRadius);
        if (way > body.fastWay) {
            gap = std::min(gap, body.radius);
        }
    }
    return gap;
}

// m/s, at which a and b can come together along n (from a to b, world), one of them stopped or not.
template <class S>
double approach(const PairSide<S>& a, const PairSide<S>& b, const Vec3d& n) {
    const double va = n.dot(a.v.template cast<double>());
    const double vb = -n.dot(b.v.template cast<double>());
    return std::max({va + vb, va, vb, 0.0}) + turningSpeed(a, b);
}

}  // namespace

template <class S>
void PairContacts<S>::beginStep() {
    ended.clear();
    for (ContactPatch<S>& patch : patches) {
        for (ContactPointState<S>& point : patch.points) {
            point.impulse.setZero();
            point.normalImpulse = S(0);
        }
    }
}

template <class S>
void PairContacts<S>::endPoints(const ContactPatch<S>& patch, const Pose<S>& a, const Pose<S>& b) {
    for (const ContactPointState<S>& point : patch.points) {
        if (point.handedOn || point.impulse.isZero(S(0))) {
            continue;
        }
        EndedContact& end = ended.emplace_back();
        end.point = (S(0.5) * (a * point.geometry.onA + b * point.geometry.onB)).template cast<double>();
        end.normal = point.geometry.direction(a, b).template cast<double>();
        end.impulse = point.impulse.template cast<double>();
        end.normalImpulse = static_cast<double>(point.normalImpulse);
        end.shapeA = patch.manifold.shapeA;
        end.shapeB = patch.manifold.shapeB;
        end.friction = static_cast<double>(patch.friction);
        end.staticFriction = static_cast<double>(patch.staticFriction);
        end.restitution = static_cast<double>(patch.restitution);
    }
}

template <class S>
bool collidePair(PairContacts<S>& pair, const PairSide<S>& a, const PairSide<S>& b, const ContactReach& reach,
                 NarrowCounts& counts) {
    const Posed frameA = a.frame();
    const Posed frameB = b.frame();
    const Posed aFromB = relativePose(frameA, frameB);
    const double ahead = closing(a, b, reach.dt);
    pair.before.clear();
    if (pair.made) {
        // What lies within reach of this step must be among the known points.
        const double moved = movedSince(pair, aFromB, *a.body, *b.body);
        if (moved <= stillBound(pair, reach.still, std::min(a.body->radius, b.body->radius)) &&
            moved + ahead <= pair.margin) {
            for (ContactPatch<S>& patch : pair.patches) {
                for (std::size_t k = 0; k < static_cast<std::size_t>(patch.known); ++k) {
                    patch.points[k].separation = patch.points[k].geometry.separation(a.pose, b.pose);
                }
            }
            return false;
        }
    }
    const double margin = reach.margin + ahead;
    static thread_local std::vector<Manifold> manifolds;
    manifolds.clear();
    collide(a.body->def.shapes, b.body->def.shapes, aFromB, margin, pair.cache, manifolds, counts);
    // What is beside the motion cannot be met.
    double known = margin;
    std::erase_if(manifolds, [&](const Manifold& manifold) {
        double least = infinity<double>();
        for (int k = 0; k < manifold.count; ++k) {
            least = std::min(least, manifold.points[static_cast<std::size_t>(k)].separation);
        }
        const bool beside = least > reach.margin + reach.dt * approach(a, b, frameA.rotation * manifold.normal);
        known = beside ? std::min(known, least) : known;
        return beside;
    });
    std::vector<ContactPatch<S>> patches;
    patches.reserve(manifolds.size());
    for (const Manifold& manifold : manifolds) {
        ContactPatch<S>* before = nullptr;
        for (ContactPatch<S>& old : pair.patches) {
            if (old.manifold.shapeA == manifold.shapeA && old.manifold.shapeB == manifold.shapeB &&
                old.manifold.patch == manifold.patch) {
                before = &old;
            }
        }
        const Vec3d normalInB = relativePose(frameB, frameA).rotation * manifold.normal;
        patches.push_back(makePatch(manifold, *a.body, *b.body, normalInB, before));
    }
    for (const ContactPatch<S>& old : pair.patches) {
        pair.endPoints(old, a.pose, b.pose);
    }
    for (ContactPatch<S>& patch : patches) {
        for (ContactPointState<S>& point : patch.points) {
            point.geometry.startStep(a.pose, b.pose);
        }
    }
    pair.before = std::move(pair.patches);
    pair.patches = std::move(patches);
    pair.aFromB = aFromB;
    pair.margin = known;
    pair.made = true;
    return true;
}

template <class S>
void ContactTable<S>::update(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, const ContactReach& reach,
                             JobSystem& jobs, bool onlyChanged) {
    const auto drop = [&](PairContacts<S>& pair) {
        const Pose<S>& a = bodies[pair.pair.a].pose;
        const Pose<S>& b = bodies[pair.pair.b].pose;
        for (const ContactPatch<S>& patch : pair.patches) {
            pair.endPoints(patch, a, b);
        }
        if (!pair.ended.empty()) {
            gone_.push_back(std::move(pair));
        }
    };
    next_.clear();
    next_.reserve(near.size());
    auto old = pairs_.begin();
    for (const ProxyPair& pair : near) {
        while (old != pairs_.end() && old->pair < pair) {
            drop(*old++);
        }
        if (old != pairs_.end() && old->pair == pair) {
            next_.push_back(std::move(*old++));
        } else {
            next_.emplace_back().pair = pair;
        }
    }
    while (old != pairs_.end()) {
        drop(*old++);
    }
    pairs_.swap(next_);

    countsOf_.assign(pairs_.size(), {});
    isCarried_.assign(pairs_.size(), 0);
    parallelFor(jobs, pairs_.size(), 32, [&](std::size_t i) {
        PairContacts<S>& pair = pairs_[i];
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        const bool moves =
            onlyChanged ? a.changed || b.changed
                        : (a.awake && a.def.type != BodyType::Static) || (b.awake && b.def.type != BodyType::Static);
        if (moves || !pair.made) {
            const bool anew = collidePair<S>(pair, {&a, a.pose, a.v, a.w}, {&b, b.pose, b.v, b.w}, reach, countsOf_[i]);
            isCarried_[i] = anew ? 0 : 1;
        }
    });
    ground_.clear();
    for (PairContacts<S>& pair : pairs_) {
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        if (onlyChanged && !a.changed && !b.changed) {
            continue;
        }
        addGroundPair<S>(ground_, pair, {&a, a.pose, a.v, a.w}, {&b, b.pose, b.v, b.w});
    }
    closeSeams(ground_, jobs);
    counts_ = {};
    carried_ = static_cast<int>(std::count(isCarried_.begin(), isCarried_.end(), 1));
    for (const NarrowCounts& c : countsOf_) {
        counts_ += c;
    }
}

template <class S>
void ContactTable<S>::forget(ProxyId body) {
    std::erase_if(pairs_, [&](const PairContacts<S>& p) { return p.pair.a == body || p.pair.b == body; });
}

template struct PairContacts<float>;
template struct PairContacts<double>;
template bool collidePair(PairContacts<float>&, const PairSide<float>&, const PairSide<float>&, const ContactReach&,
                          NarrowCounts&);
template bool collidePair(PairContacts<double>&, const PairSide<double>&, const PairSide<double>&, const ContactReach&,
                          NarrowCounts&);
template class ContactTable<float>;
template class ContactTable<double>;

}  // namespace cairn
