#pragma once
// How deep bodies are in each other, from their shapes and poses alone: whatever the engine that moved them found,
// kept or told of contacts.
#include <cairn/cairn.hpp>

#include <span>
#include <vector>

namespace cairn::bench {

struct Placed {
    std::span<const Shape> shapes;
    Posed pose;
    Filter filter;
    bool moves = true;
};

struct Depths {
    double worst = 0;  // m
    double mean = 0;   // m, over the pairs that overlap
    int pairs = 0;     // that overlap
};

// `apart`: sorted pairs of places in `bodies`, the lower first, that do not collide whatever their filters say.
Depths exactDepth(std::span<const Placed> bodies, std::span<const std::pair<int, int>> apart);

}  // namespace cairn::bench
