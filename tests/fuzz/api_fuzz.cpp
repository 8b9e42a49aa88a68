// The public calls of a world, in any order and with any numbers, under every solver in both precisions. A call does
// what it says or throws InputError; after every step all numbers are finite, all ids that are told are of bodies and
// joints that are there, flags agree with what they stand for, and momentum is what was given.
#include "tests/fuzz/input.hpp"

#include <cairn/cairn.hpp>
#include <cairn/deformable.hpp>

#include <algorithm>
#include <optional>

namespace cairn::fuzz {
namespace {

constexpr std::size_t mostBodies = 10;
constexpr int mostCalls = 48;
constexpr int mostSteps = 8;

template <class S>
class Session {
public:
    explicit Session(Input input) : input_(input), world_(worldDef()) {}

    void run() {
        for (int call = 0; call < mostCalls && steps_ < mostSteps && !input_.isEmpty(); ++call) {
            attempt([&] { act(); });
        }
        attempt([&] { step(); });
    }

private:
    template <class Act>
    static void attempt(Act act) {
        try {
            act();
        } catch (const InputError& error) {
            claim(!error.field().empty() && !error.remedy().empty(), "an error says where and what to do");
        }
    }

    // The bytes that say how the session is come first.
    WorldDef worldDef() {
        const std::uint8_t how = input_.byte();
        isWild_ = (how & 1) != 0;
        isClosed_ = (how & 2) != 0;
        WorldDef def;
        def.solver = solverNamed(solverList()[input_.below(solverList().size())].name);
        solver_ = solverName(def.solver);
        def.gravity = isClosed_ ? Vec3d(Vec3d::Zero()) : Vec3d(0, -9.81, 0);
        def.sleep.enabled = (how & 4) != 0 && !isClosed_;
        def.narrowPhase = (how & 8) != 0 ? NarrowPhase::Fcl : NarrowPhase::Auto;
        if ((how & 16) != 0) {
            def.accuracy.position = 0.001;
            def.accuracy.maxSubdivisions = 4;
        }
        if (isWild_ && (how & 32) != 0) {
            WorldDef wild = def;
            wild.gravity = vector();
            wild.contactMargin = input_.anything();
            wild.continuousShare = input_.anything();
            wild.maxPushOutSpeed = input_.anything();
            wild.manifoldReuseDistance = input_.anything();
            try {
                World<S> tried(wild);
                return wild;
            } catch (const InputError&) {
                return def;
            }
        }
        return def;
    }

    double number() { return isWild_ ? input_.anything() : input_.within(-4, 4); }
    double positive(double low, double high) {
        return isWild_ && input_.byte() < 32 ? input_.anything() : input_.within(low, high);
    }
    Vec3d vector() {
        const double x = number();
        const double y = number();
        return {x, y, number()};
    }
    Vec3<S> vectorS() { return vector().template cast<S>(); }

    BodyId body() {
        if (bodies_.empty() || input_.byte() > 250) {
            return gone_.empty() ? BodyId{} : gone_[input_.below(gone_.size())];
        }
        return bodies_[input_.below(bodies_.size())];
    }
    JointId joint() {
        return joints_.empty() || input_.byte() > 250 ? JointId{} : joints_[input_.below(joints_.size())];
    }

    Shape shape() {
        Shape made;
        made.kind = static_cast<ShapeKind>(input_.below(isWild_ ? 12 : 6));
        made.size = Vec3d(positive(0.05, 1), positive(0.05, 1), positive(0.05, 1));
        if (made.kind == ShapeKind::HalfSpace) {
            made.size = Vec3d::UnitY();
            made.offset = number();
        }
        if (input_.byte() < 40) {
            made.pose = {input_.vectorWithin(0.5), input_.rotation()};
        }
        made.material.friction = positive(0, 1);
        made.material.restitution = input_.byte() < 64 ? positive(0, 1) : 0;
        if (input_.byte() < 32) {
            made.material.rollingFriction = positive(0, 0.1);
            made.material.spinningFriction = positive(0, 0.1);
        }
        return made;
    }

    void addBody() {
        if (bodies_.size() >= mostBodies) {
            return;
        }
        BodyDef def;
        for (std::size_t k = input_.byte() < 230 ? 1 : input_.below(4); k > 0; --k) {
            def.shapes.push_back(shape());
        }
        def.position = vector();
        def.rotation = input_.rotation();
        def.linearVelocity = vector();
        def.angularVelocity = vector();
        def.mass = input_.byte() < 128 ? positive(0.1, 100) : 0;
        const std::uint8_t kind = input_.byte();
        if (!isClosed_) {
            def.type = kind < 150 ? BodyType::Dynamic : kind < 220 ? BodyType::Static : BodyType::Kinematic;
            def.lockLinear[kind % 3] = kind % 16 == 5;
            def.lockAngular[kind % 3] = kind % 16 == 7;
            def.linearDamping = kind % 8 == 1 ? positive(0, 2) : 0;
            def.angularDamping = kind % 8 == 2 ? positive(0, 2) : 0;
            def.gravityScale = kind % 8 == 3 ? number() : 1;
        }
        if (isWild_ && kind % 8 == 4) {
            def.inertia = vector();
        }
        if (kind % 16 == 9) {
            def.particle = true;
            def.angularVelocity.setZero();
            def.shapes.resize(std::min<std::size_t>(def.shapes.size(), 1));
        }
        def.continuous = static_cast<Continuous>(input_.below(3));
        def.tolerance = kind % 32 == 11 ? positive(0, 0.01) : 0;
        def.awake = kind % 16 != 13;
        bodies_.push_back(world_.add(def));
    }

    template <class Def>
    void addJointOf(Def def) {
        def.a = body();
        def.b = body();
        const Vec3d place = vector();
        const Vec3d axis = vector();
        const double first = number();
        const double second = number();
        if constexpr (requires { def.anchor; }) {
            def.anchor = place;
        }
        if constexpr (requires { def.anchorA; }) {
            def.anchorA = place;
            def.anchorB = axis;
        }
        if constexpr (requires { def.axis; }) {
            def.axis = axis;
        }
        if constexpr (requires { def.c; }) {
            def.c = body();
            def.d = body();
        }
        if (input_.flag()) {
            if constexpr (requires { def.lower; }) {
                def.lower = first;
                def.upper = second;
            }
            if constexpr (requires { def.motorSpeed; }) {
                def.motorSpeed = first;
            }
            if constexpr (requires { def.motorTorque; }) {
                def.motorTorque = std::abs(second);
            }
        }
        if (input_.byte() < 64) {
            if constexpr (requires { def.softness; }) {
                def.softness.frequency = positive(0, 10);
                def.softness.dampingRatio = positive(0, 2);
            }
        }
        def.collide = input_.flag();
        joints_.push_back(world_.addJoint(def));
    }
    template <std::size_t I = 0>
    void addJointOfKind(std::size_t kind) {
        if constexpr (I < std::variant_size_v<JointDef>) {
            if (kind == I) {
                addJointOf(std::variant_alternative_t<I, JointDef>{});
            } else {
                addJointOfKind<I + 1>(kind);
            }
        }
    }

    void addJointOfAnyKind() { addJointOfKind(input_.below(std::variant_size_v<JointDef>)); }

    void setSolver() {
        const SolverInfo& info = solverList()[input_.below(solverList().size())];
        SolverDef def = solverNamed(info.name);
        if (input_.flag() && !info.fields.empty()) {
            const std::string_view field = info.fields[input_.below(info.fields.size())];
            const std::array<SolverValue, 3> values = {static_cast<int>(input_.below(8)), number(), input_.flag()};
            setField(def, field, values[input_.below(values.size())]);
        }
        world_.setSolver(def);
        solver_ = info.name;
    }

    void setRules() {
        if (input_.flag()) {
            return world_.setMotor(joint(), number(), number());
        }
        AccuracyDef accuracy;
        accuracy.position = input_.flag() ? positive(0, 0.01) : 0;
        accuracy.velocity = input_.flag() ? positive(0, 0.1) : 0;
        accuracy.maxSubdivisions = static_cast<int>(input_.below(9));
        accuracy.qualityLevel = static_cast<int>(input_.below(14)) - 1;
        accuracy.coulomb = input_.flag();
        world_.setAccuracy(accuracy);
    }

    void addRope() {
        RopeDef rope;
        rope.from = vector();
        rope.to = vector();
        rope.segments = static_cast<int>(input_.below(5));
        rope.radius = positive(0.01, 0.2);
        rope.stiffness = input_.flag() ? positive(1, 1000) : unlimited;
        rope.damping = positive(0, 0.1);
        rope.airDamping = positive(0, 1);
        if (input_.flag()) {
            rope.attachments = {{.body = body(), .position = vector(), .radius = positive(0, 1)}};
        }
        const Deformable made = addDeformable(world_, rope);
        bodies_.insert(bodies_.end(), made.particles.begin(), made.particles.end());
        joints_.insert(joints_.end(), made.joints.begin(), made.joints.end());
        wasDamped_ = true;
        surfaceOf(world_, made);
    }

    void removeBody() {
        const BodyId id = body();
        world_.remove(id);
        std::erase(bodies_, id);
        std::erase_if(joints_, [&](JointId j) { return !world_.contains(j); });
        gone_.push_back(id);
        claim(!world_.contains(id), "what was removed is gone");
    }

    void push() {
        const BodyId id = body();
        switch (input_.below(5)) {
            case 0:
                world_.applyForce(id, vectorS());
                break;
            case 1:
                world_.applyForce(id, vectorS(), vectorS());
                break;
            case 2:
                world_.applyTorque(id, vectorS());
                break;
            case 3:
                world_.applyImpulse(id, vectorS(), vectorS());
                break;
            default:
                world_.setVelocity(id, vectorS(), vectorS());
        }
        wasPushed_ = true;
    }

    void ask() {
        const WorldQuery query = world_.query();
        const std::vector<Shape> shapes = {shape()};
        const Probe probe{shapes, {vector(), input_.rotation()}};
        const auto check = [&](BodyId id) { claim(world_.contains(id), "who answers a query is there"); };
        switch (input_.below(6)) {
            case 0:
                for (const auto& hit : query.rayCastAll({.origin = vector(), .direction = vector()})) {
                    check(hit.body);
                    claim(hit.distance >= 0 && hit.normal.allFinite(), "a ray's hit is somewhere");
                }
                break;
            case 1:
                for (const auto& hit : query.shapeCastAll(probe, vector())) {
                    check(hit.body);
                    claim(hit.fraction >= 0 && hit.fraction <= 1, "a cast meets something on its way");
                }
                break;
            case 2:
                for (const BodyId id : query.overlapping(probe)) {
                    check(id);
                }
                break;
            case 3:
                for (const BodyId id : query.containing(vector())) {
                    check(id);
                }
                break;
            case 4:
                if (const auto nearest = query.closest(probe)) {
                    check(nearest->body);
                    claim(!std::isnan(nearest->distance), "a distance is a number");
                }
                break;
            default:
                world_.diagnose(S(1.0 / 60));
        }
    }

    void act() {
        switch (input_.below(16)) {
            case 0:
            case 1:
            case 2:
            case 3:
                return addBody();
            case 4:
                return bodies_.size() < mostBodies && input_.byte() < 64 ? addRope() : addJointOfAnyKind();
            case 5:
                return addJointOfAnyKind();
            case 6:
                return removeBody();
            case 7: {
                const JointId id = joint();
                world_.remove(id);
                std::erase(joints_, id);
                return;
            }
            case 8:
                return world_.setPose(body(), {vectorS(), input_.rotation().cast<S>()});
            case 9:
            case 10:
                return push();
            case 11:
                return ask();
            case 12:
                return setSolver();
            case 13:
                return setRules();
            default:
                return step();
        }
    }

    Vec3d momentum(double& size) const {
        Vec3d sum = Vec3d::Zero();
        size = 0;
        for (const BodyId id : bodies_) {
            const Vec3d one = static_cast<double>(world_.mass(id)) * world_.linearVelocity(id).template cast<double>();
            sum += one;
            size += one.norm();
        }
        return sum;
    }

    void step() {
        ++steps_;
        double sizeBefore = 0;
        double sizeAfter = 0;
        const Vec3d before = momentum(sizeBefore);
        const S dt = isWild_ && input_.byte() < 32 ? static_cast<S>(input_.anything()) : S(1.0 / 60);
        const StepReport report = world_.step(dt);
        if ((report.flags & FlagRefused) != 0) {
            return;
        }
        checkBodies();
        checkReport(report);
        const Vec3d after = momentum(sizeAfter);
        if (isClosed_ && !isWild_ && !wasPushed_ && !wasDamped_ && report.ok() && report.counts.ccdHeldBodies == 0 &&
            isBalanced()) {
            const double share = std::is_same_v<S, double> ? 1e-9 : 1e-4;
            claim((after - before).norm() <= share * (sizeBefore + sizeAfter) + share,
                  "a closed world keeps its momentum");
        }
        wasPushed_ = false;
    }

    // Those that push body after body keep momentum only as far as they have converged.
    bool isBalanced() const { return solver_ != "vbd" && solver_ != "avbd"; }

    void checkBodies() const {
        claim(world_.bodies().size() == bodies_.size(), "as many bodies as were added");
        for (const BodyId id : bodies_) {
            claim(world_.contains(id), "a body stays until it is removed");
            const Pose<S> pose = world_.pose(id);
            claim(pose.isFinite(), "a body is somewhere");
            claim(std::abs(pose.rotation.norm() - S(1)) < S(1e-3), "a rotation is one");
            claim(world_.linearVelocity(id).allFinite() && world_.angularVelocity(id).allFinite(), "a speed is finite");
        }
    }

    void checkReport(const StepReport& report) const {
        claim((report.flags & FlagNonFinite) != 0 ? !report.nonFinite.empty() : report.nonFinite.empty(),
              "who went non-finite is named, and the flag says that some did");
        for (const BodyId id : report.nonFinite) {
            claim(world_.contains(id), "who went non-finite is there");
        }
        claim(report.counts.bodies == static_cast<int>(bodies_.size()), "bodies are counted");
        claim(report.error.maxPenetration >= 0 && report.error.maxJointGap >= 0, "errors are numbers");
        claim(!std::isnan(report.kineticEnergy) && !std::isnan(report.potentialEnergy), "energy is a number");
        for (const ContactView& contact : world_.contacts()) {
            claim(world_.contains(contact.a) && world_.contains(contact.b), "who touches is there");
            claim(contact.point.allFinite() && std::abs(contact.normal.norm() - 1) < 1e-3, "a contact is somewhere");
            claim(contact.impulse.allFinite(), "an impulse is finite");
        }
        for (const JointView& view : world_.jointViews()) {
            claim(world_.contains(view.id) && world_.contains(view.a) && world_.contains(view.b), "joints are there");
            claim(!std::isnan(view.gap) && !std::isnan(view.angle), "a gap is a number");
        }
        for (const BodyErrorView& view : world_.bodyErrors()) {
            claim(world_.contains(view.id), "who errs is there");
        }
    }

    Input input_;
    bool isWild_ = false;
    bool isClosed_ = false;
    bool wasPushed_ = false;
    bool wasDamped_ = false;
    int steps_ = 0;
    std::string solver_;
    World<S> world_;
    std::vector<BodyId> bodies_;
    std::vector<BodyId> gone_;
    std::vector<JointId> joints_;
};

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    cairn::fuzz::Input input(data, size);
    if (input.flag()) {
        cairn::fuzz::Session<float>(input).run();
    } else {
        cairn::fuzz::Session<double>(input).run();
    }
    return 0;
}
