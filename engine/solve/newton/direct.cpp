#include "engine/solve/newton/direct.hpp"
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"
#include "engine/solve/newton/direct_tuning.hpp"
#include "engine/solve/newton/joint_newton.hpp"
#include "engine/solve/newton/widen.hpp"

namespace cairn {

// Newton works in double whatever the world's precision: a load of 1e4 : 1 leaves no digits of a float for the light
// body.
template <class S>
struct DirectMemory {
    ContactNewton<double> newton;
    JointNewton<S> joints;
    Problem<double> wide;     // bodies and rows of a float island, in double
    std::uint64_t graph = 0;  // for which cost was predicted
    double factorWork = 0;
};

template <class S>
S fastestCentre(const Problem<S>& problem) {
    S fastest = 0;
    for (const SolverBody<S>& body : problem.bodies) {
        fastest = std::max(fastest, body.vBefore.template head<3>().norm());
    }
    return fastest;
}

namespace {

using Tuning = DirectTuning;

template <class S>
DirectMemory<S>& memoryOf(Problem<S>& problem) {
    if (!problem.memory.direct) {
        problem.memory.direct = std::make_shared<DirectMemory<S>>();
    }
    if (problem.memory.isShared) {
        problem.memory.direct->newton.forget();
    }
    return *problem.memory.direct;
}

// Whether contacts are expected to open and shut.
template <class S>
bool isActiveSetChanging(const Problem<S>& problem) {
    return !problem.contacts.empty() && fastestCentre(problem) > static_cast<S>(Tuning::movingSpeed);
}

// Contacts are looked for before bodies meet: what only passes by must not cost a chain the solution of joints alone.
template <class S>
bool touchesNothing(const Problem<S>& problem) {
    return std::none_of(problem.points.begin(), problem.points.end(), [](const ProblemPoint<S>& point) {
        return point.separation <= S(0) || point.normalForce > S(0);
    });
}

// Whether no jointed body turns so far within the sub-step that its rows point elsewhere afterwards.
template <class S>
bool turnsLittle(const Problem<S>& problem, const ContactNewton<double>& newton, double h) {
    const auto turn = [&](int body) {
        return h * newton.system.v[static_cast<std::size_t>(body)].template tail<3>().norm();
    };
    return std::all_of(problem.joints.begin(), problem.joints.end(), [&](const auto& link) {
        return turn(link.a) <= Tuning::maxTurn && turn(link.b) <= Tuning::maxTurn;
    });
}

// To `C` (m or rad): what joints are off by if the sub-step of length h ends with Newton's velocities. `start`: the
// bodies, as which they are left.
template <class S>
void jointErrorsAfter(Problem<S>& problem, const ContactNewton<double>& newton, S h,
                      const std::vector<SolverBody<S>>& start, std::vector<S>& C) {
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        problem.bodies[i].v = newton.system.v[i].template cast<S>();
    }
    problem.integrate(h);
    problem.jointErrors(C);
    problem.bodies = start;
}

// Whether that tears no joint open by more than `most` (m or rad).
template <class S>
bool keepsJointsClosed(Problem<S>& problem, const ContactNewton<double>& newton, S h, double most) {
    if (problem.jointBlocks == 0) {
        return true;
    }
    const std::vector<SolverBody<S>> start = problem.bodies;
    std::vector<S> C;
    jointErrorsAfter(problem, newton, h, start, C);
    for (std::size_t i = 0; i < C.size(); ++i) {
        const Row<S>& row = problem.rows[i];
        if (row.isHardEquality() && std::abs(C[i]) > std::abs(row.C) + static_cast<S>(most)) {
            return false;
        }
    }
    return true;
}

// Whether Newton's velocities may move the bodies for all of h. mayTear: what they tear is not looked at.
template <class S>
bool isShortEnough(Problem<S>& problem, const ContactNewton<double>& newton, S h, bool mayTear) {
    if (!problem.limits.mayRefuse) {
        return mayTear || !problem.plan.mayRestart() || keepsJointsClosed(problem, newton, h, Tuning::maxSweptTear);
    }
    return turnsLittle(problem, newton, static_cast<double>(h)) &&
           (mayTear || keepsJointsClosed(problem, newton, h, Tuning::maxTear));
}

// Newton iterations that the sub-step's bound on work still pays for after what has been spent, with what a few
// fallback sweeps take kept back.
template <class S>
int affordableIterations(const Problem<S>& problem, const ContactNewton<double>& newton, double spent) {
    const double rows = static_cast<double>(problem.rows.size());
    const double kept = 2 * Tuning::minFallbackSweeps * rows;
    const double iterations = (problem.limits.maxWork - spent - kept) /
                              (visitsOfProduct * newton.work() + Tuning::visitsOfIteration * rows + 1);
    return static_cast<int>(std::clamp(iterations, 0.0, Tuning::manyIterations));
}

template <class S>
bool isSingle(const Problem<S>& problem) {
    return std::count_if(problem.bodies.begin(), problem.bodies.end(), [](const auto& body) { return !body.fixed; }) ==
           1;
}

// Whether it came to rest by sweeps, without joints; they would have it again.
template <class S>
bool hasComeToRest(const Problem<S>& problem) {
    const StepPlan& plan = problem.plan;
    return plan.mayRestart() && plan.rests && plan.wasSwept;
}

// The base tolerance holds for what rests; what moves is solved to a share of its speed.
template <class S>
NewtonOptions optionsFor(const Problem<S>& problem, const SolverSettings& settings, double work) {
    const bool moves = isActiveSetChanging(problem);
    const bool jointsAlone = problem.contacts.empty();
    const bool heap = moves && work > Tuning::heapWork;
    const double speed = static_cast<double>(fastestCentre(problem));
    NewtonOptions options;
    options.heap = heap;
    options.standing = !moves;
    options.slidesOn = moves && problem.joints.empty() && isSingle(problem);
    options.maxDeSaxceUpdates = heap ? 0 : options.maxDeSaxceUpdates;
    options.minRegularisation = Tuning::minRegularisation;
    options.tolerance = settings.def.tolerance > 0 ? settings.def.tolerance : Tuning::tolerance<S>;
    if (jointsAlone) {
        options.tolerance *= Tuning::jointShare;
        options.regularisation = Tuning::jointOnlyRegularisation;
    } else {
        options.tolerance = std::max(options.tolerance, (heap ? Tuning::heapShare : Tuning::movingShare) * speed);
        options.regularisation = heap    ? Tuning::heapRegularisation
                                 : moves ? Tuning::movingRegularisation
                                         : Tuning::restingRegularisation;
    }
    options.solvedShare = moves || jointsAlone ? 1 : Tuning::restingShare;
    options.stalled = options.tolerance * (jointsAlone || moves ? Tuning::movingStalled : Tuning::restingStalled);
    options.deSaxceTolerance = std::max(Tuning::deSaxceTolerance, Tuning::deSaxceShare * speed) *
                               (options.slidesOn ? Tuning::slidingShare : 1);
    options.maxIterations = settings.def.iterations > 0 ? settings.def.iterations : Tuning::maxIterations;
    if (problem.plan.iterationCap > 0) {
        options.maxIterations = std::min(options.maxIterations, problem.plan.iterationCap);
    }
    if (hasComeToRest(problem)) {
        options.enough = Tuning::enoughAtRest;
    }
    if (problem.plan.settles) {
        // A step goes as far as it would at any time.
        options.enough = options.tolerance;
        options.tolerance *= Tuning::settledShare;
        options.solvedShare = 1;
        options.stalled *= Tuning::settledShare;
        options.maxIterations =
            std::min(options.maxIterations, problem.plan.calms ? Tuning::maxIterations : Tuning::settleIterations);
    }
    return options;
}

void fillSystem(const Problem<double>& problem, ContactNewton<double>& newton, const SolverSettings& settings,
                double band, double gentle, double h) {
    RowSystem<double>& system = newton.system;
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<double>& block = problem.blocks[k];
        system.friction[k] = frictionCoefficient(problem, block);
        for (int r = 0; r < block.count; ++r) {
            const std::size_t i = static_cast<std::size_t>(block.first + r);
            const Row<double>& row = problem.rows[i];
            bool hard = false;
            RowTerms<double>& t = system.terms[i];
            t = rowTerms(row, problem.responses[i].delassus, h, hard);
            if (hard) {
                const double C = block.kind == BlockKind::Contact ? row.C - std::clamp(row.C, -band, band) : row.C;
                t.bias = hardBias(C, row.lo, gentle, h);
            }
            system.p[i] = row.lambda * h * settings.def.warmStart;
        }
        if (block.kind == BlockKind::Contact && block.count == 3) {
            // The share of last step's friction that today's coefficient still carries.
            double* p = &system.p[static_cast<std::size_t>(block.first)];
            ontoDisc(system.friction[k] * p[0], p[1], p[2]);
        }
    });
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        newton.vStar[i] = problem.bodies[i].v;
    }
}

// A number that changes when who touches whom changes (FNV-1a).
template <class S>
std::uint64_t graphOf(const Problem<S>& problem) {
    std::uint64_t hash = 14695981039346656037U;
    const auto add = [&](auto... numbers) {
        ((hash = (hash ^ static_cast<std::uint32_t>(numbers)) * 1099511628211U), ...);
    };
    for (const SolverBody<S>& body : problem.bodies) {
        add(body.fixed ? 1 : 0);
    }
    for (const auto& link : problem.joints) {
        add(link.a, link.b, link.c, link.d);
    }
    for (const auto& link : problem.locks) {
        add(link.b);
    }
    for (const ProblemContact<S>& contact : problem.contacts) {
        add(contact.a, contact.b, contact.count);
    }
    return hash;
}

// The largest violation of a hard row at the present poses, m or rad.
template <class S>
S worstError(const Problem<S>& problem) {
    std::vector<S> C;
    problem.contactErrors(C);
    S worst = 0;
    for (const S c : C) {
        worst = std::max(worst, -c);
    }
    problem.jointErrors(C);
    for (std::size_t i = 0; i < C.size(); ++i) {
        Row<S> row = problem.rows[i];
        row.C = C[i];
        worst = std::max(worst, row.violation());
    }
    return worst;
}

// The problem of moving the bodies by h v, as little as may be (in the metric of mass), to where the hard rows are
// obeyed. Friction, motors and springs have no part in it.
void fillProjection(const Problem<double>& problem, ContactNewton<double>& newton, double pushOut, double h) {
    RowSystem<double>& system = newton.system;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<double>& block = problem.blocks[k];
        system.friction[k] = -1;
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<double>& row = problem.rows[i];
            RowTerms<double>& t = system.terms[i];
            t = {};
            system.p[i] = 0.0;
            if (row.isVelocity || row.isSoft()) {
                continue;
            }
            const bool equality = row.lo < 0.0 && row.hi > 0.0;
            t.delassus = problem.responses[i].delassus;
            t.lo = row.lo;
            t.hi = row.hi;
            t.bias = equality ? std::clamp(row.C / h, -pushOut, pushOut) : std::max(row.C / h, -pushOut);
            if (!equality && partsByItself(row.C, problem.rowVelocity(row, block))) {
                t.bias = std::max(t.bias, 0.0);
            }
        }
    }
    for (Vec6<double>& v : newton.vStar) {
        v.setZero();
    }
}

// By h (s) times Newton's velocities, which stay what they are.
template <class S>
void moveBy(Problem<S>& problem, const ContactNewton<double>& newton, S h) {
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        SolverBody<S>& body = problem.bodies[i];
        if (!body.fixed) {
            const Vec6<S> moved = h * newton.system.v[i].template cast<S>();
            body.pose.position += moved.template head<3>();
            body.pose.rotation = rotated<S>(body.pose.rotation, moved.template tail<3>());
        }
    }
}

// Gives the bodies Newton's velocities, and the constraints its impulses.
template <class S>
void takeAnswer(Problem<S>& problem, const ContactNewton<double>& newton, S h) {
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        problem.bodies[i].v = newton.system.v[i].template cast<S>();
    }
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
        problem.rows[i].lambda = static_cast<S>(newton.system.p[i] / static_cast<double>(h));
    }
    problem.storeLambda(h);
}

NewtonReport solve(ContactNewton<double>& newton, const Problem<double>& problem, const NewtonOptions& options,
                   SolveReport& report) {
    const double before = newton.system.work();
    const NewtonReport solved = newton.solve(problem, options);
    report.newtonIterations += solved.iterations;
    report.factorisations += solved.factorisations;
    report.work += newton.system.work() - before;
    return solved;
}

// `fill` makes the system, with contacts that are open or deep by no more than it is given taken as shut. What came to
// rest by sweeps and has no answer with hardly any is asked for one with more.
template <class S, class Fill>
NewtonReport solveWithin(const Problem<S>& problem, ContactNewton<double>& newton, const Problem<double>& wide,
                         NewtonOptions options, const Fill& fill, SolveReport& report) {
    const int iterations = options.maxIterations;
    report.gapes = problem.plan.gapes || problem.plan.calms;
    const bool mayGape = !report.gapes && hasComeToRest(problem) && !problem.plan.settles;
    if (mayGape) {
        options.maxIterations = std::min(iterations, Tuning::tightIterations);
    }
    fill(problem.plan.calms ? Tuning::calmSlop : report.gapes ? Tuning::wideSlop : Tuning::contactSlop<S>);
    const NewtonReport solved = solve(newton, wide, options, report);
    if (solved.converged || !mayGape || solved.iterations >= iterations) {
        return solved;
    }
    report.gapes = true;
    options.maxIterations = iterations - solved.iterations;
    fill(Tuning::wideSlop);
    return solve(newton, wide, options, report);
}

}  // namespace

template <class S>
StepPlan Direct<S>::plan(Problem<S>& problem, const ControllerState&, S) const {
    StepPlan plan{.substeps = std::max(1, settings_.def.substeps)};
    if (problem.isOfCrowd) {
        plan.maxWork = Tuning::crowdWork * problem.expectedRows();
    }
    return plan;
}

template <class S>
typename Direct<S>::Cost Direct<S>::predictCost(Problem<S>& problem) const {
    DirectMemory<S>& memory = memoryOf(problem);
    if (const std::uint64_t graph = graphOf(problem); graph != memory.graph) {
        memory.graph = graph;
        memory.factorWork = memory.newton.predictWork(problem, settings_.def.linearSolver);
    }
    return {memory.factorWork, memory.factorWork * (isActiveSetChanging(problem) ? Tuning::expectedIterations : 1),
            problem.expectedRows()};
}

template <class S>
SolveReport Direct<S>::advance(Problem<S>& problem, S h) {
    SolveReport report;
    report.directSolves = 1;
    if (problem.isFree()) {
        problem.fly(h);
        return report;
    }
    problem.spend(Tuning::paceOfRows * problem.expectedRows());
    problem.predict(h);
    problem.linearize();
    if (resolveImpacts(problem, settings_, h)) {
        problem.takeOffsets(h);
    }
    report.rows = static_cast<int>(problem.rows.size());
    DirectMemory<S>& memory = memoryOf(problem);
    const bool mayBeAlone =
        touchesNothing(problem) &&
        memory.joints.prepare(problem, Tuning::maxJointWork * static_cast<double>(problem.bodies.size()));
    if (mayBeAlone && solveJoints(problem, h, report)) {
        return report;
    }
    const bool jointsAlone = mayBeAlone && problem.contacts.empty();
    // Rows point where they did at the start of the sub-step, an explicit rule for the swing of what is taut between
    // joints, as the planks of a bridge under crates. Joints alone have their own answer.
    if (!jointsAlone && problem.jointBlocks > 0) {
        addGeometricStiffness(problem, h, static_cast<S>(Tuning::maxPhase));
        problem.respond();
    }
    const Problem<double>& wide = widen(problem, memory.wide);
    ContactNewton<double>& newton = memory.newton;
    const double hWide = static_cast<double>(h);
    problem.spend(Tuning::paceOfTerms * problem.expectedRows());
    newton.prepare(wide, settings_.def.linearSolver);
    const auto fill = [&](double slop) {
        fillSystem(wide, newton, settings_, slop, jointsAlone ? Tuning::slowSpeed : Tuning::smallError / hWide, hWide);
    };
    NewtonOptions options = optionsFor(problem, settings_, newton.work());
    const int affordable = std::max(Tuning::minIterations, affordableIterations(problem, newton, report.work));
    const bool isBounded = affordable < options.maxIterations;
    options.maxIterations = std::min(options.maxIterations, affordable);
    NewtonReport solved = solveWithin(problem, newton, wide, options, fill, report);
    if (problem.isGivenUp()) {
        return report;
    }
    // What joints alone have no nonlinear answer for gets a linear one, which takes energy at most.
    // Where contacts open and shut, their own error is the larger one: there the projection closes the joints as well,
    // as long as they are not off by much.
    const bool quiet = !isActiveSetChanging(problem);
    const bool shortEnough = isShortEnough(problem, newton, h, quiet || !solved.converged);
    const bool closed =
        solved.converged && shortEnough && !jointsAlone && (!quiet || correctJoints(problem, options, h, report));
    report.unconverged = !closed || solved.contradicts;
    report.newtonFailed = !solved.converged;
    report.truncated = report.truncated || (isBounded && !solved.converged);
    // What was truncated would not fare better in shorter sub-steps of the same work; what was so because more is not
    // worth it is swept.
    const bool isTooDear =
        report.truncated && problem.plan.mayRestart() && (problem.limits.isByPlan || problem.plan.kept > 0);
    if (solved.converged
            ? !closed && (problem.limits.mayRefuse || !shortEnough)
            : isTooDear || (!report.truncated && (problem.limits.mayRefuse || problem.plan.mayRestart()))) {
        report.tooLong = true;
        return report;
    }
    if (!solved.converged) {
        const double sweeps = (problem.limits.maxWork - report.work) / (2 * static_cast<double>(problem.rows.size()));
        solved.residual = newton.runFallbackSweeps(
            wide, static_cast<int>(std::clamp<double>(sweeps, Tuning::minFallbackSweeps, Tuning::fallbackSweeps)));
    }
    report.residual = solved.residual;
    takeAnswer(problem, newton, h);
    problem.integrate(h);
    projectErrors(problem, h, report);
    return report;
}

template <class S>
bool Direct<S>::solveJoints(Problem<S>& problem, S h, SolveReport& report) const {
    JointNewton<S>& joints = memoryOf(problem).joints;
    S farthest = 0;
    for (const SolverBody<S>& body : problem.bodies) {
        farthest = std::max(farthest, body.pose.position.cwiseAbs().maxCoeff());
    }
    JointNewtonOptions options;
    options.tolerance = Tuning::jointSpeed;
    options.floor = 2 * static_cast<double>(Eigen::NumTraits<S>::epsilon() * farthest);
    options.gentle = Tuning::smallError;
    options.warmStart = settings_.def.warmStart;
    const bool answered = joints.solve(problem, h, options, report);
    if (answered && !problem.points.empty() && joints.meetsContacts(problem, h)) {
        return false;
    }
    const double turn = problem.limits.mayRefuse ? Tuning::maxTurn : Tuning::maxWildTurn;
    const bool keepsEnergy = problem.limits.mayRefuse
                                 ? std::abs(joints.energyShare()) <= Tuning::maxJointEnergy
                                 : joints.energyShare() <= Tuning::growthOfShortest * Tuning::maxJointEnergy;
    const bool accepted = answered && static_cast<double>(h) * joints.fastestSpin() <= turn && keepsEnergy;
    if (problem.limits.mayRefuse && !accepted) {
        report.tooLong = true;
        return true;
    }
    if (!accepted) {
        return false;
    }
    joints.handBack(problem, h);
    problem.storeLambda(h);
    problem.integrate(h);
    if (joints.worst() > Tuning::smallError) {
        projectErrors(problem, h, report);
    }
    return true;
}

template <class S>
bool Direct<S>::correctJoints(Problem<S>& problem, const NewtonOptions& options, S h, SolveReport& report) const {
    if (problem.jointBlocks == 0) {
        return true;
    }
    DirectMemory<S>& memory = memoryOf(problem);
    const Problem<double>& wide = widen(problem, memory.wide);
    ContactNewton<double>& newton = memory.newton;
    const std::vector<SolverBody<S>> start = problem.bodies;
    const S gentle = static_cast<S>(Tuning::smallError);
    // No tighter than what the velocities are solved to.
    const S tolerance = std::max(static_cast<S>(Tuning::jointTolerance), S(2) * h * static_cast<S>(options.tolerance));
    const RowSystem<double> uncorrected = newton.system;
    NewtonOptions onwards = options;
    onwards.goesOn = true;
    std::vector<S> C;
    S worst = 0;
    for (int iteration = 0; iteration < Tuning::jointIterations; ++iteration) {
        jointErrorsAfter(problem, newton, h, start, C);
        worst = 0;
        for (std::size_t i = 0; i < C.size(); ++i) {
            const Row<S>& row = problem.rows[i];
            if (!row.isHardEquality()) {
                continue;
            }
            const S error = C[i] - row.C + std::clamp(row.C, -gentle, gentle);
            worst = std::max(worst, std::abs(error));
            newton.system.terms[i].bias += static_cast<double>(error / h);
        }
        if (worst <= tolerance) {
            return true;
        }
        onwards.maxIterations = std::min(options.maxIterations, affordableIterations(problem, newton, report.work));
        if (onwards.maxIterations == 0) {
            report.truncated = true;
            break;
        }
        const NewtonReport again = solve(newton, wide, onwards, report);
        if (!again.converged) {
            break;
        }
    }
    // What the linear rows say errs, but is bounded; corrections that do not settle need not be.
    newton.system = uncorrected;
    return false;
}

template <class S>
void Direct<S>::projectErrors(Problem<S>& problem, S h, SolveReport& report) const {
    DirectMemory<S>& memory = memoryOf(problem);
    ContactNewton<double>& newton = memory.newton;
    NewtonOptions options = optionsFor(problem, settings_, newton.work());
    options.tolerance = Tuning::projectionTolerance * Tuning::smallError / static_cast<double>(h);
    options.solvedShare = 1;
    options.stalled = Tuning::projectionStalled * options.tolerance;
    // Joints alone are closed by their own Newton: what it has not closed is torn, and pulled together share by share
    // it would lift what hangs from it.
    const int halvings = problem.contacts.empty() ? 0 : Tuning::projectionHalvings;
    S before = infinity<S>();
    // Of the sub-step itself, which its reports go by.
    std::vector<Row<S>> rows;
    std::vector<RowBlock<S>> blocks;
    std::vector<RowResponse<S>> responses;
    std::vector<ContactFrame<S>> frames;
    std::vector<ContactRows<S>> contactRows;
    for (int pass = 0; pass < Tuning::projectionPasses; ++pass) {
        const S worst = worstError(problem);
        if (worst <= static_cast<S>(Tuning::smallError) || worst > static_cast<S>(Tuning::projectionGain) * before) {
            break;
        }
        before = worst;
        options.maxIterations = std::min(options.maxIterations, affordableIterations(problem, newton, report.work));
        if (options.maxIterations < Tuning::minIterations) {
            report.truncated = true;
            break;
        }
        if (rows.empty()) {
            rows = problem.rows;
            blocks = problem.blocks;
            responses = problem.responses;
            frames = problem.frames;
            contactRows = problem.contactRows;
        }
        problem.linearize();
        const Problem<double>& wide = widen(problem, memory.wide);
        newton.prepare(wide, settings_.def.linearSolver);
        newton.forget();
        fillProjection(wide, newton, settings_.maxPushOutSpeed, static_cast<double>(h));
        solve(newton, wide, options, report);
        const std::vector<SolverBody<S>> unmoved = problem.bodies;
        S share = 1;
        moveBy(problem, newton, share * h);
        for (int halving = 0; !(worstError(problem) < worst); ++halving) {
            problem.bodies = unmoved;
            if (halving == halvings) {
                break;
            }
            share *= S(0.5);
            moveBy(problem, newton, share * h);
        }
    }
    if (!rows.empty()) {
        problem.rows = std::move(rows);
        problem.blocks = std::move(blocks);
        problem.responses = std::move(responses);
        problem.frames = std::move(frames);
        problem.contactRows = std::move(contactRows);
    }
}

template <class S>
std::unique_ptr<Solver<S>> makeDirect(const SolverSettings& settings) {
    return std::make_unique<Direct<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeDirect(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeDirect(const SolverSettings&);
template float fastestCentre(const Problem<float>&);
template double fastestCentre(const Problem<double>&);
template class Direct<float>;
template class Direct<double>;

}  // namespace cairn
