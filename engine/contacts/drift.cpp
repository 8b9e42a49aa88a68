#include "engine/contacts/drift.hpp"

#include <algorithm>
#include <numeric>

namespace cairn {

template <class S>
void CommonDrift<S>::find(const std::vector<ProxyPair>& pairs, const BodyTable<S>& bodies, const JointTable<S>& joints,
                          std::span<const std::uint32_t> awakeBodies, std::span<const std::uint32_t> awakeJoints, S dt,
                          S margin) {
    for (const std::uint32_t i : flyers_) {
        placeOf_[i] = none;
    }
    flyers_.clear();
    velocities_.clear();
    const S slow = margin / dt;
    if (std::none_of(awakeBodies.begin(), awakeBodies.end(),
                     [&](std::uint32_t i) { return bodies[i].v.squaredNorm() > slow * slow; })) {
        return;
    }
    placeOf_.resize(bodies.slotCount(), none);
    flights_.clear();
    for (const std::uint32_t i : awakeBodies) {
        if (bodies[i].isDynamic() && bodies[i].awake && placeOf_[i] == none) {
            placeOf_[i] = static_cast<std::uint32_t>(flyers_.size());
            flyers_.push_back(i);
            const S mass = bodies[i].kind->mass;
            flights_.push_back({mass, mass * bodies[i].v, bodies[i].kind->locked});
        }
    }
    parents_.resize(flyers_.size());
    std::iota(parents_.begin(), parents_.end(), 0U);
    for (const ProxyPair& pair : pairs) {
        connect(placeOf_[pair.a], placeOf_[pair.b]);
    }
    for (const std::uint32_t j : awakeJoints) {
        for (int k = 1; k < joints[j].bodyCount(); ++k) {
            connect(placeOf_[joints[j].body(0).index], placeOf_[joints[j].body(k).index]);
        }
    }
    // Roots are lower than what hangs on them.
    for (std::uint32_t place = static_cast<std::uint32_t>(flyers_.size()); place-- > 0;) {
        if (const std::uint32_t root = rootOf(place); root != place) {
            flights_[root].mass += flights_[place].mass;
            flights_[root].momentum += flights_[place].momentum;
            flights_[root].isHeld = flights_[root].isHeld || flights_[place].isHeld;
        }
    }
    velocities_.resize(flyers_.size());
    for (std::uint32_t place = 0; place < flyers_.size(); ++place) {
        const Flight& flight = flights_[rootOf(place)];
        // What is beyond numbers the step puts back.
        const bool flies = !flight.isHeld && flight.momentum.allFinite();
        velocities_[place] = flies ? Vec3<S>(flight.momentum / flight.mass) : Vec3<S>(Vec3<S>::Zero());
    }
}

template <class S>
void CommonDrift<S>::connect(std::uint32_t a, std::uint32_t b) {
    if (a == none || b == none) {
        if (a != b) {
            flights_[std::min(a, b)].isHeld = true;
        }
        return;
    }
    const std::uint32_t rootA = rootOf(a);
    const std::uint32_t rootB = rootOf(b);
    parents_[std::max(rootA, rootB)] = std::min(rootA, rootB);
}

template <class S>
std::uint32_t CommonDrift<S>::rootOf(std::uint32_t place) {
    while (parents_[place] != place) {
        place = parents_[place] = parents_[parents_[place]];
    }
    return place;
}

template class CommonDrift<float>;
template class CommonDrift<double>;

}  // namespace cairn
