#pragma once
#include "engine/islands/island.hpp"

namespace cairn {

// What a step changes of an island, so that it can be taken again.
template <class S>
class Checkpoint {
public:
    explicit Checkpoint(const Island<S>& island) : bodies_(island.bodies), halvings_(island.memory.halvings) {
        for (const auto& link : island.pairs) {
            pairs_.push_back(*link.pair);
        }
        for (const auto& link : island.joints) {
            lambdas_.push_back(link.joint->lambda);
        }
        for (const auto& link : island.locks) {
            lambdas_.push_back(*link.lambda);
        }
    }
    void restore(Island<S>& island) const {
        island.bodies = bodies_;
        island.memory.halvings = halvings_;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            *island.pairs[k].pair = pairs_[k];
        }
        auto lambda = lambdas_.begin();
        for (const auto& link : island.joints) {
            link.joint->lambda = *lambda++;
            link.joint->beginStep();
        }
        for (const auto& link : island.locks) {
            *link.lambda = *lambda++;
        }
        island.collectManifolds();
    }

private:
    std::vector<SolverBody<S>> bodies_;
    std::vector<PairContacts<S>> pairs_;
    std::vector<std::vector<S>> lambdas_;
    int halvings_;
};

}  // namespace cairn
