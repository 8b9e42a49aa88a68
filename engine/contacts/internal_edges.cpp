#include "engine/contacts/internal_edges.hpp"

#include "base/so3.hpp"

#include <algorithm>
#include <numbers>

namespace cairn {
namespace {

// Normals closer than 0.2 degrees are one.
constexpr double sameNormal = 1 - 5e-6;

// m/s: slower, static friction may hold a point.
constexpr double slidingSpeed = 0.01;

// m: pieces that differ in height by less are one plane. size: a length of the body, m.
double planeSlack(double size) {
    return std::min(1e-4, 2e-3 * size);
}

// A ground pair with its bodies where they are.
template <class S>
struct PlacedPair {
    PairContacts<S>* contacts;
    bool groundIsB;
    PairSide<S> body;
    PairSide<S> ground;

    PlacedPair(const GroundPair<S>& pair, const SideOf<S>& side)
        : contacts(pair.contacts),
          groundIsB(pair.groundIsB),
          body(side(pair.mover)),
          ground(side(pair.groundIsB ? pair.contacts->pair.b : pair.contacts->pair.a)) {}
};

// The manifolds of one body with its ground, in the body's frame.
template <class S>
class InternalEdges {
public:
    void cull(std::span<const GroundPair<S>> pairs, const SideOf<S>& side) {
        pairs_.clear();
        manifolds_.clear();
        for (const GroundPair<S>& pair : pairs) {
            pairs_.emplace_back(pair, side);
        }
        for (const PlacedPair<S>& pair : pairs_) {
            addManifolds(pair);
        }
        // What one shape of the body meets has nothing to do with what another does.
        const auto earlier = [](const GroundManifold& p, const GroundManifold& q) { return p.shape < q.shape; };
        if (!std::is_sorted(manifolds_.begin(), manifolds_.end(), earlier)) {
            std::stable_sort(manifolds_.begin(), manifolds_.end(), earlier);
        }
        for (std::size_t begin = 0, end = 0; begin < manifolds_.size(); begin = end) {
            while (end < manifolds_.size() && manifolds_[end].shape == manifolds_[begin].shape) {
                ++end;
            }
            cullShape(begin, end);
        }
        for (GroundManifold& manifold : manifolds_) {
            putInForce(manifold);
        }
        if (manifolds_.size() > 1) {
            transferForces();
        }
        for (std::size_t i = 0; i < manifolds_.size(); ++i) {
            shareEvenly(i);
        }
    }

private:
    struct GroundManifold {
        ContactManifold<S>* contacts;
        const PlacedPair<S>* pair;
        Posed bodyFromGround;
        std::uint32_t shape;   // of the body
        std::uint32_t ground;  // shape of the ground
        Vec3d normal;          // out of the ground
        std::array<bool, 4> inForce{};
        std::size_t surface = SIZE_MAX;  // the first manifold of its plane and material
        std::size_t next = SIZE_MAX;     // of that surface; none: SIZE_MAX

        const ContactPointState<S>& point(int k) const { return contacts->points[static_cast<std::size_t>(k)]; }
        Vec3d onBody(int k) const { return pair->groundIsB ? point(k).onA : point(k).onB; }
        Vec3d onGround(int k) const { return bodyFromGround * (pair->groundIsB ? point(k).onB : point(k).onA); }
        // The place of the body that a contact holds up: of what is round the centre, or that of the ball on its axis.
        Vec3d held(int k) const {
            const Shape& met = pair->body.body->kind->def.shapes[shape];
            if (met.kind == ShapeKind::Ellipsoid) {
                return met.pose.position;
            }
            const Vec3d& normalInBody = pair->groundIsB ? contacts->normal : contacts->normalInB;
            const Vec3<S> round = roundPart(met, onBody(k), normalInBody).template cast<S>();
            return onBody(k) - round.template cast<double>();
        }
    };
    struct PointRef {
        std::size_t manifold;
        int point;
    };

    void addManifolds(const PlacedPair<S>& pair) {
        const Posed bodyFromGround = relativePose(pair.body.frame(), pair.ground.frame());
        for (ContactManifold<S>& contacts : pair.contacts->manifolds) {
            GroundManifold& manifold = manifolds_.emplace_back();
            manifold.contacts = &contacts;
            manifold.pair = &pair;
            manifold.bodyFromGround = bodyFromGround;
            manifold.shape = pair.groundIsB ? contacts.shapeA : contacts.shapeB;
            manifold.ground = pair.groundIsB ? contacts.shapeB : contacts.shapeA;
            manifold.normal =
                pair.groundIsB ? Vec3d(-contacts.normal) : Vec3d(bodyFromGround.rotation * contacts.normal);
            std::fill_n(manifold.inForce.begin(), contacts.known, true);
        }
    }

    // The manifolds [begin, end) of one shape of the body.
    void cullShape(std::size_t begin, std::size_t end) {
        findSurfaces(begin, end);
        if (end - begin < 2) {
            return;
        }
        const GroundManifold& first = manifolds_[begin];
        // An edge is culled by other pieces alone.
        if (std::any_of(manifolds_.begin() + static_cast<std::ptrdiff_t>(begin) + 1,
                        manifolds_.begin() + static_cast<std::ptrdiff_t>(end), [&](const GroundManifold& other) {
                            return other.pair != first.pair || other.ground != first.ground;
                        })) {
            cullEdges(begin, end);
        }
        for (std::size_t i = begin; i < end; ++i) {
            reduce(i);
        }
    }

    // Whether two pieces stay as they lie to each other.
    bool areNeighbours(const GroundManifold& p, const GroundManifold& q) const {
        const Body<S>* a = p.pair->ground.body;
        const Body<S>* b = q.pair->ground.body;
        return a == b || (a->type == BodyType::Static && b->type == BodyType::Static);
    }

    // Manifolds in one plane and of one material are one surface, named by the first of them.
    void findSurfaces(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            std::size_t last = SIZE_MAX;
            for (std::size_t j = i; manifolds_[i].surface >= i && j < end; ++j) {
                if (manifolds_[j].surface > i && isOneSurface(manifolds_[i], manifolds_[j])) {
                    manifolds_[j].surface = i;
                    if (last != SIZE_MAX) {
                        manifolds_[last].next = j;
                    }
                    last = j;
                }
            }
        }
    }

    // While a place of the body stays above a surface, it cannot touch what lies wholly below that plane: a contact
    // with that would only stop it, since an edge ahead is taken as a plane within a step. What is culled only by what
    // is culled itself stays.
    void cullEdges(std::size_t begin, std::size_t end) {
        std::vector<std::size_t> undecided;
        for (std::size_t i = begin; i < end; ++i) {
            if (manifolds_[i].surface == i) {
                undecided.push_back(i);
            }
        }
        std::vector<std::size_t> kept;
        for (bool changes = true; changes && !undecided.empty();) {
            changes = false;
            std::vector<std::size_t> left;
            for (const std::size_t surface : undecided) {
                for (const PointRef& edge : pointsOf(surface, refs_)) {
                    bool& inForce = manifolds_[edge.manifold].inForce[static_cast<std::size_t>(edge.point)];
                    inForce = std::none_of(kept.begin(), kept.end(), [&](std::size_t k) { return culls(k, edge); });
                }
                const std::vector<PointRef>& edges = pointsOf(surface, refs_);
                const bool isFree = std::none_of(undecided.begin(), undecided.end(), [&](std::size_t other) {
                    return std::any_of(edges.begin(), edges.end(),
                                       [&](const PointRef& edge) { return culls(other, edge); });
                });
                if (edges.empty() || isFree) {
                    changes = true;
                    if (!edges.empty()) {
                        kept.push_back(surface);
                    }
                } else {
                    left.push_back(surface);
                }
            }
            undecided.swap(left);
        }
    }

    // The points of a surface that are in force; `refs` is room for them.
    const std::vector<PointRef>& pointsOf(std::size_t surface, std::vector<PointRef>& refs) const {
        refs.clear();
        for (std::size_t i = manifolds_[surface].surface == surface ? surface : SIZE_MAX; i != SIZE_MAX;
             i = manifolds_[i].next) {
            for (int k = 0; k < manifolds_[i].contacts->known; ++k) {
                if (manifolds_[i].inForce[static_cast<std::size_t>(k)]) {
                    refs.push_back({i, k});
                }
            }
        }
        return refs;
    }

    bool culls(std::size_t surface, const PointRef& edgeRef) const {
        const GroundManifold& plane = manifolds_[surface];
        const GroundManifold& edge = manifolds_[edgeRef.manifold];
        if (edge.surface == surface || !areNeighbours(plane, edge) || plane.normal.dot(edge.normal) > sameNormal) {
            return false;
        }
        std::vector<PointRef> refs;
        pointsOf(surface, refs);
        const bool ofOthers = std::any_of(refs.begin(), refs.end(), [&](const PointRef& ref) {
            return manifolds_[ref.manifold].pair != edge.pair || manifolds_[ref.manifold].ground != edge.ground;
        });
        if (!ofOthers || !isHeld(refs, edge.held(edgeRef.point))) {
            return false;
        }
        const double slack = planeSlack(edge.pair->body.body->kind->radius);
        const Quatd upright = turnBetween<double>(plane.normal, Vec3d::UnitY());
        const std::span<const Shape> shapes = edge.pair->ground.body->kind->def.shapes;
        const Aabb box = bounds(shapes.subspan(edge.ground, 1), Posed{Vec3d::Zero(), upright} * edge.bodyFromGround);
        return box.max.y() <= plane.normal.dot(plane.onGround(0)) + slack;
    }

    // Whether a place of the body lies within the hull of the places that a surface holds up, or nearly so: among
    // points all around it, or beside a line of two.
    bool isHeld(const std::vector<PointRef>& refs, const Vec3d& place) const {
        constexpr double share = 0.02;  // of the body's radius
        const GroundManifold& manifold = manifolds_[refs.front().manifold];
        const double slack = share * manifold.pair->body.body->kind->radius;
        Vec3d t1;
        Vec3d t2;
        completeBasis(manifold.normal, t1, t2);
        std::vector<Vec3d> arms;
        std::vector<double> angles;
        for (const PointRef& ref : refs) {
            const Vec3d& arm = arms.emplace_back(manifolds_[ref.manifold].held(ref.point) - place);
            if (std::abs(manifold.normal.dot(arm)) > slack) {
                return false;
            }
            angles.push_back(std::atan2(t2.dot(arm), t1.dot(arm)));
        }
        std::sort(angles.begin(), angles.end());
        constexpr double halfTurn = std::numbers::pi;
        double gap = angles.front() + 2 * halfTurn - angles.back();
        for (std::size_t i = 1; i < angles.size(); ++i) {
            gap = std::max(gap, angles[i] - angles[i - 1]);
        }
        if (gap <= halfTurn) {
            return true;
        }
        for (const Vec3d& from : arms) {
            for (const Vec3d& to : arms) {
                const Vec3d side = to - from;
                const double along = std::clamp(-from.dot(side) / std::max(side.squaredNorm(), 1e-300), 0.0, 1.0);
                if ((from + along * side).norm() <= slack) {
                    return true;
                }
            }
        }
        return false;
    }

    // Of all points of a surface in several pieces, at most four stay in force.
    void reduce(std::size_t surface) {
        const std::vector<PointRef>& refs = pointsOf(surface, refs_);
        if (refs.size() < 3 || refs.front().manifold == refs.back().manifold) {
            return;
        }
        const GroundManifold& first = manifolds_[surface];
        const Posed shapeFromBody = first.pair->body.body->kind->def.shapes[first.shape].pose.inverse();
        std::vector<ContactPoint> points;
        for (const PointRef& ref : refs) {
            points.push_back(manifolds_[ref.manifold].point(ref.point).found());
            points.back().onA = shapeFromBody * manifolds_[ref.manifold].onBody(ref.point);
        }
        std::array<int, 4> chosen{};
        const int count = spreadPoints(points, shapeFromBody.rotation * first.normal, chosen);
        for (std::size_t i = 0; i < refs.size(); ++i) {
            manifolds_[refs[i].manifold].inForce[static_cast<std::size_t>(refs[i].point)] =
                std::find(chosen.begin(), chosen.begin() + count, static_cast<int>(i)) != chosen.begin() + count;
        }
    }

    bool isOneSurface(const GroundManifold& p, const GroundManifold& q) const {
        if (&p == &q) {
            return true;
        }
        if (!areNeighbours(p, q) || p.normal.dot(q.normal) < sameNormal ||
            p.contacts->friction != q.contacts->friction || p.contacts->staticFriction != q.contacts->staticFriction ||
            p.contacts->restitution != q.contacts->restitution) {
            return false;
        }
        const double slack = planeSlack(p.pair->body.body->kind->radius);
        for (int k = 0; k < q.contacts->known; ++k) {
            if (std::abs(p.normal.dot(q.onGround(k) - p.onGround(0))) > slack) {
                return false;
            }
        }
        return true;
    }

    // The points in force come first.
    void putInForce(GroundManifold& manifold) {
        ContactManifold<S>& contacts = *manifold.contacts;
        std::size_t count = 0;
        for (std::size_t k = 0; k < static_cast<std::size_t>(contacts.known); ++k) {
            if (manifold.inForce[k]) {
                contacts.swapPoints(k, count);
                std::swap(manifold.inForce[k], manifold.inForce[count]);
                ++count;
            }
        }
        contacts.count = static_cast<std::uint8_t>(count);
    }

    // What a point carried that is no longer in force goes to the one that took its place on the next piece.
    void transferForces() {
        struct Lost {
            std::uint32_t shape;
            Vec3d place;  // on the body
            std::uint64_t feature;
            ContactPointState<S> state;
            Vec3<S> slip;
            S sign;  // of friction and slip: 1 if the body was b
            bool taken = false;
        };
        std::vector<Lost> lost;
        const auto lose = [&](const PlacedPair<S>& pair, const ContactManifold<S>& manifold, std::size_t k) {
            const ContactPointState<S>& point = manifold.points[k];
            if (point.normalForce != S(0)) {
                lost.push_back({pair.groundIsB ? manifold.shapeA : manifold.shapeB,
                                pair.groundIsB ? point.onA : point.onB, point.feature, point, manifold.slip(point),
                                pair.groundIsB ? S(-1) : S(1)});
            }
        };
        for (const PlacedPair<S>& pair : pairs_) {
            for (const ContactManifold<S>& manifold : pair.contacts->before()) {
                for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.count); ++k) {
                    if (!manifold.isTransferred(k)) {
                        lose(pair, manifold, k);
                    }
                }
            }
            for (ContactManifold<S>& manifold : pair.contacts->manifolds) {
                for (std::size_t k = static_cast<std::size_t>(manifold.count);
                     k < static_cast<std::size_t>(manifold.known); ++k) {
                    lose(pair, manifold, k);
                    manifold.points[k].normalForce = S(0);
                    manifold.points[k].preload = S(0);
                    manifold.points[k].friction.setZero();
                    manifold.setSlip(manifold.points[k], Vec3<S>::Zero());
                }
            }
        }
        for (const GroundManifold& manifold : manifolds_) {
            for (int k = 0; k < manifold.contacts->count; ++k) {
                ContactPointState<S>& state = manifold.contacts->points[static_cast<std::size_t>(k)];
                if (state.normalForce != S(0)) {
                    continue;
                }
                constexpr double near = 0.02;  // m, as in matchPoints
                Lost* best = nullptr;
                double nearest = 0;
                for (Lost& old : lost) {
                    const double distance = (old.place - manifold.onBody(k)).norm();
                    if (!old.taken && old.shape == manifold.shape &&
                        (distance < near || old.feature == manifold.point(k).feature) &&
                        (best == nullptr || distance < nearest)) {
                        best = &old;
                        nearest = distance;
                    }
                }
                if (best != nullptr) {
                    const S sign = best->sign * (manifold.pair->groundIsB ? S(-1) : S(1));
                    state.normalForce = best->state.normalForce;
                    state.preload = best->state.preload;
                    state.friction = sign * best->state.friction;
                    manifold.contacts->setSlip(state, sign * best->slip);
                    best->taken = true;
                }
            }
        }
    }

    // Four points on a plane can share a weight in many ways, and what iterations leave of one another step after step
    // is an accident of their order; yet how friction slows a turn hangs on it. What slides starts each step from the
    // share that equal springs would have: the least sum of squares with the same force and torque.
    void shareEvenly(std::size_t surface) {
        const std::vector<PointRef>& refs = pointsOf(surface, refs_);
        if (refs.size() != 4 || !slides(refs)) {
            return;
        }
        const Vec3d normal = manifolds_[surface].normal;
        const auto place = [&](std::size_t i) { return manifolds_[refs[i].manifold].onBody(refs[i].point); };
        const auto area = [&](std::size_t i, std::size_t j, std::size_t k) {
            return normal.dot((place(j) - place(i)).cross(place(k) - place(i)));
        };
        // Forces in this ratio have neither sum nor torque.
        const Eigen::Vector4d idle(area(1, 2, 3), -area(0, 2, 3), area(0, 1, 3), -area(0, 1, 2));
        Eigen::Vector4d force;
        for (std::size_t i = 0; i < 4; ++i) {
            force[static_cast<Eigen::Index>(i)] = static_cast<double>(stateOf(refs[i]).normalForce);
        }
        if (idle.isZero(0) || force.minCoeff() <= 0) {
            return;
        }
        const Eigen::Vector4d change = -force.dot(idle) / idle.squaredNorm() * idle;
        double share = 1;
        for (Eigen::Index i = 0; i < 4; ++i) {
            share = change[i] < 0 ? std::min(share, -force[i] / change[i]) : share;
        }
        for (std::size_t i = 0; i < 4; ++i) {
            ContactPointState<S>& state = stateOf(refs[i]);
            const S grown = S(1) + static_cast<S>(share * change[static_cast<Eigen::Index>(i)]) / state.normalForce;
            state.normalForce *= grown;
            state.friction *= grown;
        }
    }

    ContactPointState<S>& stateOf(const PointRef& ref) {
        return manifolds_[ref.manifold].contacts->points[static_cast<std::size_t>(ref.point)];
    }

    bool slides(const std::vector<PointRef>& refs) const {
        return std::all_of(refs.begin(), refs.end(), [&](const PointRef& ref) {
            const GroundManifold& manifold = manifolds_[ref.manifold];
            const PairSide<S>& body = manifold.pair->body;
            const PairSide<S>& ground = manifold.pair->ground;
            const Vec3d place = body.frame() * manifold.onBody(ref.point);
            const auto at = [&](const PairSide<S>& side) {
                return Vec3d(side.v.template cast<double>() +
                             side.w.template cast<double>().cross(place - side.pose.position.template cast<double>()));
            };
            const Vec3d slip = body.frame().rotation.conjugate() * (at(body) - at(ground));
            return (slip - slip.dot(manifold.normal) * manifold.normal).norm() > slidingSpeed;
        });
    }

    std::vector<PlacedPair<S>> pairs_;
    std::vector<GroundManifold> manifolds_;
    std::vector<PointRef> refs_;
};

// Whether no point of the body slips over the ground faster than the least speed that counts as sliding.
template <class S>
bool isSlow(const PlacedPair<S>& pair) {
    constexpr double sure = 0.5;  // a point may lie a little outside the body
    const PairSide<S>& body = pair.body;
    const double fastest =
        static_cast<double>(body.v.norm()) + static_cast<double>(body.w.norm()) * body.body->kind->radius;
    return pair.ground.v.isZero(S(0)) && pair.ground.w.isZero(S(0)) && fastest < sure * slidingSpeed;
}

// One manifold alone, all in force, that does not slide: most bodies, most of the time.
template <class S>
void closeRun(std::span<const GroundPair<S>> pairs, const SideOf<S>& side) {
    const std::vector<ContactManifold<S>>& manifolds = pairs.front().contacts->manifolds;
    const bool isOne = pairs.size() == 1 && manifolds.size() == 1;
    if (!isOne || manifolds.front().count != manifolds.front().known ||
        (manifolds.front().known == 4 && !isSlow(PlacedPair<S>(pairs.front(), side)))) {
        static thread_local InternalEdges<S> edges;
        edges.cull(pairs, side);
    }
}

// Calls close(run) for the pairs of each body; sorts them by their bodies.
template <class S, class Close>
void forEachRun(std::vector<GroundPair<S>>& pairs, Close close) {
    const auto earlier = [](const GroundPair<S>& p, const GroundPair<S>& q) { return p.mover < q.mover; };
    if (!std::is_sorted(pairs.begin(), pairs.end(), earlier)) {
        std::stable_sort(pairs.begin(), pairs.end(), earlier);
    }
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        while (end < pairs.size() && pairs[end].mover == pairs[begin].mover) {
            ++end;
        }
        close(std::span<const GroundPair<S>>(pairs).subspan(begin, end - begin));
    }
}

}  // namespace

template <class S>
void addGroundPair(std::vector<GroundPair<S>>& out, PairContacts<S>& pair, const Body<S>& a, const Body<S>& b) {
    const bool movesA = a.isDynamic();
    if (pair.manifolds.empty() || movesA == b.isDynamic()) {
        return;
    }
    const Body<S>& mover = movesA ? a : b;
    if (mover.awake || mover.changed) {
        out.push_back({movesA ? pair.pair.a : pair.pair.b, &pair, movesA});
    }
}

template <class S>
void cullInternalEdges(std::vector<GroundPair<S>>& pairs, SideOf<S> side, JobSystem& jobs) {
    if (jobs.threadCount() == 1) {
        cullInternalEdges(pairs, side);
        return;
    }
    std::vector<std::span<const GroundPair<S>>> runs;
    forEachRun(pairs, [&](std::span<const GroundPair<S>> run) { runs.push_back(run); });
    parallelFor(jobs, runs.size(), 16, [&](std::size_t i) { closeRun<S>(runs[i], side); });
}

template <class S>
void cullInternalEdges(std::vector<GroundPair<S>>& pairs, SideOf<S> side) {
    forEachRun(pairs, [&](std::span<const GroundPair<S>> run) { closeRun<S>(run, side); });
}

template void addGroundPair(std::vector<GroundPair<float>>&, PairContacts<float>&, const Body<float>&,
                            const Body<float>&);
template void addGroundPair(std::vector<GroundPair<double>>&, PairContacts<double>&, const Body<double>&,
                            const Body<double>&);
template void cullInternalEdges(std::vector<GroundPair<float>>&, SideOf<float>, JobSystem&);
template void cullInternalEdges(std::vector<GroundPair<float>>&, SideOf<float>);
template void cullInternalEdges(std::vector<GroundPair<double>>&, SideOf<double>, JobSystem&);
template void cullInternalEdges(std::vector<GroundPair<double>>&, SideOf<double>);

}  // namespace cairn
