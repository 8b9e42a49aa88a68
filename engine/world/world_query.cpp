#include "collision/queries/body_query.hpp"
#include "collision/shapes/validate.hpp"
#include "engine/world/world_impl.hpp"

#include <cmath>

namespace cairn {
namespace {

void requireFinite(const char* field, bool finite) {
    if (!finite) {
        throw InputError(field, "a non-finite number", "give finite numbers");
    }
}

// `called`: how messages name the probe; it is asked only for one.
void check(const Probe& probe, FunctionRef<std::string()> called) {
    for (std::size_t i = 0; i < probe.shapes.size(); ++i) {
        validate(probe.shapes[i], [&] { return called() + ".shapes[" + std::to_string(i) + "]"; });
    }
    validate(probe.pose, [&] { return called() + ".pose"; });
}

void check(const Probe& probe) {
    check(probe, [] { return std::string("probe"); });
}

void check(const Probe& probe, const Vec3d& displacement) {
    check(probe);
    requireFinite("displacement", displacement.allFinite());
}

void checkDistance(double maxDistance) {
    if (std::isnan(maxDistance)) {
        throw InputError("maxDistance", "not a number", "give a distance in m; it may be infinite");
    }
}

void checkAll(std::span<const Probe> probes) {
    for (std::size_t i = 0; i < probes.size(); ++i) {
        check(probes[i], [&] { return "probes[" + std::to_string(i) + "]"; });
    }
}

// The collision layer's answers name proxies, which are the indices of bodies.
template <class Hit>
using AnswerOf = std::conditional_t<std::is_base_of_v<RayHit, Hit>, RayHit,
                                    std::conditional_t<std::is_base_of_v<Impact, Hit>, Impact, Closest>>;

template <class Hit, class IdOf>
OfBody<AnswerOf<Hit>> named(const Hit& hit, const IdOf& idOf) {
    return {static_cast<const AnswerOf<Hit>&>(hit), idOf(hit.body)};
}

template <class IdOf>
BodyId named(ProxyId proxy, const IdOf& idOf) {
    return idOf(proxy);
}

template <class Hit, class IdOf>
auto named(const std::optional<Hit>& hit, const IdOf& idOf) {
    return hit ? std::optional(named(*hit, idOf)) : std::nullopt;
}

template <class Answer, class IdOf>
auto named(const std::vector<Answer>& answers, const IdOf& idOf) {
    std::vector<decltype(named(answers.front(), idOf))> all;
    all.reserve(answers.size());
    for (const Answer& answer : answers) {
        all.push_back(named(answer, idOf));
    }
    return all;
}

}  // namespace

struct WorldQuery::Impl {
    BodyQuery bodies;
    std::function<BodyId(ProxyId)> idOf;
    std::function<bool(ProxyId)> seen;  // null: every body
    std::shared_ptr<JobSystem> jobs;

    BodyQuery::Filter proxyFilter(const Predicate& filter) const {
        if (!filter) {
            return seen;
        }
        return [this, &filter](ProxyId proxy) { return (!seen || seen(proxy)) && filter(idOf(proxy)); };
    }
};

std::optional<OfBody<RayHit>> WorldQuery::rayCast(const Ray& ray, const Predicate& filter) const {
    return named(impl_->bodies.rayCast(ray, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<OfBody<RayHit>> WorldQuery::rayCastAll(const Ray& ray, const Predicate& filter) const {
    return named(impl_->bodies.rayCastAll(ray, impl_->proxyFilter(filter)), impl_->idOf);
}

bool WorldQuery::rayHits(const Ray& ray, const Predicate& filter) const {
    return impl_->bodies.rayHits(ray, impl_->proxyFilter(filter));
}

std::optional<OfBody<Impact>> WorldQuery::shapeCast(const Probe& probe, const Vec3d& displacement,
                                                    const Predicate& filter) const {
    check(probe, displacement);
    return named(impl_->bodies.shapeCast(probe, displacement, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<OfBody<Impact>> WorldQuery::shapeCastAll(const Probe& probe, const Vec3d& displacement,
                                                     const Predicate& filter) const {
    check(probe, displacement);
    return named(impl_->bodies.shapeCastAll(probe, displacement, impl_->proxyFilter(filter)), impl_->idOf);
}

bool WorldQuery::shapeCastHits(const Probe& probe, const Vec3d& displacement, const Predicate& filter) const {
    check(probe, displacement);
    return impl_->bodies.shapeCastHits(probe, displacement, impl_->proxyFilter(filter));
}

std::vector<BodyId> WorldQuery::overlapping(const Probe& probe, const Predicate& filter) const {
    check(probe);
    return named(impl_->bodies.overlapping(probe, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<BodyId> WorldQuery::containing(const Vec3d& point, const Predicate& filter) const {
    requireFinite("point", point.allFinite());
    return named(impl_->bodies.containing(point, impl_->proxyFilter(filter)), impl_->idOf);
}

std::optional<OfBody<Closest>> WorldQuery::closest(const Probe& probe, double maxDistance,
                                                   const Predicate& filter) const {
    check(probe);
    checkDistance(maxDistance);
    return named(impl_->bodies.closest(probe, maxDistance, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<std::optional<OfBody<RayHit>>> WorldQuery::rayCasts(std::span<const Ray> rays,
                                                                const Predicate& filter) const {
    return named(impl_->bodies.rayCasts(rays, *impl_->jobs, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<std::optional<OfBody<Impact>>> WorldQuery::shapeCasts(std::span<const ProbeCast> casts,
                                                                  const Predicate& filter) const {
    for (std::size_t i = 0; i < casts.size(); ++i) {
        const auto called = [&] { return "casts[" + std::to_string(i) + "]"; };
        check(casts[i].probe, [&] { return called() + ".probe"; });
        if (!casts[i].displacement.allFinite()) {
            throw InputError(called() + ".displacement", "a non-finite number", "give finite numbers");
        }
    }
    return named(impl_->bodies.shapeCasts(casts, *impl_->jobs, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<std::vector<BodyId>> WorldQuery::overlappings(std::span<const Probe> probes,
                                                          const Predicate& filter) const {
    checkAll(probes);
    return named(impl_->bodies.overlappings(probes, *impl_->jobs, impl_->proxyFilter(filter)), impl_->idOf);
}

std::vector<std::optional<OfBody<Closest>>> WorldQuery::closests(std::span<const Probe> probes, double maxDistance,
                                                                 const Predicate& filter) const {
    checkAll(probes);
    checkDistance(maxDistance);
    return named(impl_->bodies.closests(probes, *impl_->jobs, maxDistance, impl_->proxyFilter(filter)), impl_->idOf);
}

namespace {

template <class S>
BodyQuery bodyQuery(const BodyTable<S>& bodies, const BroadPhase& broadPhase) {
    return {broadPhase, [&bodies](ProxyId proxy) {
                const Body<S>& b = bodies[proxy];
                return QueryBody{b.kind->shapes(), b.framePoseDouble()};
            }};
}

}  // namespace

template <class S>
WorldQuery World<S>::query() const {
    const Impl* impl = &*impl_;
    return WorldQuery(std::make_shared<const WorldQuery::Impl>(
        WorldQuery::Impl{bodyQuery(impl->bodies, impl->broadPhase),
                         [impl](ProxyId proxy) { return impl->bodies.idAt(proxy); },
                         {},
                         impl->jobs}));
}

template <class S>
WorldQuery World<S>::query(const Filter& as) const {
    const Impl* impl = &*impl_;
    return WorldQuery(std::make_shared<const WorldQuery::Impl>(WorldQuery::Impl{
        bodyQuery(impl->bodies, impl->broadPhase), [impl](ProxyId proxy) { return impl->bodies.idAt(proxy); },
        [impl, as](ProxyId proxy) { return filtersAgree(as, impl->bodies[proxy].kind->def.filter); }, impl->jobs}));
}

template WorldQuery World<float>::query() const;
template WorldQuery World<double>::query() const;
template WorldQuery World<float>::query(const Filter&) const;
template WorldQuery World<double>::query(const Filter&) const;

}  // namespace cairn
