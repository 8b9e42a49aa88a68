#pragma once
// Inside collision/ only. What walks through trees of boxes share: where a moving box meets a standing one, how far two
// boxes are apart, and the walk itself, nearest first.
#include <cairn/shapes.hpp>

#include <algorithm>
#include <limits>

namespace cairn {

// A box of half extents moved from an origin along a motion; a ray has none.
struct MovingBox {
    Vec3d origin;
    Vec3d inverse;  // 1 / motion, infinite where it is 0
    Vec3d half;

    MovingBox(const Vec3d& from, const Vec3d& motion, const Vec3d& halfExtents)
        : origin(from), inverse(motion.cwiseInverse()), half(halfExtents) {}

    // The fraction of the motion at which the box is entered, at least 0; infinite where it is missed or entered beyond
    // `limit`.
    double entry(const Vec3d& low, const Vec3d& high, double limit) const {
        constexpr double never = std::numeric_limits<double>::infinity();
        double enter = 0;
        double leave = limit;
        for (int i = 0; i < 3; ++i) {
            const double toLow = low[i] - half[i] - origin[i];
            const double toHigh = high[i] + half[i] - origin[i];
            if (std::isinf(inverse[i])) {
                if (toLow > 0 || toHigh < 0) {
                    return never;
                }
                continue;
            }
            const double t0 = toLow * inverse[i];
            const double t1 = toHigh * inverse[i];
            enter = std::max(enter, std::min(t0, t1));
            leave = std::min(leave, std::max(t0, t1));
        }
        // Rounding must not lose a box that is only grazed.
        return enter <= leave * (1 + 1e-12) + 1e-300 ? enter : never;
    }
};

inline double boxDistance(const Aabb& box, const Vec3d& low, const Vec3d& high) {
    return (low - box.max).cwiseMax(box.min - high).cwiseMax(0.0).norm();
}

// A stack on the stack; trees here are seldom higher than its room, and then it grows.
template <class T>
class WalkStack {
public:
    bool empty() const { return count_ == 0; }
    void push(const T& value) {
        if (count_ < room_.size()) {
            room_[count_] = value;
        } else {
            more_.push_back(value);
        }
        ++count_;
    }
    T pop() {
        --count_;
        if (count_ < room_.size()) {
            return room_[count_];
        }
        const T value = more_.back();
        more_.pop_back();
        return value;
    }

private:
    std::array<T, 64> room_{};
    std::vector<T> more_;
    std::size_t count_ = 0;
};

// Walks a binary tree of boxes, the nearer child first. measure(node, limit): a lower bound of what is in the node,
// infinite to leave it out. isLeaf(node); child(node, 0 or 1); visit(leaf, limit) answers the new limit, which must not
// be greater. Leaves whose bound equals the limit are still visited.
template <class Node, class Measure, class IsLeaf, class Child, class Visit>
double walkNearest(Node root, double limit, Measure measure, IsLeaf isLeaf, Child child, Visit visit) {
    struct Open {
        Node node;
        double bound;
    };
    WalkStack<Open> open;
    const double first = measure(root, limit);
    if (first <= limit && !std::isinf(first)) {
        open.push({root, first});
    }
    while (!open.empty()) {
        const Open next = open.pop();
        if (next.bound > limit) {
            continue;
        }
        if (isLeaf(next.node)) {
            limit = visit(next.node, limit);
            continue;
        }
        Open a{child(next.node, 0), 0};
        Open b{child(next.node, 1), 0};
        a.bound = measure(a.node, limit);
        b.bound = measure(b.node, limit);
        if (b.bound < a.bound) {
            std::swap(a, b);
        }
        for (const Open& ahead : {b, a}) {
            if (ahead.bound <= limit && !std::isinf(ahead.bound)) {
                open.push(ahead);
            }
        }
    }
    return limit;
}

}  // namespace cairn
