#include "engine/problem/colouring.hpp"

#include <bit>

namespace cairn {

void findColours(std::span<const Pushed> constraints, std::size_t bodyCount, Colouring& out) {
    constexpr std::size_t colourCount = 64;
    static thread_local std::vector<std::uint64_t> taken;  // of each body, a bit a colour
    static thread_local std::vector<std::uint8_t> colourOf;
    taken.assign(bodyCount, 0);
    colourOf.resize(constraints.size());
    std::array<std::size_t, colourCount + 1> count{};
    for (std::size_t k = 0; k < constraints.size(); ++k) {
        std::uint64_t used = 0;
        for (const int body : constraints[k]) {
            used |= body >= 0 ? taken[static_cast<std::size_t>(body)] : 0;
        }
        const std::size_t colour = static_cast<std::size_t>(std::countr_one(used));
        for (const int body : constraints[k]) {
            if (body >= 0 && colour < colourCount) {
                taken[static_cast<std::size_t>(body)] |= std::uint64_t(1) << colour;
            }
        }
        colourOf[k] = static_cast<std::uint8_t>(colour);
        ++count[colour];
    }
    out.ends.clear();
    std::array<std::size_t, colourCount + 1> next{};
    std::size_t end = 0;
    for (std::size_t colour = 0; colour <= colourCount; ++colour) {
        next[colour] = end;
        end += count[colour];
        if (count[colour] > 0 || colour == colourCount) {
            out.ends.push_back(end);
        }
    }
    out.order.resize(constraints.size());
    for (std::size_t k = 0; k < constraints.size(); ++k) {
        out.order[next[colourOf[k]]++] = static_cast<std::uint32_t>(k);
    }
}

}  // namespace cairn
