#include "command/advice/check.hpp"

#include <cmath>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

// JSON has no infinity: sweeps that never get there are null.
Json number(double x) {
    return std::isfinite(x) ? Json(x) : Json(nullptr);
}

}  // namespace

std::string bodyName(const Scene& scene, const Simulation& simulation, BodyId id) {
    return bodyName(scene, simulation, simulation.indexOf(id));
}

std::string bodyName(const Scene& scene, const Simulation& simulation, std::size_t index) {
    if (index < scene.bodies.size()) {
        const std::string& given = scene.bodies[index].name;
        return given.empty() ? "body " + std::to_string(index) : given;
    }
    for (std::size_t i = 0; i < simulation.deformableCount(); ++i) {
        const std::size_t first = simulation.firstParticle(i);
        if (index >= first && index < first + simulation.particleCount(i)) {
            const std::string given = std::visit([](const auto& def) { return def.name; }, scene.deformables[i]);
            return (given.empty() ? "deformable " + std::to_string(i) : given) + ", particle " +
                   std::to_string(index - first);
        }
    }
    return "body " + std::to_string(index);
}

const char* name(FindingKind kind) {
    switch (kind) {
        case FindingKind::MassRatio:
            return "mass_ratio";
        case FindingKind::SlowSweeps:
            return "slow_sweeps";
        case FindingKind::StiffSpring:
            return "stiff_spring";
        case FindingKind::FastBody:
            return "fast_body";
        case FindingKind::Overlap:
            return "overlap";
        case FindingKind::FlatInertia:
            return "flat_inertia";
        case FindingKind::Units:
            return "units";
        case FindingKind::RedundantJoints:
            return "redundant_joints";
    }
    return "";
}

std::vector<Bounce> bounces(const Scene& scene) {
    std::vector<Bounce> bouncing;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        double restitution = 0;
        for (const Shape& shape : scene.bodies[i].shapes) {
            restitution = std::max(restitution, shape.material.restitution);
        }
        if (restitution > 0) {
            bouncing.push_back({i, restitution});
        }
    }
    return bouncing;
}

nlohmann::ordered_json diagnosisJson(const Diagnosis& diagnosis, double position, const Scene& scene,
                                     const Simulation& simulation) {
    Json json;
    json["scene"] = scene.name;
    json["error_m"] = position;
    json["findings"] = Json::array();
    for (const Finding& finding : diagnosis.findings) {
        Json bodies = Json::array();
        for (const BodyId id : finding.bodies) {
            bodies.push_back(bodyName(scene, simulation, id));
        }
        json["findings"].push_back({{"kind", name(finding.kind)},
                                    {"text", finding.text},
                                    {"figure", number(finding.figure)},
                                    {"bodies", std::move(bodies)}});
    }
    json["bounces"] = Json::array();
    for (const Bounce& bounce : bounces(scene)) {
        json["bounces"].push_back(
            {{"body", bodyName(scene, simulation, bounce.body)}, {"restitution", bounce.restitution}});
    }
    json["islands"] = Json::array();
    for (const IslandForecast& island : diagnosis.islands) {
        json["islands"].push_back({{"lowest", bodyName(scene, simulation, island.lowest)},
                                   {"bodies", island.bodies},
                                   {"rows", island.rows},
                                   {"spectral_radius", number(island.radius)},
                                   {"dominance", number(island.dominance)},
                                   {"sweeps",
                                    {{"gauss_seidel", number(island.sweeps)},
                                     {"jacobi", number(island.jacobiSweeps)},
                                     {"nncg", number(island.conjugateSweeps)}}},
                                   {"direct_work", number(island.directWork)},
                                   {"exact", island.exact}});
    }
    return json;
}

}  // namespace cairn
