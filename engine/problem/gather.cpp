#include "engine/problem/gather.hpp"
#include "engine/contacts/internal_edges.hpp"
#include "engine/model/gyroscopics.hpp"

namespace cairn {
namespace {

template <class S>
SolverBody<S> solverBody(std::uint32_t index, const Body<S>& body, const MotionSettings<S>& motion) {
    SolverBody<S> s;
    s.index = index;
    s.fixed = !body.isDynamic();
    s.pose = body.pose;
    s.v << body.v, body.w;
    s.vBefore = s.v;
    s.acceleration = body.acceleration;
    if (s.fixed) {
        return s;
    }
    s.gyroscopic = body.gyroscopic ? motion.gyroscopic : GyroscopicRule::None;
    s.gyroscopicInertia = motion.gyroscopicInertia && s.gyroscopic != GyroscopicRule::None;
    s.mass = body.mass;
    s.inverseMass = S(1) / body.mass;
    s.localInertia = body.inertia;
    s.particle = body.def.particle;
    if (!s.particle) {
        s.localInverseInertia = inverseOf<S>(body.inertia);
    }
    s.tolerance = body.def.tolerance;
    s.force << body.mass * static_cast<S>(body.def.gravityScale) * motion.gravity + body.force, body.torque;
    s.linearDecay = static_cast<S>(body.def.linearDamping);
    s.angularDecay = static_cast<S>(body.def.angularDamping);
    s.refreshInertia();
    return s;
}

// Where the fixed bodies of the problem that a thread has at hand are in it, by index; -1: not there.
std::vector<int>& fixedPlaces() {
    static thread_local std::vector<int> places;
    return places;
}

// Sets and clears them for those that the problem has, now and at the end.
template <class S>
class FixedPlaces {
public:
    FixedPlaces(const Problem<S>& problem, std::size_t slots) : problem_(problem) {
        if (fixedPlaces().size() < slots) {
            fixedPlaces().resize(slots, -1);
        }
        int place = 0;
        for (const SolverBody<S>& body : problem.bodies) {
            set(body, place++);
        }
    }
    ~FixedPlaces() {
        for (const SolverBody<S>& body : problem_.bodies) {
            set(body, -1);
        }
    }
    FixedPlaces(const FixedPlaces&) = delete;
    FixedPlaces& operator=(const FixedPlaces&) = delete;

private:
    static void set(const SolverBody<S>& body, int place) {
        if (body.fixed && body.index != UINT32_MAX) {
            fixedPlaces()[body.index] = place;
        }
    }
    const Problem<S>& problem_;
};

}  // namespace

template <class S>
int Gatherer<S>::placeOf(std::uint32_t body) {
    if (world_.bodies[body].isDynamic()) {
        return world_.islands.placeOf(body);
    }
    int& place = fixedPlaces()[body];
    if (place < 0) {
        place = static_cast<int>(problem_.bodies.size());
        problem_.bodies.push_back(solverBody(body, world_.bodies[body], world_.motion));
    }
    return place;
}

template <class S>
void Gatherer<S>::gather() {
    problem_.clear();
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    for (const std::uint32_t i : island_.bodies) {
        problem_.bodies.push_back(solverBody(i, world_.bodies[i], world_.motion));
    }
    for (const std::uint32_t j : island_.joints) {
        const Joint<S>& joint = world_.joints[j];
        std::array<int, 4> body{-1, -1, -1, -1};
        for (int n = 0; n < joint.bodyCount(); ++n) {
            body[static_cast<std::size_t>(n)] = placeOf(joint.body(n).index);
        }
        problem_.joints.push_back({&joint, body[0], body[1], body[2], body[3]});
    }
    for (std::size_t i = 0; i < island_.bodies.size(); ++i) {
        const std::uint32_t index = island_.bodies[i];
        const Body<S>& source = world_.bodies[index];
        if (source.locked) {
            SolverBody<S>& ground = problem_.bodies.emplace_back();
            ground.fixed = true;
            ground.index = UINT32_MAX;
            problem_.locks.push_back({source.def.lockLinear, source.def.lockAngular, source.home,
                                      static_cast<int>(problem_.bodies.size()) - 1, static_cast<int>(i),
                                      world_.islands.lockLambda(index)});
        }
    }
    for (const std::uint32_t p : island_.pairs) {
        PairContacts<S>& pair = world_.contacts.pairs()[p];
        pair.beginStep();
        pair.isNew = false;
        placeOf(pair.pair.a);
        placeOf(pair.pair.b);
    }
    fillContacts();
}

template <class S>
void Gatherer<S>::gatherContacts() {
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    fillContacts();
}

template <class S>
void Gatherer<S>::fillContacts() {
    problem_.contacts.clear();
    problem_.points.clear();
    for (const std::uint32_t p : island_.pairs) {
        const PairContacts<S>& pair = world_.contacts.pairs()[p];
        const Body<S>& bodyA = world_.bodies[pair.pair.a];
        const Body<S>& bodyB = world_.bodies[pair.pair.b];
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            const int a = placeOf(pair.pair.a);
            const int b = placeOf(pair.pair.b);
            problem_.contacts.push_back({a, b, static_cast<int>(problem_.points.size()), manifold.count,
                                         manifold.friction, manifold.staticFriction, manifold.restitution});
            for (const ContactPointState<S>& from : manifold.inForce()) {
                ProblemPoint<S>& point = problem_.points.emplace_back();
                point.geometry = contactGeometry(manifold, from, bodyA, bodyB);
                point.separation = from.separation;
                point.normalForce = from.normalForce;
                point.friction = from.friction;
                point.slip = from.slip;
                point.impulse = from.impulse;
                point.normalImpulse = from.normalImpulse;
                point.error = from.error;
            }
        }
    }
    problem_.startContacts();
}

template <class S>
void Gatherer<S>::handContactsBack() {
    const ProblemPoint<S>* from = problem_.points.data();
    for (const std::uint32_t p : island_.pairs) {
        for (ContactManifold<S>& manifold : world_.contacts.pairs()[p].manifolds) {
            for (ContactPointState<S>& point : manifold.inForce()) {
                point.normalForce = from->normalForce;
                point.friction = from->friction;
                point.slip = from->slip;
                point.impulse = from->impulse;
                point.normalImpulse = from->normalImpulse;
                point.error = from->error;
                ++from;
            }
        }
    }
}

template <class S>
void Gatherer<S>::handBack() {
    handContactsBack();
    auto lambda = problem_.jointLambda.begin();
    std::size_t next = 0;  // block
    for (const std::uint32_t j : island_.joints) {
        Joint<S>& joint = world_.joints[j];
        const int count = problem_.blocks[next].count;
        joint.lambda.assign(lambda, lambda + count);
        lambda += count;
        joint.impulseA = problem_.jointImpulse[next].a;
        joint.impulseB = problem_.jointImpulse[next].b;
        ++next;
    }
    for (const typename Problem<S>::LockLink& lock : problem_.locks) {
        const int count = problem_.blocks[next++].count;
        world_.islands.lockLambda(island_.bodies[static_cast<std::size_t>(lock.b)]).assign(lambda, lambda + count);
        lambda += count;
    }
}

template <class S>
void Gatherer<S>::detect(const SpeculativeBounds& speculative, NarrowCounts& counts) {
    handContactsBack();
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    const auto side = [&](std::uint32_t body) {
        const std::size_t place = static_cast<std::size_t>(placeOf(body));
        const SolverBody<S>& s = problem_.bodies[place];
        return PairSide<S>{&world_.bodies[body], s.pose, s.v.template head<3>(), s.v.template tail<3>()};
    };
    static thread_local std::vector<GroundPair<S>> ground;
    ground.clear();
    for (const std::uint32_t p : island_.pairs) {
        PairContacts<S>& pair = world_.contacts.pairs()[p];
        const PairSide<S> a = side(pair.pair.a);
        const PairSide<S> b = side(pair.pair.b);
        collidePair(pair, a, b, speculative, counts);
        addGroundPair(ground, pair, *a.body, *b.body);
    }
    cullInternalEdges<S>(ground, side);
}

template class Gatherer<float>;
template class Gatherer<double>;

}  // namespace cairn
