#include <cairn/engine/world_impl.hpp>

namespace cairn {
namespace {

void requireFinite(const char* field, bool finite) {
    if (!finite) {
        throw InputError(field, "a non-finite number", "give finite numbers");
    }
}

void check(const Probe& probe) {
    requireFinite("probe.pose", probe.pose.isFinite());
}

void check(const Probe& probe, const Vec3d& displacement) {
    check(probe);
    requireFinite("displacement", displacement.allFinite());
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

BodyQuery::Filter WorldQuery::proxyFilter(const Predicate& filter) const {
    if (!filter) {
        return seen_;
    }
    return [&](ProxyId proxy) { return (!seen_ || seen_(proxy)) && filter(idOf_(proxy)); };
}

std::optional<OfBody<RayHit>> WorldQuery::rayCast(const Ray& ray, const Predicate& filter) const {
    return named(bodies_.rayCast(ray, proxyFilter(filter)), idOf_);
}

std::vector<OfBody<RayHit>> WorldQuery::rayCastAll(const Ray& ray, const Predicate& filter) const {
    return named(bodies_.rayCastAll(ray, proxyFilter(filter)), idOf_);
}

bool WorldQuery::rayHits(const Ray& ray, const Predicate& filter) const {
    return bodies_.rayHits(ray, proxyFilter(filter));
}

std::optional<OfBody<Impact>> WorldQuery::shapeCast(const Probe& probe, const Vec3d& displacement,
                                                    const Predicate& filter) const {
    check(probe, displacement);
    return named(bodies_.shapeCast(probe, displacement, proxyFilter(filter)), idOf_);
}

std::vector<OfBody<Impact>> WorldQuery::shapeCastAll(const Probe& probe, const Vec3d& displacement,
                                                     const Predicate& filter) const {
    check(probe, displacement);
    return named(bodies_.shapeCastAll(probe, displacement, proxyFilter(filter)), idOf_);
}

bool WorldQuery::shapeCastHits(const Probe& probe, const Vec3d& displacement, const Predicate& filter) const {
    check(probe, displacement);
    return bodies_.shapeCastHits(probe, displacement, proxyFilter(filter));
}

std::vector<BodyId> WorldQuery::overlapping(const Probe& probe, const Predicate& filter) const {
    check(probe);
    return named(bodies_.overlapping(probe, proxyFilter(filter)), idOf_);
}

std::vector<BodyId> WorldQuery::containing(const Vec3d& point, const Predicate& filter) const {
    requireFinite("point", point.allFinite());
    return named(bodies_.containing(point, proxyFilter(filter)), idOf_);
}

std::optional<OfBody<Closest>> WorldQuery::closest(const Probe& probe, double maxDistance,
                                                   const Predicate& filter) const {
    check(probe);
    return named(bodies_.closest(probe, maxDistance, proxyFilter(filter)), idOf_);
}

std::vector<std::optional<OfBody<RayHit>>> WorldQuery::rayCasts(std::span<const Ray> rays,
                                                                const Predicate& filter) const {
    return named(bodies_.rayCasts(rays, *jobs_, proxyFilter(filter)), idOf_);
}

std::vector<std::optional<OfBody<Impact>>> WorldQuery::shapeCasts(std::span<const CastOf> casts,
                                                                  const Predicate& filter) const {
    for (const CastOf& cast : casts) {
        check(cast.probe, cast.displacement);
    }
    return named(bodies_.shapeCasts(casts, *jobs_, proxyFilter(filter)), idOf_);
}

std::vector<std::vector<BodyId>> WorldQuery::overlappings(std::span<const Probe> probes,
                                                          const Predicate& filter) const {
    std::ranges::for_each(probes, [](const Probe& probe) { check(probe); });
    return named(bodies_.overlappings(probes, *jobs_, proxyFilter(filter)), idOf_);
}

std::vector<std::optional<OfBody<Closest>>> WorldQuery::closests(std::span<const Probe> probes, double maxDistance,
                                                                 const Predicate& filter) const {
    std::ranges::for_each(probes, [](const Probe& probe) { check(probe); });
    return named(bodies_.closests(probes, *jobs_, maxDistance, proxyFilter(filter)), idOf_);
}

template <class S>
WorldQuery World<S>::query() const {
    const Impl* impl = impl_.get();
    return {BodyQuery(impl->broadPhase,
                      [impl](ProxyId proxy) {
                          const Body<S>& b = impl->bodies[proxy];
                          return QueryBody{b.def.shapes, b.framePoseDouble()};
                      }),
            [impl](ProxyId proxy) { return impl->bodies.idAt(proxy); },
            {},
            impl->jobs};
}

template <class S>
WorldQuery World<S>::query(const Filter& as) const {
    WorldQuery query = this->query();
    query.seen_ = [impl = impl_.get(), as](ProxyId proxy) { return filtersAgree(as, impl->bodies[proxy].def.filter); };
    return query;
}

template WorldQuery World<float>::query() const;
template WorldQuery World<double>::query() const;
template WorldQuery World<float>::query(const Filter&) const;
template WorldQuery World<double>::query(const Filter&) const;

}  // namespace cairn
