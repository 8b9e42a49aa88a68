#pragma once
// What solvers keep of an island from step to step: orders, patterns, factors. For speed alone, never part of the
// answer; each may find another's, or nothing.
#include "base/base.hpp"

#include <memory>
#include <vector>

namespace cairn {

template <class S>
struct DirectMemory;

template <class S>
struct SolverMemory {
    std::shared_ptr<DirectMemory<S>> direct;
    std::vector<S> slowestMode;  // gauss_seidel, of the Jacobi iteration, by row
};

}  // namespace cairn
