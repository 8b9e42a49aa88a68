#pragma once
// What a game asks of a world between steps: who is in a ray's or a shape's way, who is near, who is here.
#include <cairn/defs.hpp>
#include <cairn/shape_query.hpp>

namespace cairn {

// An answer of shape_query.hpp with the body that gave it.
template <class Answer>
struct OfBody : Answer {
    BodyId body;
};

// A view of a world's bodies as they stand now; from World::query(). Cheap to make and to copy; it must not outlive the
// world, and what it answers follows the world. Every call is const: as many threads as you like may ask at once while
// none changes the world. Answers are the same on every run: of equal ones the lowest body, lists in rising order of
// ids. Of a probe that overlaps a body at the start, fraction and distance tell so. Bodies without shapes are not seen.
// Questions with a number that is not finite, or a shape that is none (validate()), throw InputError.
class WorldQuery {
public:
    using Predicate = std::function<bool(BodyId)>;  // which bodies are asked at all; none: every one

    std::optional<OfBody<RayHit>> rayCast(const Ray& ray, const Predicate& filter = {}) const;   // the closest
    std::vector<OfBody<RayHit>> rayCastAll(const Ray& ray, const Predicate& filter = {}) const;  // first of each body
    bool rayHits(const Ray& ray, const Predicate& filter = {}) const;                            // whether any

    // A probe moved in a straight line without turning; B of an answer is the body.
    std::optional<OfBody<Impact>> shapeCast(const Probe& probe, const Vec3d& displacement,
                                            const Predicate& filter = {}) const;
    std::vector<OfBody<Impact>> shapeCastAll(const Probe& probe, const Vec3d& displacement,
                                             const Predicate& filter = {}) const;
    bool shapeCastHits(const Probe& probe, const Vec3d& displacement, const Predicate& filter = {}) const;

    std::vector<BodyId> overlapping(const Probe& probe, const Predicate& filter = {}) const;
    std::vector<BodyId> containing(const Vec3d& point, const Predicate& filter = {}) const;
    // The nearest body, or the one that the probe overlaps most; nothing beyond maxDistance (m). B is the body.
    std::optional<OfBody<Closest>> closest(const Probe& probe,
                                           double maxDistance = std::numeric_limits<double>::infinity(),
                                           const Predicate& filter = {}) const;

    // Many at once on the world's threads, from one thread at a time: answer i belongs to question i and is what the
    // single form answers. The filter is called from several threads.
    std::vector<std::optional<OfBody<RayHit>>> rayCasts(std::span<const Ray> rays, const Predicate& filter = {}) const;
    std::vector<std::optional<OfBody<Impact>>> shapeCasts(std::span<const ProbeCast> casts,
                                                          const Predicate& filter = {}) const;
    std::vector<std::vector<BodyId>> overlappings(std::span<const Probe> probes, const Predicate& filter = {}) const;
    std::vector<std::optional<OfBody<Closest>>> closests(std::span<const Probe> probes,
                                                         double maxDistance = std::numeric_limits<double>::infinity(),
                                                         const Predicate& filter = {}) const;

private:
    template <class S>
    friend class World;
    struct Impl;
    explicit WorldQuery(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

    std::shared_ptr<const Impl> impl_;
};

}  // namespace cairn
