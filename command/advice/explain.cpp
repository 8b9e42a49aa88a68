#include "command/advice/explain.hpp"
#include "command/advice/measure.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

template <class Change>
void changeShapes(Scene& scene, const Change& change) {
    for (BodyDef& body : scene.bodies) {
        for (Shape& shape : body.shapes) {
            change(shape.material);
        }
    }
}

bool hasLimits(const JointDef& joint) {
    return std::visit(
        []<class Def>(const Def& def) {
            if constexpr (std::is_same_v<Def, ConeTwistDef>) {
                return true;
            } else if constexpr (std::is_same_v<Def, HingeDef> || std::is_same_v<Def, SliderDef>) {
                return def.lower != -unlimited || def.upper != unlimited;
            } else {
                return false;
            }
        },
        joint);
}

bool hasMotor(const JointDef& joint) {
    return std::visit(
        []<class Def>(const Def& def) {
            if constexpr (requires { def.motorTorque; }) {
                return def.motorTorque > 0;
            } else if constexpr (requires { def.motorForce; }) {
                return def.motorForce > 0;
            } else {
                return false;
            }
        },
        joint);
}

// A cone-twist joint without its limits is a ball joint.
void freeLimits(SceneJoint& joint) {
    if (const auto* const cone = std::get_if<ConeTwistDef>(&joint.def)) {
        joint.def = BallDef{
            .a = cone->a, .b = cone->b, .anchor = cone->anchor, .softness = cone->softness, .collide = cone->collide};
    } else if (auto* const hinge = std::get_if<HingeDef>(&joint.def)) {
        hinge->lower = -unlimited;
        hinge->upper = unlimited;
    } else if (auto* const slider = std::get_if<SliderDef>(&joint.def)) {
        slider->lower = -unlimited;
        slider->upper = unlimited;
    }
}

void stopMotors(Scene& scene) {
    std::erase_if(scene.joints, [](const SceneJoint& joint) {
        return std::holds_alternative<LinearMotorDef>(joint.def) || std::holds_alternative<AngularMotorDef>(joint.def);
    });
    for (SceneJoint& joint : scene.joints) {
        if (auto* const hinge = std::get_if<HingeDef>(&joint.def)) {
            hinge->motorTorque = 0;
        } else if (auto* const slider = std::get_if<SliderDef>(&joint.def)) {
            slider->motorForce = 0;
        }
    }
}

const char* name(GyroscopicRule rule) {
    switch (rule) {
        case GyroscopicRule::None:
            return "none";
        case GyroscopicRule::Explicit:
            return "explicit";
        case GyroscopicRule::RestoredMomentum:
            return "restored momentum";
        case GyroscopicRule::Midpoint:
            return "midpoint";
        case GyroscopicRule::RungeKutta:
            return "Runge-Kutta";
    }
    return "";
}

// "1 contact", "2 contacts"
std::string count(std::int64_t n, const std::string& what) {
    const bool body = what == "body";
    return std::to_string(n) + " " + (n == 1 ? what : body ? "bodies" : what + "s");
}

// What the run of the scene as it is showed.
struct Seen {
    // Of awake bodies, at the step that had most rows.
    int rows = 0;
    int contacts = 0;
    int slippery = 0;  // contacts without friction
    int sticky = 0;    // contacts whose static friction is above the sliding one
    int bouncy = 0;    // contacts with restitution
    double restitution = 0;
    std::int64_t ccdBodies = 0;  // this and the rest: summed over the steps
    std::int64_t held = 0;
    std::int64_t pairs = 0;
    std::int64_t carried = 0;
    std::int64_t asleep = 0;  // dynamic bodies
    std::int64_t solves = 0;
    std::int64_t islands = 0;
};

void look(Seen& seen, const Simulation& simulation) {
    const StepReport& report = simulation.report();
    const StepCounts& counts = report.counts;
    seen.ccdBodies += counts.ccdBodies;
    seen.held += counts.ccdHeldBodies;
    seen.pairs += counts.pairs;
    seen.carried += counts.carriedPairs;
    seen.solves += counts.solves;
    seen.islands += counts.islands;
    for (std::size_t i = 0; i < simulation.bodyCount(); ++i) {
        seen.asleep += simulation.mass(i) > 0 && !simulation.awake(i) ? 1 : 0;
    }
    if (counts.rows <= seen.rows) {
        return;
    }
    seen.rows = counts.rows;
    seen.contacts = seen.slippery = seen.sticky = seen.bouncy = 0;
    seen.restitution = 0;
    const auto moves = [&](BodyId id) {
        const std::size_t body = simulation.indexOf(id);
        return simulation.mass(body) > 0 && simulation.awake(body);
    };
    for (const ContactView& contact : simulation.contacts()) {
        if (!moves(contact.a) && !moves(contact.b)) {
            continue;
        }
        ++seen.contacts;
        seen.slippery += contact.friction > 0 || contact.staticFriction > 0 ? 0 : 1;
        seen.sticky += contact.staticFriction > contact.friction ? 1 : 0;
        seen.bouncy += contact.restitution > 0 ? 1 : 0;
        seen.restitution = std::max(seen.restitution, contact.restitution);
    }
}

// One copy of the scene and what its repeats took.
struct Variant {
    Scene scene;
    Repeats seconds = {};
    double rows = 0;   // this and the next: summed over the steps
    double looks = 0;  // at pairs, by the narrow phase
};

void runOnce(Variant& variant, Precision precision, int steps, Seen* seen) {
    // A run of some microseconds is run again, up to a few milliseconds, or the clock is all one sees.
    constexpr double enough = 0.005;
    constexpr int maxRepeats = 20;
    double spent = 0;
    double smallest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < maxRepeats && (k == 0 || spent < enough); ++k) {
        const std::unique_ptr<Simulation> simulation = makeSimulation(variant.scene, precision);
        double seconds = 0;
        variant.rows = 0;
        variant.looks = 0;
        for (int i = 0; i < steps; ++i) {
            const double start = cpuSeconds();
            const StepReport& report = simulation->step(variant.scene.dt);
            seconds += cpuSeconds() - start;
            variant.rows += report.counts.rows;
            variant.looks += report.counts.pairs - report.counts.carriedPairs;
            if (seen != nullptr && k == 0) {
                look(*seen, *simulation);
            }
        }
        spent += seconds;
        smallest = std::min(smallest, seconds);
    }
    variant.seconds.add(smallest);
}

struct Feature {
    Explanation explanation;
    std::function<void(Scene&)> switchOff;
};

Feature friction(const Seen& seen) {
    const int rough = seen.contacts - seen.slippery;
    std::string why = seen.contacts == 0 ? "nothing touches"
                      : rough == 0       ? "all " + count(seen.contacts, "contact") + " have mu 0: no friction rows"
                                   : "friction rows: " + std::to_string(2 * rough) + " of " + std::to_string(seen.rows);
    if (rough > 0) {
        why += seen.slippery == 0
                   ? "; no contact has mu 0"
                   : "; " + count(seen.slippery, "contact") + (seen.slippery == 1 ? " has" : " have") + " mu 0";
    }
    return {{.feature = "friction", .on = rough > 0, .why = why}, [](Scene& scene) {
                changeShapes(scene, [](Material& material) {
                    material.friction = 0;
                    material.staticFriction = -1;
                });
                for (DeformableDef& deformable : scene.deformables) {
                    std::visit([](auto& def) { def.friction = 0; }, deformable);
                }
            }};
}

Feature staticFriction(const Seen& seen) {
    return {{.feature = "static friction",
             .on = seen.sticky > 0,
             .why = seen.sticky > 0 ? std::to_string(seen.sticky) + " of " + count(seen.contacts, "contact") +
                                          " stick harder than they slide"
                                    : "no contact sticks harder than it slides: one coefficient serves both"},
            [](Scene& scene) { changeShapes(scene, [](Material& material) { material.staticFriction = -1; }); }};
}

Feature restitution(const Seen& seen, const Scene& scene) {
    return {{.feature = "restitution",
             .on = seen.bouncy > 0,
             .why = seen.bouncy > 0 ? std::to_string(seen.bouncy) + " of " + count(seen.contacts, "contact") +
                                          " bounce, e up to " + brief(seen.restitution) + ", if they meet at over " +
                                          brief(scene.world.restitutionSpeed) + " m/s"
                                    : "no contact bounces: no pass over impacts"},
            [](Scene& copy) { changeShapes(copy, [](Material& material) { material.restitution = 0; }); }};
}

Feature gyroscopic(const Scene& scene, const Simulation& simulation) {
    int uneven = 0;
    int dynamic = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        uneven += simulation.gyroscopic(i) ? 1 : 0;
        dynamic += simulation.mass(i) > 0 ? 1 : 0;
    }
    const bool asked = scene.world.gyroscopic != GyroscopicRule::None;
    const std::string of = std::to_string(uneven) + " of " + std::to_string(dynamic) + " rigid bodies";
    return {{.feature = "gyroscopic term",
             .on = asked && uneven > 0,
             .why = !asked        ? "the world's rule is none; " + of + " would turn by themselves"
                    : uneven == 0 ? "no body has unequal moments of inertia"
                                  : of + " have unequal moments of inertia; rule: " + name(scene.world.gyroscopic)},
            [](Scene& copy) { copy.world.gyroscopic = GyroscopicRule::None; }};
}

Feature limits(const Scene& scene) {
    const auto n =
        std::count_if(scene.joints.begin(), scene.joints.end(), [](const auto& joint) { return hasLimits(joint.def); });
    const auto all = static_cast<std::int64_t>(scene.joints.size());
    return {{.feature = "joint limits",
             .on = n > 0,
             .why = all == 0 ? "no joints" : std::to_string(n) + " of " + std::to_string(all) + " joints have limits"},
            [](Scene& copy) { std::for_each(copy.joints.begin(), copy.joints.end(), freeLimits); }};
}

Feature motors(const Scene& scene) {
    const auto n =
        std::count_if(scene.joints.begin(), scene.joints.end(), [](const auto& joint) { return hasMotor(joint.def); });
    const auto all = static_cast<std::int64_t>(scene.joints.size());
    return {{.feature = "joint motors",
             .on = n > 0,
             .why = all == 0 ? "no joints" : std::to_string(n) + " of " + std::to_string(all) + " joints have motors"},
            stopMotors};
}

Feature continuous(const Seen& seen, const Scene& scene) {
    std::int64_t asked = 0;
    for (const BodyDef& body : scene.bodies) {
        asked += body.type == BodyType::Dynamic && body.continuous != Continuous::Never ? 1 : 0;
    }
    const std::string motions = count(seen.ccdBodies, "motion") + " of fast bodies searched, " +
                                count(seen.held, "body") + " held back before something";
    return {{.feature = "continuous collision",
             .on = asked > 0,
             .why = asked == 0            ? "no body asks for it"
                    : seen.ccdBodies == 0 ? count(asked, "body") + " would be searched for; none was ever fast enough"
                                          : motions},
            [](Scene& copy) {
                for (BodyDef& body : copy.bodies) {
                    body.continuous = Continuous::Never;
                }
            }};
}

Feature sleeping(const Seen& seen, const Scene& scene, int steps) {
    return {
        {.feature = "sleeping",
         .on = scene.world.sleep.enabled,
         .why = !scene.world.sleep.enabled ? "the world lets nothing sleep"
                : seen.asleep == 0         ? "nothing came to rest in this run"
                                   : brief(static_cast<double>(seen.asleep) / steps) + " bodies asleep in the mean"},
        [](Scene& copy) { copy.world.sleep.enabled = false; }};
}

Feature manifoldReuse(const Seen& seen, const Scene& scene) {
    const bool on = scene.world.manifoldReuseDistance > 0;
    return {{.feature = "manifold reuse",
             .on = on,
             .why = !on               ? "manifoldReuseDistance is 0: every pair is asked in every step"
                    : seen.pairs == 0 ? "no pairs are near each other"
                                      : std::to_string(seen.carried) + " of " + count(seen.pairs, "look") +
                                            " at a pair kept the points that it had"},
            [](Scene& copy) { copy.world.manifoldReuseDistance = 0; }};
}

Feature accuracy(const Seen& seen, const Scene& scene) {
    const AccuracyDef& asked = scene.world.accuracy;
    const bool on = asked.position > 0 || asked.velocity > 0;
    std::string why = "no tolerance is asked: an island is solved once, or twice where it strikes something";
    if (on) {
        why = "asked: ";
        if (asked.position > 0) {
            why += brief(1e3 * asked.position) + " mm";
        }
        if (asked.velocity > 0) {
            why += std::string(asked.position > 0 ? ", " : "") + brief(asked.velocity) + " m/s";
        }
        why += "; " + count(seen.islands, "island") + " solved " + std::to_string(seen.solves) + " times";
    }
    return {{.feature = "accuracy", .on = on, .why = why}, [](Scene& copy) {
                copy.world.accuracy.position = 0;
                copy.world.accuracy.velocity = 0;
            }};
}

Explanation budget(const Scene& scene) {
    const double asked = scene.world.accuracy.budget;
    return {.feature = "budget",
            .on = asked > 0,
            .why = asked > 0 ? "asked: " + brief(1e3 * asked) + " ms a step; left out of these runs"
                             : "no budget is asked: no clock has a say"};
}

}  // namespace

SceneExplanation explain(const Scene& given, Precision precision, double seconds, int repeats,
                         const std::function<void(double)>& tell) {
    const Scene scene = withoutBudget(given);
    const int steps = std::max(1, static_cast<int>(std::lround(seconds / scene.dt)));
    Seen seen;
    Variant base{scene};
    runOnce(base, precision, steps, &seen);
    base.seconds = {};  // looking at the steps disturbed them

    const std::unique_ptr<Simulation> start = makeSimulation(scene, precision);
    std::vector<Feature> features = {friction(seen),
                                     staticFriction(seen),
                                     restitution(seen, scene),
                                     gyroscopic(scene, *start),
                                     limits(scene),
                                     motors(scene),
                                     continuous(seen, scene),
                                     sleeping(seen, scene, steps),
                                     manifoldReuse(seen, scene),
                                     accuracy(seen, scene)};
    std::vector<Variant> variants;
    for (const Feature& feature : features) {
        if (feature.explanation.on) {
            feature.switchOff(variants.emplace_back(Variant{scene}).scene);
        }
    }
    const double runs = static_cast<double>(repeats) * static_cast<double>(variants.size() + 1);
    int done = 0;
    // In turns, so that a while in which the machine is slow meets all of them.
    for (int repeat = 0; repeat < repeats; ++repeat) {
        runOnce(base, precision, steps, nullptr);
        for (Variant& variant : variants) {
            runOnce(variant, precision, steps, nullptr);
            if (tell) {
                tell(++done / runs);
            }
        }
    }

    const double ms = 1e3 / steps;
    SceneExplanation result{.scene = scene.name,
                            .seconds = steps * scene.dt,
                            .steps = steps,
                            .repeats = repeats,
                            .ms = ms * base.seconds.min(),
                            .noise = ms * base.seconds.noise(),
                            .rows = base.rows / steps,
                            .looks = base.looks / steps,
                            .features = {}};
    auto variant = variants.begin();
    for (Feature& feature : features) {
        Explanation& one = feature.explanation;
        if (one.on) {
            one.measured = true;
            one.ms = ms * (base.seconds.min() - variant->seconds.min());
            one.noise = ms * (base.seconds.noise() + variant->seconds.noise());
            one.rows = (base.rows - variant->rows) / steps;
            one.looks = (base.looks - variant->looks) / steps;
            ++variant;
        }
        result.features.push_back(std::move(one));
    }
    result.features.push_back(budget(given));
    return result;
}

nlohmann::ordered_json toJson(const SceneExplanation& explanation) {
    using Json = nlohmann::ordered_json;
    Json json = {{"scene", explanation.scene},     {"seconds", explanation.seconds}, {"steps", explanation.steps},
                 {"repeats", explanation.repeats}, {"ms_per_step", explanation.ms},  {"noise_ms", explanation.noise},
                 {"rows", explanation.rows},       {"looks", explanation.looks},     {"features", Json::array()}};
    for (const Explanation& one : explanation.features) {
        const auto measured = [&](auto value) { return one.measured ? Json(value) : Json(nullptr); };
        json["features"].push_back({{"feature", one.feature},
                                    {"on", one.on},
                                    {"why", one.why},
                                    {"ms", measured(one.ms)},
                                    {"noise_ms", measured(one.noise)},
                                    {"within_noise", measured(one.withinNoise())},
                                    {"rows", measured(one.rows)},
                                    {"looks", measured(one.looks)}});
    }
    return json;
}

}  // namespace cairn
