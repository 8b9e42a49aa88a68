#pragma once
// A joint as the world keeps it between steps.
#include <cairn/engine/body.hpp>
#include <cairn/engine/constraints/list.hpp>

namespace cairn {

template <class S>
struct Joint {
    JointDef def;
    BodyId a, b;
    JointFrames<S> frames;
    std::vector<S> compliance;  // of each row; empty: rigid
    std::vector<S> damping;
    std::vector<S> lambda;  // N or N m, of each row after the last step

    // Appends the joint's rows at the poses of the two centres of mass, soft rows marked, lambda loaded.
    void linearize(const Pose<S>& poseA, const Pose<S>& poseB, std::vector<Row<S>>& rows, RowBlock<S>& block) const {
        const std::size_t first = rows.size();
        block.first = static_cast<int>(first);
        RowWriter<S> writer(rows, block);
        std::visit([&](const auto& d) { cairn::linearize(d, frames, poseA, poseB, writer); }, def);
        for (std::size_t k = 0; k < compliance.size(); ++k) {
            rows[first + k].compliance = compliance[k];
            rows[first + k].damping = damping[k];
        }
        for (std::size_t k = 0; k < lambda.size(); ++k) {
            rows[first + k].lambda = lambda[k];
        }
    }
};

template <class S>
using JointTable = SlotTable<Joint<S>, JointId>;

// The joint that `def` asks for between two bodies as they stand. Throws InputError naming field, value and remedy.
template <class S>
Joint<S> makeJoint(const JointDef& def, const BodyTable<S>& bodies);

}  // namespace cairn
