// Scene -> Bullet world (single precision, as packaged), at Bullet's defaults but for what the dials turn.
#include "base/so3.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/hull.hpp"
#include "command/compare/reference_engine_kit.hpp"

#include <btBulletDynamicsCommon.h>
#include <Eigen/Eigenvalues>

#include <deque>
#include <numbers>

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

btVector3 toBullet(const Vec3d& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btTransform toBullet(const Posed& p) {
    const Quatd& q = p.rotation;
    return btTransform(btQuaternion(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                    static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())),
                       toBullet(p.position));
}

Posed fromBullet(const btTransform& t) {
    const btQuaternion q = t.getRotation();
    return {Vec3d(static_cast<double>(t.getOrigin().x()), static_cast<double>(t.getOrigin().y()),
                  static_cast<double>(t.getOrigin().z())),
            Quatd(static_cast<double>(q.w()), static_cast<double>(q.x()), static_cast<double>(q.y()),
                  static_cast<double>(q.z()))
                .normalized()};
}

constexpr const char* engineName = "bullet";

// The scene's own filters, by the user pointer of each object.
struct SceneFilter final : btOverlapFilterCallback {
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
        const auto filterOf = [](btBroadphaseProxy* proxy) {
            return *static_cast<const Filter*>(
                static_cast<btCollisionObject*>(proxy->m_clientObject)->getUserPointer());
        };
        const bool fixed = static_cast<btCollisionObject*>(a->m_clientObject)->isStaticOrKinematicObject() &&
                           static_cast<btCollisionObject*>(b->m_clientObject)->isStaticOrKinematicObject();
        return !fixed && filtersAgree(filterOf(a), filterOf(b));
    }
};

class BulletEngine final : public ReferenceEngine {
public:
    BulletEngine(const Scene& scene, int iterations, int substeps)
        : world_(&dispatcher_, &broadPhase_, &solver_, &configuration_), substeps_(substeps) {
        world_.setGravity(toBullet(scene.world.gravity));
        world_.getSolverInfo().m_numIterations = iterations;
        world_.getPairCache()->setOverlapFilterCallback(&filter_);
        refuseDeformables(engineName, scene);
        for (const BodyDef& body : scene.bodies) {
            addBody(body, scene.world.gravity);
        }
        for (const SceneJoint& joint : scene.joints) {
            if (const std::optional<Push> push = pushOf(scene, joint)) {
                pushes_.push_back(*push);
                continue;
            }
            std::visit([&](const auto& def) { addJoint(scene, def); }, joint.def);
        }
    }

    ~BulletEngine() override {
        for (const auto& constraint : constraints_) {
            world_.removeConstraint(constraint.get());
        }
        for (Entry& entry : entries_) {
            world_.removeRigidBody(entry.body.get());
        }
    }
    BulletEngine(const BulletEngine&) = delete;
    BulletEngine& operator=(const BulletEngine&) = delete;

    void step(double dt) override {
        const double h = dt / substeps_;
        for (int k = 0; k < substeps_; ++k) {
            for (Entry& entry : entries_) {
                if (entry.body->isKinematicObject()) {
                    Posed p = fromBullet(entry.body->getWorldTransform());
                    p.position += h * entry.linear;
                    p.rotation = rotated<double>(p.rotation, h * entry.angular);
                    entry.motion->setWorldTransform(toBullet(p));
                }
            }
            for (const Push& push : pushes_) {
                entries_[push.body].body->applyCentralForce(toBullet(push.force));
            }
            world_.stepSimulation(static_cast<btScalar>(h), 0);
        }
    }

    Posed pose(std::size_t body) const override {
        const Entry& entry = entries_[body];
        return fromBullet(entry.body->getWorldTransform()) * entry.frameFromCentre.inverse();
    }
    Vec3d velocity(std::size_t body) const override {
        const btVector3& v = entries_[body].body->getLinearVelocity();
        return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
    }

private:
    struct Entry {
        std::unique_ptr<btDefaultMotionState> motion;
        std::unique_ptr<btRigidBody> body;
        Posed frameFromCentre;  // Bullet's frame (centre of mass, principal axes) in the body's frame
        Filter filter;
        Vec3d linear = Vec3d::Zero();  // of kinematic bodies
        Vec3d angular = Vec3d::Zero();
    };

    btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape) {
        shapes_.push_back(std::move(shape));
        return shapes_.back().get();
    }

    btCollisionShape* convert(const Shape& shape) {
        const btScalar radius = static_cast<btScalar>(shape.size.x());
        const btScalar height = static_cast<btScalar>(2 * shape.size.y());
        switch (shape.kind) {
            case ShapeKind::Sphere:
                return keep(std::make_unique<btSphereShape>(radius));
            case ShapeKind::Capsule:
                return keep(std::make_unique<btCapsuleShape>(radius, height));
            case ShapeKind::Box:
                return keep(std::make_unique<btBoxShape>(toBullet(shape.size)));
            case ShapeKind::Cylinder:
                return keep(std::make_unique<btCylinderShape>(btVector3(radius, height / 2, radius)));
            case ShapeKind::Cone:
                return keep(std::make_unique<btConeShape>(radius, height));
            case ShapeKind::Hull: {
                auto hull = std::make_unique<btConvexHullShape>();
                for (const Vec3d& vertex : bareSurface(shape).vertices) {
                    hull->addPoint(toBullet(vertex), false);
                }
                hull->recalcLocalAabb();
                // Bullet's margin of 4 cm grows a hull outwards, which the common error would count as a gap.
                hull->setMargin(btScalar(0.001));
                return keep(std::move(hull));
            }
            case ShapeKind::Mesh: {
                const TriangleMesh triangles = bareSurface(shape);
                auto mesh = std::make_unique<btTriangleMesh>();
                for (const std::array<int, 3>& t : triangles.triangles) {
                    const auto vertex = [&](std::size_t k) {
                        return toBullet(triangles.vertices[static_cast<std::size_t>(t[k])]);
                    };
                    mesh->addTriangle(vertex(0), vertex(1), vertex(2));
                }
                auto* bvh = keep(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true));
                meshes_.push_back(std::move(mesh));
                return bvh;
            }
            case ShapeKind::Ellipsoid:
            case ShapeKind::HalfSpace:
            case ShapeKind::HeightField:
                break;
        }
        noCounterpart(engineName, std::string("a shape ") + name(shape.kind));
    }

    // A half-space becomes a big box: against a plane Bullet finds one point of a box a step, which would judge it by
    // its weakest routine.
    static Shape bounded(const Shape& shape) {
        if (shape.kind != ShapeKind::HalfSpace) {
            return shape;
        }
        constexpr double half = 100;  // m
        Shape slab = box({half, half, half});
        slab.pose =
            shape.pose * Posed{(shape.offset - half) * shape.size, turnBetween<double>(Vec3d::UnitY(), shape.size)};
        return slab;
    }

    // The shapes of a body about its centre of mass.
    btCollisionShape* convert(std::vector<Shape> shapes, const Posed& centreFromFrame) {
        std::transform(shapes.begin(), shapes.end(), shapes.begin(), bounded);
        if (shapes.empty()) {
            return keep(std::make_unique<btEmptyShape>());
        }
        const Posed first = centreFromFrame * shapes[0].pose;
        const bool inPlace = first.position.isZero(1e-12) && logQuat<double>(first.rotation).isZero(1e-12);
        if (shapes.size() == 1 && inPlace) {
            return convert(shapes[0]);
        }
        auto compound = std::make_unique<btCompoundShape>();
        for (const Shape& shape : shapes) {
            compound->addChildShape(toBullet(centreFromFrame * shape.pose), convert(shape));
        }
        return keep(std::move(compound));
    }

    void addBody(const BodyDef& def, const Vec3d& gravity) {
        Entry& entry = entries_.emplace_back();
        entry.filter = def.filter;
        const bool dynamic = def.type == BodyType::Dynamic;
        const MassProperties properties = massOf(def);
        Vec3d moments = properties.inertia.diagonal();
        entry.frameFromCentre.position = properties.centre;
        if (dynamic && !properties.inertia.isDiagonal(1e-9)) {
            const Eigen::SelfAdjointEigenSolver<Mat3d> principal(properties.inertia);
            Mat3d axes = principal.eigenvectors();
            axes.col(2) *= axes.determinant() < 0 ? -1 : 1;
            entry.frameFromCentre.rotation = Quatd(axes).normalized();
            moments = principal.eigenvalues();
        }
        const Posed frame{def.position, def.rotation.normalized()};
        entry.motion = std::make_unique<btDefaultMotionState>(toBullet(frame * entry.frameFromCentre));
        btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(properties.mass), entry.motion.get(),
                                                      convert(def.shapes, entry.frameFromCentre.inverse()),
                                                      toBullet(moments));
        if (!def.shapes.empty()) {
            // Bullet multiplies the two coefficients of a pair; Cairn takes the root of the product.
            info.m_friction = static_cast<btScalar>(std::sqrt(def.shapes[0].material.friction));
            info.m_restitution = static_cast<btScalar>(std::sqrt(def.shapes[0].material.restitution));
        }
        // Bullet: v *= (1 - damping)^dt. Cairn: v *= exp(-damping dt).
        info.m_linearDamping = static_cast<btScalar>(1 - std::exp(-def.linearDamping));
        info.m_angularDamping = static_cast<btScalar>(1 - std::exp(-def.angularDamping));
        entry.body = std::make_unique<btRigidBody>(info);
        btRigidBody& body = *entry.body;
        body.setUserPointer(&entry.filter);
        body.setActivationState(DISABLE_DEACTIVATION);
        if (def.type == BodyType::Kinematic) {
            body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
            entry.linear = def.linearVelocity;
            entry.angular = def.angularVelocity;
        }
        world_.addRigidBody(&body);
        if (dynamic) {
            body.setLinearVelocity(toBullet(def.linearVelocity));
            body.setAngularVelocity(toBullet(def.angularVelocity));
            body.setGravity(toBullet(def.gravityScale * gravity));
            const auto factor = [](const std::array<bool, 3>& lock) {
                return btVector3(lock[0] ? 0 : 1, lock[1] ? 0 : 1, lock[2] ? 0 : 1);
            };
            body.setLinearFactor(factor(def.lockLinear));
            body.setAngularFactor(factor(def.lockAngular));
        }
    }

    // The frame of a joint whose x is `axis`, in the Bullet frames of its two bodies.
    struct Ends {
        btRigidBody& a;
        btRigidBody& b;
        btTransform frameA;
        btTransform frameB;
    };
    template <class Def>
    Ends endsOf(const Scene& scene, const Def& def, const Posed& frame) {
        refuseSoft(engineName, def);
        const auto local = [&](BodyId id) {
            const BodyDef& body = scene.bodies[id.index];
            const Posed centre = Posed{body.position, body.rotation.normalized()} * entries_[id.index].frameFromCentre;
            return toBullet(relativePose(centre, frame));
        };
        return {*entries_[def.a.index].body, *entries_[def.b.index].body, local(def.a), local(def.b)};
    }
    void add(std::unique_ptr<btTypedConstraint> constraint, bool collide) {
        world_.addConstraint(constraint.get(), !collide);
        constraints_.push_back(std::move(constraint));
    }
    static Posed frameAt(const Vec3d& anchor, const Vec3d& axis, const Vec3d& along) {
        return {anchor, turnBetween<double>(along, axis)};
    }

    void addJoint(const Scene& scene, const BallDef& def) {
        const Ends e = endsOf(scene, def, {def.anchor, Quatd::Identity()});
        add(std::make_unique<btPoint2PointConstraint>(e.a, e.b, e.frameA.getOrigin(), e.frameB.getOrigin()),
            def.collide);
    }
    void addJoint(const Scene& scene, const WeldDef& def) {
        const Ends e = endsOf(scene, def, {def.anchor, Quatd::Identity()});
        add(std::make_unique<btFixedConstraint>(e.a, e.b, e.frameA, e.frameB), def.collide);
    }
    // Bullet's hinge turns about the z of its frames; with useReferenceFrameA its angle grows as b turns about +z.
    void addJoint(const Scene& scene, const HingeDef& def) {
        const Ends e = endsOf(scene, def, frameAt(def.anchor, def.axis, Vec3d::UnitZ()));
        auto hinge = std::make_unique<btHingeConstraint>(e.a, e.b, e.frameA, e.frameB, true);
        if (std::isfinite(def.lower) || std::isfinite(def.upper)) {
            hinge->setLimit(static_cast<btScalar>(std::max(def.lower, -pi)),
                            static_cast<btScalar>(std::min(def.upper, pi)));
        }
        if (def.motorTorque > 0) {
            hinge->enableAngularMotor(true, static_cast<btScalar>(def.motorSpeed),
                                      static_cast<btScalar>(def.motorTorque * scene.dt));
        }
        add(std::move(hinge), def.collide);
    }
    void addJoint(const Scene& scene, const SliderDef& def) {
        const Ends e = endsOf(scene, def, frameAt(def.anchor, def.axis, Vec3d::UnitX()));
        auto slider = std::make_unique<btSliderConstraint>(e.a, e.b, e.frameA, e.frameB, true);
        slider->setLowerAngLimit(0);
        slider->setUpperAngLimit(0);
        const bool limited = std::isfinite(def.lower) || std::isfinite(def.upper);
        slider->setLowerLinLimit(limited ? static_cast<btScalar>(std::max(def.lower, -1e6)) : btScalar(1));
        slider->setUpperLinLimit(limited ? static_cast<btScalar>(std::min(def.upper, 1e6)) : btScalar(-1));
        if (def.motorForce > 0) {
            slider->setPoweredLinMotor(true);
            slider->setTargetLinMotorVelocity(static_cast<btScalar>(def.motorSpeed));
            slider->setMaxLinMotorForce(static_cast<btScalar>(def.motorForce));
        }
        add(std::move(slider), def.collide);
    }
    void addJoint(const Scene& scene, const ConeTwistDef& def) {
        const Ends e = endsOf(scene, def, frameAt(def.anchor, def.axis, Vec3d::UnitX()));
        auto cone = std::make_unique<btConeTwistConstraint>(e.a, e.b, e.frameA, e.frameB);
        // Its twist is bounded alike on both sides.
        const double twist = std::max(std::abs(def.twistLower), std::abs(def.twistUpper));
        cone->setLimit(static_cast<btScalar>(def.swing), static_cast<btScalar>(def.swing),
                       static_cast<btScalar>(std::min(twist, pi)));
        add(std::move(cone), def.collide);
    }
    template <class Def>
    void addJoint(const Scene&, const Def&) {
        noCounterpart(engineName, std::string("a joint ") + Def::typeName);
    }

    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadPhase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld world_;
    int substeps_;
    SceneFilter filter_;
    std::vector<Push> pushes_;
    std::vector<std::unique_ptr<btTriangleMesh>> meshes_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::deque<Entry> entries_;  // of Scene::bodies; Bullet keeps pointers into it
    std::vector<std::unique_ptr<btTypedConstraint>> constraints_;
};

}  // namespace

Engine bulletEngine() {
    static constexpr int standard = 10;  // iterations, its default
    const auto iterations = [](const Scene& scene, double value) -> std::unique_ptr<ReferenceEngine> {
        return std::make_unique<BulletEngine>(scene, static_cast<int>(value), 1);
    };
    const auto substeps = [](const Scene& scene, double value) -> std::unique_ptr<ReferenceEngine> {
        return std::make_unique<BulletEngine>(scene, standard, static_cast<int>(value));
    };
    return {engineName,
            "",
            {{"", {standard}, iterations},
             {"iterations", {1, 4, 50, 200}, iterations},
             {"substeps", {2, 4, 8, 16, 32}, substeps}}};
}

}  // namespace cairn
