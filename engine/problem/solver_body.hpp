#pragma once
// A body as solvers see it: a copy, at its centre of mass.
#include <cairn/defs.hpp>

#include "base/base.hpp"

namespace cairn {

template <class S>
struct SolverBody {
    std::uint32_t index = 0;                           // in the world's table
    bool fixed = false;                                // static or kinematic: moves as its velocity says, takes no push
    GyroscopicRule gyroscopic = GyroscopicRule::None;  // None also where it has no effect
    bool particle = false;                             // has no rotation and no inertia
    Pose<S> pose;                                      // of the centre of mass
    Vec6<S> v = Vec6<S>::Zero();                       // twist, world axes: m/s, rad/s
    S mass = 0;
    S inverseMass = 0;                       // 0: fixed
    Mat3<S> localInertia = Mat3<S>::Zero();  // body axes
    Mat3<S> localInverseInertia = Mat3<S>::Zero();
    Mat3<S> inertia = Mat3<S>::Zero();  // world axes at the present pose
    Mat3<S> inverseInertia = Mat3<S>::Zero();
    Quat<S> inertiaAt{0, 0, 0, 0};    // the rotation at which those two were taken; 0: none
    Vec6<S> force = Vec6<S>::Zero();  // gravity and what the game asked for, N and N m
    S linearDecay = 0;                // 1/s
    S angularDecay = 0;
    Vec3<S> acceleration = Vec3<S>::Zero();     // m/s2, mean over the last step
    Vec3<S> spinChange = Vec3<S>::Zero();       // rad/s, Body::spinChange()
    Vec3<S> stiffening = Vec3<S>::Zero();       // kg m2, of the diagonal of `inertia`: geometric stiffness, no mass
    Vec6<S> vBefore = Vec6<S>::Zero();          // twist at the start of the sub-step
    Vec6<S> externalImpulse = Vec6<S>::Zero();  // N s, N m s: what forces, damping and impacts gave it in this sub-step
    S momentumResidual = -1;  // sqrt(J), worst of the step's sub-steps: momentum that neither they nor its rows
                              // explain; -1: not looked at in this step
    double tolerance = 0;     // m, BodyDef::tolerance
    // Where the gyroscopic rule carries momentum: N m s, by which inertia times w, the mean spin of the sub-step, falls
    // short of the angular momentum after its forces and impulses.
    Vec3<S> gyroMomentum = Vec3<S>::Zero();
    bool gyroscopicInertia = false;    // as the solver was asked for, for this body
    bool holdsInertia = false;         // inertia is that of the sub-step's equation of motion until it has moved
    bool isJointed = false;            // a joint or lock holds it
    bool flies = false;                // no row held it in this sub-step
    Vec6<S> offset = Vec6<S>::Zero();  // m and rad, what flight and impacts within the sub-step add to h v

    // Takes the inertia at the present pose; nothing to do where it was taken at that.
    void refreshInertia();
    bool hasInertia() const {
        return particle || (inertiaAt.x() == pose.rotation.x() && inertiaAt.y() == pose.rotation.y() &&
                            inertiaAt.z() == pose.rotation.z() && inertiaAt.w() == pose.rotation.w() && !isStiffened());
    }
    bool isStiffened() const { return stiffening.x() != S(0) || stiffening.y() != S(0) || stiffening.z() != S(0); }
    // v <- the twist that forces (h force / M) and damping at the start of a sub-step of h leave.
    void predict(S h);
    // By how much forces and damping change the twist in h, from vBefore.
    Vec6<S> forced(S h) const;
    // What its motion will have beside h v: the offset, and what is hit is expected to fly, unless a joint holds it.
    Vec6<S> expectedOffset(S h) const;
    // The mean of the free spin in place of the spin that forces and impulses at the start of the sub-step leave, and
    // back; nothing where no gyroscopic rule holds.
    void startTurn(S h);
    void undoTurn();
    // Moves the place by h v or, where no row held the body, along the parabola of its forces, and finds how such a
    // body turns; turn() follows.
    void travel(S h);
    // Turns by h v and the offset; then v is the twist at the end of the sub-step.
    void turn(S h);
    // Whether refreshInertia(), startTurn() and turn() are those of turn_kernels.hpp: there is something to refresh and
    // nothing that stiffens it; it turns by the midpoint rule, and little.
    bool refreshesInLanes() const;
    bool startsInLanes(S h) const;
    bool turnsInLanes(S h) const;
    // Where the body is after h seconds at twist v, starting here (offset included).
    Pose<S> moved(const Vec6<S>& twist, S h) const;
    // M^-1 times a generalised impulse.
    [[gnu::always_inline]] Vec6<S> applyInverseMass(const Vec6<S>& impulse) const {
        Vec6<S> dv;
        dv.template head<3>() = inverseMass * impulse.template head<3>();
        dv.template tail<3>().noalias() = inverseInertia * impulse.template tail<3>();
        return dv;
    }
    [[gnu::always_inline]] Vec6<S> applyMass(const Vec6<S>& twist) const {
        Vec6<S> p;
        p.template head<3>() = mass * twist.template head<3>();
        p.template tail<3>().noalias() = inertia * twist.template tail<3>();
        return p;
    }

private:
    // Where no row held the body, its place is to lie on the parabola of its forces, and its turn to be that of a free
    // body.
    void fly(S h);
    // N m s, angular, of the body and not of what stiffens it.
    Vec3<S> ownMomentum() const {
        const Vec3<S> w = v.template tail<3>();
        return inertia * w - stiffening.cwiseProduct(w) + gyroMomentum;
    }
};

}  // namespace cairn
