#pragma once
// When moving bodies meet: the first time of impact over a motion that turns and travels, and the cast of a shape along
// a line. Both go forward by safe steps only (conservative advancement): no answer lies beyond a meeting, however thin
// or fast the shapes. Plain functions of immutable data, for any thread.
#include <cairn/collision/shape.hpp>

#include <optional>
#include <span>

namespace cairn {

// A body on its way: the centre moves straight, the body turns about it at an even rate.
struct Motion {
    Posed start;                         // of the body's frame, world
    Vec3d centre = Vec3d::Zero();        // m, body frame: what moves straight (the centre of mass)
    Vec3d displacement = Vec3d::Zero();  // m, world, of the centre over the whole motion
    Vec3d turn = Vec3d::Zero();          // rad, world: the rotation vector over the whole motion

    Posed at(double fraction) const;
};

struct Impact {
    double fraction = 0;            // of the motion, in [0, 1]: never later than the true one
    Vec3d point = Vec3d::Zero();    // m, world, between the nearest places at that time
    Vec3d normal = Vec3d::UnitY();  // unit, from A to B, world
    double separation = 0;          // m, along the normal at that time
    std::uint32_t shapeA = 0;
    std::uint32_t shapeB = 0;
    int triangle = -1;    // of a mesh or height field
    bool isExact = true;  // false: the search was given up early, so the true impact may be later or none
};

struct ImpactSettings {
    double gap = 1e-3;  // m, > 0: the distance at which shapes are said to meet, so that contacts find them apart
    // m, >= 0: meetings that get no deeper than this over the motion are left to the contacts, so that what slides on
    // or over a seam does not stop. Held to a quarter of the thinner shape's inner radius.
    double slack = 5e-3;
};

// The first meeting of two bodies. Shapes that touch at the start count once they are `slack` deeper than they were,
// and at that time: held where they started, they would never come free. Triangles are one-sided: those whose back the
// shape's centre sees at the start are passed, as in collide(). Nothing where they do not meet.
std::optional<Impact> timeOfImpact(std::span<const Shape> a, const Motion& motionA, std::span<const Shape> b,
                                   const Motion& motionB, const ImpactSettings& settings = {});

// Where a body without turning first touches another that stands: separation is at most 1e-5 m, and 0 along the normal
// at the answered fraction. Overlap at the start gives fraction 0. Triangles are seen from both sides.
std::optional<Impact> shapeCast(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                std::span<const Shape> standing, const Posed& pose);

// How far the body's points can be moved by turning, m: no point of it travels farther than |displacement| + |turn|
// times this. For choosing whom to sweep at all.
double turningRadius(std::span<const Shape> shapes, const Vec3d& centre);

}  // namespace cairn
