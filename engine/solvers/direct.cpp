#include <cairn/engine/impacts.hpp>
#include <cairn/engine/solvers/direct.hpp>

namespace cairn {
namespace {

// Errors up to this much (m or rad) are corrected by the velocity of the next step: too slow to be seen as a bounce.
// Larger ones (bodies born overlapping, joints torn by an impact) are projected away without leaving speed behind.
constexpr double smallError = 1e-4;
// Joints are closed to this much (m or rad) at the moved poses. Limits are left to the next step: they come and go.
constexpr double jointTolerance = 1e-6;
// Rounds of that; where they are not enough, the bodies turn too far within the sub-step.
constexpr int jointRounds = 8;
// rad, that a jointed body may turn within a sub-step.
constexpr double mostTurn = 0.3;
// rad^2, (h omega)^2 of the swing of a body under its joints' forces.
constexpr double mostPhase = 1;
// m/s, above which contacts are expected to open and shut within a step.
constexpr double movingSpeed = 0.05;
// Passes of the projection, each about the poses that the last one left.
constexpr int projectionPasses = 3;
// Sweeps that Gauss-Seidel gets where Newton has not converged.
constexpr int polishSweeps = 20;

// Surfaces this close (m) touch: no bias within. The corners of a box are one too many for a plane; without the band
// their last nanometres would decide which of them bear the load.
constexpr double touchBand = 1e-6;

template <class S>
ContactNewton<S>& newtonOf(Island<S>& island) {
    using Memory = std::shared_ptr<ContactNewton<S>>;
    if (std::any_cast<Memory>(&island.memory.solver) == nullptr) {
        island.memory.solver = std::make_shared<ContactNewton<S>>();
    }
    return **std::any_cast<Memory>(&island.memory.solver);
}

// m/s, of the centres of mass at the start of the sub-step.
template <class S>
S fastestSpeed(const Island<S>& island) {
    S fastest = 0;
    for (const SolverBody<S>& body : island.bodies) {
        fastest = std::max(fastest, body.vBefore.template head<3>().norm());
    }
    return fastest;
}

// Whether contacts are expected to open and shut.
template <class S>
bool churns(const Island<S>& island) {
    return !island.patches.empty() && fastestSpeed(island) > static_cast<S>(movingSpeed);
}

// Whether no jointed body turns so far within the sub-step that its rows point elsewhere afterwards.
template <class S>
bool turnsLittle(const Island<S>& island, const ContactNewton<S>& newton, S h) {
    const auto turn = [&](int body) {
        return h * newton.problem.v[static_cast<std::size_t>(body)].template tail<3>().norm();
    };
    return std::all_of(island.joints.begin(), island.joints.end(), [&](const auto& link) {
        return turn(link.a) <= static_cast<S>(mostTurn) && turn(link.b) <= static_cast<S>(mostTurn);
    });
}

// Whether the forces of the joints swing no body through more than about a radian of phase within the sub-step. Rows
// point where they did at its start, which is an explicit rule for the swing of a tight chain, and unstable from h
// omega = 2 on. omega^2 is that of a body held by the force f at the end of an arm: |f| |arm| / I, the geometric
// stiffness of the joint (seed 7.20).
template <class S>
bool swingsLittle(const Island<S>& island, const ContactNewton<S>& newton, S h) {
    std::vector<S> stiffness(island.bodies.size(), S(0));
    for (std::size_t k = 0; k < static_cast<std::size_t>(island.jointBlocks); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        Vec3<S> impulse = Vec3<S>::Zero();  // on b
        for (int r = 0; r < block.pointRows; ++r) {
            const std::size_t i = static_cast<std::size_t>(block.first + r);
            impulse += newton.problem.p[i] * island.rows[i].b.template head<3>();
        }
        stiffness[static_cast<std::size_t>(block.a)] += std::max(S(0), -impulse.dot(block.armA)) / h;
        stiffness[static_cast<std::size_t>(block.b)] += std::max(S(0), impulse.dot(block.armB)) / h;
    }
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        const SolverBody<S>& body = island.bodies[i];
        if (!body.fixed &&
            h * h * stiffness[i] * body.inverseInertia.diagonal().maxCoeff() > static_cast<S>(mostPhase)) {
            return false;
        }
    }
    return true;
}

// The base tolerance holds for what rests. What moves at a speed v is solved to a share of v: a ten-thousandth of it is
// far below what the step length itself gets wrong.
template <class S>
NewtonOptions optionsFor(const Island<S>& island, const SolverSettings& settings) {
    constexpr double movingShare = 1e-4;
    constexpr double liftShare = 5e-3;
    const double speed = static_cast<double>(fastestSpeed(island));
    const bool isDouble = std::is_same_v<S, double>;
    NewtonOptions options;
    // A loose grip takes fewer rounds where contacts open and shut; a tight one fewer where rows stay.
    options.regularisation = churns(island) ? 1e-2 : (isDouble ? 1e-4 : 1e-3);
    options.leastRegularisation = isDouble ? 1e-9 : 1e-6;
    options.tolerance = settings.def.tolerance > 0 ? settings.def.tolerance : (isDouble ? 1e-6 : 2e-4);
    if (!island.patches.empty()) {
        options.tolerance = std::max(options.tolerance, movingShare * speed);
    }
    options.liftTolerance = std::max(1e-3, liftShare * speed);
    options.maxRounds = settings.def.iterations > 0 ? settings.def.iterations : 60;
    if (island.roundCap > 0) {
        options.maxRounds = std::min(options.maxRounds, island.roundCap);
    }
    return options;
}

template <class S>
void fillProblem(Island<S>& island, ContactNewton<S>& newton, const SolverSettings& settings, S h) {
    RowProblem<S>& problem = newton.problem;
    const S gentle = static_cast<S>(smallError) / h;
    const S band = static_cast<S>(touchBand);
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        problem.friction[k] = frictionCoefficient(island, block);
        for (int r = 0; r < block.count; ++r) {
            const std::size_t i = static_cast<std::size_t>(block.first + r);
            const Row<S>& row = island.rows[i];
            bool hard = false;
            RowTerms<S>& t = problem.terms[i];
            t = rowTerms(row, island.mobility(row, block), h, hard);
            if (hard) {
                const S C = block.kind == BlockKind::Contact ? row.C - std::clamp(row.C, -band, band) : row.C;
                const bool open = row.lo == S(0) && C > S(0);
                t.bias = open ? C / h : std::clamp(C / h, -gentle, gentle);
            }
            problem.p[i] = row.lambda * h * static_cast<S>(settings.def.warmStart);
        }
        if (block.kind == BlockKind::Contact && block.count == 3) {
            // The share of last step's friction that today's coefficient still carries.
            S* p = &problem.p[static_cast<std::size_t>(block.first)];
            const S length = std::hypot(p[1], p[2]);
            const S most = problem.friction[k] * p[0];
            if (length > most) {
                p[1] *= most / length;
                p[2] *= most / length;
            }
        }
    }
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        newton.vStar[i] = island.bodies[i].v;
    }
}

// The largest violation of a hard row at the present poses, m or rad.
template <class S>
S worstError(const Island<S>& island) {
    std::vector<S> C;
    island.contactErrors(C);
    S worst = 0;
    for (const S c : C) {
        worst = std::max(worst, -c);
    }
    island.jointErrors(C);
    for (std::size_t i = 0; i < C.size(); ++i) {
        Row<S> row = island.rows[i];
        row.C = C[i];
        worst = std::max(worst, row.violation());
    }
    return worst;
}

// The problem of moving the bodies by h v, as little as may be (in the metric of mass), to where the hard rows are
// obeyed. Friction, motors and springs have no part in it.
template <class S>
void fillProjection(Island<S>& island, ContactNewton<S>& newton, S pushOut, S h) {
    RowProblem<S>& problem = newton.problem;
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        problem.friction[k] = S(-1);
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<S>& row = island.rows[i];
            RowTerms<S>& t = problem.terms[i];
            t = {};
            problem.p[i] = S(0);
            if (row.isVelocity || row.isSoft()) {
                continue;
            }
            const bool equality = row.lo < S(0) && row.hi > S(0);
            t.mobility = island.mobility(row, block);
            t.lo = row.lo;
            t.hi = row.hi;
            t.bias = equality ? std::clamp(row.C / h, -pushOut, pushOut) : std::max(row.C / h, -pushOut);
        }
    }
    for (Vec6<S>& v : newton.vStar) {
        v.setZero();
    }
}

template <class S>
void takeReport(const NewtonReport& newton, SolveReport& report) {
    report.newtonRounds += newton.rounds;
    report.factorisations += newton.factorisations;
}

}  // namespace

template <class S>
int Direct<S>::substeps(Island<S>&, S) const {
    return settings_.def.substeps > 0 ? settings_.def.substeps : 1;
}

template <class S>
typename Direct<S>::Cost Direct<S>::predictCost(Island<S>& island) const {
    island.linearize();
    ContactNewton<S>& newton = newtonOf(island);
    newton.prepare(island);
    return {newton.work(), newton.work() * (churns(island) ? 30 : 3)};
}

template <class S>
SolveReport Direct<S>::advance(Island<S>& island, S h) {
    SolveReport report;
    report.directSolves = 1;
    island.predict(h);
    island.linearize();
    resolveImpacts(island, settings_, h);
    report.rows = static_cast<int>(island.rows.size());

    ContactNewton<S>& newton = newtonOf(island);
    newton.prepare(island);
    fillProblem(island, newton, settings_, h);
    const NewtonOptions options = optionsFor(island, settings_);
    NewtonReport solved = newton.solve(island, options);
    takeReport<S>(solved, report);
    // Where contacts open and shut, their own error is the larger one: there the projection closes the joints as well.
    const bool quiet = !churns(island);
    const bool shortEnough =
        !island.mayRefuse || (turnsLittle(island, newton, h) && (!quiet || swingsLittle(island, newton, h)));
    const bool closed =
        solved.converged && shortEnough && (!quiet || correctJoints(island, newton, options, h, report));
    report.unconverged = !closed;
    report.newtonFailed = !solved.converged;
    if (solved.converged ? !closed && island.mayRefuse : island.mayRefuse || island.mayRestart) {
        report.tooLong = true;
        return report;
    }
    if (!solved.converged) {
        solved.residual = newton.polish(island, polishSweeps);
    }
    report.residual = solved.residual;
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        island.bodies[i].v = newton.problem.v[i];
    }
    for (std::size_t i = 0; i < island.rows.size(); ++i) {
        island.rows[i].lambda = newton.problem.p[i] / h;
    }
    island.storeLambda();
    island.integrate(h);
    projectErrors(island, h, report);
    return report;
}

template <class S>
bool Direct<S>::correctJoints(Island<S>& island, ContactNewton<S>& newton, const NewtonOptions& options, S h,
                              SolveReport& report) const {
    if (island.jointBlocks == 0) {
        return true;
    }
    const std::vector<SolverBody<S>> start = island.bodies;
    const S gentle = static_cast<S>(smallError);
    // No tighter than what the velocities are solved to.
    const S tolerance = std::max(static_cast<S>(jointTolerance), S(2) * h * static_cast<S>(options.tolerance));
    const RowProblem<S> uncorrected = newton.problem;
    NewtonOptions onwards = options;
    onwards.goesOn = true;
    std::vector<S> C;
    S worst = 0;
    for (int round = 0; round < jointRounds; ++round) {
        for (std::size_t i = 0; i < island.bodies.size(); ++i) {
            island.bodies[i].v = newton.problem.v[i];
        }
        island.integrate(h);
        island.jointErrors(C);
        island.bodies = start;
        worst = 0;
        for (std::size_t i = 0; i < C.size(); ++i) {
            const Row<S>& row = island.rows[i];
            const bool equality = row.lo < S(0) && row.hi > S(0);
            if (row.isVelocity || row.isSoft() || !equality) {
                continue;
            }
            const S error = C[i] - row.C + std::clamp(row.C, -gentle, gentle);
            worst = std::max(worst, std::abs(error));
            newton.problem.terms[i].bias += error / h;
        }
        if (worst <= tolerance) {
            return true;
        }
        const NewtonReport again = newton.solve(island, onwards);
        takeReport<S>(again, report);
        if (!again.converged) {
            break;
        }
    }
    // What the linear rows say errs, but is bounded; corrections that do not settle need not be.
    newton.problem = uncorrected;
    return false;
}

template <class S>
void Direct<S>::projectErrors(Island<S>& island, S h, SolveReport& report) const {
    ContactNewton<S>& newton = newtonOf(island);
    NewtonOptions options = optionsFor(island, settings_);
    options.tolerance = 0.1 * smallError / static_cast<double>(h);
    S before = infinity<S>();
    std::vector<Row<S>> rows;  // of the sub-step itself, which its reports go by
    for (int pass = 0; pass < projectionPasses; ++pass) {
        const S worst = worstError(island);
        // Rows that contradict each other do not get better.
        if (worst <= static_cast<S>(smallError) || worst > S(0.9) * before) {
            break;
        }
        before = worst;
        if (rows.empty()) {
            rows = island.rows;
        }
        island.linearize();
        newton.prepare(island);
        newton.forget();
        fillProjection(island, newton, static_cast<S>(settings_.maxPushOutSpeed), h);
        takeReport<S>(newton.solve(island, options), report);
        const std::vector<SolverBody<S>> unmoved = island.bodies;
        for (std::size_t i = 0; i < island.bodies.size(); ++i) {
            SolverBody<S>& body = island.bodies[i];
            if (!body.fixed) {
                body.pose.position += h * newton.problem.v[i].template head<3>();
                body.pose.rotation = rotated<S>(body.pose.rotation, h * newton.problem.v[i].template tail<3>());
            }
        }
        if (!(worstError(island) < worst)) {
            island.bodies = unmoved;
            break;
        }
    }
    if (!rows.empty()) {
        island.rows = std::move(rows);
    }
}

template class Direct<float>;
template class Direct<double>;

}  // namespace cairn
