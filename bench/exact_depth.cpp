#include "exact_depth.hpp"

#include <algorithm>
#include <numeric>

namespace cairn::bench {

// Boxes in order of their lower end along x, each against those that begin before it ends.
Depths exactDepth(std::span<const Placed> bodies, std::span<const std::pair<int, int>> apart) {
    std::vector<Aabb> boxes;
    for (const Placed& body : bodies) {
        boxes.push_back(bounds(body.shapes, body.pose));
    }
    std::vector<int> order(bodies.size());
    std::iota(order.begin(), order.end(), 0);
    const auto box = [&](int i) -> const Aabb& { return boxes[static_cast<std::size_t>(i)]; };
    std::sort(order.begin(), order.end(), [&](int i, int k) { return box(i).min.x() < box(k).min.x(); });
    Depths depths;
    for (auto i = order.begin(); i != order.end(); ++i) {
        for (auto k = i + 1; k != order.end() && box(*k).min.x() <= box(*i).max.x(); ++k) {
            const Placed& a = bodies[static_cast<std::size_t>(std::min(*i, *k))];
            const Placed& b = bodies[static_cast<std::size_t>(std::max(*i, *k))];
            if (!(a.moves || b.moves) || !box(*i).overlaps(box(*k)) || !filtersAgree(a.filter, b.filter) ||
                std::binary_search(apart.begin(), apart.end(), std::pair<int, int>(std::minmax(*i, *k)))) {
                continue;
            }
            const auto closest = closestPoints(a.shapes, a.pose, b.shapes, b.pose, 0);
            if (closest && closest->distance < 0) {
                depths.worst = std::max(depths.worst, -closest->distance);
                depths.mean -= closest->distance;
                ++depths.pairs;
            }
        }
    }
    depths.mean /= std::max(depths.pairs, 1);
    return depths;
}

}  // namespace cairn::bench
