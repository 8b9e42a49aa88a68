#pragma once
// What several joints share: rules of fields, softness, row groups. Poses are of the bodies' centres of mass, world
// frame.
//
// A joint is its Def (include/cairn/joints/) and a header here: describe(archive, def) for its fields, validate(def)
// where fields must agree with each other, and linearize(def, frames, poseA, poseB, rows). Where it sits is told by the
// members its Def has: `anchor`, or `anchorA` and `anchorB`, is the origin of its frames on both bodies, and `axis`, if
// any, their x axis.
#include <cairn/joints/softness.hpp>

#include "engine/constraints/rows.hpp"
#include "engine/model/fields.hpp"

#include <numbers>

namespace cairn {

template <class A>
void describe(A& a, Softness& s) {
    a.field("compliance", s.compliance, {"m/N or rad/(N m), inverse stiffness; 0: rigid", 0});
    a.field("damping", s.damping, {"N s/m or N m s/rad", 0});
    a.field("frequency", s.frequency, {"Hz; above 0 it overrides compliance and damping", 0});
    a.field("dampingRatio", s.dampingRatio, {"of critical, used with frequency", 0});
}

inline std::optional<Complaint> validate(const Softness& s) {
    if (s.damping > 0 && s.frequency == 0 && s.compliance == 0) {
        return Complaint{"damping", numberText(s.damping),
                         "damping needs a compliance > 0 beside it (a rigid row has nothing to damp)"};
    }
    return std::nullopt;
}

inline constexpr FieldRule anchorRule = {.text = "m, world at time 0", .required = true};
inline constexpr FieldRule axisRule = {
    .text = "direction, world at time 0, of any length but 0", .required = true, .direction = true};
inline constexpr FieldRule speedRule = {"m/s, of b against a"};
inline constexpr FieldRule turnRateRule = {"rad/s, of b against a"};

inline std::optional<Complaint> inOrder(const char* lowerName, double lower, const char* upperName, double upper) {
    if (lower > upper) {
        return Complaint{lowerName, numberText(lower),
                         std::string("give at most ") + upperName + ", which is " + numberText(upper)};
    }
    return std::nullopt;
}

inline std::optional<Complaint> anglesInOrder(const char* lowerName, double lower, const char* upperName,
                                              double upper) {
    constexpr double pi = std::numbers::pi;
    if ((std::isfinite(lower) && lower <= -pi) || (std::isfinite(upper) && upper >= pi)) {
        return Complaint{lowerName, numberText(lower) + " .. " + numberText(upper),
                         "angles are known within (-pi, pi) only: narrow the limits or leave them out"};
    }
    return inOrder(lowerName, lower, upperName, upper);
}

// Where two points that a joint brings together are: arms from the centres of mass to p_b, and p_b - p_a.
template <class S>
struct PointEnds {
    Vec3<S> armA, armB, gap;

    PointEnds(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b) {
        armB = turned(b.rotation, frames.b.position);
        const Vec3<S> pointB = b.position + armB;
        armA = pointB - a.position;
        gap = pointB - a * frames.a.position;
    }
};

// Three rows that bring two points together: C = p_b - p_a in the axes of a's joint frame (theory 4.4). Axes
// that turn with a make C blind to a common rotation, so that angular momentum is conserved (theory 3.9).
template <class S>
void pointRows(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    const PointEnds<S> ends(frames, a, b);
    const Mat3<S> axes = (a.rotation * frames.a.rotation).toRotationMatrix();
    for (int k = 0; k < 3; ++k) {
        const Vec3<S> n = axes.col(k);
        rows.point(n, ends.armA, ends.armB, n.dot(ends.gap));
    }
    rows.pointForce(3, ends.armA, ends.armB);
}
// C of those alone.
template <class S>
Vec3<S> pointErrors(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b) {
    return turned((a.rotation * frames.a.rotation).conjugate(), PointEnds<S>(frames, a, b).gap);
}
// The same rows along the axes of the world, with C, its direction (b's) and arms, and no gradient of a turn.
template <class S>
void pointRowsInWorld(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    const PointEnds<S> ends(frames, a, b);
    for (int k = 0; k < 3; ++k) {
        Row<S>& row = rows.add({});
        row.b(k) = S(1);
        row.C = ends.gap(k);
    }
    rows.pointForce(3, ends.armA, ends.armB);
}

inline constexpr FieldRule jointFrictionRule = {"N m, the most that resists turning", 0};

// Friction against turning: a velocity row about each axis of a's joint frame.
template <class S>
void frictionRows(double friction, const JointFrames<S>& frames, const Pose<S>& a, RowWriter<S>& rows) {
    if (friction > 0 && !frames.particles) {
        const Mat3<S> axes = (a.rotation * frames.a.rotation).toRotationMatrix();
        for (int k = 0; k < 3; ++k) {
            rows.makeMotor(rows.angular(axes.col(k), S(0)), S(0), static_cast<S>(friction));
        }
    }
}

// Three rows that keep b's joint frame turned as a's: C = log(R_b R_a^T) in the axes of a's frame. The gradient is
// J_L^-1(C) (w_b - w_a) (theory 4.9).
template <class S>
void orientationRows(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    const Quat<S> frameA = a.rotation * frames.a.rotation;
    const Quat<S> frameB = b.rotation * frames.b.rotation;
    const Vec3<S> error = logQuat<S>(frameB * frameA.conjugate());
    const Mat3<S> gradient = leftJacobianInverse(error).transpose();
    const Mat3<S> axes = frameA.toRotationMatrix();
    for (int k = 0; k < 3; ++k) {
        const Vec3<S> axis = axes.col(k);
        rows.angular(gradient * axis, axis.dot(error));
    }
}

}  // namespace cairn
