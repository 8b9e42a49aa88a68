#pragma once
// Colours of a graph's edges: constraints of one colour push no body in common, so that threads may solve them at once
// and the answer does not depend on how many there are.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cairn {

// The bodies that move of a constraint; -1: none.
using Pushed = std::array<int, 4>;

struct Colouring {
    std::vector<std::uint32_t> order;  // of the constraints: colour by colour, each rising
    std::vector<std::size_t> ends;     // of the colours in it; the last is of those that found none, and may be empty
};

// Greedy: each constraint in turn gets the first of 64 colours that none of its bodies has (bodyCount: of the island).
// A manifold seldom needs more than 12; what a body of very many contacts leaves over goes to the last range. O(n).
void findColours(std::span<const Pushed> constraints, std::size_t bodyCount, Colouring& out);

}  // namespace cairn
