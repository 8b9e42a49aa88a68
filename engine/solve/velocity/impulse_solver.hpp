#pragma once
// What the solvers on impulses have in common; they differ in iterate() alone. Per sub-step:
//     v* <- predict;  rows at x, taken once;  v, p <- iterate(with push-out);  x <- x + h v;  v, p <- iterate(without).
// Errors of hard rows are worked off by a stiff, over-damped spring in the sweeps that move the bodies; sweeps without
// it follow ("relax"), so that the push-out leaves no speed behind. Full correction with a full warm start diverges
// (theory section 9.5, finding b).
#include "engine/solve/solver.hpp"
#include "engine/solve/velocity/compact_sweeps.hpp"

#include <algorithm>
#include <numbers>

namespace cairn {

// How a solver on impulses takes contacts up.
enum class ContactForm : std::uint8_t {
    Compact,  // compact_sweeps.hpp
    Rows,     // written out, where single rows are asked for
};

template <class S>
class ImpulseSolver : public Solver<S> {
public:
    // The spring by which hard rows are pushed out: `phase`, rad, h omega, and its damping ratio. .25/h Hz and 10 is as
    // stiff as one sweep of gauss_seidel a sub-step bears: at twice that towers of ten wander.
    struct PushOut {
        double phase = 0.5 * std::numbers::pi;
        double dampingRatio = 10;
        // As PushOutSpring, deepShare the part in a sub-step.
        double deepShare = 0;
        double deepFrom = 0;
        double deepSpeed = 0;

        PushOutSpring<S> spring(S h, S maxSpeed) const {
            const S stiff = S(2) * static_cast<S>(dampingRatio) + static_cast<S>(phase);
            return {static_cast<S>(phase) / stiff / h, static_cast<S>(phase) * stiff, maxSpeed,
                    static_cast<S>(deepShare) / h,     static_cast<S>(deepFrom),      static_cast<S>(deepSpeed)};
        }
    };
    // As stiff as sweeps with conjugate directions bear, six and more a sub-step.
    static PushOut conjugatePushOut() { return {.phase = 5, .dampingRatio = 5}; }
    // What a solver takes where the settings ask for nothing else.
    struct Sweeps {
        int substeps;
        int iterations;
        // Without push-out, after the bodies have moved. They have nothing to start from but the pushed-out answer: one
        // leaves visible speed in four-point contacts.
        int relaxing = 2;
        PushOut pushOut = {};
    };
    ImpulseSolver(const SolverSettings& settings, ContactForm form, const Sweeps& sweeps)
        : settings_(settings),
          substeps_(settings.def.substeps > 0 ? settings.def.substeps : sweeps.substeps),
          iterations_(settings.def.iterations > 0 ? settings.def.iterations : sweeps.iterations),
          relaxing_(settings.def.iterations > 0 ? std::max(2, settings.def.iterations) : sweeps.relaxing),
          form_(form),
          pushOut_(sweeps.pushOut) {}
    SolveReport advance(Problem<S>& problem, S h) override {
        return form_ == ContactForm::Compact ? advanceWith<CompactSweeps<S>>(problem, h)
                                             : advanceWith<RowSweeps<S>>(problem, h);
    }
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override {
        return {.substeps = substeps_, .mayBeRefused = false};
    }
    // A sub-step of ContactForm::Compact begins. Gives the spring of the joints: `spring` is that of the contacts.
    virtual PushOutSpring<S> begin(Problem<S>&, const PushOutSpring<S>& spring, S) { return spring; }
    // Whether iterate() reads what Problem::responses hold beside delassus.
    virtual bool readsResponses(const Problem<S>&) const { return form_ == ContactForm::Rows; }
    // Lowers the error of `system` by `iterations` sweeps; the second of those with ContactForm::Compact alone.
    virtual void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) = 0;
    virtual void iterate(Problem<S>&, CompactSweeps<S>&, int) { CAIRN_CHECK(false, "a solver on rows written out"); }
    // The same of the sweeps that move the bodies by h (s).
    virtual void iterateMoving(Problem<S>& problem, CompactSweeps<S>& system, int iterations, S) {
        iterate(problem, system, iterations);
    }

protected:
    SolverSettings settings_;
    int substeps_;
    int iterations_;
    int relaxing_;

private:
    template <class System>
    SolveReport advanceWith(Problem<S>& problem, S h);

    ContactForm form_;
    PushOut pushOut_;
};

}  // namespace cairn
