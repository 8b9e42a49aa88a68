// Scene -> ODE world (double precision, as packaged), at ODE's defaults (ERP 0.2, CFM 1e-10, gyroscopic terms on) but
// for what the dials turn. Friction is ODE's pyramid that follows the normal force (dContactApprox1), without which mu
// would be a force. Hulls are ODE's convex geoms: its triangle meshes as moving bodies find too few points to stand on.
// dWorldStep throws aligned stacks apart, whatever CFM from 1e-10 to 1e-4 and however few the points of a pair: it is
// here for what it does well.
#include "base/so3.hpp"
#include "collision/shapes/hull.hpp"
#include "command/compare/reference_engine_kit.hpp"

#include <ode/ode.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <deque>

static_assert(sizeof(dReal) == sizeof(double), "Debian's libode is of double precision");

namespace cairn {
namespace {

constexpr const char* engineName = "ode";

// dWorldStep solves all rows of an island at once by a dense factor, in cubic time.
constexpr int maxDantzigRows = 1500;

struct OdeSettings {
    bool quick = true;  // dWorldQuickStep; else dWorldStep
    int iterations = 20;
    int substeps = 1;
};

[[noreturn]] void onError(int, const char* format, va_list arguments) {
    char words[256];
    std::vsnprintf(words, sizeof words, format, arguments);
    throw InputError("engine", engineName, std::string("it gave up: ") + words);
}

void onMessage(int, const char*, va_list) {}  // its solver's hints; what went wrong shows in the errors

// Once, and for as long as the program runs.
void startOde() {
    static const bool started = [] {
        dInitODE2(0);
        dSetErrorHandler(onError);
        dSetDebugHandler(onError);
        dSetMessageHandler(onMessage);
        return true;
    }();
    static_cast<void>(started);
}

Vec3d fromOde(const dReal* v) {
    return {v[0], v[1], v[2]};
}

void place(dGeomID geom, const Posed& pose) {
    const Quatd& q = pose.rotation;
    const dQuaternion turn = {q.w(), q.x(), q.y(), q.z()};
    if (dGeomGetBody(geom) != nullptr) {
        dGeomSetOffsetPosition(geom, pose.position.x(), pose.position.y(), pose.position.z());
        dGeomSetOffsetQuaternion(geom, turn);
    } else {
        dGeomSetPosition(geom, pose.position.x(), pose.position.y(), pose.position.z());
        dGeomSetQuaternion(geom, turn);
    }
}

// ODE's capsules and cylinders stand along z.
Posed standingAlongZ(const Posed& pose) {
    return pose * Posed{Vec3d::Zero(), turnBetween<double>(Vec3d::UnitZ(), Vec3d::UnitY())};
}

class OdeEngine final : public ReferenceEngine {
public:
    OdeEngine(const Scene& scene, const OdeSettings& settings)
        : scene_(scene), settings_(settings), joined_(joinedPairs(scene)) {
        startOde();
        refuseDeformables(engineName, scene);
        world_.reset(dWorldCreate());
        space_.reset(dHashSpaceCreate(nullptr));
        contacts_.reset(dJointGroupCreate(0));
        const Vec3d& g = scene.world.gravity;
        dWorldSetGravity(world_.get(), g.x(), g.y(), g.z());
        dWorldSetQuickStepNumIterations(world_.get(), settings.iterations);
        dWorldSetLinearDampingThreshold(world_.get(), 0);
        dWorldSetAngularDampingThreshold(world_.get(), 0);
        for (const BodyDef& body : scene.bodies) {
            addBody(body);
        }
        for (const SceneJoint& joint : scene.joints) {
            if (const std::optional<Push> push = pushOf(scene, joint)) {
                pushes_.push_back(*push);
                continue;
            }
            std::visit([&](const auto& def) { addJoint(def); }, joint.def);
        }
    }
    OdeEngine(const OdeEngine&) = delete;
    OdeEngine& operator=(const OdeEngine&) = delete;

    void step(double dt) override {
        const double h = dt / settings_.substeps;
        for (int k = 0; k < settings_.substeps; ++k) {
            for (const Push& push : pushes_) {
                dBodyAddForce(bodies_[push.body].body, push.force.x(), push.force.y(), push.force.z());
            }
            for (const Entry& entry : bodies_) {
                if (entry.weight != 0) {
                    const Vec3d f = entry.weight * scene_.world.gravity;
                    dBodyAddForce(entry.body, f.x(), f.y(), f.z());
                }
            }
            rows_ = 0;
            dSpaceCollide(space_.get(), this,
                          [](void* self, dGeomID a, dGeomID b) { static_cast<OdeEngine*>(self)->touch(a, b); });
            if (settings_.quick) {
                dWorldQuickStep(world_.get(), h);
            } else if (rows_ <= maxDantzigRows) {
                dWorldStep(world_.get(), h);
            } else {
                throw InputError("engine", "ode dantzig",
                                 "more than " + std::to_string(maxDantzigRows) +
                                     " rows would take it seconds a step: choose a smaller scene");
            }
            dJointGroupEmpty(contacts_.get());
        }
    }

    Posed pose(std::size_t body) const override {
        const Entry& entry = bodies_[body];
        if (entry.body == nullptr) {
            return entry.start;
        }
        const dReal* q = dBodyGetQuaternion(entry.body);
        const Quatd turn = Quatd(q[0], q[1], q[2], q[3]).normalized();
        return {fromOde(dBodyGetPosition(entry.body)) - turn * entry.centre, turn};
    }
    Vec3d velocity(std::size_t body) const override {
        return bodies_[body].body == nullptr ? Vec3d(Vec3d::Zero()) : fromOde(dBodyGetLinearVel(bodies_[body].body));
    }

private:
    template <class Id, void (*destroy)(Id)>
    struct Destroy {
        using pointer = Id;
        void operator()(Id id) const { destroy(id); }
    };
    template <class Id, void (*destroy)(Id)>
    using Owned = std::unique_ptr<std::remove_pointer_t<Id>, Destroy<Id, destroy>>;

    struct Entry {
        dBodyID body = nullptr;  // none: static
        Posed start;
        Vec3d centre = Vec3d::Zero();  // of mass, in the body's frame
        double weight = 0;             // kg: mass that gravity pulls beyond what the world's does
    };
    // A geom and what it stands for, by the user pointer of the geom.
    struct Surface {
        std::size_t body;
        Material material;
    };
    // What ODE refers to and does not copy.
    struct Convex {
        std::vector<dReal> planes;
        std::vector<dReal> points;
        std::vector<unsigned> polygons;
    };
    struct Triangles {
        std::vector<double> vertices;
        std::vector<dTriIndex> indices;
        Owned<dTriMeshDataID, dGeomTriMeshDataDestroy> data;
    };

    dGeomID convexGeom(const Hull& hull) {
        Convex& c = convexes_.emplace_back();
        for (const Vec3d& v : hull.vertices) {
            c.points.insert(c.points.end(), {v.x(), v.y(), v.z()});
        }
        for (const Hull::Face& face : hull.faces) {
            c.planes.insert(c.planes.end(), {face.normal.x(), face.normal.y(), face.normal.z(), face.offset});
            c.polygons.push_back(static_cast<unsigned>(face.vertices.size()));
            for (const int vertex : face.vertices) {
                c.polygons.push_back(static_cast<unsigned>(vertex));
            }
        }
        return dCreateConvex(space_.get(), c.planes.data(), static_cast<unsigned>(hull.faces.size()), c.points.data(),
                             static_cast<unsigned>(hull.vertices.size()), c.polygons.data());
    }
    dGeomID triangleGeom(const TriangleMesh& surface) {
        Triangles& t = triangles_.emplace_back();
        for (const Vec3d& v : surface.vertices) {
            t.vertices.insert(t.vertices.end(), {v.x(), v.y(), v.z()});
        }
        for (const std::array<int, 3>& triangle : surface.triangles) {
            for (const int corner : triangle) {
                t.indices.push_back(static_cast<dTriIndex>(corner));
            }
        }
        t.data.reset(dGeomTriMeshDataCreate());
        dGeomTriMeshDataBuildDouble(t.data.get(), t.vertices.data(), 3 * sizeof(double),
                                    static_cast<int>(surface.vertices.size()), t.indices.data(),
                                    static_cast<int>(t.indices.size()), 3 * sizeof(dTriIndex));
        return dCreateTriMesh(space_.get(), t.data.get(), nullptr, nullptr, nullptr);
    }

    // `frame`: the body's frame, in the frame that ODE's body or, of a static one, the world has.
    void addGeom(std::size_t index, const Shape& shape, const Posed& frame) {
        const dSpaceID space = space_.get();
        const double radius = shape.size.x();
        const double height = 2 * shape.size.y();
        Posed pose = frame * shape.pose;
        dGeomID geom = nullptr;
        switch (shape.kind) {
            case ShapeKind::Sphere:
                geom = dCreateSphere(space, radius);
                break;
            case ShapeKind::Box:
                geom = dCreateBox(space, 2 * shape.size.x(), 2 * shape.size.y(), 2 * shape.size.z());
                break;
            case ShapeKind::Capsule:
                geom = dCreateCapsule(space, radius, height);
                pose = standingAlongZ(pose);
                break;
            case ShapeKind::Cylinder:
                geom = dCreateCylinder(space, radius, height);
                pose = standingAlongZ(pose);
                break;
            case ShapeKind::Hull:
                geom = convexGeom(*shape.hull);
                break;
            case ShapeKind::Mesh:
            case ShapeKind::HeightField:
                geom = triangleGeom(bareSurface(shape));
                break;
            case ShapeKind::HalfSpace: {
                const Vec3d normal = pose.rotation * shape.size;
                geom =
                    dCreatePlane(space, normal.x(), normal.y(), normal.z(), shape.offset + normal.dot(pose.position));
                break;
            }
            case ShapeKind::Cone:
            case ShapeKind::Ellipsoid:
                noCounterpart(engineName, std::string("a shape ") + name(shape.kind));
        }
        surfaces_.push_back({index, shape.material});
        dGeomSetData(geom, &surfaces_.back());
        if (shape.kind == ShapeKind::HalfSpace) {
            return;  // it has no place of its own
        }
        if (bodies_[index].body != nullptr) {
            dGeomSetBody(geom, bodies_[index].body);
        }
        place(geom, pose);
    }

    void addBody(const BodyDef& def) {
        const auto locked = [](const std::array<bool, 3>& lock) { return lock[0] || lock[1] || lock[2]; };
        if (locked(def.lockLinear) || locked(def.lockAngular)) {
            noCounterpart(engineName, "a locked axis");
        }
        const std::size_t index = bodies_.size();
        Entry& entry = bodies_.emplace_back();
        entry.start = {def.position, def.rotation.normalized()};
        Posed frame = entry.start;
        if (def.type != BodyType::Static) {
            const MassProperties properties = massOf(def);
            entry.centre = properties.centre;
            entry.body = dBodyCreate(world_.get());
            const Vec3d at = entry.start * entry.centre;
            const Quatd& q = entry.start.rotation;
            const dQuaternion turn = {q.w(), q.x(), q.y(), q.z()};
            dBodySetPosition(entry.body, at.x(), at.y(), at.z());
            dBodySetQuaternion(entry.body, turn);
            dBodySetLinearVel(entry.body, def.linearVelocity.x(), def.linearVelocity.y(), def.linearVelocity.z());
            dBodySetAngularVel(entry.body, def.angularVelocity.x(), def.angularVelocity.y(), def.angularVelocity.z());
            if (def.type == BodyType::Kinematic) {
                dBodySetKinematic(entry.body);
            } else {
                const Mat3d& i = properties.inertia;
                dMass mass;
                dMassSetParameters(&mass, properties.mass, 0, 0, 0, i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2),
                                   i(1, 2));
                dBodySetMass(entry.body, &mass);
                entry.weight = properties.mass * (def.gravityScale - 1);
                // ODE: v *= 1 - scale in each step. Cairn: v *= exp(-damping dt).
                const double h = scene_.dt / settings_.substeps;
                dBodySetLinearDamping(entry.body, 1 - std::exp(-def.linearDamping * h));
                dBodySetAngularDamping(entry.body, 1 - std::exp(-def.angularDamping * h));
            }
            frame = {-entry.centre, Quatd::Identity()};
        }
        for (const Shape& shape : def.shapes) {
            addGeom(index, shape, frame);
        }
    }

    void touch(dGeomID a, dGeomID b) {
        const Surface& one = *static_cast<Surface*>(dGeomGetData(a));
        const Surface& other = *static_cast<Surface*>(dGeomGetData(b));
        if (!mayCollide(scene_, joined_, one.body, other.body)) {
            return;
        }
        constexpr int maxPoints = 32;
        std::array<dContactGeom, maxPoints> points;
        const int count = dCollide(a, b, maxPoints, points.data(), sizeof(dContactGeom));
        dContact contact{};
        contact.surface.mode = dContactApprox1;
        contact.surface.mu = frictionOf(one.material, other.material);
        contact.surface.bounce = std::sqrt(one.material.restitution * other.material.restitution);
        if (contact.surface.bounce > 0) {
            contact.surface.mode |= dContactBounce;
            contact.surface.bounce_vel = scene_.world.restitutionSpeed;
        }
        for (int k = 0; k < count; ++k) {
            contact.geom = points[static_cast<std::size_t>(k)];
            const dJointID joint = dJointCreateContact(world_.get(), contacts_.get(), &contact);
            dJointAttach(joint, bodies_[one.body].body, bodies_[other.body].body);
        }
        rows_ += count * (contact.surface.mu > 0 ? 3 : 1);
    }

    template <class Def>
    void attach(dJointID joint, const Def& def) {
        refuseSoft(engineName, def);
        // b first: ODE's angles and ways are those of its first body against its second.
        dJointAttach(joint, bodies_[def.b.index].body, bodies_[def.a.index].body);
    }
    template <class Def>
    static void refuseLimits(const Def& def, double motor) {
        if (std::isfinite(def.lower) || std::isfinite(def.upper) || motor > 0) {
            noCounterpart(engineName, std::string("limits or a motor of a joint ") + Def::typeName);
        }
    }
    void addJoint(const BallDef& def) {
        const dJointID joint = dJointCreateBall(world_.get(), nullptr);
        attach(joint, def);
        dJointSetBallAnchor(joint, def.anchor.x(), def.anchor.y(), def.anchor.z());
    }
    void addJoint(const WeldDef& def) {
        const dJointID joint = dJointCreateFixed(world_.get(), nullptr);
        attach(joint, def);
        dJointSetFixed(joint);
    }
    void addJoint(const HingeDef& def) {
        refuseLimits(def, def.motorTorque);
        const dJointID joint = dJointCreateHinge(world_.get(), nullptr);
        attach(joint, def);
        dJointSetHingeAnchor(joint, def.anchor.x(), def.anchor.y(), def.anchor.z());
        dJointSetHingeAxis(joint, def.axis.x(), def.axis.y(), def.axis.z());
    }
    void addJoint(const SliderDef& def) {
        refuseLimits(def, def.motorForce);
        const dJointID joint = dJointCreateSlider(world_.get(), nullptr);
        attach(joint, def);
        dJointSetSliderAxis(joint, def.axis.x(), def.axis.y(), def.axis.z());
    }
    template <class Def>
    void addJoint(const Def&) {
        noCounterpart(engineName, std::string("a joint ") + Def::typeName);
    }

    const Scene scene_;
    const OdeSettings settings_;
    const std::vector<BodyPair> joined_;
    std::deque<Convex> convexes_;
    std::deque<Triangles> triangles_;
    std::deque<Surface> surfaces_;
    std::vector<Entry> bodies_;
    std::vector<Push> pushes_;
    int rows_ = 0;  // of the last sub-step's contacts
    Owned<dWorldID, dWorldDestroy> world_;
    Owned<dSpaceID, dSpaceDestroy> space_;
    Owned<dJointGroupID, dJointGroupDestroy> contacts_;
};

}  // namespace

Engine odeEngine() {
    const auto make = [](bool quick, bool turnsIterations) {
        return [=](const Scene& scene, double value) -> std::unique_ptr<ReferenceEngine> {
            OdeSettings settings{.quick = quick};
            (turnsIterations ? settings.iterations : settings.substeps) = static_cast<int>(value);
            return std::make_unique<OdeEngine>(scene, settings);
        };
    };
    return {engineName,
            "",
            {{"", {20}, make(true, true)},
             {"quick iterations", {5, 50, 200}, make(true, true)},
             {"quick substeps", {2, 4, 8, 16}, make(true, false)},
             {"dantzig substeps", {1, 2, 4, 8}, make(false, false)}}};
}

}  // namespace cairn
