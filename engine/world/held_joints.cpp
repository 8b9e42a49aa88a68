#include "engine/world/held_joints.hpp"

#include <algorithm>
#include <optional>

namespace cairn {
namespace {

constexpr int maxSweeps = 20;
template <class S>
constexpr S closed = S(1e-4);  // m or rad
// m or rad, by which a joint may have been open before: what is torn has no place to be brought back to, since its
// error turns with its bodies.
template <class S>
constexpr S torn = S(0.01);

// M^-1 of a body, world axes.
template <class S>
struct InverseMass {
    S linear = 0;
    Mat3<S> angular = Mat3<S>::Zero();

    InverseMass(const Body<S>& body, bool isStill) {
        if (!body.isDynamic() || isStill) {
            return;
        }
        linear = S(1) / body.kind->mass;
        if (!body.kind->def.particle) {
            const Mat3<S> R = body.pose.rotation.toRotationMatrix();
            angular = R * body.kind->inverseInertia * R.transpose();
        }
    }
    Vec6<S> operator*(const Vec6<S>& impulse) const {
        Vec6<S> answer;
        answer.template head<3>() = linear * impulse.template head<3>();
        answer.template tail<3>().noalias() = angular * impulse.template tail<3>();
        return answer;
    }
};

}  // namespace

template <class S>
void HeldJoints<S>::linearize(const Joint<S>& joint) {
    rows_.clear();
    block_ = {};
    JointPoses<S> poses{};
    for (int k = 0; k < joint.bodyCount(); ++k) {
        poses[at(k)] = &bodies_[joint.body(k).index].pose;
    }
    joint.linearize(poses, rows_, block_);
}

template <class S>
void HeldJoints<S>::add(std::size_t joint) {
    linearize(joints_[joint]);
    if (std::any_of(rows_.begin(), rows_.end(),
                    [](const Row<S>& row) { return row.isHardEquality() && std::abs(row.C) > torn<S>; })) {
        return;
    }
    held_.push_back({joint, errors_.size()});
    for (const Row<S>& row : rows_) {
        errors_.push_back(row.C);
    }
}

template <class S>
S HeldJoints<S>::close(const HeldJoint& held) {
    const Joint<S>& joint = joints_[held.joint];
    const S* errors = errors_.data() + held.firstError;
    linearize(joint);
    S worst = 0;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        worst = rows_[r].isHardEquality() ? std::max(worst, std::abs(rows_[r].C - errors[r])) : worst;
    }
    if (worst <= closed<S>) {
        return worst;
    }
    const std::size_t count = at(joint.bodyCount());
    const auto body = [&](std::size_t k) -> Body<S>& { return bodies_[joint.body(static_cast<int>(k)).index]; };
    std::array<Vec6<S>, 4> moved;
    moved.fill(Vec6<S>::Zero());
    std::array<std::optional<InverseMass<S>>, 4> inverse;
    for (std::size_t k = 0; k < count; ++k) {
        inverse[k].emplace(body(k), isStill_[joint.body(static_cast<int>(k)).index] != 0);
    }
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const Row<S>& row = rows_[r];
        if (!row.isHardEquality()) {
            continue;
        }
        S off = row.C - errors[r];
        S delassus = 0;
        std::array<Vec6<S>, 4> answer;
        for (std::size_t k = 0; k < count; ++k) {
            const Vec6<S> gradient = bodyGradient(row, block_, static_cast<int>(k));
            answer[k] = *inverse[k] * gradient;
            off += gradient.dot(moved[k]);
            delassus += gradient.dot(answer[k]);
        }
        for (std::size_t k = 0; k < count && delassus > S(0); ++k) {
            moved[k] -= off / delassus * answer[k];
        }
    }
    for (std::size_t k = 0; k < count; ++k) {
        if (Pose<S>& pose = body(k).pose; body(k).isDynamic()) {
            pose.position += moved[k].template head<3>();
            pose.rotation = rotated<S>(pose.rotation, moved[k].template tail<3>());
        }
    }
    return worst;
}

template <class S>
void HeldJoints<S>::close() {
    for (int sweep = 0; sweep < maxSweeps; ++sweep) {
        S worst = 0;
        for (const HeldJoint& joint : held_) {
            worst = std::max(worst, close(joint));
        }
        if (worst <= closed<S>) {
            return;
        }
        // There and back: what opens the next one closes along a chain at once.
        std::reverse(held_.begin(), held_.end());
    }
}

template class HeldJoints<float>;
template class HeldJoints<double>;

}  // namespace cairn
