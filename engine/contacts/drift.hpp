#pragma once
// Bodies that fly together. How far ahead contacts are looked for hangs on how fast each body goes, since one of a pair
// may be stopped by something else: by what stands, or by what is stopped in its turn. What can meet nothing but each
// other is stopped by nothing that stands, and its motion counts in a frame that moves along: limbs of a ragdoll that
// falls at 15 m/s go a quarter of a metre in a step, and some millimetres against each other.
#include "collision/broad_phase/broad_phase.hpp"
#include "engine/constraints/joint.hpp"
#include "engine/model/body.hpp"

#include <span>

namespace cairn {

template <class S>
class CommonDrift {
public:
    // Looks for it. pairs: of bodies whose boxes, of the way within dt, are near. Where nobody goes farther than
    // `margin` (m) within dt there is none.
    void find(const std::vector<ProxyPair>& pairs, const BodyTable<S>& bodies, const JointTable<S>& joints,
              std::span<const std::uint32_t> awakeBodies, std::span<const std::uint32_t> awakeJoints, S dt, S margin);
    bool any() const { return !velocities_.empty(); }
    // m/s, of the frame that a body flies in; zero of what may meet what stands or sleeps, or is tied to it.
    Vec3<S> of(std::uint32_t body) const {
        const bool flies = any() && placeOf_[body] != none;
        return flies ? velocities_[placeOf_[body]] : Vec3<S>(Vec3<S>::Zero());
    }

private:
    // What all bodies weigh (kg), and carry along (kg m/s), that are connected to one.
    struct Flight {
        S mass = 0;
        Vec3<S> momentum = Vec3<S>::Zero();
        bool isHeld = false;  // by what stands or sleeps
    };
    static constexpr std::uint32_t none = UINT32_MAX;

    void connect(std::uint32_t a, std::uint32_t b);
    std::uint32_t rootOf(std::uint32_t place);

    std::vector<std::uint32_t> placeOf_;  // by body: among flyers_; none: it is not awake, or no force moves it
    std::vector<std::uint32_t> flyers_;
    std::vector<std::uint32_t> parents_;  // by place, as the next: of a forest of those connected
    std::vector<Flight> flights_;
    std::vector<Vec3<S>> velocities_;
};

}  // namespace cairn
