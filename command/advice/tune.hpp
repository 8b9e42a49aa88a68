#pragma once
// Which settings serve a scene best: each of a grid runs the scene for a short while from one state, and is judged by
// how far its bodies end up from a converged run and by the processor time it took.
#include "command/studies/studies.hpp"
#include "demos/simulation.hpp"

namespace cairn {

// One way to run a scene.
struct TuneSetting {
    SolverDef solver = {};
    int divisor = 1;  // steps in place of one of Scene::dt
    Precision precision = Precision::Double;
    double accuracy = 0;  // m, AccuracyDef::position
    bool given = false;   // as the scene says; what is above says the same

    // In words, one for each setting of a grid: "nncg, 4 sub-steps, 8 iterations, dt/2, float, to 1 mm".
    std::string label() const;
    // The scene, to be run so.
    Scene apply(const Scene& scene) const;
};

enum class TuneSize { Quick, Standard, Full };

// What a setting is judged by.
enum class TuneBy {
    Both,  // the worse of distance and step; the step alone where the truth is not known to `error`
    Step,  // the step alone
};

struct TuneRequest {
    double error = 0.001;  // m: of what it is judged by (tuneError)
    // s of processor time for 1/60 s of the scene; where given, the best within it is looked for and `error` is only
    // what the settings' tolerances are laid about.
    std::optional<double> budget = {};
    double at = 0;          // s that the scene runs as it is before it is measured
    double horizon = 0.25;  // s that is measured
    TuneSize size = TuneSize::Standard;
    int repeats = 3;  // of which the least time counts
    TuneBy by = TuneBy::Both;
};

// The grid for a scene; its own setting comes first.
std::vector<TuneSetting> tuneSettings(const Scene& scene, const TuneRequest& request);

// m, at the end of one step of the scene, or of the steps in its place.
struct TuneMoment {
    double distance = 0;  // of the body that is farthest from the truth, with what it turned too far
    double step = 0;      // worst StepError::position
};

struct TuneEntry {
    TuneSetting setting = {};
    double ms = 0;                         // of processor time for 1/60 s of the scene
    std::vector<TuneMoment> moments = {};  // one for each step of the scene
    double distance = 0;                   // m, the worst of the moments
    std::size_t farthest = 0;              // that body, by Simulation's bodies
    double farthestAt = 0;                 // s after `at`, when that was
    double step = 0;                       // m, worst StepError::position
    double worstAt = 0;                    // s after `at`, when that was
    double energy = 0;                     // J that no force explains, summed (StepError::energyGained)
    bool finite = true;                    // no body went non-finite
    std::uint32_t flags = 0;               // StepFlag bits that any step raised
};

// Where the bodies are after each step by the `direct` solver in double precision, with nothing asleep, drawn out from
// runs of shorter and shorter steps to steps of no length (Richardson: twice the finer run less the coarser one).
struct TuneTruth {
    std::vector<std::vector<Posed>> poses = {};  // by step, then by Simulation's bodies; empty: not known yet
    int divisor = 0;                             // of Scene::dt, of the shortest steps
    double doubt = 0;                            // m, how far a body moved when the steps were halved for the last time
    std::uint32_t flags = 0;
};

// What is known so far; a stopped one can be gone on with.
struct TuneResult {
    TuneRequest request = {};
    TuneTruth truth = {};
    std::vector<TuneEntry> entries = {};
};

// Finishes `result` for the scene: whatever it holds already is kept. A budget of the scene is left out: by it the
// clock would choose what is done. `finished` is called after the truth and after each setting, with how many of how
// many are done. Throws InputError for a horizon, error or budget that is not above 0.
void tune(const Scene& scene, TuneResult& result, const std::function<void(int, int)>& finished = {});

// Whether only steps' own errors count: that was asked, or the truth is not known to the error asked, because the scene
// goes another way at any step.
bool tuneByStep(const TuneResult& result);
// m; infinite where a body went non-finite.
double tuneError(const TuneResult& result, const TuneEntry& entry);

// Of settings that are finite: those that no other beats in both cost and error, cheapest first. Places in
// TuneResult::entries.
std::vector<std::size_t> tuneFront(const TuneResult& result);
// The cheapest within the error, or the best within the budget; empty: there is none. Costs within 10 % of each other
// count as the same: of those the scene's own setting is taken, or else the one that errs least.
std::optional<std::size_t> tuneChoice(const TuneResult& result);
// The scene's own setting; empty before it is measured.
std::optional<std::size_t> tuneOwn(const TuneResult& result);
// What a reader should know before the numbers are believed, a sentence each; may be empty.
std::vector<std::string> tuneNotes(const Scene& scene, const TuneResult& result);

// m, of each body by Simulation's bodies: how far its mass is from where it should be, `turned` at the radius of
// gyration.
std::vector<double> distances(const Scene& scene, const std::vector<Posed>& is, const std::vector<Posed>& should);

// The scene at a time (s) after `at`, run by a setting.
std::unique_ptr<Simulation> tuneReplay(const Scene& scene, const TuneRequest& request, const TuneSetting& setting,
                                       double time);

// Error (mm) against cost (ms), with the front.
Figure tuneFigure(const Scene& scene, const TuneResult& result);

// For scripts; field names are a promise as those of a run.
nlohmann::ordered_json toJson(const Scene& scene, const TuneResult& result);
// To go on with later; it names the scene by a hash of what it holds. Throws InputError for a scene that no file can
// hold.
nlohmann::ordered_json tuneState(const Scene& scene, const TuneResult& result);
// Puts what a state holds into `result`. Throws InputError with `file` for a state of another scene, dt, error or
// horizon, and for what is no state.
void resumeTune(const nlohmann::json& state, const std::string& file, const Scene& scene, TuneResult& result);

}  // namespace cairn
