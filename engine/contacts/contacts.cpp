#include "engine/contacts/internal_edges.hpp"

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
    const Vec3d displacement = fromB ? Vec3d(aFromB.inverse() * centre - pair.aFromB.inverse() * centre)
                                     : Vec3d(aFromB * centre - pair.aFromB * centre);
    return displacement.norm() + 2 * (pair.aFromB.rotation.conjugate() * aFromB.rotation).vec().norm() * small.radius;
}

// m. Where something rolls, the point that touches wanders off the known one, and a separation that is too small by the
// square of the displacement would drive it: such pairs must stand still. Small bodies move less before it counts.
template <class S>
double reuseBound(const PairContacts<S>& pair, double wanted, double smallerRadius) {
    constexpr double rolling = 1e-6;
    constexpr double ofRadius = 1e-3;
    double bound = std::min(wanted, ofRadius * smallerRadius);
    for (const ContactManifold<S>& manifold : pair.manifolds) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.geometry.count); ++k) {
            const ContactGeometry<S>& geometry = manifold.points[k].geometry;
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
ContactManifold<S> makeManifold(const Manifold& geometry, const Body<S>& a, const Body<S>& b, const Vec3d& normalInB,
                                ContactManifold<S>* before) {
    ContactManifold<S> manifold;
    manifold.geometry = geometry;
    manifold.known = geometry.count;
    const Material& materialA = a.def.shapes[geometry.shapeA].material;
    const Material& materialB = b.def.shapes[geometry.shapeB].material;
    manifold.friction = combined<S>(materialA.friction, materialB.friction);
    manifold.staticFriction = combined<S>(staticFriction(materialA), staticFriction(materialB));
    manifold.restitution = static_cast<S>(std::max(materialA.restitution, materialB.restitution));
    const std::array<int, 4> match =
        before != nullptr ? matchPoints(before->geometry, geometry) : std::array<int, 4>{-1, -1, -1, -1};
    for (std::size_t k = 0; k < static_cast<std::size_t>(geometry.count); ++k) {
        const ContactPoint& point = geometry.points[k];
        ContactPointState<S>& state = manifold.points[k];
        if (match[k] >= 0) {
            ContactPointState<S>& old = before->points[static_cast<std::size_t>(match[k])];
            state = old;
            old.forcesTransferred = true;
        }
        state.geometry.onA = point.onA.cast<S>() - a.localCentre;
        state.geometry.onB = point.onB.cast<S>() - b.localCentre;
        state.geometry.particleA = a.def.particle;
        state.geometry.particleB = b.def.particle;
        state.geometry.roundA = roundPart(a.def.shapes[geometry.shapeA], point.onA, geometry.normal).template cast<S>();
        state.geometry.roundB = roundPart(b.def.shapes[geometry.shapeB], point.onB, normalInB).template cast<S>();
        state.geometry.normal = (state.geometry.carriedByB() ? normalInB : geometry.normal).template cast<S>();
        state.separation = static_cast<S>(point.separation);
    }
    return manifold;
}

// m/s: spins count by the smaller body's size, so that a spinning floor reaches no further than what stands on it.
template <class S>
double turningSpeed(const PairSide<S>& a, const PairSide<S>& b) {
    const double radius = std::min(a.body->radius, b.body->radius);
    return std::isfinite(radius) ? static_cast<double>(a.w.norm() + b.w.norm()) * radius : 0;
}

// The gap that a and b can close within dt, also where something else stops one of them: of two balls that fall
// together the lower one meets the floor first. A fast body has continuous collision: contacts far ahead of it would
// stop it at what it only passes.
template <class S>
double closing(const PairSide<S>& a, const PairSide<S>& b, double dt) {
    const S speed = std::max({(a.v - b.v).norm(), a.v.norm(), b.v.norm()});
    double gap = dt * (static_cast<double>(speed) + turningSpeed(a, b));
    for (const PairSide<S>* side : {&a, &b}) {
        const Body<S>& body = *side->body;
        const double displacement =
            dt * (static_cast<double>(side->v.norm()) + static_cast<double>(side->w.norm()) * body.turningRadius);
        if (displacement > body.ccdDistance) {
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
int PairContacts<S>::pointCount() const {
    int count = 0;
    for (const ContactManifold<S>& manifold : manifolds) {
        count += manifold.geometry.count;
    }
    return count;
}

template <class S>
void PairContacts<S>::beginStep() {
    ended.clear();
    for (ContactManifold<S>& manifold : manifolds) {
        for (ContactPointState<S>& point : manifold.points) {
            point.impulse.setZero();
            point.normalImpulse = S(0);
        }
    }
}

template <class S>
void PairContacts<S>::endPoints(const ContactManifold<S>& manifold, const Pose<S>& a, const Pose<S>& b) {
    for (const ContactPointState<S>& point : manifold.points) {
        if (point.forcesTransferred || point.impulse.isZero(S(0))) {
            continue;
        }
        EndedContact& end = ended.emplace_back();
        end.point = (S(0.5) * (a * point.geometry.onA + b * point.geometry.onB)).template cast<double>();
        end.normal = point.geometry.direction(a, b).template cast<double>();
        end.impulse = point.impulse.template cast<double>();
        end.normalImpulse = static_cast<double>(point.normalImpulse);
        end.shapeA = manifold.geometry.shapeA;
        end.shapeB = manifold.geometry.shapeB;
        end.friction = static_cast<double>(manifold.friction);
        end.staticFriction = static_cast<double>(manifold.staticFriction);
        end.restitution = static_cast<double>(manifold.restitution);
    }
}

template <class S>
bool collidePair(PairContacts<S>& pair, const PairSide<S>& a, const PairSide<S>& b,
                 const SpeculativeBounds& speculative, NarrowCounts& counts) {
    const Posed frameA = a.frame();
    const Posed frameB = b.frame();
    const Posed aFromB = relativePose(frameA, frameB);
    const double ahead = closing(a, b, speculative.dt);
    pair.before.clear();
    if (pair.made) {
        // What lies within the speculative bounds of this step must be among the known points.
        const double moved = movedSince(pair, aFromB, *a.body, *b.body);
        if (moved <= reuseBound(pair, speculative.reuseDistance, std::min(a.body->radius, b.body->radius)) &&
            moved + ahead <= pair.margin) {
            for (ContactManifold<S>& manifold : pair.manifolds) {
                for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.known); ++k) {
                    manifold.points[k].separation = manifold.points[k].geometry.separation(a.pose, b.pose);
                }
            }
            return false;
        }
    }
    const double margin = speculative.margin + ahead;
    static thread_local std::vector<Manifold> found;
    found.clear();
    collide(a.body->def.shapes, b.body->def.shapes, aFromB, margin, pair.cache, found, counts);
    // What is beside the motion cannot be met.
    double known = margin;
    std::erase_if(found, [&](const Manifold& geometry) {
        double smallest = infinity<double>();
        for (int k = 0; k < geometry.count; ++k) {
            smallest = std::min(smallest, geometry.points[static_cast<std::size_t>(k)].separation);
        }
        const bool beside =
            smallest > speculative.margin + speculative.dt * approach(a, b, frameA.rotation * geometry.normal);
        known = beside ? std::min(known, smallest) : known;
        return beside;
    });
    std::vector<ContactManifold<S>> manifolds;
    manifolds.reserve(found.size());
    for (const Manifold& geometry : found) {
        ContactManifold<S>* before = nullptr;
        for (ContactManifold<S>& old : pair.manifolds) {
            if (old.geometry.shapeA == geometry.shapeA && old.geometry.shapeB == geometry.shapeB &&
                old.geometry.id == geometry.id) {
                before = &old;
            }
        }
        const Vec3d normalInB = relativePose(frameB, frameA).rotation * geometry.normal;
        manifolds.push_back(makeManifold(geometry, *a.body, *b.body, normalInB, before));
    }
    for (const ContactManifold<S>& old : pair.manifolds) {
        pair.endPoints(old, a.pose, b.pose);
    }
    for (ContactManifold<S>& manifold : manifolds) {
        for (ContactPointState<S>& point : manifold.points) {
            point.geometry.startStep(a.pose, b.pose);
        }
    }
    pair.before = std::move(pair.manifolds);
    pair.manifolds = std::move(manifolds);
    pair.aFromB = aFromB;
    pair.margin = known;
    pair.made = true;
    return true;
}

template <class S>
void ContactTable<S>::update(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies,
                             const SpeculativeBounds& speculative, JobSystem& jobs, bool onlyChanged) {
    const auto rests = [&](std::uint32_t i) { return !bodies[i].awake || bodies[i].def.type == BodyType::Static; };
    const auto drop = [&](PairContacts<S>& pair) {
        if (rests(pair.pair.a) && rests(pair.pair.b)) {
            restingPoints_ += pair.pointCount();
            resting_.emplace(pair.pair, std::move(pair));
            return;
        }
        const Pose<S>& a = bodies[pair.pair.a].pose;
        const Pose<S>& b = bodies[pair.pair.b].pose;
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            pair.endPoints(manifold, a, b);
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
        } else if (const auto kept = resting_.find(pair); kept != resting_.end()) {
            restingPoints_ -= kept->second.pointCount();
            next_.push_back(std::move(kept->second));
            resting_.erase(kept);
        } else {
            next_.emplace_back().pair = pair;
        }
    }
    while (old != pairs_.end()) {
        drop(*old++);
    }
    pairs_.swap(next_);
    if (hasWoken_) {
        std::erase_if(resting_, [&](const auto& entry) {
            const bool isLeft = !rests(entry.first.a) || !rests(entry.first.b);
            restingPoints_ -= isLeft ? entry.second.pointCount() : 0;
            return isLeft;
        });
        hasWoken_ = false;
    }

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
            const bool anew =
                collidePair<S>(pair, {&a, a.pose, a.v, a.w}, {&b, b.pose, b.v, b.w}, speculative, countsOf_[i]);
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
    cullInternalEdges(ground_, jobs);
    counts_ = {};
    carried_ = static_cast<int>(std::count(isCarried_.begin(), isCarried_.end(), 1));
    for (const NarrowCounts& c : countsOf_) {
        counts_ += c;
    }
}

template <class S>
void ContactTable<S>::forget(ProxyId body) {
    std::erase_if(pairs_, [&](const PairContacts<S>& p) { return p.pair.a == body || p.pair.b == body; });
    std::erase_if(resting_, [&](const auto& entry) {
        const bool isOf = entry.first.a == body || entry.first.b == body;
        restingPoints_ -= isOf ? entry.second.pointCount() : 0;
        return isOf;
    });
}

template <class S>
std::vector<std::uint32_t> ContactTable<S>::restingNeighbours(std::uint32_t body) const {
    std::vector<std::uint32_t> others;
    for (const auto& [pair, contacts] : resting_) {
        if (!contacts.manifolds.empty() && (pair.a == body || pair.b == body)) {
            others.push_back(pair.a == body ? pair.b : pair.a);
        }
    }
    return others;
}

template struct PairContacts<float>;
template struct PairContacts<double>;
template bool collidePair(PairContacts<float>&, const PairSide<float>&, const PairSide<float>&,
                          const SpeculativeBounds&, NarrowCounts&);
template bool collidePair(PairContacts<double>&, const PairSide<double>&, const PairSide<double>&,
                          const SpeculativeBounds&, NarrowCounts&);
template class ContactTable<float>;
template class ContactTable<double>;

}  // namespace cairn
