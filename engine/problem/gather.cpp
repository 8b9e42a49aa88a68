#include "engine/problem/gather.hpp"
#include "base/resize.hpp"
#include "engine/contacts/crowds.hpp"
#include "engine/contacts/internal_edges.hpp"
#include "engine/problem/colouring.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace cairn {
namespace {

// Contacts: with fewer, too many lanes stay empty.
constexpr std::size_t worthLanes = 12;

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
    s.spinChange = body.spinChange();
    s.gyroscopic = body.kind->gyroscopic ? motion.gyroscopic : GyroscopicRule::None;
    s.gyroscopicInertia = motion.gyroscopicInertia && s.gyroscopic != GyroscopicRule::None;
    s.mass = body.kind->mass;
    s.inverseMass = S(1) / body.kind->mass;
    s.localInertia = body.kind->inertia;
    s.particle = body.kind->def.particle;
    s.localInverseInertia = body.kind->inverseInertia;
    s.tolerance = body.kind->def.tolerance;
    s.force << body.kind->mass * static_cast<S>(body.kind->def.gravityScale) * motion.gravity + body.force(),
        body.torque();
    s.linearDecay = static_cast<S>(body.kind->def.linearDamping);
    s.angularDecay = static_cast<S>(body.kind->def.angularDamping);
    return s;
}

// Brings items[order[k]] to place k, without room for them all twice; `order` is used up.
template <class T>
void sortInto(std::vector<T>& items, std::vector<std::uint32_t>& order) {
    for (std::uint32_t first = 0; first < order.size(); ++first) {
        if (order[first] == first) {
            continue;
        }
        const T held = items[first];
        std::uint32_t to = first;
        while (order[to] != first) {
            const std::uint32_t from = std::exchange(order[to], to);
            items[to] = items[from];
            to = from;
        }
        order[to] = to;
        items[to] = held;
    }
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
int Gatherer<S>::placeAmong(const std::vector<int>& fixed, std::uint32_t body) const {
    return world_.bodies[body].isDynamic() ? world_.islands.placeOf(body) : fixed[body];
}

template <class S>
void Gatherer<S>::gather() {
    problem_.clear();
    problem_.jobs = island_.isLarge() ? world_.jobs : nullptr;
    problem_.isDriven = island_.isDriven;
    problem_.isOfCrowd = std::any_of(island_.bodies.begin(), island_.bodies.end(),
                                     [&](std::uint32_t i) { return isOfCrowd(world_.contacts.crowd(), i); });
    // With room for some fixed ones, which would double it.
    constexpr std::size_t fixedBodies = 16;
    if (island_.bodies.size() + fixedBodies > problem_.bodies.capacity()) {
        problem_.bodies.reserve(island_.bodies.size() + island_.bodies.size() / 16 + fixedBodies);
    }
    problem_.bodies.resize(island_.bodies.size());
    problem_.forEach(island_.bodies.size(), [&](std::size_t k) {
        const std::uint32_t i = island_.bodies[k];
        problem_.bodies[k] = solverBody(i, world_.bodies[i], world_.motion);
    });
    problem_.refreshInertia();
    // One body that nothing holds or may touch: heaps that fall have hundreds.
    if (island_.bodies.size() == 1 && island_.joints.empty() && island_.pairs.empty() &&
        !world_.bodies[island_.lowest()].kind->locked) {
        return;
    }
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    for (const std::uint32_t j : island_.joints) {
        const Joint<S>& joint = world_.joints[j];
        std::array<int, 4> body{-1, -1, -1, -1};
        for (int n = 0; n < joint.bodyCount(); ++n) {
            body[static_cast<std::size_t>(n)] = placeOf(joint.body(n).index);
        }
        problem_.joints.push_back({&joint, body[0], body[1], body[2], body[3], j});
    }
    for (std::size_t i = 0; i < island_.bodies.size(); ++i) {
        const std::uint32_t index = island_.bodies[i];
        const Body<S>& source = world_.bodies[index];
        if (source.kind->locked) {
            SolverBody<S>& ground = problem_.bodies.emplace_back();
            ground.fixed = true;
            ground.index = UINT32_MAX;
            problem_.locks.push_back({source.kind->def.lockLinear, source.kind->def.lockAngular, source.home(),
                                      static_cast<int>(problem_.bodies.size()) - 1, static_cast<int>(i),
                                      world_.islands.lock(index).lambda});
        }
    }
    problem_.forEach(island_.pairs.size(), [&](std::size_t k) {
        PairContacts<S>& pair = pairAt(k);
        prefetchAfterPair(k);
        pair.beginStep();
        pair.isNew = false;
    });
    placeFixedBodies();
    fillContacts();
}

template <class S>
void Gatherer<S>::placeFixedBodies() {
    static thread_local std::vector<std::uint8_t> hasFixed;  // by pair of the island
    hasFixed.resize(island_.pairs.size());
    problem_.forEach(hasFixed.size(), [&, into = hasFixed.data()](std::size_t k) {
        const ProxyPair& pair = pairAt(k).pair;
        into[k] = world_.bodies[pair.a].isDynamic() && world_.bodies[pair.b].isDynamic() ? 0 : 1;
    });
    for (std::size_t k = 0; k < hasFixed.size(); ++k) {
        if (hasFixed[k] != 0) {
            placeOf(pairAt(k).pair.a);
            placeOf(pairAt(k).pair.b);
        }
    }
}

template <class S>
void Gatherer<S>::gatherContacts() {
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    fillContacts();
}

template <class S>
void Gatherer<S>::colourJoints() {
    problem_.jointOrder.clear();
    problem_.jointColours.clear();
    if (problem_.jobs == nullptr || problem_.joints.size() + problem_.locks.size() + problem_.rolls.size() == 0) {
        return;
    }
    std::vector<Pushed> joints;
    for (const typename Problem<S>::JointLink& link : problem_.joints) {
        const auto at = [&](int body) { return body < 0 ? -1 : pushed(body); };
        joints.push_back({at(link.a), at(link.b), at(link.c), at(link.d)});
    }
    for (const typename Problem<S>::LockLink& lock : problem_.locks) {
        joints.push_back({lock.b, -1, -1, -1});
    }
    for (const typename Problem<S>::RollLink& roll : problem_.rolls) {
        const ProblemContact<S>& contact = problem_.contacts[roll.contact];
        joints.push_back({pushed(contact.a), pushed(contact.b), -1, -1});
    }
    Colouring colouring;
    findColours(joints, problem_.bodies.size(), colouring);
    // The same again if joints are coloured in the order of their colours: what has impulses stays where it is.
    std::vector<std::uint32_t> joined;
    std::copy_if(colouring.order.begin(), colouring.order.end(), std::back_inserter(joined),
                 [&](std::uint32_t block) { return block < problem_.joints.size(); });
    sortInto(problem_.joints, joined);
    std::uint32_t next = 0;
    for (std::uint32_t& block : colouring.order) {
        block = block < problem_.joints.size() ? next++ : block;
    }
    problem_.jointOrder = std::move(colouring.order);
    problem_.jointColours = std::move(colouring.ends);
}

template <class S>
void Gatherer<S>::colourContacts() {
    static thread_local std::vector<Pushed> pushedBy;
    static thread_local Colouring colouring;
    pushedBy.clear();
    for (const ProblemContact<S>& contact : problem_.contacts) {
        pushedBy.push_back({pushed(contact.a), pushed(contact.b), -1, -1});
    }
    findColours(pushedBy, problem_.bodies.size(), colouring);
    problem_.contactColours = colouring.ends;
    sortInto(problem_.contacts, colouring.order);
}

template <class S>
auto Gatherer<S>::listManifolds() -> Seldom {
    // By pair of the island, where its manifolds begin among the contacts.
    static thread_local std::vector<std::size_t> firstOf;
    firstOf.resize(island_.pairs.size() + 1);
    std::size_t* const first = firstOf.data();  // not those of the thread that runs a part of the loop
    problem_.forEach(island_.pairs.size(), [&](std::size_t k) { first[k + 1] = pairAt(k).manifolds.size(); });
    first[0] = 0;
    std::partial_sum(firstOf.begin(), firstOf.end(), firstOf.begin());
    problem_.contacts.clear();
    problem_.contacts.resize(firstOf.back());
    const std::vector<int>& fixed = fixedPlaces();
    return problem_.sum(island_.pairs.size(), Seldom{}, [&](std::size_t begin, std::size_t end) {
        Seldom seldom;
        for (std::size_t k = begin; k < end; ++k) {
            const PairContacts<S>& pair = pairAt(k);
            prefetchAfterPair(k);
            for (std::uint32_t m = 0; m < pair.manifolds.size(); ++m) {
                const ContactManifold<S>& manifold = pair.manifolds[m];
                ProblemContact<S>& contact = problem_.contacts[first[k] + m];
                contact.pair = island_.pairs[k];
                contact.manifold = m;
                contact.a = placeAmong(fixed, pair.pair.a);
                contact.b = placeAmong(fixed, pair.pair.b);
                contact.count = manifold.count;
                contact.firstRound = manifold.isRound ? 0 : -1;
                contact.friction = manifold.friction;
                contact.staticFriction = manifold.staticFriction;
                contact.restitution = manifold.restitution;
                seldom += {static_cast<bool>(manifold.slips), static_cast<bool>(manifold.rolling)};
            }
        }
        return seldom;
    });
}

template <class S>
void Gatherer<S>::fillContacts() {
    problem_.beginImpulses();
    const Seldom seldom = listManifolds();
    problem_.inLanes = problem_.jobs != nullptr || problem_.contacts.size() >= worthLanes;
    if (problem_.jobs != nullptr) {
        colourContacts();
    }
    int count = 0;
    int rounds = 0;
    for (ProblemContact<S>& contact : problem_.contacts) {
        contact.firstPoint = count;
        count += contact.count;
        if (contact.firstRound >= 0) {
            contact.firstRound = rounds;
            rounds += contact.count;
        }
    }
    problem_.slips.resize(seldom.slips ? static_cast<std::size_t>(count) : 0);
    resizeClosely(problem_.points, static_cast<std::size_t>(count));
    resizeClosely(problem_.places, static_cast<std::size_t>(count));
    resizeClosely(problem_.rounds, static_cast<std::size_t>(rounds));
    problem_.forEach(problem_.contacts.size(), [&](std::size_t c) {
        prefetchAfterContact(c);
        fillPoints(problem_.contacts[c]);
    });
    problem_.rolls.clear();
    if (seldom.rolls) {
        fillRolls();
    }
    colourJoints();
}

template <class S>
void Gatherer<S>::fillRolls() {
    for (std::size_t c = 0; c < problem_.contacts.size(); ++c) {
        const ProblemContact<S>& contact = problem_.contacts[c];
        const Rare<RollingState<S>>& rolling = manifoldOf(contact).rolling;
        const auto turns = [&](int body) { return !problem_.bodies[static_cast<std::size_t>(body)].particle; };
        if (rolling && (rolling->rollingFriction > S(0) || rolling->spinningFriction > S(0)) && contact.count > 0 &&
            turns(contact.a) && turns(contact.b)) {
            problem_.rolls.push_back(
                {static_cast<std::uint32_t>(c), rolling->rollingFriction, rolling->spinningFriction});
            problem_.rolls.back().impulse = rolling->impulse;
        }
    }
}

template <class S>
void Gatherer<S>::fillPoints(ProblemContact<S>& contact) {
    const PairContacts<S>& pair = world_.contacts.pairs()[contact.pair];
    const ContactManifold<S>& manifold = pair.manifolds[contact.manifold];
    int k = 0;
    for (const ContactPointState<S>& from : manifold.inForce()) {
        problem_.placePoint(contact, k,
                            contactGeometry(manifold, from, world_.bodies[pair.pair.a], world_.bodies[pair.pair.b]));
        const std::size_t i = static_cast<std::size_t>(contact.firstPoint + k++);
        problem_.points[i] = {from.separation, from.normalForce, from.friction, from.error, from.preload};
        if (!problem_.slips.empty()) {
            problem_.slips[i] = manifold.slip(from);
        }
    }
}

// After a step: what an exact solution finds at rest. What a contact no longer bears it forgets in some fifty steps: at
// once, a stack that rocks would sink where it is lifted, and lean.
template <class S>
S preloadAfter(const ProblemPoint<S>& point, bool isHeldAtRest) {
    constexpr S forgotten = S(0.02);
    return isHeldAtRest ? point.normalForce
                        : point.preload - forgotten * std::max(S(0), point.preload - point.normalForce);
}

template <class S>
void Gatherer<S>::handContactsBack() {
    problem_.forEach(problem_.contacts.size(), [&](std::size_t c) {
        prefetchAfterContact(c);
        const ProblemContact<S>& contact = problem_.contacts[c];
        ContactManifold<S>& manifold = manifoldOf(contact);
        std::size_t i = static_cast<std::size_t>(contact.firstPoint);
        for (ContactPointState<S>& point : manifold.inForce()) {
            const ProblemPoint<S>& from = problem_.points[i];
            point.normalForce = from.normalForce;
            point.friction = from.friction;
            point.error = from.error;
            point.preload = preloadAfter(from, problem_.isHeldAtRest);
            if (!problem_.slips.empty()) {
                manifold.setSlip(point, problem_.slips[i]);
            }
            const PointGiven<S> given = problem_.givenBy(contact, i++);
            point.impulse += given.impulse;
            point.normalImpulse += given.normal;
        }
    });
    for (const typename Problem<S>::RollLink& roll : problem_.rolls) {
        manifoldOf(problem_.contacts[roll.contact]).rolling->impulse = roll.impulse;
    }
}

template <class S>
void Gatherer<S>::handBack() {
    handContactsBack();
    auto lambda = problem_.jointLambda.begin();
    std::size_t next = 0;  // block
    for (const typename Problem<S>::JointLink& link : problem_.joints) {
        Joint<S>& joint = world_.joints[link.index];
        const int count = problem_.blocks[next].count;
        joint.lambda.assign(lambda, lambda + count);
        lambda += count;
        joint.impulseA = problem_.jointImpulse[next].a;
        joint.impulseB = problem_.jointImpulse[next].b;
        ++next;
    }
    for (const typename Problem<S>::LockLink& lock : problem_.locks) {
        const int count = problem_.blocks[next].count;
        LockState<S>& state = world_.islands.lock(island_.bodies[static_cast<std::size_t>(lock.b)]);
        state.lambda.assign(lambda, lambda + count);
        lambda += count;
        state.impulse = problem_.jointImpulse[next].b;
        ++next;
    }
}

template <class S>
PairSide<S> Gatherer<S>::sideOf(std::uint32_t body, const std::vector<int>& fixed) const {
    const SolverBody<S>& s = problem_.bodies[static_cast<std::size_t>(placeAmong(fixed, body))];
    return {&world_.bodies[body], s.pose, s.v.template head<3>(), s.v.template tail<3>()};
}

template <class S>
void Gatherer<S>::detect(const SpeculativeBounds& speculative, NarrowCounts& counts) {
    handContactsBack();
    const FixedPlaces<S> places(problem_, world_.bodies.slotCount());
    const auto side = [&, &fixed = fixedPlaces()](std::uint32_t body) { return sideOf(body, fixed); };
    counts += problem_.sum(island_.pairs.size(), NarrowCounts{}, [&](std::size_t begin, std::size_t end) {
        NarrowCounts sum;
        for (std::size_t k = begin; k < end; ++k) {
            PairContacts<S>& pair = pairAt(k);
            collidePair(pair, side(pair.pair.a), side(pair.pair.b), speculative, sum);
        }
        return sum;
    });
    static thread_local std::vector<GroundPair<S>> ground;
    ground.clear();
    for (const std::uint32_t p : island_.pairs) {
        PairContacts<S>& pair = world_.contacts.pairs()[p];
        addGroundPair(ground, pair, world_.bodies[pair.pair.a], world_.bodies[pair.pair.b]);
    }
    cullInternalEdges<S>(ground, side);
}

template class Gatherer<float>;
template class Gatherer<double>;

}  // namespace cairn
