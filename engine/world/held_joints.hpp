#pragma once
// Joints of bodies that continuous collision holds back. Each body goes back along its own way, and where bodies turn,
// what a joint holds together at both ends of their ways is apart between them, by the sagittas of their arcs: a hand
// that turns by a radian in the step by a centimetre.
#include "engine/constraints/joint.hpp"

namespace cairn {

template <class S>
class HeldJoints {
public:
    HeldJoints(BodyTable<S>& bodies, const JointTable<S>& joints) : bodies_(bodies), joints_(joints) {}

    // Reads the errors, at the present poses, of all joints of which isHeld(body) says that they hold one such, but
    // those that are torn. The bodies are to be held back then.
    template <class IsHeld>
    void read(const IsHeld& isHeld) {
        held_.clear();
        errors_.clear();
        isStill_.assign(bodies_.slotCount(), 0);
        joints_.forEach([&](std::size_t j) {
            for (int k = 0; k < joints_[j].bodyCount(); ++k) {
                if (isHeld(joints_[j].body(k).index)) {
                    add(j);
                    return;
                }
            }
        });
    }
    bool any() const { return !held_.empty(); }
    // It is to stay where it is: at what it met, which it would be moved into.
    void keepStill(std::uint32_t body) { isStill_[body] = 1; }
    // Moves the other dynamic bodies, by as little as may be in the metric of mass, until the rows that give way to
    // nothing err as they did: nonlinear Gauss-Seidel on positions (theory 6.2).
    void close();

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    struct HeldJoint {
        std::size_t joint, firstError;
    };

    void add(std::size_t joint);
    void linearize(const Joint<S>& joint);
    // Gives how far it was off, m or rad.
    S close(const HeldJoint& joint);

    BodyTable<S>& bodies_;
    const JointTable<S>& joints_;
    std::vector<HeldJoint> held_;
    std::vector<std::uint8_t> isStill_;  // by body
    std::vector<S> errors_;              // m or rad, of their rows, in their order
    std::vector<Row<S>> rows_;           // scratch
    RowBlock<S> block_;
};

}  // namespace cairn
