#pragma once
// A row of a joint knows the end of a sub-step along the tangent, C + h J v. Bodies turn on arcs, and off the tangent
// the two points that a pin holds part by
//     q = (exp([h w_b]) - 1 - [h w_b]) r_b - (exp([h w_a]) - 1 - [h w_a]) r_a      m; r: arms, world, at the start.
// Rows that ask for J v + bias + q / h = 0 close pins where the bodies end (SHAKE: Ryckaert, Ciccotti and Berendsen
// 1977). The speed q / h is not push-out: the constraint's own force gives it, and it stays. With it the mean speeds of
// two sub-steps lie as mirror images about the pose between them, and what swings keeps its energy; without it each
// sub-step loses the part of the last speed that no longer lies along the tangent, (h w)^2 of its energy.
#include "engine/solve/velocity/row_sweeps.hpp"

#include <array>

namespace cairn {

template <class S>
class PinCurvature {
public:
    // A sub-step begins; nothing is bent yet.
    void begin(const Problem<S>& problem);
    // Takes q at the twists of `rows` into their bias, in place of the last one. Gives by how much it changed, m, at
    // the pin where it did most. Where it changes by ever more, pins do not close so: they are left on the tangent for
    // the rest of the sub-step, which isTooLong().
    S renew(const Problem<S>& problem, RowSweeps<S>& rows, S h);
    bool isTooLong() const { return isTooLong_; }
    // The rows have another bias: adds q / h to it, as far as the sub-step sees the swing of the two bodies under the
    // forces of their pins. Where geometric stiffness holds it, a speed that turns with it is one that grows.
    void keep(const Problem<S>& problem, RowSweeps<S>& rows) const;

private:
    // rad, that a body may turn in a sub-step: what turns farther is left on the tangent, since the rows that would
    // close it point elsewhere at the end.
    static constexpr S mostTurn = S(1.5);
    static constexpr S mostGrowth = S(0.001);  // m, of the change

    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    struct Pin {
        int a, b;  // bodies
        int row;   // the first of three
        Vec3<S> armA, armB;
        std::array<Vec3<S>, 3> axes;      // of the rows
        Vec3<S> speed = Vec3<S>::Zero();  // q / h, m/s, as the rows have it
    };

    // Of a body that turns by theta (rad).
    struct Turn {
        Vec3<S> theta;
        S versine, lag;  // TurnSeries; lag times theta^2
        bool isFar;

        Vec3<S> offTangent(const Vec3<S>& arm) const {
            const Vec3<S> along = theta.cross(arm);
            return versine * theta.cross(along) - lag * along;
        }
    };

    static void bend(Pin& pin, RowSweeps<S>& rows, const Vec3<S>& speed);

    std::vector<Pin> pins_;
    std::vector<Turn> turns_;  // by body
    std::vector<S> changes_;   // m, by pin
    S change_ = 0;             // m, the last one
    bool isTooLong_ = false;
};

}  // namespace cairn
