#include "collision/queries/body_query.hpp"
#include "collision/queries/ray.hpp"

#include <algorithm>

namespace cairn {
namespace {

// A batch is cut into jobs of this many questions: some 20 us each.
constexpr std::size_t batchGrain = 16;

bool passes(const BodyQuery::Filter& filter, ProxyId id) {
    return !filter || filter(id);
}

template <class Hit>
void sortByBody(std::vector<Hit>& hits) {
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.body < b.body; });
}

void requireEnd(const Probe& probe) {
    for (const Shape& shape : probe.shapes) {
        if (shape.kind == ShapeKind::HalfSpace) {
            throw InputError("probe.shapes", name(shape.kind), "cast shapes that have an end");
        }
    }
}

// The box of a probe as a middle and half extents.
struct Boxed {
    Vec3d middle;
    Vec3d half;
    explicit Boxed(const Probe& probe) {
        requireEnd(probe);
        const Aabb box = bounds(probe.shapes, probe.pose);
        middle = 0.5 * (box.min + box.max);
        half = 0.5 * (box.max - box.min);
    }
};

bool overlapsParts(const Probe& probe, const QueryBody& body) {
    const std::span<const Shape> shapes = body.shapes.shapes;
    if (body.shapes.tree == nullptr) {
        return overlaps(probe.shapes, probe.pose, shapes, body.pose);
    }
    std::vector<std::uint32_t> near;
    body.shapes.tree->find(bounds(probe.shapes, relativePose(body.pose, probe.pose)), near);
    return std::any_of(near.begin(), near.end(), [&](std::uint32_t part) {
        return overlaps(probe.shapes, probe.pose, shapes.subspan(part, 1), body.pose);
    });
}

// As closestPoints(), of equally near parts the first.
std::optional<Closest> closestOfParts(const Probe& probe, const QueryBody& body, double maxDistance) {
    if (body.shapes.tree == nullptr) {
        return closestPoints(probe.shapes, probe.pose, body.shapes.shapes, body.pose, maxDistance);
    }
    std::optional<Closest> best;
    const Aabb box = bounds(probe.shapes, relativePose(body.pose, probe.pose));
    body.shapes.tree->near(box, maxDistance, [&](std::uint32_t part, double limit) {
        auto near = closestPoints(probe.shapes, probe.pose, body.shapes.shapes.subspan(part, 1), body.pose, limit);
        if (near &&
            (!best || near->distance < best->distance || (near->distance == best->distance && part < best->shapeB))) {
            near->shapeB = part;
            best = near;
        }
        // The deepest of several overlaps is asked for: all those boxes are at 0.
        return best ? std::clamp(best->distance, 0.0, limit) : limit;
    });
    return best;
}

template <class Answer, class Ask>
std::vector<Answer> batch(std::size_t count, JobSystem& jobs, const Ask& ask) {
    std::vector<Answer> answers(count);
    parallelFor(jobs, count, batchGrain, [&](std::size_t i) { answers[i] = ask(i); });
    return answers;
}

}  // namespace

std::optional<BodyRayHit> BodyQuery::rayCast(const Ray& ray, const Filter& filter) const {
    std::optional<BodyRayHit> best;
    Ray rest = ray;
    phase_.cast(ray.origin, unitDirection(ray), Vec3d::Zero(), ray.length, [&](ProxyId id, double limit) {
        if (!passes(filter, id)) {
            return limit;
        }
        rest.length = limit;
        const QueryBody body = bodyOf_(id);
        const std::optional<RayHit> hit = rayCastParts(body.shapes, body.pose, rest);
        if (!hit || (best && hit->distance == best->distance && id > best->body)) {
            return limit;
        }
        best = BodyRayHit{*hit, id};
        return hit->distance;
    });
    return best;
}

std::vector<BodyRayHit> BodyQuery::rayCastAll(const Ray& ray, const Filter& filter) const {
    std::vector<BodyRayHit> hits;
    phase_.cast(ray.origin, unitDirection(ray), Vec3d::Zero(), ray.length, [&](ProxyId id, double limit) {
        if (passes(filter, id)) {
            const QueryBody body = bodyOf_(id);
            if (const std::optional<RayHit> hit = rayCastParts(body.shapes, body.pose, ray)) {
                hits.push_back({*hit, id});
            }
        }
        return limit;
    });
    sortByBody(hits);
    return hits;
}

bool BodyQuery::rayHits(const Ray& ray, const Filter& filter) const {
    bool any = false;
    phase_.cast(ray.origin, unitDirection(ray), Vec3d::Zero(), ray.length, [&](ProxyId id, double limit) {
        if (!any && passes(filter, id)) {
            const QueryBody body = bodyOf_(id);
            any = rayCastParts(body.shapes, body.pose, ray).has_value();
        }
        return any ? -1.0 : limit;
    });
    return any;
}

std::optional<BodyCastHit> BodyQuery::shapeCast(const Probe& probe, const Vec3d& displacement,
                                                const Filter& filter) const {
    std::optional<BodyCastHit> best;
    const Boxed box(probe);
    phase_.cast(box.middle, displacement, box.half, 1, [&](ProxyId id, double limit) {
        if (!passes(filter, id)) {
            return limit;
        }
        const QueryBody body = bodyOf_(id);
        const auto hit = shapeCastParts(probe.shapes, probe.pose, displacement, body.shapes, body.pose);
        if (!hit ||
            (best && (hit->fraction > best->fraction || (hit->fraction == best->fraction && id > best->body)))) {
            return limit;
        }
        best = BodyCastHit{*hit, id};
        return hit->fraction;
    });
    return best;
}

std::vector<BodyCastHit> BodyQuery::shapeCastAll(const Probe& probe, const Vec3d& displacement,
                                                 const Filter& filter) const {
    std::vector<BodyCastHit> hits;
    const Boxed box(probe);
    phase_.cast(box.middle, displacement, box.half, 1, [&](ProxyId id, double limit) {
        if (passes(filter, id)) {
            const QueryBody body = bodyOf_(id);
            if (const auto hit = shapeCastParts(probe.shapes, probe.pose, displacement, body.shapes, body.pose)) {
                hits.push_back({*hit, id});
            }
        }
        return limit;
    });
    sortByBody(hits);
    return hits;
}

bool BodyQuery::shapeCastHits(const Probe& probe, const Vec3d& displacement, const Filter& filter) const {
    bool any = false;
    const Boxed box(probe);
    phase_.cast(box.middle, displacement, box.half, 1, [&](ProxyId id, double limit) {
        if (!any && passes(filter, id)) {
            const QueryBody body = bodyOf_(id);
            any = shapeCastParts(probe.shapes, probe.pose, displacement, body.shapes, body.pose).has_value();
        }
        return any ? -1.0 : limit;
    });
    return any;
}

std::vector<ProxyId> BodyQuery::overlapping(const Probe& probe, const Filter& filter) const {
    std::vector<ProxyId> found = phase_.query(bounds(probe.shapes, probe.pose));
    std::erase_if(found, [&](ProxyId id) {
        if (!passes(filter, id)) {
            return true;
        }
        const QueryBody body = bodyOf_(id);
        return !overlapsParts(probe, body);
    });
    return found;
}

std::vector<ProxyId> BodyQuery::containing(const Vec3d& point, const Filter& filter) const {
    std::vector<ProxyId> found = phase_.query({point, point});
    std::erase_if(found, [&](ProxyId id) {
        if (!passes(filter, id)) {
            return true;
        }
        const QueryBody body = bodyOf_(id);
        return !contains(body.shapes.shapes, body.pose, point);
    });
    return found;
}

std::optional<BodyDistance> BodyQuery::closest(const Probe& probe, double maxDistance, const Filter& filter) const {
    std::optional<BodyDistance> best;
    phase_.near(
        bounds(probe.shapes, probe.pose),
        [&](ProxyId id, double limit) {
            if (!passes(filter, id)) {
                return limit;
            }
            const QueryBody body = bodyOf_(id);
            const auto near = closestOfParts(probe, body, limit);
            if (!near ||
                (best && (near->distance > best->distance || (near->distance == best->distance && id > best->body)))) {
                return limit;
            }
            best = BodyDistance{*near, id};
            // The deepest of several overlaps is asked for: all those boxes are at 0.
            return std::max(near->distance, 0.0);
        },
        maxDistance);
    return best;
}

std::vector<std::optional<BodyRayHit>> BodyQuery::rayCasts(std::span<const Ray> rays, JobSystem& jobs,
                                                           const Filter& filter) const {
    // Here, as an exception must not leave a game's own threads.
    std::ranges::for_each(rays, [](const Ray& ray) { unitDirection(ray); });
    return batch<std::optional<BodyRayHit>>(rays.size(), jobs, [&](std::size_t i) { return rayCast(rays[i], filter); });
}

std::vector<std::optional<BodyCastHit>> BodyQuery::shapeCasts(std::span<const ProbeCast> casts, JobSystem& jobs,
                                                              const Filter& filter) const {
    std::ranges::for_each(casts, [](const ProbeCast& cast) { requireEnd(cast.probe); });
    return batch<std::optional<BodyCastHit>>(
        casts.size(), jobs, [&](std::size_t i) { return shapeCast(casts[i].probe, casts[i].displacement, filter); });
}

std::vector<std::vector<ProxyId>> BodyQuery::overlappings(std::span<const Probe> probes, JobSystem& jobs,
                                                          const Filter& filter) const {
    return batch<std::vector<ProxyId>>(probes.size(), jobs,
                                       [&](std::size_t i) { return overlapping(probes[i], filter); });
}

std::vector<std::optional<BodyDistance>> BodyQuery::closests(std::span<const Probe> probes, JobSystem& jobs,
                                                             double maxDistance, const Filter& filter) const {
    return batch<std::optional<BodyDistance>>(probes.size(), jobs,
                                              [&](std::size_t i) { return closest(probes[i], maxDistance, filter); });
}

}  // namespace cairn
