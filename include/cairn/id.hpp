#pragma once
// Generation ids: an index into a table and the generation of the slot. A stale id differs in generation from the slot
// it points to, so it is caught, never followed. So is an id of another world: each world of a process counts its
// generations from another number. That number hangs on how many worlds came before, so it may differ from run to run;
// indices do not. What is to be kept, printed or compared between runs is the index.
#include <compare>
#include <cstdint>

namespace cairn {

template <class Tag>
struct Id {
    std::uint32_t index = UINT32_MAX;
    std::uint32_t generation = 0;

    bool isNull() const { return index == UINT32_MAX; }
    friend bool operator==(const Id&, const Id&) = default;
    friend auto operator<=>(const Id&, const Id&) = default;
};

}  // namespace cairn
