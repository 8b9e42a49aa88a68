#include <cairn/demos/peers/peer.hpp>

namespace cairn {
namespace {

template <class S>
class CairnPeer final : public Peer {
public:
    CairnPeer(const Scene& scene, const WorldDef& def) : world_(def), ids_(populate(world_, scene).bodies) {}
    void step(double dt) override { world_.step(static_cast<S>(dt)); }
    Posed pose(std::size_t body) const override { return world_.pose(ids_[body]).template cast<double>(); }

private:
    World<S> world_;
    std::vector<BodyId> ids_;
};

}  // namespace

std::unique_ptr<Peer> makeCairnPeer(const Scene& scene, const std::string& solver, bool isFloat) {
    WorldDef def = scene.world;
    def.solver.name = solver;
    def.sleep.enabled = false;
    if (isFloat) {
        return std::make_unique<CairnPeer<float>>(scene, def);
    }
    return std::make_unique<CairnPeer<double>>(scene, def);
}

}  // namespace cairn
