#include "engine/solve/inner_part.hpp"

namespace cairn {

template <class S>
InnerPart<S>::InnerPart(Island<S>& whole, const Checkpoint<S>& start, S dt) : placeOf_(whole.bodies.size(), -1) {
    const Checkpoint<S> end(whole);
    const std::vector<SolverBody<S>> after = whole.bodies;
    start.restore(whole);
    const auto inner = [&](int body) {
        return body >= 0 && whole.bodies[static_cast<std::size_t>(body)].tolerance > 0;
    };
    const auto place = [&](int body) { return body < 0 ? -1 : take(whole, body, after, dt); };
    for (int i = 0; i < static_cast<int>(whole.bodies.size()); ++i) {
        if (inner(i)) {
            place(i);
        }
    }
    for (const auto& link : whole.joints) {
        if (inner(link.a) || inner(link.b) || inner(link.c) || inner(link.d)) {
            part_.joints.push_back({link.joint, place(link.a), place(link.b), place(link.c), place(link.d)});
        }
    }
    for (const auto& link : whole.locks) {
        if (inner(link.b)) {
            part_.locks.push_back({link.body, place(link.fixedBody), place(link.b), link.lambda});
        }
    }
    for (const auto& link : whole.pairs) {
        if (inner(link.a) || inner(link.b)) {
            part_.pairs.push_back({link.pair, link.bodyA, link.bodyB, place(link.a), place(link.b)});
        }
    }
    part_.marksBorder = true;
    if (whole.memory.inner) {
        part_.memory = *whole.memory.inner;
    }
    part_.collectPatches();
    start_.emplace(part_);
    end.restore(whole);
}

template <class S>
int InnerPart<S>::take(Island<S>& whole, int body, const std::vector<SolverBody<S>>& after, S dt) {
    const std::size_t i = static_cast<std::size_t>(body);
    if (placeOf_[i] >= 0) {
        return placeOf_[i];
    }
    placeOf_[i] = static_cast<int>(part_.bodies.size());
    source_.push_back(i);
    SolverBody<S>& taken = part_.bodies.emplace_back(whole.bodies[i]);
    if (!taken.fixed && !(taken.tolerance > 0)) {
        const Pose<S>& to = after[i].pose;
        SolverBody<S> driven;
        driven.fixed = true;
        driven.index = taken.index;
        driven.pose = taken.pose;
        driven.v.template head<3>() = (to.position - taken.pose.position) / dt;
        driven.v.template tail<3>() = logQuat<S>(to.rotation * taken.pose.rotation.conjugate()) / dt;
        driven.vBefore = driven.v;
        taken = driven;
    }
    return placeOf_[i];
}

template <class S>
void InnerPart<S>::handBack(Island<S>& whole) {
    for (std::size_t k = 0; k < source_.size(); ++k) {
        SolverBody<S>& body = whole.bodies[source_[k]];
        const SolverBody<S>& found = part_.bodies[k];
        if (body.fixed) {
            continue;
        }
        if (found.fixed) {
            body.v += body.applyInverseMass(found.handed - body.handed);
        } else {
            body = found;
        }
    }
    whole.memory.inner = std::make_shared<typename Island<S>::Memory>(std::move(part_.memory));
    whole.collectPatches();
}

template class InnerPart<float>;
template class InnerPart<double>;

}  // namespace cairn
