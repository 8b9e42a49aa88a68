#pragma once
// When moving bodies meet: the first time of impact over a motion that turns and travels, and the cast of a shape along
// a line. Both go forward by safe steps only (conservative advancement): no answer lies beyond a meeting, however thin
// or fast the shapes. Plain functions of immutable data, for any thread.
#include <cairn/shape_query.hpp>

#include "collision/shapes/parts.hpp"

#include <optional>
#include <span>
#include <vector>

namespace cairn {

// A body on its way: the centre moves straight, the body turns about it at an even rate.
struct Motion {
    Posed start;                         // of the body's frame, world
    Vec3d centre = Vec3d::Zero();        // m, body frame: what moves straight (the centre of mass)
    Vec3d displacement = Vec3d::Zero();  // m, world, of the centre over the whole motion
    Vec3d turn = Vec3d::Zero();          // rad, world: the rotation vector over the whole motion

    Posed at(double fraction) const;
};

struct ImpactSettings {
    double gap = 1e-3;  // m, > 0: the distance at which shapes are said to meet, so that contacts find them apart
    // m, >= 0: meetings that get no deeper than this over the motion are left to the contacts, so that what slides on
    // or over an internal edge does not stop.
    double slack = 5e-3;
    double slackShare = 0.25;  // below 1: of the thinner shape's inner radius, to which the slack is held
};

// The first meeting of two bodies. Shapes that touch at the start count once they are deeper than `slack` and a third
// of it deeper than they were, and at that time: held where they started, they would never come free. Triangles are
// one-sided: those whose back the shape's centre sees at the start are passed, as in collide(). Nothing where they do
// not meet.
std::optional<Impact> timeOfImpact(const BodyShapes& a, const Motion& motionA, const BodyShapes& b,
                                   const Motion& motionB, const ImpactSettings& settings = {});

// m: no point of B within `radius` of `middle` (m, world, at the start) is moved farther than this in the frame of A:
// what goes or turns along with A is not. Of what has no end NaN.
double distanceMoved(const Motion& a, const Motion& b, const Vec3d& middle, double radius);

// As shapeCast(), at a body that knows its parts.
std::optional<Impact> shapeCastParts(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                     const BodyShapes& standing, const Posed& pose);

// How far the body's points can be moved by turning, m: no point of it travels farther than |displacement| + |turn|
// times this. For choosing who gets continuous collision at all.
double turningRadius(std::span<const Shape> shapes, const Vec3d& centre);

}  // namespace cairn
