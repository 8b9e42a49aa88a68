#pragma once
// A joint as the world keeps it between steps.
#include <cairn/joints/list.hpp>

#include "engine/constraints/list.hpp"
#include "engine/model/body.hpp"

namespace cairn {

// Of the centres of mass of a joint's bodies; null where it has fewer.
template <class S>
using JointPoses = std::array<const Pose<S>*, 4>;

// A joint between particles: its linearize() takes their positions instead of poses.
template <class Def>
concept ParticleJoint = requires {
    Def::betweenParticles;
};

template <class S>
struct Joint {
    JointDef def;
    BodyId a, b;
    BodyId c = {}, d = {};  // further particles; null: none
    JointFrames<S> frames;
    std::vector<S> compliance;  // of each row; empty: rigid
    std::vector<S> damping;
    std::vector<S> lambda;  // N or N m, of each row after the last step
    // N s and N m s over the last step, all its sub-steps and impacts: on a and on b about their centres of mass; of a
    // joint between particles on a and b, and on c and d.
    Vec6<S> impulseA = Vec6<S>::Zero();
    Vec6<S> impulseB = Vec6<S>::Zero();

    BodyId body(int k) const { return k == 0 ? a : k == 1 ? b : k == 2 ? c : d; }
    int bodyCount() const { return c == BodyId{} ? 2 : d == BodyId{} ? 3 : 4; }

    bool holds(std::uint32_t index) const {
        for (int k = 0; k < bodyCount(); ++k) {
            if (body(k).index == index) {
                return true;
            }
        }
        return false;
    }

    // Whether it holds a point of b at one of a, rigidly, and does nothing beside.
    bool isPin() const {
        const BallDef* ball = std::get_if<BallDef>(&def);
        return ball != nullptr && ball->friction == 0 && compliance.empty() && !frames.particles;
    }
    // Appends the joint's rows at the poses of its bodies' centres of mass, soft rows marked, lambda loaded.
    void linearize(const JointPoses<S>& poses, std::vector<Row<S>>& rows, RowBlock<S>& block) const {
        const std::size_t first = rows.size();
        block.first = static_cast<int>(first);
        RowWriter<S> writer(rows, block);
        std::visit(
            [&](const auto& constraint) {
                if constexpr (ParticleJoint<std::decay_t<decltype(constraint)>>) {
                    std::array<Vec3<S>, 4> x;
                    for (std::size_t k = 0; k < 4; ++k) {
                        x[k] = poses[k] != nullptr ? poses[k]->position : Vec3<S>(Vec3<S>::Zero());
                    }
                    cairn::linearize(constraint, frames, x, writer);
                } else {
                    cairn::linearize(constraint, frames, *poses[0], *poses[1], writer);
                }
            },
            def);
        for (std::size_t k = 0; k < compliance.size(); ++k) {
            rows[first + k].compliance = compliance[k];
            rows[first + k].damping = damping[k];
        }
        for (std::size_t k = 0; k < lambda.size(); ++k) {
            rows[first + k].lambda = lambda[k];
        }
    }
    void linearize(const Pose<S>& poseA, const Pose<S>& poseB, std::vector<Row<S>>& rows, RowBlock<S>& block) const {
        linearize({&poseA, &poseB, nullptr, nullptr}, rows, block);
    }
};

template <class S>
using JointTable = SlotTable<Joint<S>, JointId>;

// The joint that `def` asks for between two bodies as they stand. Throws InputError naming field, value and remedy.
template <class S>
Joint<S> makeJoint(const JointDef& def, const BodyTable<S>& bodies);

}  // namespace cairn
