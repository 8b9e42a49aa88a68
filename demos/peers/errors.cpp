#include <cairn/demos/peers/errors.hpp>

#include <algorithm>

namespace cairn {
namespace {

Posed start(const BodyDef& body) {
    return {body.position, body.rotation.normalized()};
}

}  // namespace

ErrorMeter::ErrorMeter(const Scene& scene) : scene_(scene) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& body = scene.bodies[i];
        if (!body.shapes.empty()) {
            broadPhase_.add(static_cast<ProxyId>(i), bounds(body.shapes, start(body)), body.type == BodyType::Static);
        }
    }
    for (const SceneJoint& joint : scene.joints) {
        std::visit(
            [&](const auto& def) {
                if (!def.collide) {
                    joined_.push_back({std::min(def.a.index, def.b.index), std::max(def.a.index, def.b.index)});
                }
                if constexpr (requires { def.softness; }) {
                    // What gives way by its nature has no error here.
                    if (def.softness.compliance > 0 || def.softness.frequency > 0) {
                        return;
                    }
                }
                Anchors anchors{def.a.index, def.b.index, Vec3d::Zero(), Vec3d::Zero(), &joint.def};
                const Posed toA = start(scene.bodies[def.a.index]).inverse();
                const Posed toB = start(scene.bodies[def.b.index]).inverse();
                if constexpr (requires {
                                  def.anchorA;
                                  def.lower;
                              }) {
                    anchors.onA = toA * def.anchorA;
                    anchors.onB = toB * def.anchorB;
                    const double length = (def.anchorB - def.anchorA).norm();
                    anchors.lower = def.lower < 0 ? length : def.lower;
                    anchors.upper = def.upper < 0 ? length : def.upper;
                } else if constexpr (requires { def.anchor; }) {
                    anchors.onA = toA * def.anchor;
                    anchors.onB = toB * def.anchor;
                } else {
                    return;
                }
                if constexpr (requires { def.motorForce; }) {
                    anchors.axis = toA.rotation * def.axis.normalized();
                }
                anchors_.push_back(anchors);
            },
            joint.def);
    }
    std::sort(joined_.begin(), joined_.end());
    broadPhase_.setFilter([this](ProxyId a, ProxyId b) {
        const Filter& one = scene_.bodies[a].filter;
        const Filter& two = scene_.bodies[b].filter;
        const bool shared = one.group != 0 && one.group == two.group;
        const bool agree = shared ? one.group > 0 : (one.category & two.mask) != 0 && (two.category & one.mask) != 0;
        const bool dynamic = scene_.bodies[a].type == BodyType::Dynamic || scene_.bodies[b].type == BodyType::Dynamic;
        return agree && dynamic && !std::binary_search(joined_.begin(), joined_.end(), ProxyPair{a, b});
    });
}

double ErrorMeter::displacement(const Peer& peer) const {
    double worst = 0;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        if (scene_.bodies[i].type == BodyType::Dynamic) {
            worst = std::max(worst, (peer.pose(i).position - scene_.bodies[i].position).norm());
        }
    }
    return worst;
}

double ErrorMeter::penetration(const Peer& peer) {
    std::vector<Posed> poses;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        poses.push_back(peer.pose(i));
        if (broadPhase_.contains(static_cast<ProxyId>(i)) && scene_.bodies[i].type != BodyType::Static) {
            broadPhase_.move(static_cast<ProxyId>(i), bounds(scene_.bodies[i].shapes, poses[i]), Vec3d::Zero());
        }
    }
    broadPhase_.update();
    double deepest = 0;
    std::vector<Manifold> manifolds;
    NarrowCounts counts;
    for (const ProxyPair& pair : broadPhase_.pairs()) {
        PairCache cache;
        manifolds.clear();
        collide(scene_.bodies[pair.a].shapes, scene_.bodies[pair.b].shapes, relativePose(poses[pair.a], poses[pair.b]),
                0, cache, manifolds, counts);
        for (const Manifold& manifold : manifolds) {
            for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.count); ++k) {
                deepest = std::max(deepest, -manifold.points[k].separation);
            }
        }
    }
    return deepest;
}

double ErrorMeter::jointGap(const Peer& peer) const {
    double worst = 0;
    for (const Anchors& joint : anchors_) {
        const Posed a = peer.pose(joint.a);
        Vec3d gap = peer.pose(joint.b) * joint.onB - a * joint.onA;
        double error = gap.norm();
        if (std::holds_alternative<SliderDef>(*joint.def)) {
            const Vec3d axis = a.rotation * joint.axis;
            error = (gap - gap.dot(axis) * axis).norm();
        } else if (std::holds_alternative<DistanceDef>(*joint.def)) {
            error = std::max({0.0, joint.lower - error, error - joint.upper});
        }
        worst = std::max(worst, error);
    }
    return worst;
}

}  // namespace cairn
