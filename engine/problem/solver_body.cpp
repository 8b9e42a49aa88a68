#include "engine/problem/solver_body.hpp"
#include "engine/model/gyroscopics.hpp"

namespace cairn {
namespace {

// rad, of the mean spin in a sub-step: beyond, the spin at its end is looked at.
template <class S>
constexpr S farTurn = S(0.5);

// R a R^T of a symmetric matrix.
template <class S>
void turnWith(const Mat3<S>& R, const Mat3<S>& a, Mat3<S>& out) {
    const Mat3<S> half = R * a;
    for (int r = 0; r < 3; ++r) {
        for (int c = r; c < 3; ++c) {
            out(r, c) = half(r, 0) * R(c, 0) + half(r, 1) * R(c, 1) + half(r, 2) * R(c, 2);
            out(c, r) = out(r, c);
        }
    }
}

}  // namespace

template <class S>
void SolverBody<S>::refreshInertia() {
    if (hasInertia()) {
        return;
    }
    inertiaAt = pose.rotation;
    stiffening.setZero();
    if (isBallLike(localInertia)) {
        inertia = localInertia;
        inverseInertia = localInverseInertia;
        return;
    }
    const Mat3<S> R = pose.rotation.toRotationMatrix();
    turnWith(R, localInertia, inertia);
    turnWith(R, localInverseInertia, inverseInertia);
}

template <class S>
Pose<S> SolverBody<S>::moved(const Vec6<S>& twist, S h) const {
    Pose<S> to = pose;
    to.position += h * twist.template head<3>() + offset.template head<3>();
    if (!particle) {
        to.rotation = rotated<S>(pose.rotation, h * twist.template tail<3>() + offset.template tail<3>());
    }
    return to;
}

template <class S>
void SolverBody<S>::predict(S h) {
    vBefore = v;
    externalImpulse.setZero();
    gyroMomentum.setZero();
    offset.setZero();
    isJointed = false;
    flies = false;
    if (fixed) {
        return;
    }
    if (gyroscopic != GyroscopicRule::None || isStiffened()) {
        refreshInertia();
    }
    v += forced(h);
    externalImpulse = applyMass(v - vBefore);
}

template <class S>
Vec6<S> SolverBody<S>::forced(S h) const {
    if (fixed) {
        return Vec6<S>::Zero();
    }
    Vec6<S> change = h * applyInverseMass(force);
    const auto damp = [h](S decay, const auto& before, auto&& by) {
        if (decay > S(0)) {
            by = std::exp(-decay * h) * (before + by) - before;
        }
    };
    damp(linearDecay, vBefore.template head<3>(), change.template head<3>());
    damp(angularDecay, vBefore.template tail<3>(), change.template tail<3>());
    return change;
}

template <class S>
Vec6<S> SolverBody<S>::expectedOffset(S h) const {
    Vec6<S> expected = offset;
    if (!isJointed && !offset.isZero(S(0))) {
        expected.template head<3>() -= S(0.5) * h * forced(h).template head<3>();
    }
    return expected;
}

template <class S>
bool SolverBody<S>::refreshesInLanes() const {
    return !hasInertia() && !isStiffened() && !isBallLike(localInertia);
}

template <class S>
bool SolverBody<S>::startsInLanes(S h) const {
    return gyroscopic == GyroscopicRule::Midpoint && !gyroscopicInertia &&
           h * v.template tail<3>().norm() <= turnInOne<S>;
}

template <class S>
bool SolverBody<S>::turnsInLanes(S h) const {
    const Vec3<S> w = v.template tail<3>();
    return carriesMomentum(gyroscopic) && !gyroscopicInertia && h * w.norm() <= farTurn<S> &&
           (h * w + offset.template tail<3>()).squaredNorm() < S(4) * seriesSquare<S> && !isStiffened();
}

template <class S>
void SolverBody<S>::startTurn(S h) {
    if (gyroscopic == GyroscopicRule::None) {
        return;
    }
    const Mat3<S> R = pose.rotation.toRotationMatrix();
    const Vec3<S> w = v.template tail<3>();
    const Vec3<S> local = R.transpose() * w;
    const Vec3<S> mean = R * freeSpin(gyroscopic, localInertia, local, h).mean;
    gyroMomentum = inertia * w;
    if (gyroscopicInertia) {
        inverseInertia = R * spinResponse(gyroscopic, localInertia, local, h) * R.transpose();
        inertia = inverseInertia.inverse();
        holdsInertia = true;
        inertiaAt.coeffs().setZero();
    }
    gyroMomentum -= inertia * mean;
    v.template tail<3>() = mean;
}

template <class S>
void SolverBody<S>::undoTurn() {
    if (gyroscopic == GyroscopicRule::None) {
        return;
    }
    const Vec3<S> momentum = ownMomentum();
    gyroMomentum.setZero();
    holdsInertia = false;
    refreshInertia();
    v.template tail<3>() = inverseInertia * momentum;
}

template <class S>
void SolverBody<S>::fly(S h) {
    flies = false;
    if (isJointed) {
        return;
    }
    // Of what forces changed, what a row may have changed beside it.
    constexpr S share = S(1e-6);
    const Vec6<S> change = forced(h);
    const Vec3<S> predicted = vBefore.template head<3>() + inverseMass * externalImpulse.template head<3>();
    const S unseen =
        std::max(share * change.template head<3>().norm(), S(8) * Eigen::NumTraits<S>::epsilon() * predicted.norm());
    flies = (v.template head<3>() - predicted).norm() <= unseen;
    if (!flies) {
        return;
    }
    offset.template head<3>() -= S(0.5) * h * change.template head<3>();
    if (gyroscopic == GyroscopicRule::None) {
        offset.template tail<3>() -= S(0.5) * h * change.template tail<3>();
    } else if (carriesMomentum(gyroscopic)) {
        const Mat3<S> R = pose.rotation.toRotationMatrix();
        const Vec3<S> start = localInverseInertia * (R.transpose() * ownMomentum());
        if (h * start.norm() > turnInOne<S>) {
            const FreeSpin<S> spin = freeSpin(gyroscopic, localInertia, start, h);
            offset.template tail<3>() += R * (spin.turn - h * spin.mean);
        }
    }
}

template <class S>
void SolverBody<S>::travel(S h) {
    if (!fixed) {
        fly(h);
    }
    pose.position += h * v.template head<3>() + offset.template head<3>();
}

template <class S>
void SolverBody<S>::turn(S h) {
    if (particle) {
        return;
    }
    const Vec3<S> mean = v.template tail<3>();
    const Quat<S> from = pose.rotation;
    pose.rotation = rotated<S>(from, h * mean + offset.template tail<3>());
    if (gyroscopic == GyroscopicRule::None) {
        return;
    }
    // Forces and impulses acted at the start; from there on the world keeps the angular momentum that they left.
    const Vec3<S> momentum = ownMomentum();
    holdsInertia = false;
    refreshInertia();
    if (!carriesMomentum(gyroscopic)) {
        return;
    }
    v.template tail<3>() = inverseInertia * momentum;
    // A row that stops or turns the mean spin knows nothing of how the momentum will lie in the body at the end. After
    // a far turn that may be about a light axis in place of a heavy one: energy from nothing, without bound. Who gains
    // it so keeps the spin that the rows left, in its own axes.
    constexpr S gain = S(1.1);  // of kinetic energy, that a sub-step's error in time may look like
    if (!flies && h * mean.norm() > farTurn<S>) {
        const Vec3<S> inBody = from.conjugate() * mean;
        const Vec3<S> left = from.conjugate() * momentum;
        const S energy = v.template tail<3>().dot(momentum);
        if (energy > gain * left.dot(localInverseInertia * left) && energy > inBody.dot(localInertia * inBody)) {
            v.template tail<3>() = pose.rotation * inBody;
        }
    }
}

template struct SolverBody<float>;
template struct SolverBody<double>;

}  // namespace cairn
