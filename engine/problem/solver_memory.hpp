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
struct HybridMemory;

template <class S>
struct SolverMemory {
    std::shared_ptr<DirectMemory<S>> direct = nullptr;
    std::shared_ptr<HybridMemory<S>> hybrid = nullptr;
    std::vector<S> slowestMode = {};  // gauss_seidel, of the Jacobi iteration, by row
    // Whether islands share it, one after the other: then nothing in it is of this one. What a factor or a vector of
    // another leaves would show in the last digits, and those must not depend on which thread solves what.
    bool isShared = false;
};

}  // namespace cairn
