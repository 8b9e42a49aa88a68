#pragma once
// Which settings serve a scene best: each of a grid runs the scene for a short while from one state, and is judged by
// how far its bodies end up from a converged run and by the processor time it took.
#include <cairn/demos/simulation.hpp>
#include <cairn/demos/studies/studies.hpp>

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

struct TuneRequest {
    double error = 0.001;  // m: of both distance and step (TuneEntry)
    // s of processor time for 1/60 s of the scene; where given, the best within it is looked for and `error` is only
    // what the settings' tolerances are laid about.
    std::optional<double> budget = {};
    double at = 0;          // s that the scene runs as it is before it is measured
    double horizon = 0.25;  // s that is measured
    TuneSize size = TuneSize::Standard;
    int repeats = 3;  // of which the least time counts
};

// The grid for a scene; its own setting comes first.
std::vector<TuneSetting> tuneSettings(const Scene& scene, const TuneRequest& request);

struct TuneEntry {
    TuneSetting setting = {};
    double ms = 0;            // of processor time for 1/60 s of the scene
    double distance = 0;      // m, of the dynamic body that ended farthest from the truth
    double step = 0;          // m, worst StepError::position
    double worstAt = 0;       // s after `at`, when that was
    bool finite = true;       // no body went non-finite
    std::uint32_t flags = 0;  // StepFlag bits that any step raised

    double error() const;  // m, the worse of distance and step; infinite where a body went non-finite
};

// Where the bodies are at the end by the `direct` solver in double precision, with nothing asleep and steps so short
// that shorter ones hardly change it.
struct TuneTruth {
    std::vector<Vec3d> positions = {};  // by Simulation's bodies; empty: not known yet
    int divisor = 0;                    // of Scene::dt
    double doubt = 0;                   // m, how far a body moved when the steps were halved for the last time
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

// Of settings that are finite: those that no other beats in both cost and error, cheapest first. Places in
// TuneResult::entries.
std::vector<std::size_t> tuneFront(const TuneResult& result);
// The cheapest within the error, or the best within the budget; empty: there is none.
std::optional<std::size_t> tuneChoice(const TuneResult& result);

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
