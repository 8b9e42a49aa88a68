#include "engine/problem/solver_body.hpp"
#include "engine/model/gyroscopics.hpp"

namespace cairn {

template <class S>
void SolverBody<S>::refreshInertia() {
    if (particle || (inertiaAt.coeffs() == pose.rotation.coeffs() && stiffening.isZero(S(0)))) {
        return;
    }
    const Mat3<S> R = pose.rotation.toRotationMatrix();
    inertiaAt = pose.rotation;
    stiffening.setZero();
    inertia = R * localInertia * R.transpose();
    inverseInertia = R * localInverseInertia * R.transpose();
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
    if (gyroscopic != GyroscopicRule::None || !stiffening.isZero()) {
        refreshInertia();
    }
    v += forced(h);
    externalImpulse = applyMass(v - vBefore);
    startTurn(h);
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
    // Of what forces changed, what a row may have changed beside it.
    constexpr S share = S(1e-6);
    const Vec6<S> change = forced(h);
    const Vec3<S> predicted = vBefore.template head<3>() + inverseMass * externalImpulse.template head<3>();
    const S unseen =
        std::max(share * change.template head<3>().norm(), S(8) * Eigen::NumTraits<S>::epsilon() * predicted.norm());
    flies = !isJointed && (v.template head<3>() - predicted).norm() <= unseen;
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
void SolverBody<S>::integrate(S h) {
    if (!fixed) {
        fly(h);
    }
    if (particle || gyroscopic == GyroscopicRule::None) {
        pose = moved(v, h);
        return;
    }
    // Forces and impulses acted at the start; from there on the world keeps the angular momentum that they left.
    const Vec3<S> momentum = ownMomentum();
    const Vec3<S> mean = v.template tail<3>();
    const Quat<S> from = pose.rotation;
    pose = moved(v, h);
    holdsInertia = false;
    refreshInertia();
    if (!carriesMomentum(gyroscopic)) {
        return;
    }
    v.template tail<3>() = inverseInertia * momentum;
    // A row that stops or turns the mean spin knows nothing of how the momentum will lie in the body at the end. After
    // a far turn that may be about a light axis in place of a heavy one: energy from nothing, without bound. Who gains
    // it so keeps the spin that the rows left, in its own axes.
    constexpr S farTurn = S(0.5);  // rad
    constexpr S gain = S(1.1);     // of kinetic energy, that a sub-step's error in time may look like
    if (!flies && h * mean.norm() > farTurn) {
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
