#pragma once
// The solvers there are: what SolverDef::name may be.
#include <vector>

namespace cairn {

struct SolverInfo {
    const char* name;
    const char* help;
};

const std::vector<SolverInfo>& solverList();

}  // namespace cairn
