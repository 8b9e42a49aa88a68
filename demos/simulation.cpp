#include "demos/simulation.hpp"

namespace cairn {

namespace {

template <class S>
class WorldSimulation : public Simulation {
public:
    explicit WorldSimulation(const Scene& scene) : world_(scene.world), placed_(populate(world_, scene)) {
        bodies_ = placed_.bodies;
        std::vector<JointId> joints = placed_.joints;
        for (const Deformable& deformable : placed_.deformables) {
            first_.push_back(bodies_.size());
            bodies_.insert(bodies_.end(), deformable.particles.begin(), deformable.particles.end());
            joints.insert(joints.end(), deformable.joints.begin(), deformable.joints.end());
            joints.insert(joints.end(), deformable.attachments.begin(), deformable.attachments.end());
        }
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            index_[bodies_[i]] = i;
        }
        for (std::size_t i = 0; i < joints.size(); ++i) {
            jointIndex_[joints[i]] = i;
        }
    }

    const StepReport& step(double dt) override { return world_.step(static_cast<S>(dt)); }
    const StepReport& report() const override { return world_.report(); }
    Posed pose(std::size_t body) const override { return world_.pose(bodies_[body]).template cast<double>(); }
    Vec3d linearVelocity(std::size_t body) const override {
        return world_.linearVelocity(bodies_[body]).template cast<double>();
    }
    Vec3d angularVelocity(std::size_t body) const override {
        return world_.angularVelocity(bodies_[body]).template cast<double>();
    }
    bool awake(std::size_t body) const override { return world_.awake(bodies_[body]); }
    double mass(std::size_t body) const override { return static_cast<double>(world_.mass(bodies_[body])); }
    void setPose(std::size_t body, const Posed& pose) override {
        world_.setPose(bodies_[body], pose.template cast<S>());
    }
    void setVelocity(std::size_t body, const Vec3d& linear, const Vec3d& angular) override {
        world_.setVelocity(bodies_[body], linear.template cast<S>(), angular.template cast<S>());
    }
    bool gyroscopic(std::size_t body) const override {
        if (!(world_.mass(bodies_[body]) > S(0)) || world_.def(bodies_[body]).particle) {
            return false;
        }
        const Mat3d inertia = world_.inertia(bodies_[body]).template cast<double>();
        const double mean = inertia.trace() / 3;
        return (inertia - mean * Mat3d::Identity()).cwiseAbs().maxCoeff() > 1e-6 * mean;
    }
    void setSolver(const SolverDef& solver) override { world_.setSolver(solver); }
    void setAccuracy(const AccuracyDef& accuracy) override { world_.setAccuracy(accuracy); }
    Diagnosis diagnose(double dt, double position) override { return world_.diagnose(static_cast<S>(dt), position); }
    std::size_t bodyCount() const override { return bodies_.size(); }
    std::size_t deformableCount() const override { return placed_.deformables.size(); }
    TriangleMesh surface(std::size_t deformable) const override {
        return surfaceOf(world_, placed_.deformables[deformable]);
    }
    const Skin& skin(std::size_t deformable) const override { return placed_.deformables[deformable].skin; }
    std::size_t firstParticle(std::size_t deformable) const override { return first_[deformable]; }
    std::size_t particleCount(std::size_t deformable) const override {
        return placed_.deformables[deformable].particles.size();
    }
    std::vector<ContactView> contacts() const override { return world_.contacts(); }
    std::vector<JointView> jointViews() const override { return world_.jointViews(); }
    std::vector<LockView> lockViews() const override { return world_.lockViews(); }
    std::vector<BodyErrorView> bodyErrors() const override { return world_.bodyErrors(); }
    std::size_t indexOf(BodyId id) const override { return index_.at(id); }
    std::size_t indexOf(JointId id) const override { return jointIndex_.at(id); }

private:
    World<S> world_;
    PopulatedScene<S> placed_;
    std::vector<BodyId> bodies_;      // particles included
    std::vector<std::size_t> first_;  // particle of each deformable, in bodies_
    std::map<BodyId, std::size_t> index_;
    std::map<JointId, std::size_t> jointIndex_;
};

}  // namespace

const char* name(Precision precision) {
    return precision == Precision::Float ? "float" : "double";
}

std::unique_ptr<Simulation> makeSimulation(const Scene& scene, Precision precision) {
    if (precision == Precision::Float) {
        return std::make_unique<WorldSimulation<float>>(scene);
    }
    return std::make_unique<WorldSimulation<double>>(scene);
}

}  // namespace cairn
