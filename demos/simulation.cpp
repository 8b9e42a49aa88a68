#include <cairn/demos/simulation.hpp>

namespace cairn {

namespace {

template <class S>
class WorldSimulation : public Simulation {
public:
    explicit WorldSimulation(const Scene& scene) : world_(scene.world), placed_(populate(world_, scene)) {
        for (std::size_t i = 0; i < placed_.bodies.size(); ++i) {
            index_[placed_.bodies[i]] = i;
        }
        for (std::size_t i = 0; i < placed_.joints.size(); ++i) {
            jointIndex_[placed_.joints[i]] = i;
        }
    }

    const StepReport& step(double dt) override { return world_.step(static_cast<S>(dt)); }
    const StepReport& report() const override { return world_.report(); }
    Posed pose(std::size_t body) const override { return world_.pose(placed_.bodies[body]).template cast<double>(); }
    Vec3d linearVelocity(std::size_t body) const override {
        return world_.linearVelocity(placed_.bodies[body]).template cast<double>();
    }
    Vec3d angularVelocity(std::size_t body) const override {
        return world_.angularVelocity(placed_.bodies[body]).template cast<double>();
    }
    bool awake(std::size_t body) const override { return world_.awake(placed_.bodies[body]); }
    double mass(std::size_t body) const override { return static_cast<double>(world_.mass(placed_.bodies[body])); }
    void setPose(std::size_t body, const Posed& pose) override {
        world_.setPose(placed_.bodies[body], pose.template cast<S>());
    }
    std::vector<ContactView> contacts() const override { return world_.contacts(); }
    std::vector<JointView> jointViews() const override { return world_.jointViews(); }
    std::size_t indexOf(BodyId id) const override { return index_.at(id); }
    std::size_t indexOf(JointId id) const override { return jointIndex_.at(id); }

private:
    World<S> world_;
    PopulatedScene<S> placed_;
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
