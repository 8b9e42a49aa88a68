#pragma once
// The shapes of a body, each with what tells it from the others: of compounds, of which a question concerns few.
#include <cairn/shapes.hpp>

#include "collision/shapes/turn.hpp"

#include <span>
#include <vector>

namespace cairn {

struct Frame {
    Mat3d rotation = Mat3d::Identity();
    Vec3d position = Vec3d::Zero();
    bool isIdentity = true;  // as most shapes stand in their bodies: frames need not be multiplied by it

    Vec3d operator*(const Vec3d& p) const { return turned(rotation, p) + position; }
    Frame operator*(const Frame& o) const {
        if (isIdentity || o.isIdentity) {
            return isIdentity ? o : *this;
        }
        return {rotation * o.rotation, turned(rotation, o.position) + position, false};
    }
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

// Who asks about a compound again and again makes its parts once; without them they are made each time.
struct BodyShapes {
    std::span<const Shape> shapes;
    std::span<const Part> parts;  // of each shape, or none

    BodyShapes(std::span<const Shape> all, std::span<const Part> known = {}) : shapes(all), parts(known) {}
    BodyShapes(const std::vector<Shape>& all) : shapes(all) {}
    BodyShapes(const Shape* first, std::size_t count) : shapes(first, count) {}
};

}  // namespace cairn
