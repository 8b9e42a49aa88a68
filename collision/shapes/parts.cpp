#include "collision/shapes/parts.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/convex.hpp"
#include "collision/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cairn {
namespace {

Part partOf(const Shape& shape) {
    Part part;
    part.pose = frameOf(shape.pose);
    switch (shape.kind) {
        case ShapeKind::Hull:
            part.low = shape.hull->low;
            part.high = shape.hull->high;
            break;
        case ShapeKind::HalfSpace:
            part.high.setConstant(infinity);
            part.low = -part.high;
            break;
        case ShapeKind::Mesh:
        case ShapeKind::HeightField: {
            const Aabb box = bounds(std::span(&shape, 1), shape.pose.inverse());
            part.low = box.min;
            part.high = box.max;
            break;
        }
        default: {
            const Aabb box = boxOf(makeConvex(shape));
            part.low = box.min;
            part.high = box.max;
            break;
        }
    }
    const bool isFinite = shape.kind != ShapeKind::HalfSpace;
    part.middle = isFinite ? Vec3d(part.pose * Vec3d(0.5 * (part.low + part.high))) : part.pose.position;
    part.radius = 0.5 * (part.high - part.low).norm();
    part.box = bounds(std::span(&shape, 1), Posed{});
    return part;
}

}  // namespace

Frame frameOf(const Posed& pose) {
    if (pose.rotation.coeffs() == Quatd::Identity().coeffs() && pose.position.isZero(0)) {
        return {};
    }
    return {pose.rotation.toRotationMatrix(), pose.position, false};
}

std::vector<Part> partsOf(std::span<const Shape> shapes) {
    std::vector<Part> parts;
    parts.reserve(shapes.size());
    for (const Shape& shape : shapes) {
        parts.push_back(partOf(shape));
    }
    return parts;
}

PartTree::PartTree(std::span<const Part> parts) {
    constexpr std::size_t few = 16;
    const auto isFinite = [](const Part& part) { return part.box.min.allFinite() && part.box.max.allFinite(); };
    if (parts.size() <= few || !std::all_of(parts.begin(), parts.end(), isFinite)) {
        return;
    }
    boxes_.resize(parts.size());
    std::transform(parts.begin(), parts.end(), boxes_.begin(), [](const Part& part) { return part.box; });
    order_.resize(parts.size());
    std::iota(order_.begin(), order_.end(), 0U);
    build(0, static_cast<std::uint32_t>(parts.size()));
}

std::uint32_t PartTree::build(std::uint32_t begin, std::uint32_t end) {
    constexpr std::uint32_t leafSize = 4;
    const std::uint32_t index = static_cast<std::uint32_t>(nodes_.size());
    Node node{boxes_[order_[begin]], begin, end};
    Aabb middles{node.box.min + node.box.max, node.box.min + node.box.max};
    for (std::uint32_t i = begin; i < end; ++i) {
        const Aabb& box = boxes_[order_[i]];
        node.box = {node.box.min.cwiseMin(box.min), node.box.max.cwiseMax(box.max)};
        middles = {middles.min.cwiseMin(box.min + box.max), middles.max.cwiseMax(box.min + box.max)};
    }
    nodes_.push_back(node);
    if (end - begin > leafSize) {
        int axis = 0;
        (middles.max - middles.min).maxCoeff(&axis);
        const std::uint32_t half = begin + (end - begin) / 2;
        const auto at = [&](std::uint32_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(begin), at(half), at(end), [&](std::uint32_t p, std::uint32_t q) {
            const double a = boxes_[p].min[axis] + boxes_[p].max[axis];
            const double b = boxes_[q].min[axis] + boxes_[q].max[axis];
            return a < b || (a == b && p < q);
        });
        build(begin, half);
        nodes_[index].right = build(half, end);
    }
    return index;
}

void PartTree::find(const Aabb& box, std::vector<std::uint32_t>& out) const {
    const std::ptrdiff_t first = std::ssize(out);
    std::array<std::uint32_t, 64> open;  // higher than any tree halved at the median
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
        const std::uint32_t index = open[--count];
        const Node& node = nodes_[index];
        if (!node.box.overlaps(box)) {
            continue;
        }
        if (node.right != 0) {
            open[count++] = node.right;
            open[count++] = index + 1;
            continue;
        }
        for (std::uint32_t i = node.begin; i < node.end; ++i) {
            if (boxes_[order_[i]].overlaps(box)) {
                out.push_back(order_[i]);
            }
        }
    }
    std::sort(out.begin() + first, out.end());
}

template <class Measure>
void PartTree::walk(double limit, const Measure& measure, FunctionRef<double(std::uint32_t, double)> visit) const {
    walkNearest(
        std::uint32_t(0), limit, [&](std::uint32_t node, double within) { return measure(nodes_[node].box, within); },
        [&](std::uint32_t node) { return nodes_[node].right == 0; },
        [&](std::uint32_t node, int side) { return side == 0 ? node + 1 : nodes_[node].right; },
        [&](std::uint32_t node, double within) {
            for (std::uint32_t i = nodes_[node].begin; i < nodes_[node].end; ++i) {
                const double bound = measure(boxes_[order_[i]], within);
                if (bound <= within && !std::isinf(bound)) {
                    within = visit(order_[i], within);
                }
            }
            return within;
        });
}

void PartTree::cast(const Vec3d& origin, const Vec3d& motion, const Vec3d& half, double limit,
                    FunctionRef<double(std::uint32_t, double)> visit) const {
    const MovingBox moving(origin, motion, half);
    walk(
        limit, [&](const Aabb& box, double within) { return moving.entry(box.min, box.max, within); }, visit);
}

void PartTree::near(const Aabb& box, double limit, FunctionRef<double(std::uint32_t, double)> visit) const {
    walk(
        limit, [&](const Aabb& part, double) { return boxDistance(box, part.min, part.max); }, visit);
}

}  // namespace cairn
