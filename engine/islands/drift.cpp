#include "engine/islands/drift.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Bodies by whom they are connected to; what stands or sleeps is not among them, and holds whom it is connected to.
class Flights {
public:
    explicit Flights(std::size_t slots) : parents_(slots, none), isHeld_(slots, 0) {}
    void add(std::uint32_t body) { parents_[body] = body; }
    void hold(std::uint32_t body) { isHeld_[body] = 1; }
    void connect(std::uint32_t a, std::uint32_t b) {
        const bool isA = parents_[a] != none;
        const bool isB = parents_[b] != none;
        if (isA && isB) {
            const std::uint32_t rootA = rootOf(a);
            const std::uint32_t rootB = rootOf(b);
            parents_[std::max(rootA, rootB)] = std::min(rootA, rootB);
        } else if (isA || isB) {
            hold(isA ? a : b);
        }
    }
    bool has(std::uint32_t body) const { return parents_[body] != none; }
    bool isHeld(std::uint32_t body) const { return isHeld_[body] != 0; }
    std::uint32_t rootOf(std::uint32_t body) {
        while (parents_[body] != body) {
            body = parents_[body] = parents_[parents_[body]];
        }
        return body;
    }

private:
    static constexpr std::uint32_t none = UINT32_MAX;
    std::vector<std::uint32_t> parents_;
    std::vector<std::uint8_t> isHeld_;
};

}  // namespace

template <class S>
void findDrift(const std::vector<ProxyPair>& pairs, const BodyTable<S>& bodies, const JointTable<S>& joints,
               const AwakeSet& awake, S dt, S margin, std::vector<Vec3<S>>& drift) {
    drift.clear();
    const S slow = margin / dt;
    if (std::none_of(awake.bodies.begin(), awake.bodies.end(),
                     [&](std::uint32_t i) { return bodies[i].v.squaredNorm() > slow * slow; })) {
        return;
    }
    Flights flights(bodies.slotCount());
    for (const std::uint32_t i : awake.bodies) {
        if (bodies[i].isDynamic()) {
            flights.add(i);
            if (bodies[i].kind->locked) {
                flights.hold(i);
            }
        }
    }
    for (const ProxyPair& pair : pairs) {
        flights.connect(pair.a, pair.b);
    }
    for (const std::uint32_t j : awake.joints) {
        for (int k = 1; k < joints[j].bodyCount(); ++k) {
            flights.connect(joints[j].body(0).index, joints[j].body(k).index);
        }
    }
    // By root: what all of it weigh and carry along.
    struct Flight {
        S mass = 0;                          // kg
        Vec3<S> momentum = Vec3<S>::Zero();  // kg m/s
        bool isHeld = false;
    };
    std::vector<Flight> flightOf(bodies.slotCount());
    for (const std::uint32_t i : awake.bodies) {
        if (flights.has(i)) {
            Flight& flight = flightOf[flights.rootOf(i)];
            flight.mass += bodies[i].kind->mass;
            flight.momentum += bodies[i].kind->mass * bodies[i].v;
            flight.isHeld = flight.isHeld || flights.isHeld(i);
        }
    }
    drift.assign(bodies.slotCount(), Vec3<S>::Zero());
    for (const std::uint32_t i : awake.bodies) {
        if (flights.has(i)) {
            const Flight& flight = flightOf[flights.rootOf(i)];
            if (!flight.isHeld) {
                drift[i] = flight.momentum / flight.mass;
            }
        }
    }
}

template void findDrift(const std::vector<ProxyPair>&, const BodyTable<float>&, const JointTable<float>&,
                        const AwakeSet&, float, float, std::vector<Vec3<float>>&);
template void findDrift(const std::vector<ProxyPair>&, const BodyTable<double>&, const JointTable<double>&,
                        const AwakeSet&, double, double, std::vector<Vec3<double>>&);

}  // namespace cairn
