#include <cairn/engine/joint.hpp>

#include <numbers>

namespace cairn {
namespace {

std::string text(double value) {
    return std::to_string(value);
}

void requireFinite(const std::string& field, const Vec3d& v) {
    if (!v.allFinite()) {
        throw InputError(field, "(" + text(v.x()) + ", " + text(v.y()) + ", " + text(v.z()) + ")",
                         "give finite numbers");
    }
}

// A frame at `anchor` whose x is `axis`.
Posed jointFrame(const std::string& type, const Vec3d& anchor, const Vec3d& axis) {
    requireFinite(type + ".anchor", anchor);
    requireFinite(type + ".axis", axis);
    const double length = axis.norm();
    if (!(length > 1e-9)) {
        throw InputError(type + ".axis", "length " + text(length), "give a direction of length over 1e-9");
    }
    Mat3d frame;
    Vec3d y;
    Vec3d z;
    const Vec3d x = axis / length;
    completeBasis<double>(x, y, z);
    frame << x, y, z;
    return {anchor, Quatd(frame).normalized()};
}

void requireLimits(const std::string& type, const char* lowerName, double lower, double upper, bool angular) {
    if (std::isnan(lower) || std::isnan(upper) || lower > upper) {
        throw InputError(type + "." + lowerName, text(lower), "it must not exceed the upper limit " + text(upper));
    }
    const double pi = std::numbers::pi;
    if (angular && ((std::isfinite(lower) && lower <= -pi) || (std::isfinite(upper) && upper >= pi))) {
        throw InputError(type + "." + lowerName, text(lower) + " .. " + text(upper),
                         "angles are known within (-pi, pi) only: narrow the limits or leave them out");
    }
}

void requireFinite(const std::string& field, double value) {
    if (!std::isfinite(value)) {
        throw InputError(field, text(value), "give a finite number");
    }
}

void requireNotNegative(const std::string& field, double value) {
    if (!(value >= 0) || !std::isfinite(value)) {
        throw InputError(field, text(value), "give a finite number >= 0");
    }
}

struct WorldFrames {
    Posed a;
    Posed b;
};

WorldFrames worldFrames(const BallDef& d) {
    const Posed f = jointFrame("ball", d.anchor, Vec3d::UnitX());
    return {f, f};
}

WorldFrames worldFrames(const WeldDef& d) {
    const Posed f = jointFrame("weld", d.anchor, Vec3d::UnitX());
    return {f, f};
}

WorldFrames worldFrames(const HingeDef& d) {
    const Posed f = jointFrame("hinge", d.anchor, d.axis);
    requireLimits("hinge", "lower", d.lower, d.upper, true);
    requireFinite("hinge.motorSpeed", d.motorSpeed);
    requireNotNegative("hinge.motorTorque", d.motorTorque);
    return {f, f};
}

WorldFrames worldFrames(const SliderDef& d) {
    const Posed f = jointFrame("slider", d.anchor, d.axis);
    requireLimits("slider", "lower", d.lower, d.upper, false);
    requireFinite("slider.motorSpeed", d.motorSpeed);
    requireNotNegative("slider.motorForce", d.motorForce);
    return {f, f};
}

WorldFrames worldFrames(const ConeTwistDef& d) {
    const Posed f = jointFrame("cone_twist", d.anchor, d.axis);
    if (!(d.swing > 0) || !(d.swing < std::numbers::pi)) {
        throw InputError("cone_twist.swing", text(d.swing), "give an angle in (0, pi)");
    }
    requireLimits("cone_twist", "twistLower", d.twistLower, d.twistUpper, true);
    return {f, f};
}

WorldFrames worldFrames(const DistanceDef& d) {
    requireFinite("distance.anchorA", d.anchorA);
    requireFinite("distance.anchorB", d.anchorB);
    if (std::isnan(d.lower) || std::isnan(d.upper) || (d.lower >= 0 && d.upper >= 0 && d.lower > d.upper)) {
        throw InputError("distance.lower", text(d.lower), "it must not exceed the upper limit " + text(d.upper));
    }
    return {{d.anchorA, Quatd::Identity()}, {d.anchorB, Quatd::Identity()}};
}

template <class S>
S restLength(const VolumeDef&, const Joint<S>& joint, const BodyTable<S>& bodies) {
    const auto at = [&](BodyId id) { return bodies[id.index].pose.position; };
    const Vec3<S> a = at(joint.a);
    const S volume = (at(joint.b) - a).dot((at(joint.c) - a).cross(at(joint.d) - a)) / S(6);
    if (!(std::abs(volume) > std::numeric_limits<S>::min())) {
        throw InputError("volume", "four particles in one plane", "give four corners of a tetrahedron with volume");
    }
    return volume;
}

template <class S>
S restLength(const BendDef&, const Joint<S>& joint, const BodyTable<S>& bodies) {
    const auto at = [&](BodyId id) { return bodies[id.index].pose.position; };
    const DihedralAngle<S> bend = dihedralAngle<S>({at(joint.a), at(joint.b), at(joint.c), at(joint.d)});
    if (!bend.exists) {
        throw InputError("bend", "a triangle without area",
                         "give two triangles (a, b, c) and (b, a, d) of particles that are not in one line");
    }
    return bend.angle;
}

// What a joint may ask of a particle: to be held at its centre, and not to be turned.
template <class S>
void holdParticles(Joint<S>& joint, const BodyTable<S>& bodies, const std::string& type) {
    const auto isHeldAtCentre = [&](BodyId id, Pose<S>& frame) {
        const Body<S>& body = bodies[id.index];
        if (body.def.particle) {
            const S roundOff = S(64) * Eigen::NumTraits<S>::epsilon() * (S(1) + body.pose.position.norm());
            if (frame.position.norm() > roundOff) {
                throw InputError(type + ".anchor",
                                 text(static_cast<double>(frame.position.norm())) +
                                     " m from the centre of the particle \"" + body.def.name + "\"",
                                 "put the anchor at the particle's centre");
            }
            frame.position.setZero();
        }
        return body.def.particle || (!body.isDynamic() && frame.position.isZero());
    };
    const bool a = isHeldAtCentre(joint.a, joint.frames.a);
    const bool b = isHeldAtCentre(joint.b, joint.frames.b);
    joint.frames.particles = a && b;
    const bool particleA = bodies[joint.a.index].def.particle;
    const bool particleB = bodies[joint.b.index].def.particle;
    if (!particleA && !particleB) {
        return;
    }
    std::vector<Row<S>> rows;
    RowBlock<S> block;
    joint.linearize(bodies[joint.a.index].pose, bodies[joint.b.index].pose, rows, block);
    if (std::any_of(rows.begin(), rows.end(), [](const Row<S>& row) { return row.isAngular; })) {
        throw InputError(
            type,
            "a joint that turns, on the particle \"" + bodies[(particleA ? joint.a : joint.b).index].def.name + "\"",
            "particles do not turn: use a ball or a distance");
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
    requireNotNegative(type + ".softness.compliance", s.compliance);
    requireNotNegative(type + ".softness.damping", s.damping);
    requireNotNegative(type + ".softness.frequency", s.frequency);
    requireNotNegative(type + ".softness.dampingRatio", s.dampingRatio);
    if (s.frequency == 0 && s.compliance == 0 && s.damping == 0) {
        return;
    }
    if (s.frequency == 0 && s.compliance == 0) {
        throw InputError(type + ".softness.damping", text(s.damping),
                         "damping needs a compliance > 0 beside it (a rigid row has nothing to damp)");
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
        if (body.def.particle) {
            return j.template head<3>().squaredNorm() / body.mass;
        }
        const Vec3<S> angular = body.pose.rotation.conjugate() * Vec3<S>(j.template tail<3>());
        return j.template head<3>().squaredNorm() / body.mass + angular.dot(body.inertia.inverse() * angular);
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
                    throw InputError(field, "a null or stale body id", "add the body before its joints");
                }
                for (int other = 0; other < k; ++other) {
                    if (joint.body(k) == joint.body(other)) {
                        throw InputError(field, std::string("the same body as ") + "abcd"[other],
                                         "join different bodies");
                    }
                }
                const Body<S>& body = bodies[joint.body(k).index];
                moves = moves || body.isDynamic();
                if (betweenParticles && body.isDynamic() && !body.def.particle) {
                    throw InputError(field, "\"" + body.def.name + "\", a body that turns",
                                     "only particles (BodyDef::particle) and fixed bodies can be joined by a " + type);
                }
            }
            if (!moves) {
                throw InputError(
                    type,
                    "a joint between \"" + bodies[d.a.index].def.name + "\" and \"" + bodies[d.b.index].def.name + "\"",
                    "make at least one of them dynamic");
            }
            if constexpr (betweenParticles) {
                joint.frames.rest = restLength(d, joint, bodies);
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
