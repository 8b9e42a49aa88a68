#include "engine/islands/island.hpp"
#include "engine/constraints/axis_lock.hpp"
#include "engine/contacts/internal_edges.hpp"
#include "engine/model/gyroscopics.hpp"

namespace cairn {
namespace {

template <class S>
const Pose<S>& poseOf(const Island<S>& island, int body) {
    return island.bodies[static_cast<std::size_t>(body)].pose;
}

template <class S>
void linearizeLock(const Island<S>& island, const typename Island<S>::LockLink& lock, std::vector<Row<S>>& rows,
                   RowBlock<S>& block) {
    block.first = static_cast<int>(rows.size());
    RowWriter<S> writer(rows, block);
    linearizeAxisLock(lock.body->def.lockLinear, lock.body->def.lockAngular, lock.body->home, poseOf(island, lock.b),
                      writer);
}

template <class S>
bool hasFriction(const ContactManifold<S>& manifold) {
    return manifold.friction > S(0) || manifold.staticFriction > S(0);
}

}  // namespace

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
void Island<S>::clear() {
    Island fresh;
    const auto keep = [](auto& room, auto& used) {
        used.clear();
        room.swap(used);
    };
    keep(fresh.bodies, bodies);
    keep(fresh.joints, joints);
    keep(fresh.pairs, pairs);
    keep(fresh.manifolds, manifolds);
    keep(fresh.locks, locks);
    *this = std::move(fresh);
}

template <class S>
void Island<S>::swapRoom(Room& room) {
    atStep.swap(room.atStep);
    atSubstep.swap(room.atSubstep);
    rows.swap(room.rows);
    blocks.swap(room.blocks);
    responses.swap(room.responses);
    pointOfBlock_.swap(room.pointOfBlock);
    given_.swap(room.given);
    impacts_.swap(room.impacts);
}

template <class S>
void Island<S>::detect(const SpeculativeBounds& speculative, NarrowCounts& counts) {
    const auto side = [&](const Body<S>& body, int local) {
        const SolverBody<S>& s = bodies[static_cast<std::size_t>(local)];
        return PairSide<S>{&body, s.pose, s.v.template head<3>(), s.v.template tail<3>()};
    };
    std::vector<GroundPair<S>> ground;
    for (const PairLink& link : pairs) {
        const PairSide<S> a = side(*link.bodyA, link.a);
        const PairSide<S> b = side(*link.bodyB, link.b);
        collidePair(*link.pair, a, b, speculative, counts);
        addGroundPair(ground, *link.pair, a, b);
    }
    cullInternalEdges(ground);
    collectManifolds();
}

template <class S>
void Island<S>::collectManifolds() {
    manifolds.clear();
    for (const PairLink& link : pairs) {
        for (ContactManifold<S>& manifold : link.pair->manifolds) {
            for (ContactPointState<S>& point : manifold.points) {
                point.geometry.startStep(poseOf(*this, link.a), poseOf(*this, link.b));
            }
            manifolds.push_back({&manifold, link.a, link.b});
        }
    }
}

template <class S>
void Island<S>::predict(S h) {
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
void Island<S>::linearize() {
    rows.clear();
    blocks.clear();
    std::size_t points = 0;
    for (const ManifoldLink& link : manifolds) {
        points += static_cast<std::size_t>(link.manifold->geometry.count);
    }
    rows.reserve(3 * points);
    blocks.reserve(joints.size() + locks.size() + points);
    for (SolverBody<S>& body : bodies) {
        if (!body.fixed && !body.holdsInertia) {
            body.refreshInertia();
        }
    }
    linearizeJoints(rows, blocks);
    jointBlocks = static_cast<int>(blocks.size());
    pointOfBlock_.clear();
    for (std::size_t p = 0; p < manifolds.size(); ++p) {
        const Placement<S> a(poseOf(*this, manifolds[p].a));
        const Placement<S> b(poseOf(*this, manifolds[p].b));
        for (int k = 0; k < manifolds[p].manifold->geometry.count; ++k) {
            RowBlock<S>& block = blocks.emplace_back();
            pointOfBlock_.push_back({static_cast<int>(p), k});
            linearizePoint(manifolds[p], k, a, b, rows, block);
            const ContactPointState<S>& point = manifolds[p].manifold->points[static_cast<std::size_t>(k)];
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
void Island<S>::linearizeJoints(std::vector<Row<S>>& out, std::vector<RowBlock<S>>& blocksOut) const {
    for (const JointLink& link : joints) {
        linearizeJoint(link, out, blocksOut.emplace_back());
    }
    for (const LockLink& lock : locks) {
        RowBlock<S>& block = blocksOut.emplace_back();
        block.a = lock.fixedBody;
        block.b = lock.b;
        linearizeLock(*this, lock, out, block);
        for (std::size_t k = 0; k < lock.lambda->size(); ++k) {
            out[static_cast<std::size_t>(block.first) + k].lambda = (*lock.lambda)[k];
        }
    }
}

template <class S>
RowResponse<S> Island<S>::responseOf(const Row<S>& row, const RowBlock<S>& block) const {
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
void Island<S>::respond() {
    responses.resize(rows.size());
    for (const RowBlock<S>& block : blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            responses[i] = responseOf(rows[i], block);
        }
    }
}

template <class S>
void Island<S>::linearizeJoint(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const {
    block.a = link.a;
    block.b = link.b;
    block.c = link.c;
    block.d = link.d;
    JointPoses<S> poses{};
    for (int k = 0; k < 4; ++k) {
        if (const int body = block.body(k); body >= 0) {
            poses[static_cast<std::size_t>(k)] = &poseOf(*this, body);
        }
    }
    link.joint->linearize(poses, out, block);
}

template <class S>
template <class P>
void Island<S>::linearizePoint(const ManifoldLink& link, int point, const P& a, const P& b, std::vector<Row<S>>& out,
                               RowBlock<S>& block) const {
    const ContactManifold<S>& manifold = *link.manifold;
    block.a = link.a;
    block.b = link.b;
    block.kind = BlockKind::Contact;
    block.first = static_cast<int>(out.size());
    block.friction = manifold.friction;
    block.staticFriction = manifold.staticFriction;
    RowWriter<S> writer(out, block);
    linearizeContact(manifold.points[static_cast<std::size_t>(point)].geometry, a, b, hasFriction(manifold), writer);
}

template <class S>
void Island<S>::relinearize(std::size_t k) {
    static thread_local std::vector<Row<S>> scratch;
    scratch.clear();
    RowBlock<S> block;
    if (k < joints.size()) {
        linearizeJoint(joints[k], scratch, block);
    } else if (k < static_cast<std::size_t>(jointBlocks)) {
        block.a = blocks[k].a;
        block.b = blocks[k].b;
        linearizeLock(*this, locks[k - joints.size()], scratch, block);
    } else {
        const PointRef& ref = pointOfBlock_[k - static_cast<std::size_t>(jointBlocks)];
        const ManifoldLink& link = manifolds[static_cast<std::size_t>(ref.manifold)];
        linearizePoint(link, ref.point, poseOf(*this, link.a), poseOf(*this, link.b), scratch, block);
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
void Island<S>::jointErrors(std::vector<S>& C) const {
    static thread_local std::vector<Row<S>> scratch;
    scratch.clear();
    for (const JointLink& link : joints) {
        RowBlock<S> block;
        linearizeJoint(link, scratch, block);
    }
    for (const LockLink& lock : locks) {
        RowBlock<S> block;
        linearizeLock(*this, lock, scratch, block);
    }
    C.resize(scratch.size());
    for (std::size_t i = 0; i < scratch.size(); ++i) {
        C[i] = scratch[i].C;
    }
}

template <class S>
void Island<S>::contactErrors(std::vector<S>& C) const {
    std::size_t points = 0;
    for (const ManifoldLink& link : manifolds) {
        points += static_cast<std::size_t>(link.manifold->geometry.count);
    }
    C.resize(points);
    S* next = C.data();
    for (const ManifoldLink& link : manifolds) {
        const Placement<S> a(poseOf(*this, link.a));
        const Placement<S> b(poseOf(*this, link.b));
        for (std::size_t k = 0; k < static_cast<std::size_t>(link.manifold->geometry.count); ++k) {
            *next++ = link.manifold->points[k].geometry.separation(a, b);
        }
    }
}

template <class S>
void Island<S>::integrate(S h) {
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
void Island<S>::handImpulsesOn() {
    if (given_.empty()) {
        return;
    }
    const Given* given = given_.data();
    for (const JointLink& link : joints) {
        link.joint->impulseA += given->a;
        link.joint->impulseB += given->b;
        ++given;
    }
    given += locks.size();
    for (const ManifoldLink& link : manifolds) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(link.manifold->geometry.count); ++k) {
            link.manifold->points[k].impulse += given->b.template head<3>();
            link.manifold->points[k].normalImpulse += given->normal;
            ++given;
        }
    }
    given_.clear();
}

template <class S>
void Island<S>::storeLambda(S h) {
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
    std::size_t next = 0;
    for (const JointLink& link : joints) {
        const RowBlock<S>& block = blocks[next++];
        link.joint->lambda.resize(static_cast<std::size_t>(block.count));
        for (std::size_t k = 0; k < link.joint->lambda.size(); ++k) {
            link.joint->lambda[k] = rows[static_cast<std::size_t>(block.first) + k].lambda;
        }
    }
    for (const LockLink& lock : locks) {
        const RowBlock<S>& block = blocks[next++];
        lock.lambda->resize(static_cast<std::size_t>(block.count));
        for (std::size_t k = 0; k < lock.lambda->size(); ++k) {
            (*lock.lambda)[k] = rows[static_cast<std::size_t>(block.first) + k].lambda;
        }
    }
    for (const ManifoldLink& link : manifolds) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(link.manifold->geometry.count); ++k) {
            const RowBlock<S>& block = blocks[next++];
            const Row<S>* row = &rows[static_cast<std::size_t>(block.first)];
            ContactPointState<S>& point = link.manifold->points[k];
            point.normalForce = row[0].lambda;
            point.slip.setZero();
            point.friction.setZero();
            for (int t = 1; t < block.count; ++t) {
                point.friction += row[t].lambda * row[t].b.template head<3>();
            }
        }
    }
}

template struct SolverBody<float>;
template struct SolverBody<double>;
template struct Island<float>;
template struct Island<double>;

}  // namespace cairn
