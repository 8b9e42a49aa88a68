#pragma once
// Geometric stiffness as mass: M <- M + h^2 D, D = sum of lambda d^2 C (theory 7.16; with lambda itself, or it would
// vanish just where it matters: theory erratum 12). A force f at the end of an arm r that turns with its body adds to
// the body's rotation, in exponential coordinates (theory 7.13),
//     K = (f . r) I - (f r^T + r f^T) / 2
// for f pulling outwards. Taken as the sums of its columns' absolute values on the diagonal, so that M stays positive
// definite (Andrews 2017). What it costs is exactness: angular momentum of the damped body is given to the constraint's
// turning force before that has turned.
#include "engine/model/gyroscopics.hpp"
#include "engine/problem/problem.hpp"

namespace cairn {

// The 3x3 block of one arm, N m: minus the change of the torque r x f per radian, on the diagonal.
template <class S>
Vec3<S> geometricStiffness(const Vec3<S>& force, const Vec3<S>& arm) {
    const Mat3<S> K =
        force.dot(arm) * Mat3<S>::Identity() - S(0.5) * (force * arm.transpose() + arm * force.transpose());
    return K.cwiseAbs().colwise().sum().transpose();
}

// Adds to the inertia of every body that joints hold by a force, from the forces of the last solve; the responses of
// the rows stay as they were (Problem::respond()). freePhase: rad^2, (h omega)^2 of a body's swing under them that is
// left as it is; what is added is only what goes beyond.
template <class S>
void addGeometricStiffness(Problem<S>& problem, S h, S freePhase = S(0)) {
    problem.forEach(problem.bodies.size(), [&](std::size_t i) {
        SolverBody<S>& body = problem.bodies[i];
        if (!body.fixed && !body.stiffening.isZero()) {
            body.refreshInertia();
        }
    });
    problem.forJointBlocks([&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        Vec3<S> force = Vec3<S>::Zero();  // on b
        for (int r = 0; r < block.pointRows; ++r) {
            const Row<S>& row = problem.rows[static_cast<std::size_t>(block.first + r)];
            force += row.lambda * row.b.template head<3>();
        }
        for (const bool first : {true, false}) {
            SolverBody<S>& body = problem.bodies[static_cast<std::size_t>(first ? block.a : block.b)];
            if (block.pointRows > 0 && !body.fixed && !body.particle) {
                const Vec3<S> stiff = h * h * geometricStiffness<S>(force, first ? block.armA : block.armB);
                body.stiffening += stiff;
                body.inertia.diagonal() += stiff;
            }
        }
    });
    problem.forEach(problem.bodies.size(), [&](std::size_t i) {
        SolverBody<S>& body = problem.bodies[i];
        if (body.stiffening.isZero()) {
            return;
        }
        if (freePhase > S(0)) {
            const Vec3<S> inertia = body.inertia.diagonal() - body.stiffening;
            body.stiffening = (body.stiffening - freePhase * inertia).cwiseMax(S(0));
            body.inertia.diagonal() = inertia + body.stiffening;
        }
        body.inverseInertia = inverseOf(body.inertia);
    });
}

}  // namespace cairn
