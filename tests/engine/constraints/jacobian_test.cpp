// Every constraint's rows against central differences of its C, and against the conservation of momentum.
#include "base/function_ref.hpp"
#include "engine/constraints/axis_lock.hpp"
#include "engine/constraints/contact.hpp"
#include "engine/constraints/joint.hpp"
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

template <class S>
class Jacobians : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Jacobians, Scalars);

// Of a J whose entries are about 1 (arms of a metre).
template <class S>
double tolerance() {
    return std::is_same_v<S, float> ? 1e-5 : 2e-8;
}

Posed moved(const Posed& pose, const Vec3d& translation, const Vec3d& turn) {
    return {pose.position + translation, rotated<double>(pose.rotation, turn)};
}

// Central differences of C(a, b) with respect to translation k (0..2) or rotation k - 3 of one of the two poses.
std::vector<double> difference(FunctionRef<std::vector<double>(const Posed&, const Posed&)> errors, const Posed& a,
                               const Posed& b, bool ofB, int k) {
    const double step = 1e-6;
    const auto at = [&](double h) {
        const Vec3d translation = k < 3 ? Vec3d(h * Vec3d::Unit(k)) : Vec3d(Vec3d::Zero());
        const Vec3d turn = k < 3 ? Vec3d(Vec3d::Zero()) : Vec3d(h * Vec3d::Unit(k - 3));
        return ofB ? errors(a, moved(b, translation, turn)) : errors(moved(a, translation, turn), b);
    };
    const std::vector<double> ahead = at(step);
    const std::vector<double> behind = at(-step);
    std::vector<double> slope(ahead.size());
    for (std::size_t i = 0; i < slope.size(); ++i) {
        slope[i] = (ahead[i] - behind[i]) / (2 * step);
    }
    return slope;
}

template <class S>
using Linearize = FunctionRef<void(const Pose<S>&, const Pose<S>&, std::vector<Row<S>>&)>;

// `exactly` is the same in double, for the differences.
template <class S>
void compareWithDifferences(Linearize<S> linearize, Linearize<double> exactly, const Posed& poseA, const Posed& poseB,
                            double scale) {
    const Pose<S> a = poseA.cast<S>();
    const Pose<S> b = poseB.cast<S>();
    std::vector<Row<S>> rows;
    linearize(a, b, rows);
    const auto errors = [&](const Posed& x, const Posed& y) {
        std::vector<Row<double>> at;
        exactly(x, y, at);
        std::vector<double> C;
        for (const Row<double>& row : at) {
            C.push_back(row.C);
        }
        return C;
    };
    const std::vector<double> C = errors(a.template cast<double>(), b.template cast<double>());
    ASSERT_EQ(C.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_NEAR(static_cast<double>(rows[i].C), C[i], scale * tolerance<S>()) << "C of row " << i;
    }
    for (int k = 0; k < 6; ++k) {
        const auto slopeA = difference(errors, a.template cast<double>(), b.template cast<double>(), false, k);
        const auto slopeB = difference(errors, a.template cast<double>(), b.template cast<double>(), true, k);
        for (std::size_t i = 0; i < rows.size(); ++i) {
            if (!rows[i].isVelocity) {
                EXPECT_NEAR(static_cast<double>(rows[i].a(k)), slopeA[i], scale * tolerance<S>())
                    << "a, row " << i << ", component " << k;
                EXPECT_NEAR(static_cast<double>(rows[i].b(k)), slopeB[i], scale * tolerance<S>())
                    << "b, row " << i << ", component " << k;
            }
        }
    }
}

// What the row gives to a it takes from b: no net force, and no net torque about any point.
template <class S>
void expectInternal(const std::vector<Row<S>>& rows, const Posed& a, const Posed& b, double scale) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Vec6<double> onA = rows[i].a.template cast<double>();
        const Vec6<double> onB = rows[i].b.template cast<double>();
        EXPECT_LE((onA + onB).head<3>().norm(), tolerance<S>()) << "force of row " << i;
        const Vec3d torque = onA.tail<3>() + onB.tail<3>() + a.position.cross(Vec3d(onA.head<3>())) +
                             b.position.cross(Vec3d(onB.head<3>()));
        EXPECT_LE(torque.norm(), scale * tolerance<S>()) << "torque of row " << i;
    }
}

// A joint definition with everything on that the type offers: limits, motors.
template <class Def>
Def fullDef(TestRandom& random, const Vec3d& middle) {
    Def def;
    if constexpr (requires { def.anchor; }) {
        def.anchor = middle + random.vector(0.5);
    }
    if constexpr (requires { def.anchorA; }) {
        def.anchorA = middle + random.vector(0.5);
        def.anchorB = def.anchorA + random.direction();
    }
    if constexpr (requires { def.axis; }) {
        def.axis = random.direction();
    }
    if constexpr (requires { def.lower; }) {
        if (random.uniform(0, 1) < 0.7) {
            def.lower = random.uniform(0.1, 0.3);
            def.upper = random.uniform(0.4, 1);
        }
    }
    if constexpr (requires { def.motorTorque; }) {
        def.motorTorque = 1;
    }
    if constexpr (requires { def.motorForce; }) {
        def.motorForce = 1;
    }
    return def;
}

template <class S>
Vec3d position(const BodyTable<S>& bodies, BodyId id) {
    return bodies[id.index].pose.position.template cast<double>();
}

template <class S>
BodyId addLooseBody(BodyTable<S>& bodies, const Posed& pose) {
    auto kind = std::make_shared<BodyKind<S>>();
    kind->mass = 1;
    kind->inertia.setIdentity();
    Body<S> body;
    body.kind = kind;
    body.pose = pose.cast<S>();
    return bodies.add(body);
}

template <class S>
BodyId addLooseParticle(BodyTable<S>& bodies, const Vec3d& position) {
    auto kind = std::make_shared<BodyKind<S>>();
    kind->def.particle = true;
    kind->mass = 1;
    Body<S> body;
    body.kind = kind;
    body.pose.position = position.cast<S>();
    return bodies.add(body);
}

// A joint between particles: rows against differences in every coordinate, no net force, no net torque.
template <class S>
void expectParticleRows(const Joint<S>& joint, const std::array<Vec3d, 4>& moved) {
    Joint<double> exact;
    exact.def = joint.def;
    exact.c = joint.c;
    exact.d = joint.d;
    exact.frames.rest = static_cast<double>(joint.frames.rest);
    exact.frames.particles = joint.frames.particles;
    const auto linearize = [&]<class T>(const Joint<T>& of, const std::array<Vec3d, 4>& x, RowBlock<T>& block) {
        std::array<Pose<T>, 4> poses;
        std::vector<Row<T>> rows;
        for (std::size_t k = 0; k < 4; ++k) {
            poses[k].position = x[k].cast<T>();
        }
        const bool four = of.bodyCount() == 4;
        block.c = four ? 2 : -1;
        block.d = four ? 3 : -1;
        of.linearize({&poses[0], &poses[1], four ? &poses[2] : nullptr, four ? &poses[3] : nullptr}, rows, block);
        EXPECT_TRUE(block.particles);
        return rows;
    };
    RowBlock<S> block;
    const std::vector<Row<S>> rows = linearize(joint, moved, block);
    ASSERT_FALSE(rows.empty());
    const double tol = 20 * tolerance<S>();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        Vec3d force = Vec3d::Zero();
        Vec3d torque = Vec3d::Zero();
        for (int k = 0; k < block.bodyCount(); ++k) {
            const Vec3d g = bodyGradient(rows[i], block, k).template head<3>().template cast<double>();
            force += g;
            torque += moved[static_cast<std::size_t>(k)].cross(g);
            for (int j = 0; j < 3; ++j) {
                const double step = 1e-6;
                const auto at = [&](double h) {
                    std::array<Vec3d, 4> x = moved;
                    x[static_cast<std::size_t>(k)](j) += h;
                    RowBlock<double> any;
                    return linearize(exact, x, any)[i].C;
                };
                EXPECT_NEAR(g(j), (at(step) - at(-step)) / (2 * step), tol) << "row " << i << ", particle " << k;
            }
        }
        RowBlock<double> any;
        EXPECT_NEAR(static_cast<double>(rows[i].C), linearize(exact, moved, any)[i].C, tol);
        EXPECT_LE(force.norm(), tol);
        EXPECT_LE(torque.norm(), tol);
    }
}

template <class S, class Def>
void checkParticleJoint(double away) {
    SCOPED_TRACE(std::string(Def::typeName) + ", away by " + std::to_string(away));
    TestRandom random(17);
    for (int trial = 0; trial < 40; ++trial) {
        BodyTable<S> bodies;
        // About a regular tetrahedron; the triangles of a bend keep area and stay away from its cut at pi.
        const std::array<Vec3d, 4> corner = {Vec3d(-0.5, 0, 0), Vec3d(0.5, 0, 0), Vec3d(0, 0.9, 0.1),
                                             Vec3d(0, -0.4, 0.8)};
        const Posed place{random.vector(2), random.rotation()};
        std::array<BodyId, 4> ids;
        std::array<Vec3d, 4> moved;
        for (std::size_t k = 0; k < 4; ++k) {
            const Vec3d x = place * (corner[k] + random.vector(0.1));
            ids[k] = addLooseParticle(bodies, x);
            moved[k] = x + 0.2 * away * random.vector(1);
        }
        Def def;
        def.a = ids[0];
        def.b = ids[1];
        if constexpr (requires { def.c; }) {
            def.c = ids[2];
            def.d = ids[3];
        }
        if constexpr (requires { def.anchorA; }) {
            def.anchorA = position(bodies, ids[0]);
            def.anchorB = position(bodies, ids[1]);
            if (trial % 2 == 1) {
                def.lower = 0.5;
                def.upper = 1.5;
            }
        }
        const Joint<S> joint = makeJoint(JointDef(def), bodies);
        expectParticleRows(joint, moved);
    }
}

template <class S>
void expectJointRows(const Joint<S>& joint, const Posed& a, const Posed& b) {
    Joint<double> exact;
    exact.def = joint.def;
    exact.frames = {joint.frames.a.template cast<double>(), joint.frames.b.template cast<double>(),
                    static_cast<double>(joint.frames.rest)};
    const auto linearize = [&]<class T>(const Pose<T>& x, const Pose<T>& y, std::vector<Row<T>>& rows) {
        RowBlock<T> block;
        if constexpr (std::is_same_v<T, S>) {
            joint.linearize(x, y, rows, block);
        } else {
            exact.linearize(x, y, rows, block);
        }
        EXPECT_EQ(static_cast<std::size_t>(block.count), rows.size());
    };
    compareWithDifferences<S>(linearize, linearize, a, b, 10);
    std::vector<Row<S>> rows;
    linearize(a.cast<S>(), b.cast<S>(), rows);
    expectInternal(rows, a, b, 10);
}

template <class S, class Def>
void checkJoint(double away) {
    if constexpr (ParticleJoint<Def>) {
        return checkParticleJoint<S, Def>(away);
    }
    SCOPED_TRACE(std::string(Def::typeName) + ", away by " + std::to_string(away));
    TestRandom random(17);
    for (int trial = 0; trial < 40; ++trial) {
        BodyTable<S> bodies;
        const Posed a{random.vector(2), random.rotation()};
        const Posed b{a.position + random.vector(1), random.rotation()};
        Def def = fullDef<Def>(random, 0.5 * (a.position + b.position));
        def.a = addLooseBody(bodies, a);
        def.b = addLooseBody(bodies, b);
        const Joint<S> joint = makeJoint(JointDef(def), bodies);
        // The relative rotation stays under 2 rad, far from the cut of the logarithm at pi.
        const Posed bMoved = moved(b, away * random.vector(1), away * 2 * random.uniform(0.2, 1) * random.direction());
        expectJointRows(joint, a, bMoved);
    }
}

template <class S, std::size_t... I>
void checkAllJoints(double away, std::index_sequence<I...>) {
    (checkJoint<S, std::variant_alternative_t<I, JointDef>>(away), ...);
}

using AllJoints = std::make_index_sequence<std::variant_size_v<JointDef>>;

TYPED_TEST(Jacobians, OfJointsNearConsistency) {
    checkAllJoints<TypeParam>(0.02, AllJoints());
}

TYPED_TEST(Jacobians, OfJointsFarFromConsistency) {
    checkAllJoints<TypeParam>(1, AllJoints());
}

// A fresh joint is obeyed: every hard two-sided row starts at 0.
template <class S, class Def>
void checkFresh() {
    SCOPED_TRACE(Def::typeName);
    if constexpr (ParticleJoint<Def>) {
        return checkParticleJoint<S, Def>(0);
    }
    TestRandom random(5);
    BodyTable<S> bodies;
    const Posed a{random.vector(2), random.rotation()};
    const Posed b{random.vector(2), random.rotation()};
    Def def;
    if constexpr (requires { def.anchorB; }) {
        def.anchorB = Vec3d(1, 0, 0);
    }
    def.a = addLooseBody(bodies, a);
    def.b = addLooseBody(bodies, b);
    const Joint<S> joint = makeJoint(JointDef(def), bodies);
    std::vector<Row<S>> rows;
    RowBlock<S> block;
    joint.linearize(a.cast<S>(), b.cast<S>(), rows, block);
    ASSERT_FALSE(rows.empty());
    for (const Row<S>& row : rows) {
        EXPECT_LE(static_cast<double>(row.violation()), 10 * tolerance<S>());
    }
}

template <class S, std::size_t... I>
void checkAllFresh(std::index_sequence<I...>) {
    (checkFresh<S, std::variant_alternative_t<I, JointDef>>(), ...);
}

TYPED_TEST(Jacobians, FreshJointsAreObeyed) {
    checkAllFresh<TypeParam>(AllJoints());
}

TYPED_TEST(Jacobians, OfDistancesBetweenParticles) {
    checkParticleJoint<TypeParam, DistanceDef>(0.02);
    checkParticleJoint<TypeParam, DistanceDef>(1);
}

// A folded edge: the angle is exact for every fold up to just under pi, and a collapsed triangle pushes nothing.
TYPED_TEST(Jacobians, BendMeasuresTheFold) {
    using S = TypeParam;
    for (const double fold : {-3.1, -1.5, -0.3, 0.0, 1e-3, 0.7, 2.0, 3.1}) {
        const auto angle = dihedralAngle<S>({Vec3<S>(0, 0, 0), Vec3<S>(1, 0, 0), Vec3<S>(S(0.3), 1, 0),
                                             Vec3d(0.6, -std::cos(fold), std::sin(fold)).cast<S>()});
        EXPECT_NEAR(std::abs(static_cast<double>(angle.angle)), std::abs(fold), tolerance<S>());
    }
    const auto flat =
        dihedralAngle<S>({Vec3<S>(0, 0, 0), Vec3<S>(1, 0, 0), Vec3<S>(S(0.5), 0, 0), Vec3<S>(S(0.5), -1, 0)});
    EXPECT_FALSE(flat.exists);
    for (const Vec3<S>& g : flat.gradient) {
        EXPECT_EQ(g.norm(), 0);
    }
}

// The motor drives the rate of what the limits bound.
TYPED_TEST(Jacobians, MotorsTurnWhatTheLimitsBound) {
    using S = TypeParam;
    TestRandom random(3);
    BodyTable<S> bodies;
    const Posed a{random.vector(1), random.rotation()};
    const Posed b{random.vector(1), random.rotation()};
    const BodyId idA = addLooseBody(bodies, a);
    const BodyId idB = addLooseBody(bodies, b);
    const Vec3d axis = random.direction();
    const Vec3d anchor = random.vector(1);
    HingeDef hinge{.a = idA, .b = idB, .anchor = anchor, .axis = axis, .lower = -1, .upper = 1, .motorTorque = 1};
    SliderDef slider{.a = idA, .b = idB, .anchor = anchor, .axis = axis, .lower = -1, .upper = 1, .motorForce = 1};
    for (const JointDef& def : {JointDef(hinge), JointDef(slider)}) {
        const Joint<S> joint = makeJoint(def, bodies);
        // Along the freedom that is left the joint stays consistent.
        const bool turns = std::holds_alternative<HingeDef>(def);
        const Posed arm{b.position - anchor, b.rotation};
        const Posed turn{anchor, expQuat<double>(0.4 * axis)};
        const Posed bMoved = turns ? turn * arm : moved(b, 0.4 * axis, Vec3d::Zero());
        std::vector<Row<S>> rows;
        RowBlock<S> block;
        joint.linearize(a.cast<S>(), bMoved.cast<S>(), rows, block);
        const std::size_t n = rows.size();
        ASSERT_GE(n, 3U);
        const Row<S>& motor = rows[n - 1];
        const Row<S>& lower = rows[n - 3];
        ASSERT_TRUE(motor.isVelocity);
        EXPECT_LE(static_cast<double>((motor.a - lower.a).norm() + (motor.b - lower.b).norm()), 10 * tolerance<S>());
        EXPECT_NEAR(static_cast<double>(lower.C), 1.4, 1e-5);
    }
}

TYPED_TEST(Jacobians, OfContacts) {
    using S = TypeParam;
    TestRandom random(29);
    for (int trial = 0; trial < 40; ++trial) {
        const Posed a{random.vector(2), random.rotation()};
        Posed b{random.vector(2), random.rotation()};
        ContactGeometry<double> exact{random.vector(1), random.vector(1), random.direction()};
        // Every second one is round on a, on b, or on both, where the gap is along the normal.
        const Vec3d n = a.rotation * exact.normal;
        if (trial % 4 == 1 || trial % 8 == 3) {
            exact.roundA = random.uniform(0.1, 1) * exact.normal;
        }
        if (trial % 4 == 3) {
            exact.roundB = random.uniform(-1, -0.1) * (b.rotation.conjugate() * n);
        }
        if (exact.carriedByNone()) {
            b.position = a * exact.onA + random.uniform(-0.1, 0.1) * n - b.rotation * exact.onB;
        } else if (exact.carriedByB()) {
            exact.normal = b.rotation.conjugate() * n;
        }
        exact.startStep(a, b);
        ContactGeometry<S> contact{exact.onA.template cast<S>(), exact.onB.template cast<S>(),
                                   exact.normal.template cast<S>()};
        contact.roundA = exact.roundA.template cast<S>();
        contact.roundB = exact.roundB.template cast<S>();
        contact.startStep(a.cast<S>(), b.cast<S>());
        const auto linearize = [&]<class T>(const Pose<T>& x, const Pose<T>& y, std::vector<Row<T>>& rows) {
            RowBlock<T> block;
            RowWriter<T> writer(rows, block);
            if constexpr (std::is_same_v<T, S>) {
                linearizeContact(contact, x, y, true, writer);
            } else {
                linearizeContact(exact, x, y, true, writer);
            }
        };
        compareWithDifferences<S>(linearize, linearize, a, b, 20);
        std::vector<Row<S>> rows;
        linearize(a.cast<S>(), b.cast<S>(), rows);
        ASSERT_EQ(rows.size(), 3U);
        expectInternal(rows, a, b, 20);
        Mat3<S> basis;
        for (int k = 0; k < 3; ++k) {
            basis.col(k) = rows[static_cast<std::size_t>(k)].b.template head<3>();
        }
        EXPECT_LE(static_cast<double>((basis.transpose() * basis - Mat3<S>::Identity()).norm()), 10 * tolerance<S>());
    }
}

// A particle of radius r at the end of its arm: forces act at its centre, and nothing turns the pair.
TYPED_TEST(Jacobians, OfContactsOfParticles) {
    using S = TypeParam;
    TestRandom random(37);
    for (int trial = 0; trial < 40; ++trial) {
        const bool first = trial % 2 == 0;  // whether the particle is a
        const Posed body{random.vector(2), random.rotation()};
        const Vec3d outward = random.direction();
        const Vec3d onBody = random.vector(1);
        const double r = 0.1;
        const Vec3d n = body.rotation * outward;
        const Posed particle{body * onBody + (r + random.uniform(-0.01, 0.01)) * n, Quatd::Identity()};
        ContactGeometry<double> exact;
        exact.onA = first ? Vec3d(-r * n) : onBody;
        exact.onB = first ? onBody : Vec3d(-r * n);
        exact.normal = first ? Vec3d(-outward) : outward;
        (first ? exact.particleA : exact.particleB) = true;
        (first ? exact.roundA : exact.roundB) = first ? exact.onA : exact.onB;
        const Posed a = first ? particle : body;
        const Posed b = first ? body : particle;
        exact.startStep(a, b);
        ContactGeometry<S> contact;
        contact.onA = exact.onA.template cast<S>();
        contact.onB = exact.onB.template cast<S>();
        contact.normal = exact.normal.template cast<S>();
        contact.particleA = exact.particleA;
        contact.particleB = exact.particleB;
        contact.roundA = exact.roundA.template cast<S>();
        contact.roundB = exact.roundB.template cast<S>();
        contact.startStep(a.cast<S>(), b.cast<S>());
        const auto linearize = [&]<class T>(const Pose<T>& x, const Pose<T>& y, std::vector<Row<T>>& rows) {
            RowBlock<T> block;
            RowWriter<T> writer(rows, block);
            if constexpr (std::is_same_v<T, S>) {
                linearizeContact(contact, x, y, true, writer);
            } else {
                linearizeContact(exact, x, y, true, writer);
            }
        };
        compareWithDifferences<S>(linearize, linearize, a, b, 20);
        std::vector<Row<S>> rows;
        linearize(a.cast<S>(), b.cast<S>(), rows);
        expectInternal(rows, a, b, 20);
        for (const Row<S>& row : rows) {
            EXPECT_LE(static_cast<double>((first ? row.a : row.b).template tail<3>().norm()), tolerance<S>());
        }
    }
}

TYPED_TEST(Jacobians, OfAxisLocks) {
    using S = TypeParam;
    TestRandom random(31);
    for (int trial = 0; trial < 40; ++trial) {
        const Posed home{random.vector(2), random.rotation()};
        const Posed body = moved(home, random.vector(1), random.uniform(0.05, 2) * random.direction());
        const std::array<bool, 3> all = {true, true, true};
        const Pose<S> homeS = home.cast<S>();
        const auto linearize = [&]<class T>(const Pose<T>&, const Pose<T>& y, std::vector<Row<T>>& rows) {
            RowBlock<T> block;
            RowWriter<T> writer(rows, block);
            linearizeAxisLock<T>(all, all, homeS.template cast<T>(), y, writer);
            // The world takes part in these rows; it has no pose to differentiate by.
            for (Row<T>& row : rows) {
                row.a.setZero();
            }
        };
        compareWithDifferences<S>(linearize, linearize, Posed(), body, 10);
    }
}

}  // namespace
}  // namespace cairn
