// Joints that are wrong are refused: what every type must refuse, and each type's own limits.
#include "engine/constraints/joint.hpp"
#include "tests/engine/world/bad_input.hpp"

namespace cairn {
namespace {

// What every joint must refuse, and its type's own limits.
template <class Def>
void checkJointRefusals() {
    SCOPED_TRACE(Def::typeName);
    TwoBodies t;
    const auto refused = [&](const std::string& field, FunctionRef<void(Def&)> change) {
        Def def;
        def.a = t.hook;
        def.b = t.crate;
        if constexpr (requires { def.anchorB; }) {
            def.anchorB = Vec3d(1, 0, 0);
        }
        if constexpr (ParticleJoint<Def>) {
            def.b = t.particles[0];
            def.c = t.particles[1];
            def.d = t.particles[2];
        }
        change(def);
        expectRefused(std::string(Def::typeName) + field, [&] { t.world.add(def); });
        EXPECT_TRUE(t.world.joints().empty());
    };
    refused("", [&](Def& d) {
        d.b = t.wall;
        if constexpr (ParticleJoint<Def>) {
            d.c = t.fixed[0];
            d.d = t.fixed[1];
        }
    });
    if constexpr (ParticleJoint<Def>) {
        refused(".d", [&](Def& d) { d.d = d.c; });
        refused(".c", [&](Def& d) { d.c = t.gone; });
        refused(".b", [&](Def& d) { d.b = t.crate; });
        // All four in one line: neither volume nor triangles.
        refused("", [&](Def& d) {
            d.b = t.particles[0];
            d.c = t.addParticle(Vec3d(2, 0, 0));
            d.d = t.addParticle(Vec3d(3, 0, 0));
        });
    } else if constexpr (std::is_same_v<Def, BallDef> || std::is_same_v<Def, DistanceDef>) {
        refused(".anchor", [&](Def& d) {
            d.b = t.particles[0];
            if constexpr (requires { d.anchor; }) {
                d.anchor = Vec3d(1, 0.01, 0);
            } else {
                d.anchorB = Vec3d(1, 0.01, 0);
            }
        });
    } else {
        refused("", [&](Def& d) {
            d.b = t.particles[0];
            if constexpr (requires { d.anchor; }) {
                d.anchor = Vec3d(1, 0, 0);
            }
        });
    }
    refused(".b", [&](Def& d) { d.b = d.a; });
    refused(".b", [&](Def& d) { d.b = t.gone; });
    refused(".a", [&](Def& d) { d.a = BodyId(); });
    refused(".softness", [&](Def& d) { d.softness.compliance = -1; });
    refused(".softness", [&](Def& d) { d.softness.frequency = nan; });
    refused(".softness", [&](Def& d) { d.softness = {.damping = 5}; });
    refused(".softness", [&](Def& d) { d.softness = {.frequency = 1, .dampingRatio = -1}; });
    if constexpr (requires(Def d) { d.anchor; }) {
        refused(".anchor", [&](Def& d) { d.anchor.x() = nan; });
    }
    if constexpr (requires(Def d) { d.anchorA; }) {
        refused(".anchorA", [&](Def& d) { d.anchorA.x() = inf; });
        refused(".anchorB", [&](Def& d) { d.anchorB.z() = nan; });
    }
    if constexpr (requires(Def d) { d.axis; }) {
        refused(".axis", [&](Def& d) { d.axis.setZero(); });
        refused(".axis", [&](Def& d) { d.axis.y() = nan; });
    }
    if constexpr (requires(Def d) { d.lower; }) {
        refused(".lower", [&](Def& d) {
            d.lower = 2;
            d.upper = 1;
        });
        refused("", [&](Def& d) { d.upper = nan; });
    }
    if constexpr (requires(Def d) { d.twistLower; }) {
        refused(".twistLower", [&](Def& d) { d.twistLower = 2; });
        refused(".twistLower", [&](Def& d) { d.twistUpper = 4; });
        refused(".swing", [&](Def& d) { d.swing = 0; });
        refused(".swing", [&](Def& d) { d.swing = 3.2; });
    }
    if constexpr (requires(Def d) { d.motorTorque; }) {
        refused(".motorTorque", [&](Def& d) { d.motorTorque = -1; });
        refused(".motorSpeed", [&](Def& d) {
            d.motorTorque = 1;
            d.motorSpeed = nan;
        });
        if constexpr (requires(Def d) { d.lower; }) {
            refused(".lower", [&](Def& d) { d.lower = -4; });
        }
    }
    if constexpr (requires(Def d) { d.motorForce; }) {
        refused(".motorForce", [&](Def& d) { d.motorForce = nan; });
        refused(".motorSpeed", [&](Def& d) {
            d.motorForce = 1;
            d.motorSpeed = inf;
        });
    }
}

template <std::size_t... I>
void checkAllJointRefusals(std::index_sequence<I...>) {
    (checkJointRefusals<std::variant_alternative_t<I, JointDef>>(), ...);
}

TEST(BadInput, Joints) {
    checkAllJointRefusals(std::make_index_sequence<std::variant_size_v<JointDef>>());
}

}  // namespace
}  // namespace cairn
