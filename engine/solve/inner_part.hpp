#pragma once
// The bodies of an island that ask for a tolerance of their own (BodyDef::tolerance), taken out of it to be solved
// again without the rest: a ragdoll in a pile. What touches them moves as the island's last solution says (it takes no
// push, as a kinematic body does not), and afterwards gets the impulse by which the two solutions differ: momentum is
// kept, and where the rest then goes is seen by the next step.
#include "engine/solve/checkpoint.hpp"

namespace cairn {

template <class S>
class InnerPart {
public:
    // `whole`: solved, at the end of the step of length dt (s) that began at `start`; left as it is.
    InnerPart(Island<S>& whole, const Checkpoint<S>& start, S dt);

    Island<S>& island() { return part_; }
    void restart() { start_->restore(part_); }
    // Puts what the part has come to into the whole.
    void handBack(Island<S>& whole);

private:
    int take(Island<S>& whole, int body, const std::vector<SolverBody<S>>& after, S dt);

    Island<S> part_;
    std::vector<int> placeOf_;         // in the part, of each body of the whole; -1: none
    std::vector<std::size_t> source_;  // in the whole, of each body of the part
    std::optional<Checkpoint<S>> start_;
};

}  // namespace cairn
