#include "engine/problem/problem.hpp"
#include "engine/constraints/axis_lock.hpp"
#include "engine/model/gyroscopics.hpp"

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
    energyInPlay = std::max(energyInPlay, o.energyInPlay);
    momentumDefect += o.momentumDefect;
    residualMomentum = std::max(residualMomentum, o.residualMomentum);
    return *this;
}

template <class S>
void SolverBody<S>::refreshInertia() {
    if (particle || (inertiaAt.coeffs() == pose.rotation.coeffs() && stiffening.isZero(S(0)))) {
        return;
    }
    const Mat3<S> R = pose.rotation.toRotationMatrix();
    inertiaAt = pose.rotation;
    stiffening.setZero();
    inertia = R * localInertia * R.transpose();
    inverseInertia = R * localInverseInertia * R.transpose();
}

template <class S>
Pose<S> SolverBody<S>::moved(const Vec6<S>& twist, S h) const {
    Pose<S> to = pose;
    to.position += h * twist.template head<3>() + offset.template head<3>();
    if (!particle) {
        to.rotation = rotated<S>(pose.rotation, h * twist.template tail<3>() + offset.template tail<3>());
    }
    return to;
}

template <class S>
void Problem<S>::clear() {
    bodies.clear();
    contacts.clear();
    points.clear();
    joints.clear();
    locks.clear();
    jointLambda.clear();
    jointImpulse.clear();
    given_.clear();
    impacts_.clear();
}

template <class S>
void Problem<S>::startContacts() {
    for (const ProblemContact<S>& contact : contacts) {
        for (int k = 0; k < contact.count; ++k) {
            points[static_cast<std::size_t>(contact.firstPoint + k)].geometry.startStep(poseOf(contact.a),
                                                                                        poseOf(contact.b));
        }
    }
}

template <class S>
void Problem<S>::predict(S h) {
    impacts_.clear();
    for (SolverBody<S>& body : bodies) {
        body.vBefore = body.v;
        body.externalImpulse.setZero();
        body.gyroMomentum.setZero();
        body.offset.setZero();
        if (body.fixed) {
            continue;
        }
        if (body.gyroscopic != GyroscopicRule::None || !body.stiffening.isZero()) {
            body.refreshInertia();
        }
        body.v += h * body.applyInverseMass(body.force);
        if (body.linearDecay > S(0)) {
            body.v.template head<3>() *= std::exp(-body.linearDecay * h);
        }
        if (body.angularDecay > S(0)) {
            body.v.template tail<3>() *= std::exp(-body.angularDecay * h);
        }
        body.externalImpulse = body.applyMass(body.v - body.vBefore);
        if (body.gyroscopic != GyroscopicRule::None) {
            const Mat3<S> R = body.pose.rotation.toRotationMatrix();
            const Vec3<S> w = body.v.template tail<3>();
            const Vec3<S> local = R.transpose() * w;
            const Vec3<S> mean = R * freeSpin(body.gyroscopic, body.localInertia, local, h).mean;
            body.gyroMomentum = body.inertia * w;
            if (body.gyroscopicInertia) {
                body.inverseInertia = R * spinResponse(body.gyroscopic, body.localInertia, local, h) * R.transpose();
                body.inertia = body.inverseInertia.inverse();
                body.holdsInertia = true;
                body.inertiaAt.coeffs().setZero();
            }
            body.gyroMomentum -= body.inertia * mean;
            body.v.template tail<3>() = mean;
        }
    }
}

template <class S>
void Problem<S>::linearize() {
    rows.clear();
    blocks.clear();
    rows.reserve(3 * points.size());
    blocks.reserve(joints.size() + locks.size() + points.size());
    for (SolverBody<S>& body : bodies) {
        if (!body.fixed && !body.holdsInertia) {
            body.refreshInertia();
        }
    }
    linearizeJoints(rows, blocks);
    jointBlocks = static_cast<int>(blocks.size());
    contactOfPoint_.resize(points.size());
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const ProblemContact<S>& contact = contacts[c];
        const Placement<S> a(poseOf(contact.a));
        const Placement<S> b(poseOf(contact.b));
        for (std::size_t i = static_cast<std::size_t>(contact.firstPoint);
             i < static_cast<std::size_t>(contact.firstPoint + contact.count); ++i) {
            const ProblemPoint<S>& point = points[i];
            contactOfPoint_[i] = static_cast<int>(c);
            RowBlock<S>& block = blocks.emplace_back();
            linearizePoint(contact, point, a, b, rows, block);
            Row<S>* row = &rows[static_cast<std::size_t>(block.first)];
            row[0].lambda = point.normalForce;
            for (int t = 1; t < block.count; ++t) {
                row[t].lambda = point.friction.dot(row[t].b.template head<3>());
            }
        }
    }
    respond();
}

template <class S>
void Problem<S>::linearizeJoints(std::vector<Row<S>>& out, std::vector<RowBlock<S>>& blocksOut) const {
    const std::size_t first = out.size();
    for (const JointLink& link : joints) {
        linearizeJoint(link, out, blocksOut.emplace_back());
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
}

template <class S>
void Problem<S>::linearizeLock(const LockLink& lock, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.first = static_cast<int>(out.size());
    RowWriter<S> writer(out, block);
    linearizeAxisLock(lock.linear, lock.angular, lock.home, poseOf(lock.b), writer);
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
    for (const RowBlock<S>& block : blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            responses[i] = responseOf(rows[i], block);
        }
    }
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
template <class P>
void Problem<S>::linearizePoint(const ProblemContact<S>& contact, const ProblemPoint<S>& point, const P& a, const P& b,
                                std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.a = contact.a;
    block.b = contact.b;
    block.kind = BlockKind::Contact;
    block.first = static_cast<int>(out.size());
    block.friction = contact.friction;
    block.staticFriction = contact.staticFriction;
    RowWriter<S> writer(out, block);
    linearizeContact(point.geometry, a, b, contact.hasFriction(), writer);
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
        linearizeLock(locks[k - joints.size()], scratch, block);
    } else {
        const std::size_t i = k - static_cast<std::size_t>(jointBlocks);
        const ProblemContact<S>& contact = contacts[static_cast<std::size_t>(contactOfPoint_[i])];
        linearizePoint(contact, points[i], poseOf(contact.a), poseOf(contact.b), scratch, block);
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
    scratch.clear();
    for (const JointLink& link : joints) {
        RowBlock<S> block;
        linearizeJoint(link, scratch, block);
    }
    for (const LockLink& lock : locks) {
        RowBlock<S> block;
        linearizeLock(lock, scratch, block);
    }
    C.resize(scratch.size());
    for (std::size_t i = 0; i < scratch.size(); ++i) {
        C[i] = scratch[i].C;
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
            C[i] = points[i].geometry.separation(a, b);
        }
    }
}

template <class S>
void Problem<S>::integrate(S h) {
    for (SolverBody<S>& body : bodies) {
        const Vec3<S> w = body.v.template tail<3>();
        body.pose = body.moved(body.v, h);
        if (body.particle || body.gyroscopic == GyroscopicRule::None) {
            continue;
        }
        // Forces and impulses acted at the start; from there on the world keeps the angular momentum that they left.
        const Vec3<S> momentum = body.inertia * w - body.stiffening.cwiseProduct(w) + body.gyroMomentum;
        body.holdsInertia = false;
        body.refreshInertia();
        if (carriesMomentum(body.gyroscopic)) {
            body.v.template tail<3>() = body.inverseInertia * momentum;
        }
    }
}

template <class S>
void Problem<S>::handImpulsesOn() {
    if (given_.empty()) {
        return;
    }
    jointImpulse.resize(joints.size());
    for (std::size_t k = 0; k < joints.size(); ++k) {
        jointImpulse[k] += given_[k];
    }
    const Given* given = given_.data() + jointBlocks;
    for (ProblemPoint<S>& point : points) {
        point.impulse += given->b.template head<3>();
        point.normalImpulse += given->normal;
        ++given;
    }
    given_.clear();
}

template <class S>
void Problem<S>::storeLambda(S h) {
    given_.resize(blocks.size());
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        for (int r = 0; r < blocks[k].count; ++r) {
            const Row<S>& row = rows[static_cast<std::size_t>(blocks[k].first + r)];
            if (row.lambda != S(0)) {
                given_[k] += given(k, row, h * row.lambda);
            }
        }
    }
    for (const auto& [block, impact] : impacts_) {
        given_[block] += impact;
    }
    jointLambda.clear();
    for (std::size_t k = 0; k < static_cast<std::size_t>(jointBlocks); ++k) {
        for (int r = 0; r < blocks[k].count; ++r) {
            jointLambda.push_back(rows[static_cast<std::size_t>(blocks[k].first + r)].lambda);
        }
    }
    for (std::size_t k = static_cast<std::size_t>(jointBlocks); k < blocks.size(); ++k) {
        const Row<S>* row = &rows[static_cast<std::size_t>(blocks[k].first)];
        ProblemPoint<S>& point = pointOf(k);
        point.normalForce = row[0].lambda;
        point.slip.setZero();
        point.friction.setZero();
        for (int t = 1; t < blocks[k].count; ++t) {
            point.friction += row[t].lambda * row[t].b.template head<3>();
        }
    }
}

template struct SolverBody<float>;
template struct SolverBody<double>;
template struct Problem<float>;
template struct Problem<double>;

}  // namespace cairn
