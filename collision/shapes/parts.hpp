#pragma once
// The shapes of a body, each with what tells it from the others: of compounds, of which a question concerns few.
#include <cairn/shapes.hpp>

#include "base/function_ref.hpp"
#include "collision/shapes/turn.hpp"

#include <span>
#include <vector>

namespace cairn {

struct Frame {
    Mat3d rotation = Mat3d::Identity();
    Vec3d position = Vec3d::Zero();
    bool isIdentity = true;  // as most shapes stand in their bodies: frames need not be multiplied by it

    Vec3d operator*(const Vec3d& p) const { return isIdentity ? p : Vec3d(turned(rotation, p) + position); }
    Frame inverse() const {
        return isIdentity ? Frame{} : Frame{rotation.transpose(), -turnedBack(rotation, position), false};
    }
};

Frame frameOf(const Posed& pose);

struct Part {
    Frame pose;                 // in the body
    Vec3d low = Vec3d::Zero();  // its box in its own frame, m
    Vec3d high = Vec3d::Zero();
    Vec3d middle = Vec3d::Zero();  // of a ball about it, in the body
    double radius = 0;             // m
    Aabb box;                      // along the body's axes
};

std::vector<Part> partsOf(std::span<const Shape> shapes);

// The parts of a compound by their boxes along its axes, so that a level of thousands in one body costs what the few
// beside a crate do. A binary tree, halved at the median.
class PartTree {
public:
    PartTree() = default;
    // Empty of few parts, and where one has no end: they are looked at one by one.
    explicit PartTree(std::span<const Part> parts);

    bool empty() const { return nodes_.empty(); }
    // Appends the parts whose boxes overlap `box`, rising.
    void find(const Aabb& box, std::vector<std::uint32_t>& out) const;
    // Calls visit(part, limit) for the parts that a box of these half extents may meet on its way from `origin` along
    // `motion`, up to `limit` times that, the nearer first; it answers the new limit, which must not be greater.
    void cast(const Vec3d& origin, const Vec3d& motion, const Vec3d& half, double limit,
              FunctionRef<double(std::uint32_t, double)> visit) const;
    // The same for the parts whose boxes are within `limit` (m) of a box.
    void near(const Aabb& box, double limit, FunctionRef<double(std::uint32_t, double)> visit) const;

private:
    struct Node {
        Aabb box;
        std::uint32_t begin = 0, end = 0;  // of order_
        std::uint32_t right = 0;           // 0: a leaf; the left child is the next one
    };
    std::uint32_t build(std::uint32_t begin, std::uint32_t end);
    // measure(box, limit): a lower bound, infinite to leave it out.
    template <class Measure>
    void walk(double limit, const Measure& measure, FunctionRef<double(std::uint32_t, double)> visit) const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
    std::vector<Aabb> boxes_;
};

// Who asks about a compound again and again makes its parts once; without them they are made each time.
struct BodyShapes {
    std::span<const Shape> shapes;
    std::span<const Part> parts;     // of each shape, or none
    const PartTree* tree = nullptr;  // of the parts

    BodyShapes(std::span<const Shape> all, std::span<const Part> known = {}, const PartTree* byBoxes = nullptr)
        : shapes(all), parts(known), tree(byBoxes && !byBoxes->empty() ? byBoxes : nullptr) {}
    BodyShapes(const std::vector<Shape>& all) : shapes(all) {}
    BodyShapes(const Shape* first, std::size_t count) : shapes(first, count) {}
};

}  // namespace cairn
