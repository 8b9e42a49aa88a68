#include "demos/run_json.hpp"

#include <cmath>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

// JSON has no infinity and no NaN: such a number was not computed.
Json number(double x) {
    return std::isfinite(x) ? Json(x) : Json(nullptr);
}

Json number(const std::optional<double>& x) {
    return x ? number(*x) : Json(nullptr);
}

Json vector(const Vec3d& v) {
    return Json::array({number(v.x()), number(v.y()), number(v.z())});
}

}  // namespace

Json resultJson(const RunResult& r) {
    Json json;
    json["scene"] = r.scene;
    json["solver"] = r.solver;
    json["precision"] = name(r.precision);
    json["threads"] = r.threads;
    json["steps"] = r.steps;
    json["dt"] = number(r.dt);
    json["ms_per_step"] = {{"mean", number(r.meanMs())},
                           {"p50", number(r.percentileMs(0.5))},
                           {"p99", number(r.percentileMs(0.99))},
                           {"max", number(r.maxMs())}};
    json["error"] = {
        {"max_penetration_m", number(r.worst.penetration)},    {"final_penetration_m", number(r.last.penetration)},
        {"mean_penetration_m", number(r.meanPenetration)},     {"max_joint_gap_m", number(r.worst.jointGap)},
        {"final_joint_gap_m", number(r.last.jointGap)},        {"max_joint_angle_rad", number(r.worst.jointAngle)},
        {"final_joint_angle_rad", number(r.last.jointAngle)},  {"max_displacement_m", number(r.worst.displacement)},
        {"final_displacement_m", number(r.last.displacement)}, {"position_error_m", number(r.worst.position)},
        {"final_position_error_m", number(r.last.position)},   {"velocity_error_m_s", number(r.worst.velocity)},
        {"final_velocity_error_m_s", number(r.last.velocity)}, {"residual_coulomb", number(r.residualCoulomb)},
        {"residual_constraint", number(r.residualConstraint)}, {"residual_momentum", number(r.residualMomentum)},
        {"cone_violation", number(r.coneViolation)},           {"energy_drift", number(energyDrift(r))},
        {"momentum_defect", number(r.momentumDefect)}};
    json["energy"] = {{"peak_kinetic_j", number(r.peakKineticEnergy)},
                      {"final_kinetic_j", number(r.finalKineticEnergy)},
                      {"gained_j", number(r.energyGained)}};
    json["counts"] = {{"bodies", r.counts.bodies},     {"awake", r.counts.awake},        {"pairs", r.counts.pairs},
                      {"contacts", r.counts.contacts}, {"joints", r.counts.joints},      {"islands", r.counts.islands},
                      {"rows", r.counts.rows},         {"peak_contacts", r.peakContacts}};
    json["work"] = {{"direct_islands", r.directIslands},
                    {"swept_islands", r.sweptIslands},
                    {"newton_iterations", r.newtonIterations},
                    {"factorisations", r.factorisations},
                    {"unconverged", r.unconverged},
                    {"solves", r.solves},
                    {"subdivisions", r.subdivisions},
                    {"rows", r.rows},
                    {"narrow_calls", r.narrow.calls},
                    {"narrow_shape_pairs", r.narrow.shapePairs},
                    {"narrow_completed", r.narrow.completed},
                    {"narrow_repaired_normals", r.narrow.repairedNormals},
                    {"narrow_repaired_failures", r.narrow.repairedFailures},
                    {"narrow_through_fcl", r.narrow.throughFcl},
                    {"narrow_repaired_fcl", r.narrow.repairedFcl}};
    if (!r.qualityLevels.empty()) {
        json["quality_levels"] = r.qualityLevels;
        json["max_work"] = r.maxWork;
    }
    json["flags"] = flagNames(r.flags);
    return json;
}

Json bodiesJson(const SceneRun& run) {
    Json bodies = Json::array();
    const Simulation& simulation = run.simulation();
    for (std::size_t i = 0; i < run.scene().bodies.size(); ++i) {
        const Posed pose = simulation.pose(i);
        const Quatd& q = pose.rotation;
        bodies.push_back({{"name", run.scene().bodies[i].name},
                          {"position", vector(pose.position)},
                          {"rotation", Json::array({number(q.x()), number(q.y()), number(q.z()), number(q.w())})},
                          {"linearVelocity", vector(simulation.linearVelocity(i))},
                          {"angularVelocity", vector(simulation.angularVelocity(i))},
                          {"awake", simulation.awake(i)}});
    }
    return bodies;
}

}  // namespace cairn
