#pragma once
// Auto, the default: for each island `direct` while the predicted cost of its factor is within a stated bound, else
// `gauss_seidel`.
#include <cairn/engine/solvers/direct.hpp>
#include <cairn/engine/solvers/gauss_seidel.hpp>

namespace cairn {

template <class S>
class Auto final : public Solver<S> {
public:
    explicit Auto(const SolverSettings& settings);
    SolveReport advance(Island<S>& island, S h) override;
    int substeps(Island<S>& island, S dt) const override;

private:
    SolverSettings settings_;
    std::unique_ptr<Direct<S>> direct_;
    std::unique_ptr<GaussSeidel<S>> gaussSeidel_;
};

}  // namespace cairn
