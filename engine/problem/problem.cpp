#include "engine/problem/problem.hpp"
#include "base/resize.hpp"
#include "engine/constraints/axis_lock.hpp"

namespace cairn {
SolveReport& SolveReport::operator+=(const SolveReport& o) {
    directSolves += o.directSolves;
    sweptSolves += o.sweptSolves;
    newtonIterations += o.newtonIterations;
    factorisations += o.factorisations;
    rows = std::max(rows, o.rows);
    work += o.work;
    truncated = truncated || o.truncated;
    unconverged = unconverged || o.unconverged;
    tooLong = tooLong || o.tooLong;
    residual = std::max(residual, o.residual);
    energyGained += o.energyGained;
    isTamed = isTamed || o.isTamed;
    energyChange += o.energyChange;
    energyInPlay = std::max(energyInPlay, o.energyInPlay);
    momentumDefect += o.momentumDefect;
    forces = std::max(forces, o.forces);
    residualMomentum = std::max(residualMomentum, o.residualMomentum);
    return *this;
}

template <class S>
void Problem<S>::clear() {
    bodies.clear();
    contacts.clear();
    points.clear();
    slips.clear();
    places.clear();
    rounds.clear();
    joints.clear();
    locks.clear();
    rolls.clear();
    jointLambda.clear();
    jointImpulse.clear();
    beginImpulses();
    impacts_.clear();
    contactColours.clear();
    inLanes = false;
    jointColours.clear();
    jointOrder.clear();
    jobs = nullptr;
    isDriven = false;
    isHeldAtRest = false;
}

template <class S>
void Problem<S>::placePoint(ProblemContact<S>& contact, int k, ContactGeometry<S> at) {
    at.startStep(poseOf(contact.a), poseOf(contact.b));
    if (k == 0) {
        contact.normal = at.normal;
        contact.carrier = at.carrier;
        contact.particleA = at.particleA;
        contact.particleB = at.particleB;
    }
    places[static_cast<std::size_t>(contact.firstPoint + k)] = {at.onA, at.onB};
    if (contact.firstRound >= 0) {
        rounds[static_cast<std::size_t>(contact.firstRound + k)] = {at.roundA, at.roundB, at.startRoundA,
                                                                    at.startRoundB, at.startCarrier};
    }
}

template <class S>
void Problem<S>::placeContacts() {
    rowKeeper = nullptr;
    resizeClosely(frames, contacts.size());
    resizeClosely(contactRows, points.size());
    forEach(contacts.size(), [&](std::size_t c) {
        const ProblemContact<S>& contact = contacts[c];
        if (contact.count == 0) {
            return;
        }
        const Placement<S> a(poseOf(contact.a));
        const Placement<S> b(poseOf(contact.b));
        const std::size_t first = static_cast<std::size_t>(contact.firstPoint);
        frames[c] = contactFrame(geometryOf(contact, first), a, b);
        for (std::size_t i = first; i < first + static_cast<std::size_t>(contact.count); ++i) {
            contactRows[i].place(contactArms(geometryOf(contact, i), frames[c].normal, a, b));
        }
    });
}

template <class S>
void Problem<S>::linearizeCompact(bool placesContacts) {
    rows.clear();
    blocks.clear();
    refreshInertia();
    linearizeJoints(rows, blocks);
    jointBlocks = static_cast<int>(blocks.size());
    if (placesContacts) {
        placeContacts();
    }
}

template <class S>
void Problem<S>::linearize() {
    linearizeCompact();
    blocks.resize(blocks.size() + points.size());
    contactOfPoint_.resize(points.size());
    int end = static_cast<int>(rows.size());
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const ProblemContact<S>& contact = contacts[c];
        for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
            contactOfPoint_[static_cast<std::size_t>(i)] = static_cast<int>(c);
            RowBlock<S>& block = blocks[static_cast<std::size_t>(jointBlocks + i)];
            block.first = end;
            end += contact.hasFriction() ? 3 : 1;
        }
    }
    rows.resize(static_cast<std::size_t>(end));
    forEach(points.size(), [&](std::size_t i) {
        static thread_local std::vector<Row<S>> written;
        written.clear();
        RowBlock<S>& block = blocks[static_cast<std::size_t>(jointBlocks) + i];
        const int first = block.first;
        writeRows(contacts[static_cast<std::size_t>(contactOfPoint_[i])], i, written, block);
        block.first = first;
        const ProblemPoint<S>& point = points[i];
        written[0].lambda = point.normalForce;
        for (std::size_t t = 1; t < written.size(); ++t) {
            written[t].lambda = point.friction.dot(written[t].b.template head<3>());
        }
        std::copy(written.begin(), written.end(), rows.begin() + first);
    });
    respond();
    forEach(points.size(), [&](std::size_t i) {
        const RowBlock<S>& block = blocks[static_cast<std::size_t>(jointBlocks) + i];
        for (int r = 0; r < block.count; ++r) {
            contactRows[i].delassus[r] = responses[static_cast<std::size_t>(block.first + r)].delassus;
        }
    });
}

template <class S>
void Problem<S>::takeOffsets(S h) {
    const auto offsetOf = [&](int i) { return bodies[static_cast<std::size_t>(i)].expectedOffset(h); };
    for (const ProblemContact<S>& contact : contacts) {
        if (contact.count == 0) {
            continue;
        }
        const Vec3<S> normal = frameOf(contact).normal;
        for (std::size_t i = static_cast<std::size_t>(contact.firstPoint);
             i < static_cast<std::size_t>(contact.firstPoint + contact.count); ++i) {
            const S change = normal.dot(pointSpeed(rowsOf(contact, i), offsetOf(contact.a), offsetOf(contact.b)));
            if (rowKeeper == nullptr) {
                contactRows[i].C += change;
            } else {
                rowKeeper->addToC(placeOf(contact), i, change);
            }
        }
    }
    for (std::size_t k = static_cast<std::size_t>(jointBlocks); k < blocks.size(); ++k) {
        Row<S>& row = rows[static_cast<std::size_t>(blocks[k].first)];
        row.C += rowDot(row, blocks[k], offsetOf);
    }
}

template <class S>
void Problem<S>::linearizeJoints(std::vector<Row<S>>& out, std::vector<RowBlock<S>>& blocksOut, PinAxes pins) const {
    const std::size_t first = out.size();
    for (const JointLink& link : joints) {
        if (pins == PinAxes::OfWorld && link.joint->isPin()) {
            linearizePin(link, out, blocksOut.emplace_back());
        } else {
            linearizeJoint(link, out, blocksOut.emplace_back());
        }
    }
    for (const LockLink& lock : locks) {
        RowBlock<S>& block = blocksOut.emplace_back();
        block.a = lock.fixedBody;
        block.b = lock.b;
        linearizeLock(lock, out, block);
        for (std::size_t k = 0; k < lock.lambda.size(); ++k) {
            out[static_cast<std::size_t>(block.first) + k].lambda = lock.lambda[k];
        }
    }
    for (std::size_t i = 0; i < jointLambda.size(); ++i) {
        out[first + i].lambda = jointLambda[i];
    }
    for (const RollLink& roll : rolls) {
        RowBlock<S>& block = blocksOut.emplace_back();
        linearizeRoll(roll, out, block);
        for (std::size_t k = 0; k < static_cast<std::size_t>(block.count); ++k) {
            out[static_cast<std::size_t>(block.first) + k].lambda = roll.lambda[k];
        }
    }
}

template <class S>
void Problem<S>::linearizePin(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.a = link.a;
    block.b = link.b;
    block.first = static_cast<int>(out.size());
    RowWriter<S> writer(out, block);
    pointRowsInWorld(link.joint->frames, poseOf(link.a), poseOf(link.b), writer);
}

template <class S>
void Problem<S>::linearizeLock(const LockLink& lock, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.first = static_cast<int>(out.size());
    RowWriter<S> writer(out, block);
    linearizeAxisLock(lock.linear, lock.angular, lock.home, poseOf(lock.b), writer);
}

template <class S>
void Problem<S>::linearizeRoll(const RollLink& roll, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    const ProblemContact<S>& contact = contacts[roll.contact];
    const std::size_t first = static_cast<std::size_t>(contact.firstPoint);
    block.a = contact.a;
    block.b = contact.b;
    block.first = static_cast<int>(out.size());
    S force = 0;
    for (std::size_t i = first; i < first + static_cast<std::size_t>(contact.count); ++i) {
        force += points[i].normalForce;
    }
    RowWriter<S> writer(out, block);
    const Vec3<S> normal = geometryOf(contact, first).direction(poseOf(contact.a), poseOf(contact.b));
    if (roll.spinning > S(0)) {
        writer.makeMotor(writer.angular(normal, S(0)), S(0), roll.spinning * force);
    }
    if (roll.rolling > S(0)) {
        // The first along the roll at the start of the sub-step, so that two bounds resist every direction alike.
        const auto spin = [&](int body) -> Vec3<S> {
            return bodies[static_cast<std::size_t>(body)].vBefore.template tail<3>();
        };
        Vec3<S> along = spin(contact.b) - spin(contact.a);
        along -= normal.dot(along) * normal;
        Vec3<S> across;
        if (const S speed = along.norm(); speed > Eigen::NumTraits<S>::epsilon()) {
            along /= speed;
            across = normal.cross(along);
        } else {
            completeBasis(normal, along, across);
        }
        writer.makeMotor(writer.angular(along, S(0)), S(0), roll.rolling * force);
        writer.makeMotor(writer.angular(across, S(0)), S(0), roll.rolling * force);
    }
}

template <class S>
RowResponse<S> Problem<S>::responseOf(const Row<S>& row, const RowBlock<S>& block) const {
    RowResponse<S> response;
    const auto body = [&](int i) -> const SolverBody<S>& { return bodies[static_cast<std::size_t>(i)]; };
    if (!block.particles) {
        response.a = body(block.a).applyInverseMass(row.a);
        response.b = body(block.b).applyInverseMass(row.b);
    } else {
        response.a.template head<3>() = body(block.a).inverseMass * row.a.template head<3>();
        response.a.template tail<3>() = body(block.b).inverseMass * row.a.template tail<3>();
        response.b.setZero();
        if (block.c >= 0) {
            response.b.template head<3>() = body(block.c).inverseMass * row.b.template head<3>();
        }
        if (block.d >= 0) {
            response.b.template tail<3>() = body(block.d).inverseMass * row.b.template tail<3>();
        }
    }
    response.delassus = row.a.dot(response.a) + row.b.dot(response.b);
    return response;
}

template <class S>
void Problem<S>::respond() {
    responses.resize(rows.size());
    forEach(blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = blocks[k];
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            responses[i] = responseOf(rows[i], block);
        }
    });
}

template <class S>
void Problem<S>::linearizeJoint(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.a = link.a;
    block.b = link.b;
    block.c = link.c;
    block.d = link.d;
    JointPoses<S> poses{};
    for (int k = 0; k < 4; ++k) {
        if (const int body = block.body(k); body >= 0) {
            poses[static_cast<std::size_t>(k)] = &poseOf(body);
        }
    }
    link.joint->linearize(poses, out, block);
}

template <class S>
void Problem<S>::writeRows(const ProblemContact<S>& contact, std::size_t point, std::vector<Row<S>>& out,
                           RowBlock<S>& block) const {
    block.a = contact.a;
    block.b = contact.b;
    block.kind = BlockKind::Contact;
    block.first = static_cast<int>(out.size());
    block.friction = contact.friction;
    block.staticFriction = contact.staticFriction;
    RowWriter<S> writer(out, block);
    const ContactRows<S> placed = rowsOf(contact, point);
    linearizeContact<S>(frameOf(contact), {placed.armA, placed.armB, placed.C}, contact.hasFriction(), writer);
}

template <class S>
void Problem<S>::relinearize(std::size_t k) {
    static thread_local std::vector<Row<S>> scratch;
    scratch.clear();
    RowBlock<S> block;
    if (k < joints.size()) {
        linearizeJoint(joints[k], scratch, block);
    } else if (k < static_cast<std::size_t>(jointBlocks)) {
        block.a = blocks[k].a;
        block.b = blocks[k].b;
        if (k - joints.size() < locks.size()) {
            linearizeLock(locks[k - joints.size()], scratch, block);
        } else {
            linearizeRoll(rolls[k - joints.size() - locks.size()], scratch, block);
        }
    } else {
        const std::size_t i = k - static_cast<std::size_t>(jointBlocks);
        const std::size_t c = static_cast<std::size_t>(contactOfPoint_[i]);
        const ProblemContact<S>& contact = contacts[c];
        const Pose<S>& a = poseOf(contact.a);
        const Pose<S>& b = poseOf(contact.b);
        const ContactGeometry<S> at = geometryOf(contact, i);
        frames[c] = contactFrame(at, a, b);
        contactRows[i].place(contactArms(at, frames[c].normal, a, b));
        writeRows(contact, i, scratch, block);
    }
    blocks[k].armA = block.armA;
    blocks[k].armB = block.armB;
    for (std::size_t r = 0; r < scratch.size(); ++r) {
        Row<S>& row = rows[static_cast<std::size_t>(blocks[k].first) + r];
        row.a = scratch[r].a;
        row.b = scratch[r].b;
        row.C = scratch[r].C;
    }
}

template <class S>
void Problem<S>::jointErrors(std::vector<S>& C) const {
    static thread_local std::vector<Row<S>> scratch;
    C.clear();
    const auto add = [&](const auto& linearizeIt) {
        scratch.clear();
        RowBlock<S> block;
        linearizeIt(block);
        for (const Row<S>& row : scratch) {
            C.push_back(row.C);
        }
    };
    for (const JointLink& link : joints) {
        if (link.joint->isPin()) {
            const Vec3<S> errors = pointErrors(link.joint->frames, poseOf(link.a), poseOf(link.b));
            C.insert(C.end(), errors.data(), errors.data() + 3);
        } else {
            add([&](RowBlock<S>& block) { linearizeJoint(link, scratch, block); });
        }
    }
    for (const LockLink& lock : locks) {
        add([&](RowBlock<S>& block) { linearizeLock(lock, scratch, block); });
    }
    for (const RollLink& roll : rolls) {
        add([&](RowBlock<S>& block) { linearizeRoll(roll, scratch, block); });
    }
}

template <class S>
void Problem<S>::contactErrors(std::vector<S>& C) const {
    C.resize(points.size());
    for (const ProblemContact<S>& contact : contacts) {
        const Placement<S> a(poseOf(contact.a));
        const Placement<S> b(poseOf(contact.b));
        for (std::size_t i = static_cast<std::size_t>(contact.firstPoint);
             i < static_cast<std::size_t>(contact.firstPoint + contact.count); ++i) {
            C[i] = geometryOf(contact, i).separation(a, b);
        }
    }
}

template <class S>
void Problem<S>::handImpulsesOn() {
    const std::size_t held = joints.size() + locks.size();
    jointImpulse.resize(held);
    for (std::size_t k = 0; k < jointGiven_.size(); ++k) {
        if (k < held) {
            jointImpulse[k].a += jointGiven_[k].a;
            jointImpulse[k].b += jointGiven_[k].b;
        } else {
            rolls[k - held].impulse += jointGiven_[k].b.template tail<3>();
        }
    }
    jointGiven_.clear();
}

template <class S>
void Problem<S>::storeJointLambda(S h) {
    jointGiven_.resize(static_cast<std::size_t>(jointBlocks));
    if (!impacts_.empty()) {
        resizeClosely(pointGiven_, points.size());
    }
    for (const auto& [point, impact] : impacts_) {
        pointGiven_[point] += impact;
    }
    const std::size_t held = joints.size() + locks.size();
    jointLambda.resize(held > 0 ? static_cast<std::size_t>(blocks[held - 1].first + blocks[held - 1].count) : 0);
    forEach(static_cast<std::size_t>(jointBlocks), [&](std::size_t k) {
        for (int r = 0; r < blocks[k].count; ++r) {
            const std::size_t i = static_cast<std::size_t>(blocks[k].first + r);
            const Row<S>& row = rows[i];
            if (k < held) {
                jointLambda[i] = row.lambda;
            } else {
                rolls[k - held].lambda[static_cast<std::size_t>(r)] = row.lambda;
            }
            if (row.lambda != S(0)) {
                jointGiven_[k].a += h * row.lambda * row.a;
                jointGiven_[k].b += h * row.lambda * row.b;
            }
        }
    });
}

template <class S>
void Problem<S>::keepForces(std::size_t i, S normalForce, const Vec3<S>& friction) {
    points[i].normalForce = normalForce;
    points[i].friction = friction;
    if (!slips.empty()) {
        slips[i].setZero();
    }
}

template <class S>
Vec3<S> Problem<S>::forceOf(std::size_t point, const ContactRows<S>& placed, const ContactFrame<S>& frame, S h) const {
    if (rowKeeper == nullptr) {
        return forces_[point];
    }
    const Vec3<S> friction = placed.impulse[1] * frame.tangent1 + placed.impulse[2] * frame.tangent2;
    return S(1) / h * (placed.impulse[0] * frame.normal + friction);
}

template <class S>
void Problem<S>::storeLambda(S h) {
    storeJointLambda(h);
    resizeClosely(pointGiven_, points.size());
    resizeClosely(forces_, points.size());
    forEach(points.size(), [&](std::size_t i) {
        const RowBlock<S>& block = blocks[static_cast<std::size_t>(jointBlocks) + i];
        const Row<S>* row = &rows[static_cast<std::size_t>(block.first)];
        Vec3<S> friction = Vec3<S>::Zero();
        for (int t = 1; t < block.count; ++t) {
            friction += row[t].lambda * row[t].b.template head<3>();
        }
        const Vec3<S> force = row[0].lambda * row[0].b.template head<3>() + friction;
        keepForces(i, row[0].lambda, friction);
        forces_[i] = force;
        pointGiven_[i] += {h * force, h * row[0].lambda};
    });
}

template <class S>
void Problem<S>::giveBeyondRows(std::size_t k, const JointGiven& beyond) {
    const std::size_t first = static_cast<std::size_t>(jointBlocks);
    if (k < first) {
        jointGiven_[k].a += beyond.a;
        jointGiven_[k].b += beyond.b;
    } else {
        pointGiven_[k - first].impulse += beyond.b.template head<3>();
    }
}

template <class S>
void Problem<S>::storeCompactLambda(S h) {
    storeJointLambda(h);
    resizeClosely(pointGiven_, points.size());
    resizeClosely(forces_, points.size());
    const S perTime = S(1) / h;
    const bool isAsked = keepsForces();
    forEach(contacts.size(), [&](std::size_t c) {
        const ProblemContact<S>& contact = contacts[c];
        for (std::size_t i = static_cast<std::size_t>(contact.firstPoint);
             i < static_cast<std::size_t>(contact.firstPoint + contact.count); ++i) {
            const S* p = contactRows[i].impulse;
            const Vec3<S> friction = p[1] * frames[c].tangent1 + p[2] * frames[c].tangent2;
            const Vec3<S> impulse = p[0] * frames[c].normal + friction;
            pointGiven_[i] += {impulse, p[0]};
            if (isAsked) {
                keepForces(i, perTime * p[0], perTime * friction);
                forces_[i] = perTime * impulse;
            }
        }
    });
}

template struct Problem<float>;
template struct Problem<double>;

}  // namespace cairn
