#pragma once
// A diagnosis with bodies by their names in the scene.
#include "demos/simulation.hpp"

#include <nlohmann/json.hpp>

namespace cairn {

// A body's name in the scene, "body 7" where it has none, "rope, particle 3" for a deformable's.
std::string bodyName(const Scene& scene, const Simulation& simulation, BodyId id);
std::string bodyName(const Scene& scene, const Simulation& simulation, std::size_t index);

// "mass_ratio", "slow_sweeps", ...
const char* name(FindingKind kind);

// A body of a scene, by its index, that bounces, and the largest restitution of its shapes.
struct Bounce {
    std::size_t body = 0;
    double restitution = 0;
};
std::vector<Bounce> bounces(const Scene& scene);

// error_m, findings [{kind, text, figure, bodies}], islands [{lowest, bodies, rows, spectral_radius, dominance,
// sweeps {gauss_seidel, jacobi, nncg}, direct_work, exact}], bounces [{body, restitution}]. `position`: the error (m)
// that it was asked for.
nlohmann::ordered_json diagnosisJson(const Diagnosis& diagnosis, double position, const Scene& scene,
                                     const Simulation& simulation);

}  // namespace cairn
