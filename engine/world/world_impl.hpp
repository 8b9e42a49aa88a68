#pragma once
// What a world holds. world.cpp is its face, world_step.cpp moves it.
#include <cairn/world.hpp>

#include "engine/solve/budget.hpp"
#include "engine/solve/step_controller.hpp"
#include "engine/world/continuous.hpp"
#include "engine/world/standing.hpp"

#include <mutex>
#include <optional>
#include <set>
#include <unordered_map>

namespace cairn {

// Where the generations of a new world's ids begin: another place for every world of the process, so that an id of one
// is refused by the others. Nothing but the comparison of ids depends on it.
std::uint32_t firstGenerationOfWorld();

template <class S>
struct World<S>::Impl {
    WorldDef def;
    std::shared_ptr<JobSystem> jobs;
    std::unique_ptr<Solver<S>> solver;
    std::array<std::unique_ptr<Solver<S>>, qualityLevelCount> levelSolvers;  // of a budget, made when first chosen
    BudgetKeeper budget;
    BudgetLoad load;            // of this step
    double solveSeconds = 0;    // of this step, by the budget's clock
    bool leavesUndone = false;  // this step, of an exact solution
    const std::uint32_t firstGeneration = firstGenerationOfWorld();
    BodyTable<S> bodies{firstGeneration};
    BodyMaker<S> bodyMaker;
    JointTable<S> joints{firstGeneration};
    std::unordered_map<std::uint64_t, int>
        noCollide;  // jointed bodies that ignore each other (pairKey()): their joints
    std::set<std::pair<std::uint32_t, std::uint32_t>> jointsOf;  // a body, and a joint that holds it
    BroadPhase broadPhase;
    ContactTable<S> contacts;
    Islands<S> islands;
    AwakeSet awake;
    // Bodies that fell asleep together, and the joints between them.
    struct SleepGroup {
        std::vector<std::uint32_t> bodies;
        std::vector<std::uint32_t> joints;
    };
    std::vector<SleepGroup> sleepGroups;
    std::vector<int> freeGroups;
    double sleepingPotential = 0;        // J, of gravity, of the bodies that sleep
    int tolerantBodies = 0;              // with a tolerance of their own
    std::vector<std::uint32_t> changed;  // bodies that the game has touched since the last step (Body::changed)
    double detectedFor = 0;              // s, of the step that contacts are known for
    // Steps for which solvers may keep what they took for an island that is settled: of a thousand boxes in a heap that
    // is eight megabytes of rows and five of factors.
    static constexpr int forgetAfter = 60;
    // Of an island that is, or may be, solved as standing still over several steps (standing.hpp).
    struct Standing {
        std::unique_ptr<StandingSolution<S>> solution;  // while it is being found
        int steps = 0;                                  // that it has stood so
        float swayed = 0;                               // s, that it has done nothing else
        float tryAfter = 0.5F;                          // s
        StandsAs as = StandsAs::PutUp;
        bool wasSolved = false;
        bool isPutUp = false;  // and stands so, in this step
        bool stands = false;   // in this step
        bool waits = false;    // and others are solved first
        bool isOver = false;   // something has changed before it was solved
    };
    // What is kept of an island from step to step.
    struct IslandState {
        ControllerState control;
        Rare<SolverMemory<S>> memory;  // large ones have their own
        Solution solved;               // of the last step
        std::uint32_t pairs = 0;
        std::uint32_t joints = 0;
        bool isFinite = true;
        int settledSteps = 0;  // one after the other, up to this one
        bool settled = false;  // in this step
        bool settles = false;  // this step tries to settle it; after it: and has found it at rest
        Standing standing;
    };
    std::vector<IslandState> islandStates;  // by awake island
    bool rulesChanged = true;               // solver or accuracy, since the last step
    double lastDt = 0;                      // s
    std::vector<Before<S>> before;          // of this step, by body
    std::vector<std::uint8_t> leavesBox;    // room of moveThose()
    StepReport report;

    explicit Impl(const WorldDef& worldDef);
    SolverSettings settings() const;
    bool gyroscopicInertia() const;  // of the solver, where it takes it
    bool mayCollide(ProxyId a, ProxyId b) const;
    Body<S>& body(BodyId id) {
        requireId(id);
        return bodies[id.index];
    }
    const Body<S>& body(BodyId id) const {
        requireId(id);
        return bodies[id.index];
    }
    void requireId(BodyId id) const {
        if (!bodies.contains(id)) {
            throw InputError("body id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null, stale or of another world: use ids of bodies that are in this one");
        }
    }
    Joint<S>& joint(JointId id) {
        if (!joints.contains(id)) {
            throw InputError("joint id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null, stale or of another world: use ids of joints that are in this one");
        }
        return joints[id.index];
    }
    // awake.cpp. Wakes a body with all that fell asleep with it; one that is awake is given its time anew.
    void wake(std::uint32_t i);
    void fallAsleep(const std::vector<std::vector<std::uint32_t>>& islandsOfBodies);
    // Wakes what an awake or driven body touches; false: nothing.
    bool wakeTouched();
    // A body or joint comes into the world, or is about to leave it.
    void enter(std::uint32_t i);
    void leave(std::uint32_t i);
    void jointEnters(std::uint32_t joint);
    void jointLeaves(std::uint32_t joint);
    std::vector<std::uint32_t> jointsAt(std::uint32_t body) const;  // rising
    void tidyAwake();
    double potentialOf(const Body<S>& body) const;  // J
    static std::uint64_t pairKey(std::uint32_t a, std::uint32_t b) {
        return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    }
    // A force (N) at a point (m; none: the centre of mass) and a torque (N m), world, for the next step. Throws
    // InputError where they, or all of the step together, are beyond what a world takes.
    void push(BodyId id, const Vec3<S>& force, const std::optional<Vec3<S>>& point, const Vec3<S>& torque);
    // Its contacts are found anew before the next step.
    void touch(std::uint32_t index) {
        if (!bodies[index].changed) {
            bodies[index].changed = true;
            changed.push_back(index);
            contacts.strayed(index);
        }
    }
    void wakeBodies(const Joint<S>& joint);
    void wakeNeighbours(std::uint32_t index);
    // Speculative bounds: the box about a body's way within dt as it moves now, turning anyhow, with half of the
    // contact margin around it. What it cannot meet on that way is no contact (`approach` in contacts.cpp).
    Aabb speculativeBox(const Body<S>& b, double dt) const {
        const Vec3d ahead = displacement(b, dt);
        Aabb box = bounds(b.kind->def.shapes, b.framePoseDouble()).grown(roomBeside(b, dt));
        box.min += ahead.cwiseMin(0.0);
        box.max += ahead.cwiseMax(0.0);
        return box;
    }
    // m, within dt. What is too fast to be squared (an impulse of the game, which the step finds and puts back) reaches
    // far, but not out of all boxes.
    static constexpr double farthest = 1e15;
    static Vec3d displacement(const Body<S>& b, double dt) {
        return (dt * b.v.template cast<double>()).unaryExpr([](double way) {
            return std::abs(way) < farthest ? way : std::copysign(farthest, way);
        });
    }
    // m, that no point of the body leaves its way by within dt, and still is in its speculative box.
    double roomBeside(const Body<S>& b, double dt) const {
        const double turn = std::isfinite(b.kind->radius) ? static_cast<double>(b.w.norm()) * b.kind->radius : 0;
        const double way = dt * turn;
        return 0.5 * def.contactMargin + (way < farthest ? way : farthest);
    }

    void wakeOne(std::uint32_t i);

    void step(S dt);
    Diagnosis diagnose(S dt, double position);

private:
    void move(S dt);
    // Finds contacts anew where the game has changed something since the last step, and only there.
    void applyChanges(double dt);
    // Of two that rest no pair is looked for: sleepers beside what is static and new, or was put there, do not rest
    // until it has been.
    void findSleepersBeside();
    // Contacts where the bodies are now: for the report, for queries, and for the step to come, by the drift that has
    // been looked for.
    void detect(double dt, bool onlyChanged);
    void lookForDrift(double dt);
    // Boxes for a step to come.
    void moveProxies(double dt);
    // Of the awake bodies: who leaves its fat box, most do not, is asked in parallel; they are then moved in order.
    void moveThose(FunctionRef<bool(std::uint32_t)> leaves, FunctionRef<void(std::uint32_t)> moveOne);
    void moveProxy(std::uint32_t i, double dt);
    // Tells the contacts how far who is awake went in the step.
    void noteRoaming(S dt);
    // Continuous collision.
    void catchFastBodies(S dt);
    // Completes the islands' errors by the depth of the contacts, and sums them up.
    void measure();
    // settle.cpp. How far from rest a step leaves a body, which still is as it was before.
    static RestState restStateAfter(const Body<S>& body, const SolverBody<S>& s, bool settles, S dt);
    // Gives each awake island what was kept of it, and sees which are settled.
    void recallIslands(S dt);
    // Whether nothing has changed in the island or around it since it was solved, and that moved nothing: then the same
    // forces hold it through this step, and it is not solved again.
    bool isSettled(const Island& island, const IslandState& state) const;
    // Whether nothing but the last step itself may have changed the island or anything around it, and it stood still.
    bool isUndisturbed(const Island& island, const IslandState& state) const;
    // Whether it is worth a try: exact solutions of large stacks leave a little motion, which never dies out by itself.
    // Friction would stop it within the step, if it were not the solver's own doing.
    bool maySettle(const Island& island, const IslandState& state, S dt) const;
    // Puts up with what the forces of the last solution leave unbalanced, and says how much that is.
    void settle(const Island& island, IslandState& state, S dt);
    void solveIsland(std::size_t k, Solver<S>& by, const SolveRequest& request, double maxWork, S dt, JobSystem& team);
    // standing.cpp. Whether it touches one other body by one face, from which it falls, slides or rolls away.
    bool slidesOff(const Island& island) const;
    // Whether an island stands as it was put up: at rest, all of it touching, borne by what is static, and never
    // solved.
    bool standsAsPutUp(const Island& island, const IslandState& state) const;
    // Whether it is a heap, swept, that hardly moves; and has for so long that it is worth a try.
    bool sways(const Island& island, const IslandState& state) const;
    bool hasSwayedLong(const Island& island, IslandState& state, S dt) const;
    // Whether friction alone would stop each body from such a speed (m/s) within such a time (s), and nothing rolls.
    bool isStoppedByFriction(const Island& island, S speed, S time) const;
    // Whether it would so stop whatever group of bodies moves together, by the contacts that bear it.
    bool isHeldByEachContact(const Island& island, double speed, double time) const;
    // Says which islands are solved as standing still, and which of those have to wait for others, in a step of so many
    // rows.
    void shareStanding(double rows, S dt);
    // Says which islands may try exact solutions of what moves without joints, in a step of so many rows.
    void shareTries(double rows);
    // Goes on with one. False: it is to be solved as any other.
    bool solveStanding(std::size_t k, const SolveRequest& request, S dt);
    // Ends one before it is solved.
    void breakOff(Standing& standing);
    void takeStanding(const Island& island, IslandState& state, S dt);
    // Leaves it where it is, and says what that is worth.
    void standStill(const Island& island, IslandState& state, S dt);
    // Gives the bodies where the problem has led them. A body whose numbers went non-finite stays where it was, at
    // rest.
    void writeBack(const Problem<S>& problem, IslandState& state, S dt);
    void moveKinematic(S dt);
    void forgetForces(std::uint32_t body);
    // Names the bodies that went non-finite in the report.
    void restoreNonFinite(const Island& island);
    // The solver that a budget, or who replays one, chooses for this step, with what it allows.
    Solver<S>& solverOf(SolveRequest& request);
    // Sums over islands.
    struct Totals {
        double constraint = 0;   // J
        double momentum = 0;     // J
        double coulomb = 0;      // J
        double penetration = 0;  // m
        int touching = 0;
        double energyChange = 0;  // J, as SolveReport's, and the next
        double inPlay = 0;
        double momentumDefect = 0;  // N s
        double forces = 0;          // N
    };
    // What no step gives away but a run does: energy from nothing of the last ten seconds, less what was lost, and the
    // most that was in play meanwhile, both forgotten exponentially. J.
    struct EnergyWatch {
        double gained = 0;
        double inPlay = 0;

        bool add(double change, double inPlayNow, double dt);  // whether the flag is due
    };
    // The same of momentum: what no impulse explains, against what the forces on all bodies gave. N s.
    struct MomentumWatch {
        double lost = 0;
        double given = 0;

        bool add(double lostNow, double givenNow, double dt);
    };
    void solveIslands(S dt);
    // What a budget plans by, of one island: its rows and bodies.
    double loadOf(const Island& island) const;
    double rowsToSolve();  // about as many as rows of the islands that are not settled; loads_ are theirs
    // Divides the bound on the step's work among the islands: by their rows, and by what they took in the last step.
    void shareWork(double rows);
    std::vector<double> loads_;         // by awake island: loadOf() of those that are not settled
    std::vector<double> maxWork_;       // by awake island; empty: no bound
    std::vector<double> roomBeside_;    // m, by body: as far as it may go anywhere in the box that it has
    CommonDrift<S> drift_;              // of the bodies as they are
    std::vector<std::uint8_t> isFast_;  // room of catchFastBodies()
    std::vector<std::uint32_t> fast_;
    std::shared_ptr<ContinuousRoom> continuousRoom_;
    // Of a pair: its depth, and the island whose error that is part of; -1: none's.
    struct Measured {
        int points = 0;
        int island = -1;
        PairDepth depth;
        double asked = 0;  // m
    };
    std::vector<Measured> measured_;
    Measured measure(PairContacts<S>& pair) const;
    Rare<Problem<S>> largeProblem_;  // of islands that are large, one after the other
    int stepsWithoutLarge_ = 0;
    std::mutex narrowMutex_;
    NarrowCounts narrow_;  // of contacts found within the islands of this step
    void addNarrow(const NarrowCounts& counts);
    WorldTables<S> tables(JobSystem* team) {
        return {
            bodies, joints, contacts, islands, {def.gravity.template cast<S>(), def.gyroscopic, gyroscopicInertia()},
            team};
    }
    Totals totals_;
    EnergyWatch energyWatch_;
    MomentumWatch momentumWatch_;
    void record(const Island& island, const IslandState& state);
    void countAndClose(double dt);
    bool accuracyAsked() const;
    // Whether a budget, or who replays one, chooses the quality level of a step.
    bool hasQualityLevel() const { return def.accuracy.budget > 0 || def.accuracy.qualityLevel >= 0; }
    // s. Not read where nothing hangs on it: it is a call of the system, a tenth of a small scene's step.
    double budgetClock() const { return hasQualityLevel() ? BudgetKeeper::clock(jobs->threadCount()) : 0; }
};

template <class S>
typename World<S>::Impl& World<S>::ImplPtr::operator*() const {
    if (!impl_) {
        throw InputError("world", "moved from", "use the world that it was moved to, or assign another to it");
    }
    return *impl_;
}

}  // namespace cairn
