#include "engine/constraints/joint.hpp"

#include <numbers>

namespace cairn {
namespace {

std::string text(double value) {
    return std::to_string(value);
}

struct WorldFrames {
    Posed a;
    Posed b;
};

template <class Def>
WorldFrames worldFrames(const Def& def) {
    WorldFrames frames;
    if constexpr (requires { def.anchorA; }) {
        frames.a.position = def.anchorA;
        frames.b.position = def.anchorB;
    } else if constexpr (requires { def.anchor; }) {
        frames.a.position = frames.b.position = def.anchor;
    }
    Vec3d axis = Vec3d::UnitX();
    if constexpr (requires { def.axis; }) {
        axis = def.axis.normalized();
    }
    Mat3d R;
    Vec3d y;
    Vec3d z;
    completeBasis<double>(axis, y, z);
    R << axis, y, z;
    frames.a.rotation = frames.b.rotation = Quatd(R).normalized();
    return frames;
}

// What a joint may ask of a particle: to be held at its centre, and not to be turned.
template <class S>
void holdParticles(Joint<S>& joint, const BodyTable<S>& bodies, const std::string& type) {
    const auto isHeldAtCentre = [&](BodyId id, Pose<S>& frame) {
        const Body<S>& body = bodies[id.index];
        if (body.kind->def.particle) {
            const S roundOff = S(64) * Eigen::NumTraits<S>::epsilon() * (S(1) + body.pose.position.norm());
            if (frame.position.norm() > roundOff) {
                throw InputError(type + ".anchor",
                                 text(static_cast<double>(frame.position.norm())) +
                                     " m from the centre of the particle \"" + body.name() + "\"",
                                 "put the anchor at the particle's centre");
            }
            frame.position.setZero();
        }
        return body.kind->def.particle || (!body.isDynamic() && frame.position.isZero());
    };
    const bool a = isHeldAtCentre(joint.a, joint.frames.a);
    const bool b = isHeldAtCentre(joint.b, joint.frames.b);
    joint.frames.particles = a && b;
    const bool particleA = bodies[joint.a.index].kind->def.particle;
    const bool particleB = bodies[joint.b.index].kind->def.particle;
    const bool holdsThem = std::visit(
        []<class Def>(const Def&) {
            return requires {
                Def::holdsParticles;
            };
        },
        joint.def);
    if ((particleA || particleB) && !holdsThem) {
        throw InputError(type, "on the particle \"" + bodies[(particleA ? joint.a : joint.b).index].name() + "\"",
                         "only a ball and a distance hold particles, which do not turn");
    }
    // A ball pushes both at b's point, in axes that a carries: exact where b is the particle.
    if (particleA && !particleB && std::holds_alternative<BallDef>(joint.def)) {
        std::swap(joint.a, joint.b);
        std::swap(joint.frames.a, joint.frames.b);
    }
}

// Frequency and damping ratio become compliance and damping through each row's own effective mass.
template <class S>
void applySoftness(Joint<S>& joint, const Softness& s, const BodyTable<S>& bodies, const std::string& type) {
    check(s, type + ".softness");
    if (s.frequency == 0 && s.compliance == 0) {
        return;
    }
    std::vector<Row<S>> rows;
    RowBlock<S> block;
    JointPoses<S> poses{};
    for (int k = 0; k < joint.bodyCount(); ++k) {
        poses[static_cast<std::size_t>(k)] = &bodies[joint.body(k).index].pose;
    }
    block.c = joint.bodyCount() > 2 ? 2 : -1;
    block.d = joint.bodyCount() > 3 ? 3 : -1;
    joint.linearize(poses, rows, block);
    const bool anyEquality = std::any_of(rows.begin(), rows.end(), [](const Row<S>& r) {
        return !r.isVelocity && r.lo == -infinity<S>() && r.hi == infinity<S>();
    });
    joint.compliance.assign(rows.size(), S(0));
    joint.damping.assign(rows.size(), S(0));
    const auto inverseMass = [](const Body<S>& body, const Vec6<S>& j) {
        if (!body.isDynamic()) {
            return S(0);
        }
        if (body.kind->def.particle) {
            return j.template head<3>().squaredNorm() / body.kind->mass;
        }
        const Vec3<S> angular = body.pose.rotation.conjugate() * Vec3<S>(j.template tail<3>());
        return j.template head<3>().squaredNorm() / body.kind->mass + angular.dot(body.kind->inverseInertia * angular);
    };
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const Row<S>& row = rows[k];
        const bool equality = row.lo == -infinity<S>() && row.hi == infinity<S>();
        if (row.isVelocity || (anyEquality && !equality)) {
            continue;
        }
        if (s.frequency > 0) {
            S sum = 0;
            for (int n = 0; n < joint.bodyCount(); ++n) {
                sum += inverseMass(bodies[joint.body(n).index], bodyGradient(row, block, n));
            }
            const double mass = 1 / static_cast<double>(sum);
            const double omega = 2 * std::numbers::pi * s.frequency;
            joint.compliance[k] = static_cast<S>(1 / (mass * omega * omega));
            joint.damping[k] = static_cast<S>(2 * s.dampingRatio * mass * omega);
        } else {
            joint.compliance[k] = static_cast<S>(s.compliance);
            joint.damping[k] = static_cast<S>(s.damping);
        }
    }
}

}  // namespace

template <class S>
Joint<S> makeJoint(const JointDef& def, const BodyTable<S>& bodies) {
    return std::visit(
        [&](const auto& d) {
            constexpr bool betweenParticles = ParticleJoint<std::decay_t<decltype(d)>>;
            const std::string type = d.typeName;
            Joint<S> joint;
            joint.def = def;
            joint.a = d.a;
            joint.b = d.b;
            int ids = 2;
            if constexpr (requires { d.c; }) {
                joint.c = d.c;
                ids = 3;
            }
            if constexpr (requires { d.d; }) {
                joint.d = d.d;
                ids = 4;
            }
            bool moves = false;
            for (int k = 0; k < ids; ++k) {
                const std::string field = type + "." + "abcd"[k];
                if (!bodies.contains(joint.body(k))) {
                    throw InputError(field, "a body id that is null, stale or of another world",
                                     "add the body to this world before its joints");
                }
                for (int other = 0; other < k; ++other) {
                    if (joint.body(k) == joint.body(other)) {
                        throw InputError(field, std::string("the same body as ") + "abcd"[other],
                                         "join different bodies");
                    }
                }
                const Body<S>& body = bodies[joint.body(k).index];
                moves = moves || body.isDynamic();
                if (betweenParticles && body.isDynamic() && !body.kind->def.particle) {
                    throw InputError(field, "\"" + body.name() + "\", a body that turns",
                                     "only particles (BodyDef::particle) and fixed bodies can be joined by a " + type);
                }
            }
            if (!moves) {
                throw InputError(
                    type,
                    "a joint between \"" + bodies[d.a.index].name() + "\" and \"" + bodies[d.b.index].name() + "\"",
                    "make at least one of them dynamic");
            }
            check(d, type);
            if constexpr (betweenParticles) {
                std::array<Vec3<S>, 4> x{};
                for (int k = 0; k < ids; ++k) {
                    x[static_cast<std::size_t>(k)] = bodies[joint.body(k).index].pose.position;
                }
                joint.frames.rest = restOf(d, x);
            } else {
                const WorldFrames world = worldFrames(d);
                joint.frames.a =
                    relativePose(bodies[d.a.index].pose.template cast<double>(), world.a).template cast<S>();
                joint.frames.b =
                    relativePose(bodies[d.b.index].pose.template cast<double>(), world.b).template cast<S>();
                joint.frames.rest = static_cast<S>((world.b.position - world.a.position).norm());
                holdParticles(joint, bodies, type);
            }
            applySoftness(joint, d.softness, bodies, type);
            return joint;
        },
        def);
}

template Joint<float> makeJoint(const JointDef&, const BodyTable<float>&);
template Joint<double> makeJoint(const JointDef&, const BodyTable<double>&);

}  // namespace cairn
