// The ragdoll's body. Lengths are fractions of stature (Drillis and Contini 1966, as in Winter, Biomechanics and Motor
// Control of Human Movement, fig. 4.1); masses are fractions of body mass (de Leva 1996, men).
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

constexpr double stature = 1.75;   // m
constexpr double bodyMass = 75;    // kg
constexpr double stiffness = 0.4;  // N m: joints without friction would swing for minutes
constexpr double sole = 0;         // heights, of stature
constexpr double ankle = 0.039;
constexpr double knee = 0.285;
constexpr double hip = 0.530;
constexpr double waist = 0.600;
constexpr double ribs = 0.700;
constexpr double shoulder = 0.818;
constexpr double neck = 0.850;
constexpr double crown = 1;
constexpr double elbow = shoulder - 0.186;
constexpr double wrist = elbow - 0.146;
constexpr double fingertip = wrist - 0.108;
constexpr double shoulderHalf = 0.129;  // of stature, from the middle
constexpr double hipHalf = 0.05;        // to the hip joint; the hips' outer half width is 0.0955

struct Builder {
    Scene& scene;
    const std::string& prefix;
    const Posed& root;
    const Vec3d& velocity;

    // x, z: m, of the segment's middle; low, high: of stature.
    BodyId segment(const std::string& name, double share, Shape shape, double x, double low, double high,
                   double z = 0) const {
        shape.material.friction = 0.6;
        return scene.add({.name = prefix + name,
                          .shapes = {std::move(shape)},
                          .position = root * Vec3d(x, 0.5 * (low + high) * stature, z),
                          .rotation = root.rotation,
                          .linearVelocity = velocity,
                          .mass = share * bodyMass});
    }

    static Shape boxBetween(double halfWidth, double low, double high, double halfDepth) {
        return box({halfWidth, 0.5 * (high - low) * stature, halfDepth});
    }

    // A capsule whose ends reach exactly from low to high.
    static Shape limb(double radius, double low, double high) {
        return capsule(radius, 0.5 * (high - low) * stature - radius);
    }

    Vec3d at(double x, double height, double z = 0) const { return root * Vec3d(x, height * stature, z); }

    void cone(const std::string& name, BodyId a, BodyId b, const Vec3d& anchor, double swing, double twist) const {
        // The cone's axis points down the limb, from a to b: +y for the neck, -y for the rest; both hold the same cone.
        scene.add(prefix + name, ConeTwistDef{.a = a,
                                              .b = b,
                                              .anchor = anchor,
                                              .axis = root.rotation * Vec3d(0, -1, 0),
                                              .swing = swing,
                                              .twistLower = -twist,
                                              .twistUpper = twist,
                                              .friction = stiffness});
    }

    // About the doll's +x (to its left): a positive angle swings what hangs down to the back.
    void hinge(const std::string& name, BodyId a, BodyId b, const Vec3d& anchor, double lower, double upper) const {
        scene.add(prefix + name, HingeDef{.a = a,
                                          .b = b,
                                          .anchor = anchor,
                                          .axis = root.rotation * Vec3d::UnitX(),
                                          .lower = lower,
                                          .upper = upper,
                                          .friction = stiffness});
    }
};

}  // namespace

void addRagdoll(Scene& scene, const std::string& prefix, const Posed& root, const Vec3d& velocity) {
    const Builder doll{scene, prefix, root, velocity};
    const BodyId pelvis = doll.segment("pelvis", 0.1117, Builder::boxBetween(0.15, hip, waist, 0.09), 0, hip, waist);
    const BodyId belly = doll.segment("belly", 0.1633, Builder::boxBetween(0.14, waist, ribs, 0.09), 0, waist, ribs);
    const BodyId chest = doll.segment("chest", 0.1596, Builder::boxBetween(0.16, ribs, neck, 0.10), 0, ribs, neck);
    const BodyId head = doll.segment("head", 0.0694, Builder::limb(0.085, neck, crown), 0, neck, crown);
    doll.cone("lower spine", pelvis, belly, doll.at(0, waist), 0.35, 0.3);
    doll.cone("upper spine", belly, chest, doll.at(0, ribs), 0.35, 0.3);
    doll.cone("neck", chest, head, doll.at(0, neck), 0.6, 0.9);

    for (const double side : {-1.0, 1.0}) {
        const std::string name = side < 0 ? "right " : "left ";
        const double arm = side * shoulderHalf * stature;
        const BodyId upperArm =
            doll.segment(name + "upper arm", 0.0271, Builder::limb(0.045, elbow, shoulder), arm, elbow, shoulder);
        const BodyId forearm =
            doll.segment(name + "forearm", 0.0162, Builder::limb(0.038, wrist, elbow), arm, wrist, elbow);
        const BodyId hand = doll.segment(name + "hand", 0.0061, Builder::boxBetween(0.02, fingertip, wrist, 0.042), arm,
                                         fingertip, wrist);
        doll.cone(name + "shoulder", chest, upperArm, doll.at(arm, shoulder), 1.6, 1.0);
        doll.hinge(name + "elbow", upperArm, forearm, doll.at(arm, elbow), -2.5, 0);
        doll.cone(name + "wrist", forearm, hand, doll.at(arm, wrist), 0.9, 0.5);

        const double leg = side * hipHalf * stature;
        const BodyId thigh = doll.segment(name + "thigh", 0.1416, Builder::limb(0.075, knee, hip), leg, knee, hip);
        const BodyId shank = doll.segment(name + "shank", 0.0433, Builder::limb(0.055, ankle, knee), leg, ankle, knee);
        // The ankle sits over the rear third of the foot.
        const double footHalf = 0.5 * 0.152 * stature;
        const BodyId foot = doll.segment(name + "foot", 0.0137, Builder::boxBetween(0.045, sole, ankle, footHalf), leg,
                                         sole, ankle, 0.35 * footHalf);
        doll.cone(name + "hip", pelvis, thigh, doll.at(leg, hip), 1.0, 0.5);
        doll.hinge(name + "knee", thigh, shank, doll.at(leg, knee), 0, 2.4);
        doll.cone(name + "ankle", shank, foot, doll.at(leg, ankle), 0.5, 0.2);
    }
}

}  // namespace cairn
