// Scene -> MuJoCo model, by an MJCF text. Joints that hang together as a tree are MuJoCo's own, in joint coordinates,
// so that they cannot open; a ball or a weld that closes a loop is an equality constraint.
//
// MuJoCo's contacts are soft by design; they are set as hard as its manual lets a careful user set them: the time
// constant of solref at the least that it takes, two steps, with critical damping; solimp 0.99 to 0.999 in place of
// 0.9 to 0.95 (of 0.95 to 0.99 too a load sinks in farther); elliptic cones, and impratio 10 against slip. At two steps
// what slides chatters and stops elsewhere by 7 %: hence a dial with four. "softness as it comes" is without all that.
#include "base/so3.hpp"
#include "command/compare/reference_engine_kit.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace cairn {
namespace {

constexpr const char* engineName = "mujoco";

struct MujocoSettings {
    const char* solver = "Newton";
    const char* integrator = "Euler";
    int iterations = 100;  // its default: at most; it stops at a tolerance of 1e-8
    int substeps = 1;
    int timeConstant = 2;  // of solref, steps; 0: contacts as MuJoCo's defaults say
};

[[noreturn]] void onError(const char* words) {
    throw InputError("engine", engineName, std::string("it gave up: ") + words);
}

void onWarning(const char*) {}  // they are counted in mjData::warning

std::string text(double x) {
    std::ostringstream out;
    out.precision(17);
    out << x;
    return out.str();
}
std::string text(const Vec3d& v) {
    return text(v.x()) + " " + text(v.y()) + " " + text(v.z());
}
std::string text(const Quatd& q) {
    return text(q.w()) + " " + text(q.x()) + " " + text(q.y()) + " " + text(q.z());
}
std::string attribute(const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + value + "\"";
}
std::string placed(const Posed& pose) {
    return attribute("pos", text(pose.position)) + attribute("quat", text(pose.rotation));
}
std::string frictionText(double mu) {
    // Sliding; those of spinning and rolling are for cones of more dimensions than three.
    return text(mu) + " 0.005 0.0001";
}

// Writes a scene as MJCF. Body i is called b<i>, its k-th geom g<i>_<k>.
class MjcfWriter {
public:
    MjcfWriter(const Scene& scene, const MujocoSettings& settings) : scene_(scene), settings_(settings) {
        refuseDeformables(engineName, scene);
        for (const BodyDef& body : scene.bodies) {
            refuse(body);
        }
        findTrees();
    }

    std::string write() {
        std::string bodies;
        for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
            if (scene_.bodies[i].type == BodyType::Static) {
                bodies += geoms(i, start(i));
            } else if (links_[i].parent == none) {
                bodies += body(i);
            }
        }
        const double h = scene_.dt / settings_.substeps;
        std::string options = attribute("timestep", text(h)) + attribute("gravity", text(scene_.world.gravity)) +
                              attribute("solver", settings_.solver) + attribute("integrator", settings_.integrator) +
                              attribute("iterations", std::to_string(settings_.iterations));
        std::string softness;
        if (settings_.timeConstant > 0) {
            options += attribute("cone", "elliptic") + attribute("impratio", "10");
            softness =
                attribute("solref", text(settings_.timeConstant * h) + " 1") + attribute("solimp", "0.99 0.999 0.001");
        }
        const std::string pairs = contactPairs();
        const int contacts = 64 + 10 * geomCount_;
        const int rows = 3 * contacts + 6 * static_cast<int>(scene_.joints.size());
        return "<mujoco><compiler angle=\"radian\" coordinate=\"local\" boundmass=\"0\"/><size" +
               attribute("nconmax", std::to_string(contacts)) + attribute("njmax", std::to_string(rows)) + "/><option" +
               options + "><flag multiccd=\"enable\"/></option><default><geom" + softness + "/><pair" + softness +
               "/><equality" + softness + "/></default><asset>" + assets_ + "</asset><worldbody>" + bodies +
               "</worldbody><contact>" + pairs + "</contact><equality>" + loops_ + "</equality></mujoco>";
    }

    // The forces that the scene's joints stand for.
    const std::vector<Push>& pushes() const { return pushes_; }

private:
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

    struct Link {
        std::size_t parent = none;  // body that it hangs on by a joint; none: a free body, or hung on what is static
        const SceneJoint* joint = nullptr;
    };

    // At the centre of mass: MuJoCo's steps in joint coordinates err where a free body's frame is elsewhere.
    Posed start(std::size_t body) const {
        const BodyDef& def = scene_.bodies[body];
        return Posed{def.position, def.rotation.normalized()} * Posed{massOf(def).centre, Quatd::Identity()};
    }

    static void refuse(const BodyDef& body) {
        const auto locked = [](const std::array<bool, 3>& lock) { return lock[0] || lock[1] || lock[2]; };
        if (body.type == BodyType::Kinematic) {
            noCounterpart(engineName, "a kinematic body");
        }
        if (locked(body.lockLinear) || locked(body.lockAngular)) {
            noCounterpart(engineName, "a locked axis");
        }
        if (body.linearDamping > 0 || body.angularDamping > 0 || body.gravityScale != 1) {
            noCounterpart(engineName, "damping, or a gravity of one body's own");
        }
        for (const Shape& shape : body.shapes) {
            if (shape.material.restitution > 0) {
                noCounterpart(engineName, "restitution");
            }
        }
    }

    static bool hangs(const JointDef& def) {
        return std::holds_alternative<BallDef>(def) || std::holds_alternative<HingeDef>(def) ||
               std::holds_alternative<SliderDef>(def) || std::holds_alternative<WeldDef>(def);
    }

    // From what is static outwards, then from each body that nothing has reached yet.
    void findTrees() {
        links_.resize(scene_.bodies.size());
        std::vector<std::vector<const SceneJoint*>> jointsOf(scene_.bodies.size());
        for (const SceneJoint& joint : scene_.joints) {
            if (const std::optional<Push> push = pushOf(scene_, joint)) {
                pushes_.push_back(*push);
                continue;
            }
            std::visit(
                [&](const auto& def) {
                    refuseSoft(engineName, def);
                    if (!hangs(joint.def)) {
                        noCounterpart(engineName, std::string("a joint ") + def.typeName);
                    }
                    jointsOf[def.a.index].push_back(&joint);
                    jointsOf[def.b.index].push_back(&joint);
                },
                joint.def);
        }
        std::vector<bool> reached(scene_.bodies.size(), false);
        std::vector<const SceneJoint*> used;
        const auto spread = [&](std::vector<std::size_t> wave) {
            while (!wave.empty()) {
                std::vector<std::size_t> next;
                for (const std::size_t body : wave) {
                    for (const SceneJoint* joint : jointsOf[body]) {
                        const auto [a, b] = ends(*joint);
                        const std::size_t other = a == body ? b : a;
                        if (!reached[other]) {
                            reached[other] = true;
                            const bool fixed = scene_.bodies[body].type == BodyType::Static;
                            links_[other] = {fixed ? none : body, joint};
                            used.push_back(joint);
                            next.push_back(other);
                        }
                    }
                }
                wave = std::move(next);
            }
        };
        std::vector<std::size_t> fixed;
        for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
            if (scene_.bodies[i].type == BodyType::Static) {
                reached[i] = true;
                fixed.push_back(i);
            }
        }
        spread(fixed);
        for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
            if (!reached[i]) {
                reached[i] = true;
                spread({i});
            }
        }
        for (const std::vector<const SceneJoint*>& list : jointsOf) {
            for (const SceneJoint* joint : list) {
                if (std::find(used.begin(), used.end(), joint) == used.end()) {
                    used.push_back(joint);
                    closeLoop(*joint);
                }
            }
        }
    }

    static std::pair<std::size_t, std::size_t> ends(const SceneJoint& joint) {
        return std::visit([](const auto& def) { return std::pair<std::size_t, std::size_t>(def.a.index, def.b.index); },
                          joint.def);
    }

    void closeLoop(const SceneJoint& joint) {
        const auto [a, b] = ends(joint);
        // Body 1 must be one of MuJoCo's own; what is static is its world.
        const bool swapped = scene_.bodies[a].type == BodyType::Static;
        const std::size_t first = swapped ? b : a;
        const std::size_t second = swapped ? a : b;
        std::string bodies = attribute("body1", "b" + std::to_string(first));
        if (scene_.bodies[second].type != BodyType::Static) {
            bodies += attribute("body2", "b" + std::to_string(second));
        }
        if (const auto* ball = std::get_if<BallDef>(&joint.def)) {
            loops_ += "<connect" + bodies + attribute("anchor", text(start(first).inverse() * ball->anchor)) + "/>";
        } else if (std::holds_alternative<WeldDef>(joint.def)) {
            loops_ += "<weld" + bodies + "/>";
        } else {
            noCounterpart(engineName, "a loop that a hinge or a slider closes");
        }
    }

    std::string body(std::size_t i) {
        const BodyDef& def = scene_.bodies[i];
        const Link& link = links_[i];
        if (link.joint != nullptr && !(def.linearVelocity.isZero() && def.angularVelocity.isZero())) {
            noCounterpart(engineName, "a jointed body's velocity at the start");
        }
        const Posed pose = link.parent == none ? start(i) : relativePose(start(link.parent), start(i));
        const MassProperties mass = massOf(def);
        const Mat3d& m = mass.inertia;
        std::string out = "<body" + attribute("name", "b" + std::to_string(i)) + placed(pose) + ">";
        out += link.joint == nullptr ? "<freejoint/>" : hinged(i);
        out += "<inertial" + attribute("pos", "0 0 0") + attribute("mass", text(mass.mass));
        if (m.isDiagonal(1e-12)) {
            out += attribute("diaginertia", text(Vec3d(m.diagonal()))) + "/>";
        } else {
            out += attribute("fullinertia", text(Vec3d(m.diagonal())) + " " + text(Vec3d(m(0, 1), m(0, 2), m(1, 2)))) +
                   "/>";
        }
        out += geoms(i, {-mass.centre, Quatd::Identity()});
        for (std::size_t k = 0; k < links_.size(); ++k) {
            if (links_[k].parent == i) {
                out += body(k);
            }
        }
        return out + "</body>";
    }

    // The joint by which body i hangs, in its own frame.
    std::string hinged(std::size_t i) const {
        const JointDef& def = links_[i].joint->def;
        const Posed own = start(i).inverse();
        // Angles and ways are those of b against a.
        const double sign = ends(*links_[i].joint).second == i ? 1 : -1;
        const auto axial = [&](const char* type, const auto& joint, double motor) {
            if (motor > 0 || std::isfinite(joint.lower) != std::isfinite(joint.upper)) {
                noCounterpart(engineName, "a joint's motor, or a limit on one side");
            }
            std::string out = std::string("<joint") + attribute("type", type) +
                              attribute("pos", text(own * joint.anchor)) +
                              attribute("axis", text(Vec3d(sign * (own.rotation * joint.axis.normalized()))));
            if (std::isfinite(joint.lower)) {
                out += attribute("limited", "true") + attribute("range", text(joint.lower) + " " + text(joint.upper));
            }
            return out + "/>";
        };
        if (const auto* ball = std::get_if<BallDef>(&def)) {
            return "<joint type=\"ball\"" + attribute("pos", text(own * ball->anchor)) + "/>";
        }
        if (const auto* hinge = std::get_if<HingeDef>(&def)) {
            return axial("hinge", *hinge, hinge->motorTorque);
        }
        if (const auto* slider = std::get_if<SliderDef>(&def)) {
            return axial("slide", *slider, slider->motorForce);
        }
        return "";  // a weld: MuJoCo's bodies are fixed to their parents unless a joint says otherwise
    }

    std::string geoms(std::size_t i, const Posed& frame) {
        std::string out;
        const std::vector<Shape>& shapes = scene_.bodies[i].shapes;
        for (std::size_t k = 0; k < shapes.size(); ++k) {
            out += geom(shapes[k], frame * shapes[k].pose, "g" + std::to_string(i) + "_" + std::to_string(k));
        }
        return out;
    }
    std::string geom(const Shape& shape, Posed pose, const std::string& geomName) {
        ++geomCount_;
        std::string form;
        const std::string standing = text(shape.size.x()) + " " + text(shape.size.y());
        // MuJoCo's capsules and cylinders stand along z, as its planes face it.
        const Posed upright{Vec3d::Zero(), turnBetween<double>(Vec3d::UnitZ(), Vec3d::UnitY())};
        switch (shape.kind) {
            case ShapeKind::Sphere:
                form = attribute("type", "sphere") + attribute("size", text(shape.size.x()));
                break;
            case ShapeKind::Box:
                form = attribute("type", "box") + attribute("size", text(shape.size));
                break;
            case ShapeKind::Ellipsoid:
                form = attribute("type", "ellipsoid") + attribute("size", text(shape.size));
                break;
            case ShapeKind::Capsule:
                form = attribute("type", "capsule") + attribute("size", standing);
                pose = pose * upright;
                break;
            case ShapeKind::Cylinder:
                form = attribute("type", "cylinder") + attribute("size", standing);
                pose = pose * upright;
                break;
            case ShapeKind::HalfSpace:
                form = attribute("type", "plane") + attribute("size", "0 0 1");
                pose = pose * Posed{shape.offset * shape.size, turnBetween<double>(Vec3d::UnitZ(), shape.size)};
                break;
            case ShapeKind::Hull: {
                std::string vertices;
                for (const Vec3d& v : bareSurface(shape).vertices) {
                    vertices += text(v) + " ";
                }
                assets_ += "<mesh" + attribute("name", geomName) + attribute("vertex", vertices) + "/>";
                form = attribute("type", "mesh") + attribute("mesh", geomName);
                break;
            }
            case ShapeKind::Cone:
            case ShapeKind::Mesh:
            case ShapeKind::HeightField:
                noCounterpart(engineName, std::string("a shape ") + name(shape.kind));
        }
        const double mu = shape.material.friction;
        return "<geom" + attribute("name", geomName) + form + placed(pose) + attribute("condim", mu > 0 ? "3" : "1") +
               attribute("friction", frictionText(mu)) + "/>";
    }

    // MuJoCo takes the greater friction of two geoms: where Cairn's law says otherwise, the pair is told its own.
    std::string contactPairs() const {
        const std::vector<BodyPair> joined = joinedPairs(scene_);
        std::string out;
        for (std::size_t a = 0; a < scene_.bodies.size(); ++a) {
            for (std::size_t b = a + 1; b < scene_.bodies.size(); ++b) {
                for (std::size_t i = 0; i < scene_.bodies[a].shapes.size(); ++i) {
                    for (std::size_t k = 0; k < scene_.bodies[b].shapes.size(); ++k) {
                        const Material& one = scene_.bodies[a].shapes[i].material;
                        const Material& other = scene_.bodies[b].shapes[k].material;
                        const double mu = frictionOf(one, other);
                        if (mu == std::max(one.friction, other.friction) || !mayCollide(scene_, joined, a, b)) {
                            continue;
                        }
                        out += "<pair" + attribute("geom1", "g" + std::to_string(a) + "_" + std::to_string(i)) +
                               attribute("geom2", "g" + std::to_string(b) + "_" + std::to_string(k)) +
                               attribute("condim", mu > 0 ? "3" : "1") +
                               attribute("friction", text(mu) + " " + text(mu) + " 0.005 0.0001 0.0001") + "/>";
                    }
                }
            }
        }
        return out;
    }

    const Scene& scene_;
    const MujocoSettings& settings_;
    std::vector<Link> links_;  // of each body
    std::vector<Push> pushes_;
    std::string assets_;
    std::string loops_;
    int geomCount_ = 0;
};

class MujocoEngine final : public ReferenceEngine {
public:
    MujocoEngine(const Scene& scene, const MujocoSettings& settings)
        : scene_(scene), substeps_(settings.substeps), joined_(joinedPairs(scene)) {
        mju_user_error = onError;
        mju_user_warning = onWarning;
        MjcfWriter writer(scene, settings);
        load(writer.write());
        data_.reset(mj_makeData(model_.get()));
        bodies_.resize(scene.bodies.size(), -1);
        geomBodies_.resize(static_cast<std::size_t>(model_->ngeom));
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            const BodyDef& def = scene.bodies[i];
            centres_.push_back(massOf(def).centre);
            if (def.type != BodyType::Static) {
                bodies_[i] = mj_name2id(model_.get(), mjOBJ_BODY, ("b" + std::to_string(i)).c_str());
                setVelocity(bodies_[i], def);
            }
            for (std::size_t k = 0; k < def.shapes.size(); ++k) {
                const std::string geom = "g" + std::to_string(i) + "_" + std::to_string(k);
                geomBodies_[static_cast<std::size_t>(mj_name2id(model_.get(), mjOBJ_GEOM, geom.c_str()))] = i;
            }
        }
        for (const Push& push : writer.pushes()) {
            mju_copy3(data_->xfrc_applied + 6 * bodies_[push.body], push.force.data());
        }
        mj_forward(model_.get(), data_.get());
    }

    void step(double) override {
        stepping = this;
        mjcb_contactfilter = [](const mjModel*, mjData*, int a, int b) { return stepping->refuses(a, b) ? 1 : 0; };
        for (int k = 0; k < substeps_; ++k) {
            mj_step(model_.get(), data_.get());
        }
        mjcb_contactfilter = nullptr;
        for (const mjtWarning full : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL}) {
            if (data_->warning[full].number > 0) {
                throw InputError("engine", engineName, "its room for contacts is full: choose a smaller scene");
            }
        }
        // Poses lie behind by the last sub-step's move.
        mj_kinematics(model_.get(), data_.get());
    }

    Posed pose(std::size_t body) const override {
        const int id = bodies_[body];
        if (id < 0) {
            return {scene_.bodies[body].position, scene_.bodies[body].rotation.normalized()};
        }
        if (wentBad()) {
            return {Vec3d::Constant(std::numeric_limits<double>::quiet_NaN()), Quatd::Identity()};
        }
        const mjtNum* p = data_->xpos + 3 * id;
        const mjtNum* q = data_->xquat + 4 * id;
        const Quatd turn = Quatd(q[0], q[1], q[2], q[3]).normalized();
        return {Vec3d(p[0], p[1], p[2]) - turn * centres_[body], turn};
    }

    Vec3d velocity(std::size_t body) const override {
        const int id = bodies_[body];
        if (id < 0) {
            return Vec3d::Zero();
        }
        mj_comPos(model_.get(), data_.get());
        mj_comVel(model_.get(), data_.get());
        std::array<mjtNum, 6> v{};  // turning, then moving, at the centre of mass
        mj_objectVelocity(model_.get(), data_.get(), mjOBJ_BODY, id, v.data(), 0);
        return {v[3], v[4], v[5]};
    }

private:
    struct DeleteModel {
        void operator()(mjModel* model) const { mj_deleteModel(model); }
    };
    struct DeleteData {
        void operator()(mjData* data) const { mj_deleteData(data); }
    };

    void load(const std::string& mjcf) {
        constexpr const char* file = "scene.xml";
        const auto vfs = std::make_unique<mjVFS>();
        mj_defaultVFS(vfs.get());
        mj_makeEmptyFileVFS(vfs.get(), file, static_cast<int>(mjcf.size()));
        std::copy(mjcf.begin(), mjcf.end(), static_cast<char*>(vfs->filedata[mj_findFileVFS(vfs.get(), file)]));
        char words[1000] = "";
        model_.reset(mj_loadXML(file, vfs.get(), words, sizeof words));
        mj_deleteVFS(vfs.get());
        if (!model_) {
            throw InputError("scene", scene_.name, std::string("MuJoCo refuses it: ") + words);
        }
    }

    void setVelocity(int id, const BodyDef& def) {
        const int dof = model_->body_dofadr[id];
        if (model_->body_dofnum[id] != 6) {
            return;
        }
        const Vec3d omega = def.rotation.normalized().conjugate() * def.angularVelocity;  // body axes
        mju_copy3(data_->qvel + dof, def.linearVelocity.data());
        mju_copy3(data_->qvel + dof + 3, omega.data());
    }

    bool refuses(int a, int b) const {
        return !mayCollide(scene_, joined_, geomBodies_[static_cast<std::size_t>(a)],
                           geomBodies_[static_cast<std::size_t>(b)]);
    }

    // MuJoCo starts the scene anew where numbers leave their bounds.
    bool wentBad() const {
        for (const mjtWarning bad : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
            if (data_->warning[bad].number > 0) {
                return true;
            }
        }
        return false;
    }

    // MuJoCo's hook for filters is a global one without a pointer of the user's.
    static thread_local const MujocoEngine* stepping;

    const Scene scene_;
    const int substeps_;
    const std::vector<BodyPair> joined_;
    std::unique_ptr<mjModel, DeleteModel> model_;
    std::unique_ptr<mjData, DeleteData> data_;
    std::vector<int> bodies_;              // MuJoCo's, of each of the scene's; -1: static
    std::vector<Vec3d> centres_;           // of mass, of the scene's bodies in their frames
    std::vector<std::size_t> geomBodies_;  // the scene's body of each geom
};

thread_local const MujocoEngine* MujocoEngine::stepping = nullptr;

}  // namespace

Engine mujocoEngine() {
    const auto dial = [](std::string name, std::vector<double> values, MujocoSettings settings,
                         int MujocoSettings::*turned) {
        return Dial{std::move(name), std::move(values),
                    [=](const Scene& scene, double value) -> std::unique_ptr<ReferenceEngine> {
                        MujocoSettings set = settings;
                        set.*turned = static_cast<int>(value);
                        return std::make_unique<MujocoEngine>(scene, set);
                    }};
    };
    return {engineName,
            "",
            {dial("", {1}, {}, &MujocoSettings::substeps),
             dial("Newton iterations", {2, 5, 20}, {}, &MujocoSettings::iterations),
             dial("CG iterations", {20, 100}, {.solver = "CG"}, &MujocoSettings::iterations),
             dial("PGS iterations", {20, 100}, {.solver = "PGS"}, &MujocoSettings::iterations),
             dial("substeps", {2, 4, 8, 16}, {}, &MujocoSettings::substeps),
             dial("substeps, softer", {1, 4}, {.timeConstant = 4}, &MujocoSettings::substeps),
             dial("Runge-Kutta substeps", {1, 4}, {.integrator = "RK4"}, &MujocoSettings::substeps),
             dial("softness as it comes, substeps", {1, 4}, {.timeConstant = 0}, &MujocoSettings::substeps)}};
}

}  // namespace cairn
