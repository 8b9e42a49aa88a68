#pragma once
// The joints and locks of an island as sweeps visit them, colour by colour where it has colours: the update of
// sweep.hpp, for the same numbers to rounding, of half the work. Three rows that hold two points together (a pin:
// ball, hinge, weld, cone) have one speed, of b's point against a's; how each of them changes what the next one sees is
// known beforehand, so that they push once. Where there are colours, what is a pin and no more goes through the vector
// unit (pin_kernels.hpp), to the same bits.
#include "engine/solve/kernels/pin_kernels.hpp"
#include "engine/solve/velocity/pushed_bodies.hpp"
#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {

template <class S>
class JointSweeps {
public:
    // Takes the rows that the problem has written out, in the order that they are visited in. `masses`, here and below,
    // of all bodies. Writes Problem::responses, as that says; where those are whole (hasResponses) it leaves them, and
    // is for push() alone. Terms and impulses of the rows may come after it.
    void begin(Problem<S>& problem, const BodyMass<S>* masses, bool hasResponses);
    // The bodies have other masses.
    void couple(Problem<S>& problem, const BodyMass<S>* masses) { couple(problem, masses, problem.limits.isLast); }
    // The rows have other terms, or impulses `share` times what they were.
    void renewTerms() { hasTerms_ = false; }
    void scale(S share);
    // As RowSystem::sweep(). Afterwards impulses are kept here, until writeImpulses().
    S sweep(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, S relaxation);
    // Pushes the bodies by the impulses of all rows. Gives p^T (J v + b) for the twists `before`.
    S push(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Vec6<S>* before);
    void writeImpulses(const Problem<S>& problem, RowSweeps<S>& rows);
    // All impulses, in an order of its own; and more of them.
    std::size_t impulseCount(const RowSweeps<S>& rows) const {
        return packImpulses() + (singles_.empty() ? 0 : rows.p.size());
    }
    void copyImpulses(const RowSweeps<S>& rows, S* out) const;
    void add(RowSweeps<S>& rows, const S* change);

private:
    using Pack = PinPack<S>;
    // A joint that is visited by itself.
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
    struct Ends {
        std::size_t packs, singles;
    };
    static constexpr std::uint32_t alone = UINT32_MAX;

    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    std::uint32_t blockOf(const Problem<S>& problem, std::size_t visit) const {
        return problem.jointOrder.empty() ? static_cast<std::uint32_t>(visit) : problem.jointOrder[visit];
    }
    std::size_t packImpulses() const { return 3 * Pack::width * packs_.size(); }
    PinLanesView<S> view(S* twists, const BodyMass<S>* masses) {
        static_assert(sizeof(BodyMass<S>) == 7 * sizeof(S) && sizeof(Vec6<S>) == 6 * sizeof(S));
        return {packs_.data(), twists, &masses->inverse};
    }
    // Which visits are in packs, and where.
    void layOut(const Problem<S>& problem, const BodyMass<S>* masses);
    // writes: what is read of the responses, too. After the last sub-step of a piece they are measured by.
    void couple(Problem<S>& problem, const BodyMass<S>* masses, bool writes);
    void fillPin(const Problem<S>& problem, std::size_t visit);
    void fillSingle(Problem<S>& problem, std::size_t visit, Visit& joint);
    // Calls visit(pack, lane, first row) for each pin in a lane.
    template <class OnePin>
    void forPins(const Problem<S>& problem, const OnePin& visit);
    void load(const Problem<S>& problem, const RowSweeps<S>& rows);
    S sweepOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Visit& joint,
               S relaxation);
    static S sweepPin(const RowTerms<S>* terms, S* p, const Visit& joint, S relaxation, PushedBodies<S>& bodies);
    S pushOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Vec6<S>* before,
              const Visit& joint) const;
    // Calls packs(begin, end), and visit(joint) of each other one, colour by colour: calls at one time push no body in
    // common. Each writes to results_ by visit, of which this is the sum.
    template <class Packs, class One>
    S sumOverAll(const Problem<S>& problem, const Packs& packs, const One& visit);

    std::vector<Visit> singles_;
    std::vector<std::uint32_t> visitOf_;  // of each of those
    std::vector<Gradient> gradients_;     // by row; those of pins are left out
    std::vector<Pack> packs_;
    std::vector<Ends> ends_;           // of the colours
    std::vector<std::uint32_t> lane_;  // by visit, of all lanes of the packs; or `alone`
    std::vector<S> results_;           // by visit
    std::vector<S> delassus_;          // by pack, row and lane
    bool hasTerms_ = false;            // packs have those of the rows; likewise impulses
    bool hasImpulses_ = false;
    bool hasResponses_ = false;
    bool isAhead_ = false;  // the impulses of the packs are newer than those of the rows
};

}  // namespace cairn
