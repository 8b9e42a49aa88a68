#pragma once
// Questions to many bodies at once: the broad phase finds who is in question, the functions of shape_query.hpp and
// time_of_impact.hpp answer. Everything is const and needs no scratch: call it from as many threads as you like while
// no body is moved. Answers are the same on every run: of equal ones the lowest id, lists in rising order of ids.
#include <cairn/shape_query.hpp>

#include "base/base.hpp"
#include "collision/broad_phase/broad_phase.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/parts.hpp"

namespace cairn {

// A body as a query sees it.
struct QueryBody {
    BodyShapes shapes;
    Posed pose;  // world from body
};

struct BodyRayHit : RayHit {
    ProxyId body = 0;
};
// fraction and normal as in Impact; B is the body that was hit.
struct BodyCastHit : Impact {
    ProxyId body = 0;
};
// B is the body; see Closest.
struct BodyDistance : Closest {
    ProxyId body = 0;
};

class BodyQuery {
public:
    using BodyOf = std::function<QueryBody(ProxyId)>;
    using Filter = std::function<bool(ProxyId)>;  // which bodies are asked at all; none: every one

    // The boxes of `broadPhase` must hold the bodies where bodyOf says they are. Both must outlive this.
    BodyQuery(const BroadPhase& broadPhase, BodyOf bodyOf) : phase_(broadPhase), bodyOf_(std::move(bodyOf)) {}

    std::optional<BodyRayHit> rayCast(const Ray& ray, const Filter& filter = {}) const;   // the closest
    std::vector<BodyRayHit> rayCastAll(const Ray& ray, const Filter& filter = {}) const;  // the first of each body
    bool rayHits(const Ray& ray, const Filter& filter = {}) const;                        // whether any

    // A probe moved in a straight line without turning.
    std::optional<BodyCastHit> shapeCast(const Probe& probe, const Vec3d& displacement,
                                         const Filter& filter = {}) const;
    std::vector<BodyCastHit> shapeCastAll(const Probe& probe, const Vec3d& displacement,
                                          const Filter& filter = {}) const;
    bool shapeCastHits(const Probe& probe, const Vec3d& displacement, const Filter& filter = {}) const;

    std::vector<ProxyId> overlapping(const Probe& probe, const Filter& filter = {}) const;
    std::vector<ProxyId> containing(const Vec3d& point, const Filter& filter = {}) const;
    std::optional<BodyDistance> closest(const Probe& probe,
                                        double maxDistance = std::numeric_limits<double>::infinity(),
                                        const Filter& filter = {}) const;

    // Many at once on a job system: answer i belongs to question i, and is what the single form answers. The filter is
    // called from several threads.
    std::vector<std::optional<BodyRayHit>> rayCasts(std::span<const Ray> rays, JobSystem& jobs,
                                                    const Filter& filter = {}) const;
    std::vector<std::optional<BodyCastHit>> shapeCasts(std::span<const ProbeCast> casts, JobSystem& jobs,
                                                       const Filter& filter = {}) const;
    std::vector<std::vector<ProxyId>> overlappings(std::span<const Probe> probes, JobSystem& jobs,
                                                   const Filter& filter = {}) const;
    std::vector<std::optional<BodyDistance>> closests(std::span<const Probe> probes, JobSystem& jobs,
                                                      double maxDistance = std::numeric_limits<double>::infinity(),
                                                      const Filter& filter = {}) const;

private:
    const BroadPhase& phase_;
    BodyOf bodyOf_;
};

}  // namespace cairn
