#include "engine/contacts/contacts.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// The point (frame B) in frame A, or with `inA` the point (frame A) in frame B.
Vec3d across(const Posed& aFromB, const Vec3d& point, bool inA) {
    // As the centre of mass of most bodies.
    const bool isOrigin = point.isZero(0);
    if (!inA) {
        return isOrigin ? aFromB.position : Vec3d(aFromB.position + turned(aFromB.rotation, point));
    }
    const Quatd back = aFromB.rotation.conjugate();
    const Vec3d origin = -turned(back, aFromB.position);
    return isOrigin ? origin : Vec3d(origin + turned(back, point));
}

// How the smaller of two bodies has moved against the other since their manifold was made: m, its centre. The rest of
// it comes of the turn.
template <class S>
double displacementSince(const PairContacts<S>& pair, const Posed& aFromB, const Body<S>& a, const Body<S>& b) {
    const bool fromB = a.kind->radius < b.kind->radius;
    const Vec3d centre = (fromB ? a : b).kind->localCentre.template cast<double>();
    return (across(aFromB, centre, fromB) - across(pair.aFromB, centre, fromB)).norm();
}
template <class S>
double turnSince(const PairContacts<S>& pair, const Posed& aFromB) {  // rad
    return 2 * (pair.aFromB.rotation.conjugate() * aFromB.rotation).vec().norm();
}

// m. Where something rolls, the point that touches wanders off the known one, and a separation that is too small by the
// square of the displacement would drive it: such pairs must stand still. Small bodies move less before it counts.
template <class S>
double reuseBound(const PairContacts<S>& pair, double wanted, double smallerRadius) {
    constexpr double rolling = 1e-6;
    constexpr double ofRadius = 1e-3;
    const double bound = std::min(wanted, ofRadius * smallerRadius);
    const bool rolls = std::any_of(pair.manifolds.begin(), pair.manifolds.end(),
                                   [](const ContactManifold<S>& manifold) { return manifold.isRound; });
    return rolls ? std::min(bound, rolling) : bound;
}

// By how much faces that meet are off the parallel, at least: m a m, between the points that were found.
template <class S>
double tilt(const ContactManifold<S>& manifold) {
    double steepest = 0;
    const auto points = manifold.found();
    for (std::size_t k = 1; k < points.size(); ++k) {
        const double way = (points[k].onA - points[0].onA).norm();
        const double rise = std::abs(points[k].foundSeparation - points[0].foundSeparation);
        steepest = way > 0 ? std::max(steepest, rise / way) : steepest;
    }
    return steepest;
}

// Whether the manifolds still say how the bodies lie, b at aFromB. ahead: m, what can be closed within the step.
template <class S>
bool holds(const PairContacts<S>& pair, const Posed& aFromB, const Body<S>& a, const Body<S>& b, double ahead,
           const SpeculativeBounds& speculative) {
    const double smallerRadius = std::min(a.kind->radius, b.kind->radius);
    const double displacement = displacementSince(pair, aFromB, a, b);
    const bool isFar = displacement + ahead + speculative.margin <= pair.apart;
    if (!isFar && displacement > speculative.reuseDistance) {
        return false;
    }
    const double turn = turnSince(pair, aFromB);
    const double moved = displacement + turn * smallerRadius;  // no point farther
    if (moved + ahead + speculative.margin <= pair.apart) {
        return true;
    }
    // What lies within the speculative bounds of this step must be among the known points.
    if (moved > reuseBound(pair, speculative.reuseDistance, smallerRadius) || moved + ahead > pair.margin) {
        return false;
    }
    // m: points at the rims of faces move with them, and along what tilts that shows in the depth.
    constexpr double unseen = 5e-10;
    if (std::any_of(pair.manifolds.begin(), pair.manifolds.end(),
                    [&](const ContactManifold<S>& manifold) { return moved * tilt(manifold) > unseen; })) {
        return false;
    }
    // m: where points were left out, a turn may make one of them the deepest.
    const double deeper = std::max(1e-9, 8 * static_cast<double>(std::numeric_limits<S>::epsilon()) * smallerRadius);
    return turn * smallerRadius <= deeper ||
           std::none_of(pair.manifolds.begin(), pair.manifolds.end(),
                        [](const ContactManifold<S>& manifold) { return manifold.isReduced; });
}

// m. What a corner of a does against a face of b that turns is told by the normal that goes with b: along a's it would
// be wrong by turn times slip.
template <class S>
S cornerSeparation(const ContactManifold<S>& manifold, const ContactPointState<S>& point, const Posed& frameA,
                   const Posed& frameB) {
    const Vec3d apart =
        (frameB.position + turned(frameB.rotation, point.onB)) - (frameA.position + turned(frameA.rotation, point.onA));
    return static_cast<S>(turned(frameB.rotation, manifold.normalInB).dot(apart));
}

template <class S>
S combined(double a, double b) {
    return static_cast<S>(std::sqrt(a * b));
}

double staticFriction(const Material& m) {
    return std::max(m.friction, m.staticFriction);
}

// As the narrow phase found it.
template <class S>
Manifold found(const ContactManifold<S>& manifold) {
    Manifold geometry;
    geometry.count = manifold.count;
    for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.count); ++k) {
        geometry.points[k] = manifold.points[k].found();
    }
    return geometry;
}

template <class S>
void fillManifold(const Manifold& geometry, const Body<S>& a, const Body<S>& b, const Vec3d& normalInB,
                  ContactManifold<S>* before, ContactManifold<S>& manifold) {
    manifold.shapeA = geometry.shapeA;
    manifold.shapeB = geometry.shapeB;
    manifold.id = geometry.id;
    manifold.count = static_cast<std::uint8_t>(geometry.count);
    manifold.known = manifold.count;
    manifold.normal = geometry.normal;
    manifold.normalInB = normalInB;
    manifold.isOnB = geometry.reference == 1;
    manifold.isReduced = geometry.isReduced;
    manifold.deeper = static_cast<S>(geometry.deeper);
    const Shape& shapeA = a.kind->def.shapes[geometry.shapeA];
    const Shape& shapeB = b.kind->def.shapes[geometry.shapeB];
    const Material& materialA = shapeA.material;
    const Material& materialB = shapeB.material;
    manifold.friction = combined<S>(materialA.friction, materialB.friction);
    const bool sticks =
        staticFriction(materialA) > materialA.friction || staticFriction(materialB) > materialB.friction;
    manifold.staticFriction =
        sticks ? combined<S>(staticFriction(materialA), staticFriction(materialB)) : manifold.friction;
    manifold.restitution = static_cast<S>(std::max(materialA.restitution, materialB.restitution));
    if (before != nullptr && before->rolling) {
        manifold.rolling = std::move(before->rolling);
    }
    const double rolling = std::max(materialA.rollingFriction, materialB.rollingFriction);
    const double spinning = std::max(materialA.spinningFriction, materialB.spinningFriction);
    if (manifold.rolling || rolling > 0 || spinning > 0) {
        manifold.rolling.make().rollingFriction = static_cast<S>(rolling);
        manifold.rolling->spinningFriction = static_cast<S>(spinning);
    }
    const std::array<int, 4> match =
        before != nullptr ? matchPoints(found(*before), geometry) : std::array<int, 4>{-1, -1, -1, -1};
    for (std::size_t k = 0; k < static_cast<std::size_t>(geometry.count); ++k) {
        const ContactPoint& point = geometry.points[k];
        ContactPointState<S>& state = manifold.points[k];
        if (match[k] >= 0) {
            const std::size_t old = static_cast<std::size_t>(match[k]);
            state = before->points[old];
            manifold.setSlip(state, before->slip(before->points[old]));
            before->transferred = static_cast<std::uint8_t>(before->transferred | 1U << old);
        }
        state.onA = point.onA;
        state.onB = point.onB;
        state.feature = point.feature;
        state.foundSeparation = point.separation;
        state.separation = static_cast<S>(point.separation);
        manifold.isRound = manifold.isRound || !roundPart(shapeA, point.onA, geometry.normal).isZero(0) ||
                           !roundPart(shapeB, point.onB, normalInB).isZero(0);
    }
}

// Whether a point with a force has no heir: on ground, one beside it may take the force over (internal_edges.hpp).
template <class S>
bool handsNothingOn(const std::vector<ContactManifold<S>>& manifolds) {
    return std::any_of(manifolds.begin(), manifolds.end(), [](const ContactManifold<S>& manifold) {
        const auto points = manifold.inForce();
        return std::any_of(points.begin(), points.end(), [&](const ContactPointState<S>& point) {
            return point.normalForce != S(0) && !manifold.isTransferred(manifold.placeOf(point));
        });
    });
}

// m/s: spins count by the smaller body's size, so that a spinning floor reaches no further than what stands on it.
template <class S>
double turningSpeed(const PlacedSide<S>& a, const PlacedSide<S>& b) {
    const double radius = std::min(a.body->kind->radius, b.body->kind->radius);
    return std::isfinite(radius) ? static_cast<double>(a.spin + b.spin) * radius : 0;
}

// The gap that a and b can close within dt, also where something else stops one of them: of two balls that fall
// together the lower one meets the floor first. A fast body has continuous collision: contacts far ahead of it would
// stop it at what it only passes.
template <class S>
double closing(const PlacedSide<S>& a, const PlacedSide<S>& b, double dt) {
    const S speed = std::max({(a.v - b.v).norm(), a.speed, b.speed});
    double gap = dt * (static_cast<double>(speed) + turningSpeed(a, b));
    for (const PlacedSide<S>* side : {&a, &b}) {
        const Body<S>& body = *side->body;
        const double displacement =
            dt * (static_cast<double>(side->speed) + static_cast<double>(side->spin) * body.kind->turningRadius);
        if (displacement > body.kind->ccdDistance) {
            gap = std::min(gap, body.kind->radius);
        }
    }
    return gap;
}

// Of all points, where the bodies are.
template <class S>
void placeSeparations(ContactManifold<S>& manifold, const PlacedSide<S>& a, const PlacedSide<S>& b) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.known); ++k) {
        ContactPointState<S>& point = manifold.points[k];
        ContactGeometry<S> geometry = contactGeometry(manifold, point, *a.body, *b.body);
        geometry.startStep(a.pose, b.pose);
        point.separation = manifold.isOnB && !manifold.isRound ? cornerSeparation(manifold, point, a.place, b.place)
                                                               : geometry.separation(a.pose, b.pose);
    }
}

// m/s, at which a and b can come together along n (from a to b, world), one of them stopped or not.
template <class S>
double approach(const PlacedSide<S>& a, const PlacedSide<S>& b, const Vec3d& n) {
    const double va = n.dot(a.v.template cast<double>());
    const double vb = -n.dot(b.v.template cast<double>());
    return std::max({va + vb, va, vb, 0.0}) + turningSpeed(a, b);
}

// Whether the parts of a compound are told apart by how far each goes: where it is far longer than they are, and not
// the larger body, whose spin counts by the smaller one's size.
template <class S>
bool goesByParts(const PlacedSide<S>& side, const PlacedSide<S>& other) {
    constexpr double muchShorter = 0.25;
    const BodyKind<S>& kind = *side.body->kind;
    const std::span<const Part> parts = kind.shapes().parts;
    return parts.size() > 1 && kind.radius <= other.body->kind->radius &&
           std::all_of(parts.begin(), parts.end(),
                       [&](const Part& part) { return part.radius <= muchShorter * kind.radius; });
}

// m: what no point of each shape exceeds within dt, as the body moves now.
template <class S>
void findWays(const PlacedSide<S>& side, const PlacedSide<S>& other, double dt, std::vector<double>& ways) {
    const BodyKind<S>& kind = *side.body->kind;
    const BodyShapes shapes = kind.shapes();
    const double spin = static_cast<double>(side.spin);
    const double radius = std::min(kind.radius, other.body->kind->radius);
    ways.assign(shapes.shapes.size(),
                dt * (static_cast<double>(side.speed) + (std::isfinite(radius) ? spin * radius : 0)));
    if (!goesByParts(side, other)) {
        return;
    }
    const Quatd back = side.place.rotation.conjugate();
    const Vec3d v = turned(back, side.v.template cast<double>());
    const Vec3d w = turned(back, side.w.template cast<double>());
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const Vec3d arm = shapes.parts[i].middle - kind.localCentre.template cast<double>();
        ways[i] = dt * ((v + w.cross(arm)).norm() + spin * shapes.parts[i].radius);
    }
}

}  // namespace

Vec3d roundPart(const Shape& shape, const Vec3d& point, const Vec3d& normal) {
    const Vec3d arm = point - shape.pose.position;
    const auto yAxis = [&] { return turned(shape.pose.rotation, Vec3d::UnitY()); };
    switch (shape.kind) {
        case ShapeKind::Sphere:
        case ShapeKind::Ellipsoid:
            return arm.dot(normal) * normal;
        case ShapeKind::Capsule: {
            const Vec3d axis = yAxis();
            const double halfHeight = shape.size.y();
            return (arm - std::clamp(arm.dot(axis), -halfHeight, halfHeight) * axis).dot(normal) * normal;
        }
        case ShapeKind::Cylinder:
        case ShapeKind::Cone: {
            const Vec3d axis = yAxis();
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
ContactGeometry<S> contactGeometry(const ContactManifold<S>& manifold, const ContactPointState<S>& point,
                                   const Body<S>& a, const Body<S>& b) {
    ContactGeometry<S> geometry;
    geometry.onA = point.onA.template cast<S>() - a.kind->localCentre;
    geometry.onB = point.onB.template cast<S>() - b.kind->localCentre;
    geometry.particleA = a.kind->def.particle;
    geometry.particleB = b.kind->def.particle;
    if (manifold.isRound) {
        geometry.roundA = roundPart(a.kind->def.shapes[manifold.shapeA], point.onA, manifold.normal).template cast<S>();
        geometry.roundB =
            roundPart(b.kind->def.shapes[manifold.shapeB], point.onB, manifold.normalInB).template cast<S>();
    }
    geometry.normal = (geometry.carriedByB() ? manifold.normalInB : manifold.normal).template cast<S>();
    return geometry;
}

template <class S>
std::array<int, 2> trianglesOf(const PairContacts<S>& pair, const ContactManifold<S>& manifold,
                               const ContactPointState<S>& point, const Body<S>& a, const Body<S>& b) {
    const double gap = point.foundSeparation;
    return {triangleAt(a.kind->def.shapes[manifold.shapeA], pair.aFromB * point.onB - gap * manifold.normal,
                       manifold.normal),
            triangleAt(b.kind->def.shapes[manifold.shapeB],
                       pair.aFromB.inverse() * point.onA + gap * manifold.normalInB, -manifold.normalInB)};
}

template <class S>
int PairContacts<S>::pointCount() const {
    int count = 0;
    for (const ContactManifold<S>& manifold : manifolds) {
        count += manifold.count;
    }
    return count;
}

template <class S>
double PairContacts<S>::depth() const {
    double deepest = 0;
    for (const ContactManifold<S>& manifold : manifolds) {
        // What is culled as a whole is no contact.
        for (std::size_t k = 0; manifold.count > 0 && k < static_cast<std::size_t>(manifold.known); ++k) {
            deepest = std::max(deepest, static_cast<double>(manifold.deeper - manifold.points[k].separation));
        }
    }
    return deepest;
}

template <class S>
void PairContacts<S>::beginStep() {
    clearEnded();
    for (ContactManifold<S>& manifold : manifolds) {
        if (manifold.rolling) {
            manifold.rolling->impulse.setZero();
        }
        for (ContactPointState<S>& point : manifold.found()) {
            point.impulse.setZero();
            point.normalImpulse = S(0);
        }
    }
}

template <class S>
void PairContacts<S>::endPoints(const ContactManifold<S>& manifold, const Body<S>& a, const Pose<S>& poseA,
                                const Body<S>& b, const Pose<S>& poseB) {
    bool isFirst = true;
    for (const ContactPointState<S>& point : manifold.found()) {
        if (manifold.isTransferred(manifold.placeOf(point)) || point.impulse.isZero(S(0))) {
            continue;
        }
        ContactGeometry<S> geometry = contactGeometry(manifold, point, a, b);
        geometry.startStep(poseA, poseB);
        EndedContact& end = past.make().ended.emplace_back();
        end.point = (S(0.5) * (poseA * geometry.onA + poseB * geometry.onB)).template cast<double>();
        end.normal = geometry.direction(poseA, poseB).template cast<double>();
        end.impulse = point.impulse.template cast<double>();
        end.normalImpulse = static_cast<double>(point.normalImpulse);
        if (isFirst && manifold.rolling) {
            end.angularImpulse = manifold.rolling->impulse.template cast<double>();
        }
        isFirst = false;
        end.shapeA = manifold.shapeA;
        end.shapeB = manifold.shapeB;
        end.triangles = trianglesOf(*this, manifold, point, a, b);
        end.friction = static_cast<double>(manifold.friction);
        end.staticFriction = static_cast<double>(manifold.staticFriction);
        end.restitution = static_cast<double>(manifold.restitution);
    }
}

template <class S>
bool collidePair(PairContacts<S>& pair, const PlacedSide<S>& a, const PlacedSide<S>& b,
                 const SpeculativeBounds& speculative, NarrowCounts& counts) {
    const Posed aFromB = relativePose(a.place, b.place);
    const double ahead = closing(a, b, speculative.dt);
    if (pair.made && holds(pair, aFromB, *a.body, *b.body, ahead, speculative)) {
        pair.forgetBefore();
        for (ContactManifold<S>& manifold : pair.manifolds) {
            placeSeparations(manifold, a, b);
        }
        return false;
    }
    Margin margin(speculative.margin + ahead);
    double known = margin.all;
    if (goesByParts(a, b) || goesByParts(b, a)) {
        static thread_local std::vector<double> waysOfA, waysOfB;
        findWays(a, b, speculative.dt, waysOfA);
        findWays(b, a, speculative.dt, waysOfB);
        margin.least = speculative.margin;
        margin.waysOfA = waysOfA;
        margin.waysOfB = waysOfB;
        known = margin.leastOfAll();
    }
    static thread_local std::vector<Manifold> found;
    found.clear();
    // Many boxes meet whose balls are apart: the narrow phase would find nothing.
    double apart = (a.pose.position - b.pose.position).template cast<double>().norm() - a.body->kind->radius -
                   b.body->kind->radius;
    if (!(apart > margin.all)) {
        apart = collide(a.body->kind->shapes(), b.body->kind->shapes(), aFromB, margin, pair.cache, found, counts,
                        speculative.narrowPhase);
    }
    // What is beside the motion cannot be met.
    std::erase_if(found, [&](const Manifold& geometry) {
        double smallest = infinity<double>();
        for (int k = 0; k < geometry.count; ++k) {
            smallest = std::min(smallest, geometry.points[static_cast<std::size_t>(k)].separation);
        }
        const bool beside =
            smallest > speculative.margin + speculative.dt * approach(a, b, turned(a.place.rotation, geometry.normal));
        known = beside ? std::min(known, smallest) : known;
        return beside;
    });
    // Swapped with the old ones, whose room the next pair of the thread gets.
    static thread_local std::vector<ContactManifold<S>> room;
    static const ContactManifold<S> blank;  // a copy is cheaper than a new one
    room.clear();
    room.reserve(found.size());
    // What has none keeps no room for any.
    std::vector<ContactManifold<S>> none;
    std::vector<ContactManifold<S>>& manifolds = found.empty() ? none : room;
    const Quatd bFromA = aFromB.rotation.conjugate();
    for (const Manifold& geometry : found) {
        ContactManifold<S>* before = nullptr;
        for (ContactManifold<S>& old : pair.manifolds) {
            if (old.shapeA == geometry.shapeA && old.shapeB == geometry.shapeB && old.id == geometry.id) {
                before = &old;
            }
        }
        fillManifold<S>(geometry, *a.body, *b.body, turned(bFromA, geometry.normal), before,
                        manifolds.emplace_back(blank));
    }
    for (const ContactManifold<S>& old : pair.manifolds) {
        pair.endPoints(old, *a.body, a.pose, *b.body, b.pose);
    }
    manifolds.swap(pair.manifolds);
    pair.forgetBefore();
    if (a.body->isDynamic() != b.body->isDynamic() && handsNothingOn(manifolds)) {
        pair.past.make().manifolds.swap(manifolds);
    }
    pair.isNew = true;
    pair.aFromB = aFromB;
    pair.margin = known;
    pair.apart = apart;
    pair.roamed = std::numeric_limits<double>::quiet_NaN();
    pair.made = true;
    return true;
}

template <class S>
bool PairContacts<S>::knows(const ContactManifold<S>& manifold, const ContactPointState<S>& point) const {
    return std::any_of(manifolds.begin(), manifolds.end(), [&](const ContactManifold<S>& one) {
        constexpr double sameWay = 0.99;  // cosine
        const auto points = one.inForce();
        return one.shapeA == manifold.shapeA && one.shapeB == manifold.shapeB && one.id == manifold.id &&
               one.normal.dot(manifold.normal) > sameWay &&
               std::any_of(points.begin(), points.end(),
                           [&](const ContactPointState<S>& other) { return other.feature == point.feature; });
    });
}

template <class S>
void foreseeManifold(PairContacts<S>& pair, ContactManifold<S> met, const PairSide<S>& a, const PairSide<S>& b) {
    std::array<ContactPointState<S>, 4> points;
    std::uint8_t count = 0;
    for (const ContactPointState<S>& point : met.inForce()) {
        if (!pair.knows(met, point)) {
            ContactPointState<S>& unloaded = points[count++];
            unloaded.onA = point.onA;
            unloaded.onB = point.onB;
            unloaded.feature = point.feature;
            unloaded.foundSeparation = point.foundSeparation;
        }
    }
    met.points = points;
    met.count = count;
    met.known = count;
    met.transferred = 0;
    if (met.rolling) {
        met.rolling->impulse.setZero();
    }
    met.slips.reset();
    met.deeper = S(0);
    placeSeparations(met, PlacedSide<S>(a), PlacedSide<S>(b));
    pair.manifolds.push_back(std::move(met));
    pair.made = false;
}

template void foreseeManifold(PairContacts<float>&, ContactManifold<float>, const PairSide<float>&,
                              const PairSide<float>&);
template void foreseeManifold(PairContacts<double>&, ContactManifold<double>, const PairSide<double>&,
                              const PairSide<double>&);
template std::array<int, 2> trianglesOf(const PairContacts<float>&, const ContactManifold<float>&,
                                        const ContactPointState<float>&, const Body<float>&, const Body<float>&);
template std::array<int, 2> trianglesOf(const PairContacts<double>&, const ContactManifold<double>&,
                                        const ContactPointState<double>&, const Body<double>&, const Body<double>&);
template struct PairContacts<float>;
template struct PairContacts<double>;
template bool collidePair(PairContacts<float>&, const PlacedSide<float>&, const PlacedSide<float>&,
                          const SpeculativeBounds&, NarrowCounts&);
template bool collidePair(PairContacts<double>&, const PlacedSide<double>&, const PlacedSide<double>&,
                          const SpeculativeBounds&, NarrowCounts&);

}  // namespace cairn
