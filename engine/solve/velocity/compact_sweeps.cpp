#include "engine/solve/velocity/compact_sweeps.hpp"

namespace cairn {
namespace {

template <class S>
ContactRows<S>* firstPoint(Problem<S>& problem, const ProblemContact<S>& contact) {
    return problem.contactRows.data() + contact.firstPoint;
}

template <class S>
std::size_t rowsOf(const ProblemContact<S>& contact) {  // of each point
    return contact.hasFriction() ? 3 : 1;
}

template <class S>
const Vec3<S>& direction(const ContactFrame<S>& frame, std::size_t row) {
    return row == 0 ? frame.normal : row == 1 ? frame.tangent1 : frame.tangent2;
}

// Of three impulses, along the normal and the tangents.
template <class S>
[[gnu::always_inline]] inline Vec3<S> inWorld(const ContactFrame<S>& frame, const S* impulse) {
    return impulse[0] * frame.normal + impulse[1] * frame.tangent1 + impulse[2] * frame.tangent2;
}

}  // namespace

template <class S>
void CompactSweeps<S>::readBodies(Problem<S>& problem) {
    rows_.readBodies(problem);
    readMasses(problem);
    joints_.couple(problem, masses_.data());
    if (!problem.inLanes) {
        problem.forEach(problem.contacts.size(), [&](std::size_t c) {
            const ProblemContact<S>& contact = problem.contacts[c];
            for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
                const ContactRows<S>& point = problem.contactRows[static_cast<std::size_t>(i)];
                if (!point.isIdle) {
                    readTurns(contact, problem.frames[c], point, sweeps_[static_cast<std::size_t>(i)]);
                    readScales(contact, point, sweeps_[static_cast<std::size_t>(i)]);
                }
            }
        });
    }
}

template <class S>
void CompactSweeps<S>::readMasses(const Problem<S>& problem) {
    masses_.resize(problem.bodies.size());
    problem.forEach(problem.bodies.size(), [&](std::size_t i) {
        const SolverBody<S>& body = problem.bodies[i];
        const Mat3<S>& I = body.inverseInertia;
        masses_[i] = {body.inverseMass, {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}};
    });
}

template <class S>
void CompactSweeps<S>::begin(Problem<S>& problem, const PushOutSpring<S>& spring, const PushOutSpring<S>& ofJoints,
                             S warmStart, S h, bool hasResponses) {
    readMasses(problem);
    joints_.begin(problem, masses_.data(), hasResponses);
    rows_.begin(problem, ofJoints, warmStart, h);
    const bool inLanes = problem.inLanes;
    if (inLanes) {
        static_assert(sizeof(BodyMass<S>) == 7 * sizeof(S) && sizeof(Vec6<S>) == 6 * sizeof(S));
        lanes_.begin(problem,
                     {spring.rate, spring.stiffness, spring.maxSpeed, spring.deepRate, spring.deepFrom,
                      spring.deepSpeed, h, warmStart, problem.limits.isFirst, mostStartOfSpring<S>},
                     &masses_.front().inverse);
    } else {
        sweeps_.resize(problem.contactRows.size());
        problem.forEach(problem.contacts.size(),
                        [&](std::size_t c) { beginContact(problem, c, spring, warmStart, h); });
    }
    contactRowCount_ = 0;
    for (const ProblemContact<S>& contact : problem.contacts) {
        contactRowCount_ += rowsOf(contact) * static_cast<std::size_t>(contact.count);
    }
}

template <class S>
void CompactSweeps<S>::beginContact(Problem<S>& problem, std::size_t c, const PushOutSpring<S>& spring, S warmStart,
                                    S h) {
    const ProblemContact<S>& contact = problem.contacts[c];
    const ContactFrame<S>& frame = problem.frames[c];
    const S inverse =
        masses_[static_cast<std::size_t>(contact.a)].inverse + masses_[static_cast<std::size_t>(contact.b)].inverse;
    const std::size_t first = static_cast<std::size_t>(contact.firstPoint);
    for (std::size_t i = first; i < first + static_cast<std::size_t>(contact.count); ++i) {
        ContactRows<S>& point = problem.contactRows[i];
        // The tangents turn with the bodies; the first sub-step has its own to start from.
        for (S& impulse : point.impulse) {
            impulse *= warmStart;
        }
        startPoint(problem, contact, frame, i, warmStart, h, point);
        readTurns(contact, frame, point, sweeps_[i]);
        for (std::size_t t = 0; t < rowsOf(contact); ++t) {
            const Vec3<S>& along = direction(frame, t);
            const UnitTurns<S>& turns = sweeps_[i].turns[t];
            point.delassus[t] = inverse + point.armA.cross(along).dot(turns.a) + point.armB.cross(along).dot(turns.b);
        }
        point.isIdle = false;
        if (problem.limits.isFirst) {
            sweeps_[i].start = startOfSpring(spring, point.delassus[0], problem.points[i].preload, h);
            limitPreload(sweeps_[i].start, problem.points[i]);
        }
        const S start = sweeps_[i].start;
        const bool isOpen = point.C > start;
        point.bias = isOpen ? (point.C - start) / h : spring.speedAt(point.C) - spring.rate * start;
        point.softness = isOpen ? S(0) : point.delassus[0] / spring.stiffness;
        readScales(contact, point, sweeps_[i]);
    }
}

template <class S>
void CompactSweeps<S>::readTurns(const ProblemContact<S>& contact, const ContactFrame<S>& frame,
                                 const ContactRows<S>& point, PointSweep& sweep) const {
    const BodyMass<S>& a = masses_[static_cast<std::size_t>(contact.a)];
    const BodyMass<S>& b = masses_[static_cast<std::size_t>(contact.b)];
    for (std::size_t t = 0; t < rowsOf(contact); ++t) {
        const Vec3<S>& along = direction(frame, t);
        sweep.turns[t] = {a.spin(point.armA.cross(along)), b.spin(point.armB.cross(along))};
    }
}

template <class S>
void CompactSweeps<S>::readScales(const ProblemContact<S>& contact, const ContactRows<S>& point, PointSweep& sweep) {
    for (std::size_t t = 0; t < rowsOf(contact); ++t) {
        sweep.scale[t] = S(1) / (point.delassus[t] + (t == 0 ? point.softness : S(0)));
    }
}

template <class S>
void CompactSweeps<S>::relax(Problem<S>& problem, S h) {
    rows_.relax(problem, h);
    joints_.renewTerms();
    if (problem.inLanes) {
        lanes_.relax(problem, twistNumbers(), h);
        return;
    }
    problem.forEach(problem.contacts.size(), [&](std::size_t c) {
        const ProblemContact<S>& contact = problem.contacts[c];
        const Vec6<S>& va = rows_.v[static_cast<std::size_t>(contact.a)];
        const Vec6<S>& vb = rows_.v[static_cast<std::size_t>(contact.b)];
        ContactRows<S>* point = firstPoint(problem, contact);
        const PointSweep* sweep = sweeps_.data() + contact.firstPoint;
        for (int k = 0; k < contact.count; ++k, ++point, ++sweep) {
            const S gap = point->C - sweep->start;
            point->isIdle = gap > S(0) && point->impulse[0] == S(0);
            point->softness = S(0);
            point->bias = std::max(S(0), gap + h * problem.frames[c].normal.dot(pointSpeed(*point, va, vb))) / h;
        }
    });
}

template <class S>
S CompactSweeps<S>::pushAll(Problem<S>& problem) {
    const S slope = joints_.push(problem, rows_, masses_.data(), before_.data());
    if (problem.inLanes) {
        return lanes_.push(problem, twistNumbers(), before_.front().data(), slope);
    }
    return problem.sumColours(slope, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            const ProblemContact<S>& contact = problem.contacts[c];
            const Vec6<S>& va = before_[static_cast<std::size_t>(contact.a)];
            const Vec6<S>& vb = before_[static_cast<std::size_t>(contact.b)];
            PushedBodies<S> bodies(rows_.v.data(), masses_.data(), contact.a, contact.b);
            const ContactRows<S>* point = firstPoint(problem, contact);
            for (int k = 0; k < contact.count; ++k, ++point) {
                const Vec3<S> impulse = inWorld(problem.frames[c], point->impulse);
                sum += impulse.dot(pointSpeed(*point, va, vb)) + point->impulse[0] * point->bias;
                bodies.push(point->armA, point->armB, impulse);
            }
            bodies.putBack();
        }
        return sum;
    });
}

template <class S>
void CompactSweeps<S>::warmStart(Problem<S>& problem) {
    before_ = rows_.v;
    const S slope = pushAll(problem);
    S curvature = 0;
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
        curvature += rows_.p[i] * rows_.terms[i].softness * rows_.p[i];
    }
    const bool inLanes = problem.inLanes;
    curvature = inLanes ? lanes_.curvature(problem, curvature)
                        : problem.sum(problem.contactRows.size(), curvature, [&](std::size_t begin, std::size_t end) {
                              S sum = 0;
                              for (std::size_t i = begin; i < end; ++i) {
                                  const ContactRows<S>& point = problem.contactRows[i];
                                  sum += point.impulse[0] * point.softness * point.impulse[0];
                              }
                              return sum;
                          });
    curvature = problem.sum(problem.bodies.size(), curvature, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            if (!problem.bodies[i].fixed) {
                const Vec6<S> dv = rows_.v[i] - before_[i];
                sum += problem.bodies[i].applyMass(dv).dot(dv);
            }
        }
        return sum;
    });
    const S share = curvature > S(0) ? std::clamp(-slope / curvature, S(0), S(1)) : S(0);
    // To scale by what differs from 1 in rounding alone would cost the momentum its last digits, step after step.
    constexpr S rounding = 100 * std::numeric_limits<S>::epsilon();
    if (share > S(1) - rounding) {
        return;
    }
    for (S& impulse : rows_.p) {
        impulse *= share;
    }
    joints_.scale(share);
    if (inLanes) {
        lanes_.scale(problem, share);
    }
    problem.forEach(inLanes ? 0 : problem.contactRows.size(), [&](std::size_t i) {
        for (S& impulse : problem.contactRows[i].impulse) {
            impulse *= share;
        }
    });
    problem.forEach(before_.size(),
                    [&](std::size_t i) { rows_.v[i] = before_[i] + share * (rows_.v[i] - before_[i]); });
}

template <class S>
S CompactSweeps<S>::sweepContact(const ProblemContact<S>& contact, const ContactFrame<S>& frame, ContactRows<S>* points,
                                 S relaxation) {
    const PointSweep* sweep = sweeps_.data() + contact.firstPoint;
    const Vec3<S> n = frame.normal;
    const Vec3<S> t1 = frame.tangent1;
    const Vec3<S> t2 = frame.tangent2;
    const bool rubs = contact.hasFriction();
    PushedBodies<S> bodies(rows_.v.data(), masses_.data(), contact.a, contact.b);
    S change = 0;
    for (int k = 0; k < contact.count; ++k, ++sweep) {
        ContactRows<S>& point = points[k];
        if (point.isIdle) {
            continue;
        }
        S* const p = point.impulse;
        const S error = n.dot(bodies.speed(point.armA, point.armB)) + point.bias + point.softness * p[0];
        const S next = std::max(S(0), p[0] - relaxation * error * sweep->scale[0]);
        const S dp = next - p[0];
        bodies.push(n, sweep->turns[0], dp);
        change += (point.delassus[0] + point.softness) * dp * dp;
        p[0] = next;
        if (!rubs) {
            continue;
        }
        const Vec3<S> u = bodies.speed(point.armA, point.armB);
        S wanted1 = p[1] - relaxation * t1.dot(u) * sweep->scale[1];
        S wanted2 = p[2] - relaxation * t2.dot(u) * sweep->scale[2];
        ontoDisc(point.friction * next, wanted1, wanted2);
        const S dp1 = wanted1 - p[1];
        const S dp2 = wanted2 - p[2];
        bodies.push(t1, sweep->turns[1], dp1);
        bodies.push(t2, sweep->turns[2], dp2);
        change += point.delassus[1] * dp1 * dp1 + point.delassus[2] * dp2 * dp2;
        p[1] = wanted1;
        p[2] = wanted2;
    }
    bodies.putBack();
    return change;
}

template <class S>
S CompactSweeps<S>::sweep(Problem<S>& problem, S relaxation) {
    const S change = problem.rows.empty() ? S(0) : joints_.sweep(problem, rows_, masses_.data(), relaxation);
    return sweepContacts(problem, relaxation, change);
}

template <class S>
S CompactSweeps<S>::sweepContacts(Problem<S>& problem, S relaxation, S change) {
    rows_.visits += contactRowCount_;
    if (problem.inLanes) {
        return lanes_.sweep(problem, twistNumbers(), relaxation, change);
    }
    return problem.sumColours(change, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            const ProblemContact<S>& contact = problem.contacts[c];
            sum += sweepContact(contact, problem.frames[c], firstPoint(problem, contact), relaxation);
        }
        return sum;
    });
}

template <class S>
void CompactSweeps<S>::copyImpulses(const Problem<S>& problem, std::vector<S>& out) const {
    const std::size_t joints = joints_.impulseCount(rows_);
    out.resize(joints + 3 * problem.points.size());
    joints_.copyImpulses(rows_, out.data());
    if (problem.inLanes) {
        lanes_.copyImpulses(problem, out.data() + joints);
        return;
    }
    problem.forEach(problem.contactRows.size(), [&](std::size_t i) {
        for (std::size_t t = 0; t < 3; ++t) {
            out[joints + 3 * i + t] = problem.contactRows[i].impulse[t];
        }
    });
}

template <class S>
void CompactSweeps<S>::add(Problem<S>& problem, const std::vector<S>& impulses, const std::vector<Vec6<S>>& twists) {
    const std::size_t joints = joints_.impulseCount(rows_);
    joints_.add(rows_, impulses.data());
    problem.forEach(twists.size(), [&](std::size_t i) { rows_.v[i] += twists[i]; });
    if (problem.inLanes) {
        lanes_.add(problem, impulses.data() + joints);
        return;
    }
    problem.forEach(problem.contactRows.size(), [&](std::size_t i) {
        for (std::size_t t = 0; t < 3; ++t) {
            problem.contactRows[i].impulse[t] += impulses[joints + 3 * i + t];
        }
    });
}

template <class S>
std::size_t CompactSweeps<S>::rowCount(const Problem<S>& problem) const {
    return problem.rows.size() + contactRowCount_;
}

template class CompactSweeps<float>;
template class CompactSweeps<double>;

}  // namespace cairn
