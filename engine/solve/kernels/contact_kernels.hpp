#pragma once
// Sweeps over contacts, a contact a lane. What is visited together touches no moving body in common (a colour of
// Problem::contactColours), so that lanes, packs and threads may come in any order and the bits stay the same. Each
// lane does what the scalar code of compact_sweeps.cpp does, operation by operation, without fused multiply-adds: all
// instruction sets have the same bits, and in double those of the scalar code (test ContactKernels.*). Of three
// products of floats Eigen adds the last two first. Plain pointers and no Eigen: its layout changes under the
// instruction sets that these are compiled for.
#include "engine/solve/kernels/lanes.hpp"

#include <vector>

namespace cairn {

// Contacts of one colour, all with `count` points or fewer: bodies, and the frame in this sub-step.
template <class S>
struct alignas(64) ContactPack {
    static constexpr std::size_t width = laneCount<S>;
    using Index = LaneIndex<S>;

    S normal[3][width];
    S tangent1[3][width];
    S tangent2[3][width];
    S apart[3][width];  // m, world, from the centre of mass of a to that of b
    Index bodyA[width];
    Index bodyB[width];
    std::uint32_t contact[width];     // of Problem::contacts
    std::uint32_t firstPoint[width];  // of Problem::points
    std::uint8_t points[width];       // of each; 0: the lane is empty
    std::uint32_t movesA = 0;         // bit k: the body of lane k takes pushes; what does not is shared, and only read
    std::uint32_t movesB = 0;
    std::uint32_t firstRow = 0;  // of the PointPacks, one for each of `count` points
    std::uint32_t count = 0;
    std::uint32_t lanes = 0;  // that have a contact: the first ones
    // Not all lanes are flat. Its ContactLanesView::rounds begin here, one for each of `count` points.
    bool isRound = false;
    std::uint32_t firstRound = 0;
};

// A point of each contact of a pack, as ContactRows; the arm on a is `apart` longer. Of lanes without one C is
// infinite.
template <class S>
struct alignas(64) PointPack {
    static constexpr std::size_t width = ContactPack<S>::width;

    S armB[3][width];
    S C[width];
    S delassus[3][width];
    S friction[width];
    S impulse[3][width];
    S bias[width];  // infinite: the point is open, and left alone
    S softness[width];
    S start[width];  // m, startOfSpring(), of the first sub-step, before whose begin() it is the preload, N
};

// Where the forces of a contact act on b: contactArms().
enum class ArmRule : std::uint8_t { OnB, OnA, CentreOfA, CentreOfB };

// What carries the frame of a contact.
enum class FrameCarrier : std::uint8_t { A, B, World };

// The frames of a pack as ContactGeometry has them for the step, each in axes of its carrier.
template <class S>
struct alignas(64) FramePack {
    static constexpr std::size_t width = ContactPack<S>::width;

    S normal[3][width];
    S tangent1[3][width];
    S tangent2[3][width];
    S carrier[width];  // a FrameCarrier
    S rule[width];     // an ArmRule
};

// A place on a and one on b, m, for a point of each contact of a pack. Of lanes without one anything.
template <class S>
struct alignas(64) PlacePack {
    static constexpr std::size_t width = ContactPack<S>::width;

    S onA[3][width];
    S onB[3][width];
};

// What points gave since the first sub-step, N s: on b, world axes; and along the normal.
template <class S>
struct alignas(64) GivenPack {
    static constexpr std::size_t width = ContactPack<S>::width;

    S impulse[3][width];
    S normal[width];
};

// What the kernels read and write.
template <class S>
struct ContactLanesView {
    ContactPack<S>* packs;
    PointPack<S>* points;
    const FramePack<S>* frames;  // by pack
    GivenPack<S>* given;         // by PointPack
    // For the step: likewise, from the centres of mass, in the bodies' axes, without the round parts; and of packs that
    // are not all flat these, in the world's axes at the start of the step.
    const PlacePack<S>* places;
    const PlacePack<S>* rounds;
    const S* placements;  // twelve a body: columns of its rotation and position, m
    S* twists;            // six a body
    const S* masses;      // seven a body: 1/kg, and of the inverse inertia in world axes xx, yy, zz, xy, xz, yz
};

// Of the push-out, as PushOutSpring; h in s.
template <class S>
struct ContactTermRule {
    S rate, stiffness, maxSpeed, deepRate, deepFrom, deepSpeed, h;
    S warmStart;   // share of the impulses to start from
    bool isFirst;  // sub-step of the step
    S mostStart;   // m, of PointPack::start
};

// Each over packs [begin, end).
template <class S>
struct ContactKernels {
    const char* instructionSet;
    // Frames, arms and C where the bodies are now.
    void (*place)(const ContactLanesView<S>&, std::size_t begin, std::size_t end);
    // Delassus, bias, softness and the impulses to start from.
    void (*begin)(const ContactLanesView<S>&, std::size_t begin, std::size_t end, const ContactTermRule<S>& rule);
    // Pushes the bodies by the impulses. To `work`, by point: p^T (J v + b) for the twists `before`.
    void (*push)(const ContactLanesView<S>&, std::size_t begin, std::size_t end, const S* before, S* work);
    // A sweep as CompactSweeps::sweepContacts(). To `change`, by contact: what it changed.
    void (*sweep)(const ContactLanesView<S>&, std::size_t begin, std::size_t end, S relaxation, S* change);
    // Turns to sweeps without push-out.
    void (*relax)(const ContactLanesView<S>&, std::size_t begin, std::size_t end, S h);
    // Adds the impulses to what the points gave.
    void (*give)(const ContactLanesView<S>&, std::size_t begin, std::size_t end);
};

// Those of the best instruction set that this machine has.
template <class S>
const ContactKernels<S>& contactKernels();
// Of all that it has.
template <class S>
std::vector<ContactKernels<S>> allContactKernels();

}  // namespace cairn
