// Cairn itself, by what its users turn: a tolerance, sub-steps, iterations, the solver.
#include "command/compare/reference_engine_kit.hpp"

namespace cairn {
namespace {

template <class S>
class CairnEngine final : public ReferenceEngine {
public:
    CairnEngine(const Scene& scene, const WorldDef& def) : world_(def), ids_(populate(world_, scene).bodies) {}
    void step(double dt) override { world_.step(static_cast<S>(dt)); }
    Posed pose(std::size_t body) const override { return world_.pose(ids_[body]).template cast<double>(); }
    Vec3d velocity(std::size_t body) const override {
        return world_.linearVelocity(ids_[body]).template cast<double>();
    }

private:
    World<S> world_;
    std::vector<BodyId> ids_;
};

}  // namespace

Engine cairnEngine(bool isFloat) {
    using Change = void (*)(WorldDef&, double);
    const auto dial = [isFloat](std::string name, std::vector<double> values, const char* solver, Change change) {
        return Dial{std::move(name), std::move(values),
                    [=](const Scene& scene, double value) -> std::unique_ptr<ReferenceEngine> {
                        WorldDef def = scene.world;
                        def.sleep.enabled = false;
                        def.solver = solverNamed(solver, def.solver);
                        change(def, value);
                        if (isFloat) {
                            return std::make_unique<CairnEngine<float>>(scene, def);
                        }
                        return std::make_unique<CairnEngine<double>>(scene, def);
                    }};
    };
    const Change nothing = [](WorldDef&, double) {};
    const Change substeps = [](WorldDef& def, double value) {
        setField(def.solver, "substeps", static_cast<int>(value));
    };
    const Change iterations = [](WorldDef& def, double value) {
        setField(def.solver, "iterations", static_cast<int>(value));
    };
    const Change accuracy = [](WorldDef& def, double value) { def.accuracy.position = 1e-3 * value; };
    return {"cairn",
            "",
            {dial("", {0}, "auto", nothing), dial("accuracy, mm", {10, 1, 0.1, 0.01}, "auto", accuracy),
             dial("auto substeps", {2, 4, 8, 16}, "auto", substeps),
             dial("direct substeps", {1, 2, 4, 8}, "direct", substeps),
             dial("gauss_seidel substeps", {1, 2, 4, 8, 16, 32}, "gauss_seidel", substeps),
             dial("nncg iterations", {5, 10, 20, 50, 100}, "nncg", iterations),
             dial("avbd iterations", {2, 5, 10, 20, 50}, "avbd", iterations)}};
}

}  // namespace cairn
