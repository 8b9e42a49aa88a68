#pragma once
// The one formulation. A row says
//     C(x) + alpha lambda = 0,   lo <= lambda <= hi,
// and pushes its two bodies with J^T lambda. The only place where sign, unit and frame are stated:
//   C       m (linear rows) or rad (angular rows). C > 0 is open: a gap, room left before a limit.
//   lambda  N or N m: a force, not an impulse, so that any solver, any step size and the next frame can reuse it.
//           lambda > 0 drives C up.
//   J       dC/dt = a . (v_a, w_a) + b . (v_b, w_b), twists in world axes about each body's centre of mass, linear part
//           first. In a block of particles, which do not turn, the four halves a.linear, a.angular, b.linear, b.angular
//           are the gradients of up to four bodies.
//   alpha   compliance, m/N or rad/(N m); damping in N s/m or N m s/rad acts beside it.
//   lo, hi  N or N m. (-inf, inf): equality. (0, inf): C >= 0, pushing only.
// A velocity row has no C: it asks J v = velocity (m/s or rad/s) as far as its bounds allow (motors, friction).
#include "base/base.hpp"

#include <limits>

namespace cairn {

template <class S>
constexpr S infinity() {
    return std::numeric_limits<S>::infinity();
}

template <class S>
struct Row {
    Vec6<S> a = Vec6<S>::Zero();
    Vec6<S> b = Vec6<S>::Zero();
    S C = 0;
    S compliance = 0;
    S damping = 0;
    S lo = -infinity<S>();
    S hi = infinity<S>();
    S velocity = 0;
    S lambda = 0;
    bool isVelocity = false;
    bool isAngular = false;

    bool isSoft() const { return compliance > S(0) || damping > S(0); }
    // Asks C = 0, and gives way to nothing.
    bool isHardEquality() const { return !isVelocity && !isSoft() && lo < S(0) && hi > S(0); }
    // How far the row is from being obeyed, >= 0, in the unit of C; 0 for rows that may give way.
    S violation() const {
        if (isVelocity || isSoft()) {
            return S(0);
        }
        const S open = lo < S(0) ? std::max(S(0), C) : S(0);
        const S shut = hi > S(0) ? std::max(S(0), -C) : S(0);
        return std::max(open, shut);
    }
};

// What the rows of one constraint have in common: their two bodies, and how their bounds hang together.
enum class BlockKind : std::uint8_t {
    Bounds,   // each row has its own bounds
    Contact,  // row 0 pushes along the normal; |(lambda_1, lambda_2)| <= mu lambda_0, a true cone
};

template <class S>
struct RowBlock {
    int a = -1;  // bodies, indices into the island
    int b = -1;
    int c = -1;  // further particles of a block of particles; -1: none
    int d = -1;
    bool particles = false;  // its bodies do not turn: see J above
    int first = 0;           // row
    int count = 0;
    BlockKind kind = BlockKind::Bounds;
    S friction = 0;        // sliding
    S staticFriction = 0;  // sticking, >= friction
    // The first `pointRows` rows are the components of a force that acts at armA from the centre of a and at armB from
    // that of b (m, world): what a solver needs for the geometric stiffness of the block. 0: no such rows.
    int pointRows = 0;
    Vec3<S> armA = Vec3<S>::Zero();
    Vec3<S> armB = Vec3<S>::Zero();

    int body(int k) const { return k == 0 ? a : k == 1 ? b : k == 2 ? c : d; }
    int bodyCount() const { return !particles || c < 0 ? 2 : d < 0 ? 3 : 4; }
};

// The gradient of a row for body k of its block, as a twist. (Inlined by order here and below: GCC's -O2 would leave a
// call for each row.)
template <class S>
[[gnu::always_inline]] inline Vec6<S> bodyGradient(const Row<S>& row, const RowBlock<S>& block, int k) {
    if (!block.particles) {
        return k == 0 ? row.a : row.b;
    }
    const Vec6<S>& half = k < 2 ? row.a : row.b;
    Vec6<S> g = Vec6<S>::Zero();
    g.template head<3>() = half.template segment<3>(k % 2 == 0 ? 0 : 3);
    return g;
}

// J v, for twists v of all bodies of the island.
template <class S, class Twists>
[[gnu::always_inline]] inline S rowDot(const Row<S>& row, const RowBlock<S>& block, const Twists& twist) {
    if (!block.particles) {
        return row.a.dot(twist(block.a)) + row.b.dot(twist(block.b));
    }
    S sum = row.a.template head<3>().dot(twist(block.a).template head<3>()) +
            row.a.template tail<3>().dot(twist(block.b).template head<3>());
    if (block.c >= 0) {
        sum += row.b.template head<3>().dot(twist(block.c).template head<3>());
    }
    if (block.d >= 0) {
        sum += row.b.template tail<3>().dot(twist(block.d).template head<3>());
    }
    return sum;
}

// What a unit impulse of a row does: M^-1 J^T, laid out as J is, and J M^-1 J^T (1/kg or 1/(kg m2)).
template <class S>
struct RowResponse {
    Vec6<S> a;
    Vec6<S> b;
    S delassus;
};

// Adds what an impulse does to the twists v of all bodies of the island.
template <class S>
[[gnu::always_inline]] inline void respond(const RowResponse<S>& response, const RowBlock<S>& block, S impulse,
                                           std::vector<Vec6<S>>& v) {
    const auto twist = [&](int i) -> Vec6<S>& { return v[static_cast<std::size_t>(i)]; };
    if (!block.particles) {
        twist(block.a) += response.a * impulse;
        twist(block.b) += response.b * impulse;
        return;
    }
    twist(block.a).template head<3>() += response.a.template head<3>() * impulse;
    twist(block.b).template head<3>() += response.a.template tail<3>() * impulse;
    if (block.c >= 0) {
        twist(block.c).template head<3>() += response.b.template head<3>() * impulse;
    }
    if (block.d >= 0) {
        twist(block.d).template head<3>() += response.b.template tail<3>() * impulse;
    }
}

// Collects the rows of a constraint while it is linearised.
template <class S>
class RowWriter {
public:
    RowWriter(std::vector<Row<S>>& rows, RowBlock<S>& block) : rows_(rows), block_(block) {}

    // C = n . (p_b - p_a) for a direction n that a carries with it and points of the bodies. `armA` and `armB` run from
    // the centres of mass to p_b: both bodies are pushed at one place, so that angular momentum is conserved whatever
    // the gap.
    [[gnu::always_inline]] Row<S>& point(const Vec3<S>& n, const Vec3<S>& armA, const Vec3<S>& armB, S C) {
        Row<S>& row = push();
        row.a.template head<3>() = -n;
        row.a.template tail<3>() = n.cross(armA);
        row.b.template head<3>() = n;
        row.b.template tail<3>() = armB.cross(n);
        row.C = C;
        return row;
    }

    // A row that turns b against a about `axis` (world; any length): J = axis . (w_b - w_a).
    Row<S>& angular(const Vec3<S>& axis, S C) {
        Row<S>& row = push();
        row.a.template tail<3>() = -axis;
        row.b.template tail<3>() = axis;
        row.C = C;
        row.isAngular = true;
        return row;
    }

    // A row whose gradient and C are known.
    Row<S>& add(const Row<S>& row) { return push() = row; }

    // Two one-sided rows that keep `value`, whose gradient is that of `like`, within [lower, upper].
    void limits(const Row<S>& like, S value, S lower, S upper) {
        const Row<S> gradient = like;
        if (lower > -infinity<S>()) {
            Row<S>& row = push();
            row = gradient;
            row.C = value - lower;
            row.lo = S(0);
            row.hi = infinity<S>();
        }
        if (upper < infinity<S>()) {
            Row<S>& row = push();
            row = gradient;
            row.a = -row.a;
            row.b = -row.b;
            row.C = upper - value;
            row.lo = S(0);
            row.hi = infinity<S>();
        }
    }

    // A row between particles: C with its gradients, zero for particles that the block does not have.
    Row<S>& particles(S C, const Vec3<S>& a, const Vec3<S>& b, const Vec3<S>& c = Vec3<S>::Zero(),
                      const Vec3<S>& d = Vec3<S>::Zero()) {
        betweenParticles();
        Row<S>& row = push();
        row.a << a, b;
        row.b << c, d;
        row.C = C;
        return row;
    }

    // Says that all rows of the block are between particles.
    void betweenParticles() { block_.particles = true; }

    // Makes the last row a motor: J v = speed with at most `maxForce` N or N m.
    static void makeMotor(Row<S>& row, S speed, S maxForce) {
        row.isVelocity = true;
        row.velocity = speed;
        row.lo = -maxForce;
        row.hi = maxForce;
    }

    void pointForce(int pointRows, const Vec3<S>& armA, const Vec3<S>& armB) {
        block_.pointRows = pointRows;
        block_.armA = armA;
        block_.armB = armB;
    }

private:
    [[gnu::always_inline]] Row<S>& push() {
        ++block_.count;
        return rows_.emplace_back();
    }

    std::vector<Row<S>>& rows_;
    RowBlock<S>& block_;
};

// Where a joint sits on its two bodies: poses of the joint's frame in each body's frame about its centre of mass. x is
// the axis.
template <class S>
struct JointFrames {
    Pose<S> a;
    Pose<S> b;
    // At the time of adding: m, the distance of the two anchors; m3, the volume of a tetrahedron; rad, the angle of two
    // triangles.
    S rest = 0;
    bool particles = false;  // both bodies are held at their centres, and neither is turned by it
};

}  // namespace cairn
