#pragma once
// Sweeps over pins, a pin a lane: the three rows by which a joint holds a point of b at one of a. What is visited
// together touches no moving body in common (a colour of Problem::jointOrder). Each lane does what the scalar code of
// joint_sweeps.cpp does, operation by operation, as in contact_kernels.hpp (test PinKernels.*).
#include "engine/solve/kernels/lanes.hpp"

#include <vector>

namespace cairn {

// Pins of one colour, and their rows in this sub-step. Of a lane without one, which is all zero, nothing is written.
template <class S>
struct alignas(64) PinPack {
    static constexpr std::size_t width = laneCount<S>;

    S armA[3][width];      // m, world, from the centre of mass of a to the point
    S armB[3][width];      // likewise of b
    S axes[3][3][width];   // of each row
    S coupling[3][width];  // J_i M^-1 J_j^T of rows 1, 0; 2, 0; 2, 1
    S delassus[3][width];
    S bias[3][width];
    S softness[3][width];
    S impulse[3][width];
    LaneIndex<S> bodyA[width];
    LaneIndex<S> bodyB[width];
    std::uint32_t visit[width];  // which of all that are swept
    std::uint32_t movesA = 0;    // bit k: the body of lane k takes pushes; what does not is shared, and only read
    std::uint32_t movesB = 0;
    std::uint32_t count = 0;  // lanes that have a pin: the first ones
};

template <class S>
struct PinLanesView {
    PinPack<S>* packs;
    S* twists;        // six a body
    const S* masses;  // seven a body, as ContactLanesView has them
};

// Each over packs [begin, end).
template <class S>
struct PinKernels {
    const char* instructionSet;
    // Couplings. To `delassus`, three a pack and lane: J M^-1 J^T of the rows.
    void (*couple)(const PinLanesView<S>&, std::size_t begin, std::size_t end, S* delassus);
    // Pushes the bodies by the impulses. To `work`, by visit: p^T (J v + b) for the twists `before`.
    void (*push)(const PinLanesView<S>&, std::size_t begin, std::size_t end, const S* before, S* work);
    // A sweep as RowSystem::sweep(). To `change`, by visit: what it changed.
    void (*sweep)(const PinLanesView<S>&, std::size_t begin, std::size_t end, S relaxation, S* change);
};

// Those of the best instruction set that this machine has.
template <class S>
const PinKernels<S>& pinKernels();
// Of all that it has.
template <class S>
std::vector<PinKernels<S>> allPinKernels();

}  // namespace cairn
