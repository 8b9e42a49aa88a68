#pragma once
// The joints and locks of an island as sweeps visit them, colour by colour where it has colours: the update of
// sweep.hpp, for the same numbers to rounding, of half the work. Three rows that hold two points together (a pin:
// ball, hinge, weld, cone) have one speed, of b's point against a's; how each of them changes what the next one sees is
// known beforehand, so that they push once.
#include "engine/solve/velocity/pushed_bodies.hpp"
#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {

template <class S>
class JointSweeps {
public:
    // Takes the rows that the problem has written out, in the order that they are visited in. `masses`, here and below,
    // of all bodies. Writes Problem::responses, as that says.
    void begin(Problem<S>& problem, const BodyMass<S>* masses);
    // The bodies have other masses.
    void couple(Problem<S>& problem, const BodyMass<S>* masses);
    // As RowSystem::sweep().
    S sweep(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, S relaxation);
    // Pushes the bodies by the impulses of all rows. Gives p^T (J v + b) for the twists `before`.
    S push(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Vec6<S>* before) const;

private:
    struct Visit {
        int a, b;  // bodies
        int first, count;
        std::uint32_t block;  // of Problem::blocks
        bool particles;
        bool isPin;  // the first three rows hold two points together
        Vec3<S> armA, armB;
        Vec3<S> axes[3];  // of those rows
        S coupling[3];    // J_i M^-1 J_j^T of rows 1, 0; 2, 0; 2, 1
    };
    struct Gradient {
        Vec6<S> a, b;
    };

    void layOut(const Problem<S>& problem, std::size_t i, std::uint32_t block);
    S sweepOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Visit& joint,
               S relaxation);
    static S sweepPin(const RowTerms<S>* terms, S* p, const Visit& joint, S relaxation, PushedBodies<S>& bodies);
    S pushOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Vec6<S>* before,
              const Visit& joint) const;
    // Sums part(begin, end) over visits, colour by colour.
    template <class Part>
    S sumColours(const Problem<S>& problem, const Part& part) const;

    std::vector<Visit> visits_;
    std::vector<Gradient> gradients_;  // by row; those of pins are left out
};

}  // namespace cairn
