#include "command/compare/errors.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "command/compare/reference_engine_kit.hpp"

#include <algorithm>

namespace cairn {
namespace {

Posed start(const BodyDef& body) {
    return {body.position, body.rotation.normalized()};
}

}  // namespace

ErrorMeter::ErrorMeter(const Scene& scene, Known known)
    : scene_(scene), known_(std::move(known)), joined_(joinedPairs(scene)) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& body = scene.bodies[i];
        if (!body.shapes.empty()) {
            broadPhase_.add(static_cast<ProxyId>(i), bounds(body.shapes, start(body)), body.type == BodyType::Static);
        }
    }
    for (const SceneJoint& joint : scene.joints) {
        addAnchors(joint);
    }
    broadPhase_.setFilter([this](ProxyId a, ProxyId b) { return mayCollide(scene_, joined_, a, b); });
    for (std::size_t a = 0; a < scene.bodies.size() && !touches_; ++a) {
        for (std::size_t b = 0; b < a && !touches_; ++b) {
            touches_ = mayCollide(scene, joined_, a, b);
        }
    }
    listMeasures();
}

void ErrorMeter::addAnchors(const SceneJoint& joint) {
    std::visit(
        [&](const auto& def) {
            if constexpr (
                requires { def.motorSpeed; } && !requires { def.lower; }) {
                return;  // a motor alone holds nothing together
            }
            if constexpr (requires { def.softness; }) {
                // What gives way by its nature has no error here.
                if (def.softness.compliance > 0 || def.softness.frequency > 0) {
                    return;
                }
            }
            Anchors anchors{def.a.index, def.b.index, Vec3d::Zero(), Vec3d::Zero(), &joint.def};
            const Posed toA = start(scene_.bodies[def.a.index]).inverse();
            const Posed toB = start(scene_.bodies[def.b.index]).inverse();
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

void ErrorMeter::listMeasures() {
    constexpr double mm = 1e3;
    constexpr double micrometre = 1e-6;  // no eye and no game can tell less
    constexpr double failure = 0.1;      // m: a tower has fallen, a chain is torn
    if (known_.rests) {
        measures_.push_back({"max_displacement_m", "displacement mm", mm, micrometre, failure});
    }
    if (!known_.points.empty()) {
        measures_.push_back({"max_off_closed_form_m", "off closed form mm", mm, micrometre});
    }
    switch (known_.simBenchmark) {
        case SimBenchmark::None:
            break;
        case SimBenchmark::Rolling:
            measures_.push_back({"mean_square_velocity_m2_s2", "velocity error (m/s)2", 1, micrometre * micrometre});
            break;
        case SimBenchmark::Bouncing:
            measures_.push_back({"mean_square_energy_J2", "energy error J2", 1, micrometre * micrometre});
            break;
        case SimBenchmark::Balls666:
            measures_.push_back({"mean_square_penetration_m2", "penetration2 m2", 1, micrometre * micrometre});
            break;
    }
    if (!anchors_.empty()) {
        measures_.push_back({"max_joint_gap_m", "joint gap mm", mm, micrometre, failure});
    }
    if (touches_) {
        measures_.push_back({"max_penetration_m", "penetration mm", mm, micrometre, failure});
    }
}

void ErrorMeter::look(const ReferenceEngine& reference, int steps) {
    const double seconds = steps * scene_.dt;
    displacement_ = std::max(displacement_, displacement(reference));
    jointGap_ = std::max(jointGap_, jointGap(reference));
    offForm_ = std::max(offForm_, offForm(reference, seconds));
    if (touches_) {
        const Depths now = depths(reference);
        penetration_ = std::max(penetration_, now.deepest);
        simBenchmark_ += known_.simBenchmark == SimBenchmark::Balls666 ? now.sumOfSquares : 0;
    }
    simBenchmark_ += speedError(reference, seconds);
    ++steps_;
}

std::vector<double> ErrorMeter::errors() const {
    std::vector<double> values;
    if (known_.rests) {
        values.push_back(displacement_);
    }
    if (!known_.points.empty()) {
        values.push_back(offForm_);
    }
    if (known_.simBenchmark != SimBenchmark::None) {
        values.push_back(simBenchmark_ / std::max(1, steps_));
    }
    if (!anchors_.empty()) {
        values.push_back(jointGap_);
    }
    if (touches_) {
        values.push_back(penetration_);
    }
    return values;
}

double ErrorMeter::offForm(const ReferenceEngine& reference, double seconds) const {
    double worst = 0;
    for (const TruePoint& point : known_.points) {
        worst = std::max(worst, (reference.pose(point.body) * point.onBody - point.place(seconds)).norm());
    }
    return worst;
}

double ErrorMeter::speedError(const ReferenceEngine& reference, double seconds) const {
    double boxes = 0;
    double balls = 0;
    int ballCount = 0;
    double energy = 0;       // J
    double energyStart = 0;  // J
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        const BodyDef& def = scene_.bodies[i];
        if (def.type != BodyType::Dynamic) {
            continue;
        }
        if (known_.simBenchmark == SimBenchmark::Rolling) {
            const double error = (reference.velocity(i) - known_.velocity(i, seconds)).squaredNorm();
            const bool ball = def.shapes[0].kind == ShapeKind::Sphere;
            (ball ? balls : boxes) += error;
            ballCount += ball ? 1 : 0;
        } else if (known_.simBenchmark == SimBenchmark::Bouncing) {
            const Vec3d weight = def.mass * scene_.world.gravity;
            energy += 0.5 * def.mass * reference.velocity(i).squaredNorm() - weight.dot(reference.pose(i).position);
            energyStart -= weight.dot(def.position);
        }
    }
    return boxes + balls / std::max(1, ballCount) + (energy - energyStart) * (energy - energyStart);
}

double ErrorMeter::displacement(const ReferenceEngine& reference) const {
    double worst = 0;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        if (scene_.bodies[i].type == BodyType::Dynamic) {
            worst = std::max(worst, (reference.pose(i).position - scene_.bodies[i].position).norm());
        }
    }
    return worst;
}

ErrorMeter::Depths ErrorMeter::depths(const ReferenceEngine& reference) {
    std::vector<Posed> poses;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        poses.push_back(reference.pose(i));
        if (broadPhase_.contains(static_cast<ProxyId>(i)) && scene_.bodies[i].type != BodyType::Static) {
            broadPhase_.move(static_cast<ProxyId>(i), bounds(scene_.bodies[i].shapes, poses[i]), Vec3d::Zero());
        }
    }
    broadPhase_.update();
    Depths depths;
    std::vector<Manifold> manifolds;
    NarrowCounts counts;
    for (const ProxyPair& pair : broadPhase_.pairs()) {
        PairCache cache;
        manifolds.clear();
        collide(scene_.bodies[pair.a].shapes, scene_.bodies[pair.b].shapes, relativePose(poses[pair.a], poses[pair.b]),
                scene_.world.contactMargin, cache, manifolds, counts);
        for (const Manifold& manifold : manifolds) {
            for (std::size_t k = 0; k < static_cast<std::size_t>(manifold.count); ++k) {
                const double depth = std::max(0.0, -manifold.points[k].separation);
                depths.deepest = std::max(depths.deepest, manifold.deeper - manifold.points[k].separation);
                depths.sumOfSquares += depth * depth;
            }
        }
    }
    return depths;
}

double ErrorMeter::penetration(const ReferenceEngine& reference) {
    return depths(reference).deepest;
}

double ErrorMeter::jointGap(const ReferenceEngine& reference) const {
    double worst = 0;
    for (const Anchors& joint : anchors_) {
        const Posed a = reference.pose(joint.a);
        Vec3d gap = reference.pose(joint.b) * joint.onB - a * joint.onA;
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
