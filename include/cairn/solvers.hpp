#pragma once
// The solvers there are: what SolverDef::name may be, and what each of them takes.
#include <string_view>
#include <vector>

namespace cairn {

struct SolverDef;

struct SolverInfo {
    const char* name;
    const char* help;
    // The fields of SolverDef that it takes besides `name`, parted by blanks. What is given to a solver that does not
    // take it is refused by name.
    const char* fields;

    bool takes(std::string_view field) const;
};

const std::vector<SolverInfo>& solverList();

// The same, with what its solver does not take back at its default: for who changes a def's name and keeps the rest.
SolverDef onlyTaken(const SolverDef& def);

}  // namespace cairn
