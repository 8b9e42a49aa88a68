#pragma once
// Row groups that several joints share. Poses are of the bodies' centres of mass, world frame.
#include <cairn/engine/defs.hpp>
#include <cairn/engine/rows.hpp>

namespace cairn {

// How a joint gives way. Both zero: rigid. Give either compliance and damping, or frequency and damping ratio.
struct Softness {
    double compliance = 0;    // m/N or rad/(N m), inverse stiffness
    double damping = 0;       // N s/m or N m s/rad
    double frequency = 0;     // Hz, of the two bodies' effective mass on each row; > 0 overrides compliance and damping
    double dampingRatio = 1;  // of critical, used with frequency
};

// Three rows that bring two points together: C = p_b - p_a in the axes of a's joint frame (seed 5.1, vector form). Axes
// that turn with a make C blind to a common rotation, so that angular momentum is conserved (seed 5.2).
template <class S>
void pointRows(const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    const Vec3<S> pointA = a * frames.a.position;
    const Vec3<S> armB = b.rotation * frames.b.position;
    const Vec3<S> pointB = b.position + armB;
    const Vec3<S> armA = pointB - a.position;
    const Mat3<S> axes = (a.rotation * frames.a.rotation).toRotationMatrix();
    const Vec3<S> gap = pointB - pointA;
    for (int k = 0; k < 3; ++k) {
        const Vec3<S> n = axes.col(k);
        rows.point(n, armA, armB, n.dot(gap));
    }
    rows.pointForce(3, armA, armB);
}

// Three rows that keep b's joint frame turned as a's: C = log(R_b R_a^T) in the axes of a's frame. The gradient is
// J_L^-1(C) (w_b - w_a) (seed 2.1.3).
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
