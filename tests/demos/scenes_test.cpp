// Every built-in scene is a valid one, and its geometry and masses are what its file says.
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

Posed poseOf(const BodyDef& body) {
    return {body.position, body.rotation};
}

const BodyDef& bodyNamed(const Scene& scene, const std::string& name) {
    for (const BodyDef& body : scene.bodies) {
        if (body.name == name) {
            return body;
        }
    }
    throw std::out_of_range(name);
}

void expectValid(const Scene& scene) {
    SCOPED_TRACE(scene.name);
    EXPECT_FALSE(scene.description.empty());
    EXPECT_GT(scene.seconds, 0);
    EXPECT_GT(scene.dt, 0);
    EXPECT_TRUE(scene.view.eye.allFinite() && scene.view.target.allFinite());
    EXPECT_GT((scene.view.eye - scene.view.target).norm(), 1);
    std::set<std::string> names;
    int dynamic = 0;
    for (const BodyDef& body : scene.bodies) {
        EXPECT_FALSE(body.name.empty());
        EXPECT_TRUE(names.insert(body.name).second) << "two bodies named " << body.name;
        EXPECT_TRUE(poseOf(body).isFinite()) << body.name;
        EXPECT_NEAR(body.rotation.norm(), 1, 1e-12) << body.name;
        EXPECT_FALSE(body.shapes.empty()) << body.name;
        if (body.type == BodyType::Dynamic) {
            ++dynamic;
            EXPECT_GT(massProperties(body.shapes).mass, 0) << body.name;
            EXPECT_GE(body.mass, 0) << body.name;
        }
    }
    EXPECT_GT(dynamic + static_cast<int>(scene.deformables.size()), 0);
    std::set<std::string> jointNames;
    for (const SceneJoint& joint : scene.joints) {
        EXPECT_TRUE(jointNames.insert(joint.name).second) << "two joints named " << joint.name;
        std::visit(
            [&](const auto& def) {
                EXPECT_LT(def.a.index, scene.bodies.size()) << joint.name;
                EXPECT_LT(def.b.index, scene.bodies.size()) << joint.name;
                EXPECT_NE(def.a.index, def.b.index) << joint.name;
            },
            joint.def);
    }
}

std::set<std::pair<std::size_t, std::size_t>> jointedPairs(const Scene& scene) {
    std::set<std::pair<std::size_t, std::size_t>> pairs;
    for (const SceneJoint& joint : scene.joints) {
        std::visit(
            [&](const auto& def) {
                if (!def.collide) {
                    pairs.insert(std::minmax<std::size_t>(def.a.index, def.b.index));
                }
            },
            joint.def);
    }
    return pairs;
}

bool mayCollide(const BodyDef& a, const BodyDef& b) {
    if (a.type != BodyType::Dynamic && b.type != BodyType::Dynamic) {
        return false;
    }
    if (a.filter.group == b.filter.group && a.filter.group != 0) {
        return a.filter.group > 0;
    }
    return (a.filter.category & b.filter.mask) != 0 && (b.filter.category & a.filter.mask) != 0;
}

struct Touch {
    std::size_t a;
    std::size_t b;
    double separation;  // m
};

// Contact points of a scene's first moment that are at most `margin` (m) apart.
std::vector<Touch> touches(const Scene& scene, double margin) {
    const auto jointed = jointedPairs(scene);
    std::vector<Aabb> boxes;
    for (const BodyDef& body : scene.bodies) {
        boxes.push_back(bounds(body.shapes, poseOf(body)).grown(margin));
    }
    std::vector<Touch> found;
    for (std::size_t a = 0; a < scene.bodies.size(); ++a) {
        for (std::size_t b = a + 1; b < scene.bodies.size(); ++b) {
            if (!boxes[a].overlaps(boxes[b]) || !mayCollide(scene.bodies[a], scene.bodies[b]) ||
                jointed.contains({a, b})) {
                continue;
            }
            PairCache cache;
            std::vector<Manifold> manifolds;
            NarrowCounts counts;
            collide(scene.bodies[a].shapes, scene.bodies[b].shapes,
                    relativePose(poseOf(scene.bodies[a]), poseOf(scene.bodies[b])), margin, cache, manifolds, counts);
            for (const Manifold& manifold : manifolds) {
                for (int i = 0; i < manifold.count; ++i) {
                    found.push_back({a, b, manifold.points[static_cast<std::size_t>(i)].separation});
                }
            }
        }
    }
    return found;
}

class EveryScene : public testing::TestWithParam<BuiltinScene> {};

TEST_P(EveryScene, IsValidWithDefaults) {
    const Scene scene = makeScene(GetParam().name);
    EXPECT_EQ(scene.name, GetParam().name);
    expectValid(scene);
}

TEST_P(EveryScene, IsValidWithEachParameterAtItsMinimum) {
    for (const SceneParameter& parameter : GetParam().parameters) {
        SCOPED_TRACE(parameter.name);
        expectValid(makeScene(GetParam().name, {{parameter.name, parameter.min}}));
        EXPECT_GE(parameter.standard, parameter.min);
        EXPECT_LE(parameter.standard, parameter.max);
        EXPECT_FALSE(parameter.help.empty());
    }
}

TEST_P(EveryScene, RefusesWhatIsOutOfRange) {
    for (const SceneParameter& parameter : GetParam().parameters) {
        for (const double wrong : {parameter.min - 1, parameter.max + 1, std::nan("")}) {
            EXPECT_THROW(makeScene(GetParam().name, {{parameter.name, wrong}}), InputError) << parameter.name;
        }
        if (parameter.whole) {
            EXPECT_THROW(makeScene(GetParam().name, {{parameter.name, parameter.min + 0.5}}), InputError);
        }
    }
}

TEST_P(EveryScene, IsTheSameEveryTimeAndSurvivesAFile) {
    const std::string text = toJson(makeScene(GetParam().name));
    EXPECT_EQ(text, toJson(makeScene(GetParam().name)));
    EXPECT_EQ(text, toJson(parseScene(text, ".", "built-in")));
}

void expectNothingOverlaps(const Scene& scene) {
    for (const Touch& touch : touches(scene, 0)) {
        EXPECT_GT(touch.separation, -1e-9) << scene.bodies[touch.a].name << " in " << scene.bodies[touch.b].name;
    }
}

TEST_P(EveryScene, NothingOverlapsAtTheStart) {
    expectNothingOverlaps(makeScene(GetParam().name));
}

TEST_P(EveryScene, NothingOverlapsAtTheStartWhereThereIsFiveTimesAsMuch) {
    for (const SceneParameter& parameter : GetParam().parameters) {
        if (parameter.whole && parameter.choices.empty()) {
            SCOPED_TRACE(parameter.name);
            const double value = std::clamp(5 * parameter.standard, parameter.min, parameter.max);
            expectNothingOverlaps(makeScene(GetParam().name, {{parameter.name, value}}));
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(builtinScenes()),
                         [](const auto& tested) { return tested.param.name; });

TEST(Scenes, StacksTouchExactly) {
    std::vector<Scene> stacks = {makeScene("pyramid"), makeScene("wall"),  makeScene("card_house"),
                                 makeScene("arch"),    makeScene("heavy"), makeScene("slope")};
    for (int kind = 0; kind <= 4; ++kind) {
        stacks.push_back(makeScene("tower", {{"kind", kind}, {"n", 6}}));
    }
    for (const Scene& scene : stacks) {
        std::vector<bool> touched(scene.bodies.size(), false);
        for (const Touch& touch : touches(scene, 1e-4)) {
            if (std::abs(touch.separation) < 1e-9) {
                touched[touch.a] = touched[touch.b] = true;
            }
        }
        for (std::size_t i = 0; i < touched.size(); ++i) {
            EXPECT_TRUE(touched[i] || scene.bodies[i].type == BodyType::Static)
                << scene.name << ": " << scene.bodies[i].name << " touches nothing";
        }
    }
}

// Born in equilibrium, and only friction holds it: every contact must be there in the first step.
TEST(Scenes, TheHouseOfCardsDoesNotMove) {
    for (const double levels : {3.0, 4.0, 5.0}) {
        Scene scene = makeScene("card_house", {{"levels", levels}});
        scene.world.sleep.enabled = false;
        SceneRun run(scene);
        run.advanceTo(2);
        EXPECT_LT(run.result().worst.displacement, 2e-7) << levels << " storeys";
        EXPECT_EQ(run.result().flags, 0U);
    }
}

TEST(Scenes, ErrorsNameTheNearest) {
    const auto words = [](const std::string& scene, const SceneOverrides& overrides) -> std::string {
        try {
            makeScene(scene, overrides);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(words("pyramind", {}).find("'pyramid'"), std::string::npos);
    EXPECT_NE(words("pyramid", {{"row", 3}}).find("'rows'"), std::string::npos);
    EXPECT_NE(words("pyramid", {{"rows", 1000}}).find("[1, 300]"), std::string::npos);
}

TEST(Scenes, OverridesAreRead) {
    const BuiltinScene& tower = builtinScene("tower");
    EXPECT_EQ(parseOverride(tower, "n=30"), std::make_pair(std::string("n"), 30.0));
    EXPECT_EQ(parseOverride(tower, "kind=rock").second, 3);
    EXPECT_EQ(parseOverride(tower, "ratio=1e4").second, 1e4);
    for (const char* const wrong : {"n", "=3", "n=", "n=3x", "kind=cube", "m=3"}) {
        EXPECT_THROW(parseOverride(tower, wrong), InputError) << wrong;
    }
}

TEST(Scenes, NearestNameCountsEdits) {
    const std::vector<std::string> known = {"tower", "wall", "arch"};
    EXPECT_EQ(nearestName("towr", known), "tower");
    EXPECT_EQ(nearestName("ball", known), "wall");
    EXPECT_EQ(nearestName("arc", known), "arch");
    EXPECT_EQ(nearestName("x", {}), "");
}

TEST(Tower, AlternatesMassesAndStandsExactly) {
    const Scene scene = makeScene("tower", {{"n", 25}, {"ratio", 20}});
    ASSERT_EQ(scene.bodies.size(), 26u);
    for (std::size_t k = 0; k < 25; ++k) {
        const BodyDef& block = scene.bodies[k + 1];
        EXPECT_EQ(block.mass, k % 2 == 0 ? 1 : 20);
        EXPECT_EQ(block.position, Vec3d(0, static_cast<double>(k) + 0.5, 0));
        EXPECT_EQ(block.shapes[0].size, Vec3d(0.5, 0.5, 0.5));
    }
}

TEST(Tower, RocksHaveFlatEnds) {
    const Scene scene = makeScene("tower", {{"n", 20}, {"kind", 3}});
    for (std::size_t k = 1; k < scene.bodies.size(); ++k) {
        const Shape& rock = scene.bodies[k].shapes[0];
        ASSERT_EQ(rock.kind, ShapeKind::Hull);
        EXPECT_GE(rock.hull->vertices.size(), 12u);
        EXPECT_LE(rock.hull->vertices.size(), 40u);
        int top = 0;
        int bottom = 0;
        for (const Vec3d& vertex : rock.hull->vertices) {
            EXPECT_LE(std::abs(vertex.y()), 0.5);
            top += vertex.y() == 0.5 ? 1 : 0;
            bottom += vertex.y() == -0.5 ? 1 : 0;
        }
        EXPECT_GE(top, 4);
        EXPECT_GE(bottom, 4);
    }
}

TEST(Pyramid, HasAllItsBoxes) {
    EXPECT_EQ(makeScene("pyramid", {{"rows", 20}}).bodies.size(), 211u);
    EXPECT_EQ(makeScene("pyramid", {{"rows", 100}}).bodies.size(), 5051u);
}

TEST(Wall, CoursesAreEquallyLongAndHeavy) {
    const Scene scene = makeScene("wall", {{"courses", 4}, {"columns", 5}, {"ball", 10}});
    std::map<double, double> mass;    // kg, by height
    std::map<double, double> length;  // m
    for (const BodyDef& body : scene.bodies) {
        if (body.name.starts_with("brick")) {
            mass[body.position.y()] += body.mass;
            length[body.position.y()] += 2 * body.shapes[0].size.x();
        }
    }
    ASSERT_EQ(mass.size(), 4u);
    for (const auto& [height, kg] : mass) {
        EXPECT_NEAR(kg, 50, 1e-12);
        EXPECT_NEAR(length[height], 5, 1e-12);
    }
    EXPECT_EQ(bodyNamed(scene, "ball").linearVelocity, Vec3d(0, 0, -10));
    EXPECT_EQ(makeScene("wall").bodies.size() + 1, makeScene("wall", {{"ball", 1}}).bodies.size());
}

TEST(Arch, WedgesShareTheirFaces) {
    const double thickness = 0.3;
    const Scene scene = makeScene("arch", {{"stones", 9}, {"thickness", thickness}});
    ASSERT_EQ(scene.bodies.size(), 10u);
    // Corners 1 and 2 are the inner and outer ones of the face towards smaller angles, 0 and 3 of the other.
    const auto corner = [&](std::size_t stone, std::size_t vertex) -> Vec3d {
        const BodyDef& body = scene.bodies[stone + 1];
        return poseOf(body) * body.shapes[0].hull->vertices[vertex];
    };
    for (std::size_t i = 0; i + 1 < 9; ++i) {
        EXPECT_LT((corner(i, 0) - corner(i + 1, 1)).norm(), 1e-12);
        EXPECT_LT((corner(i, 3) - corner(i + 1, 2)).norm(), 1e-12);
    }
    EXPECT_NEAR(corner(0, 1).y(), 0, 1e-12);  // springs from the floor
    EXPECT_NEAR(corner(8, 0).y(), 0, 1e-12);
    EXPECT_NEAR(corner(0, 1).x(), 2 * (1 - thickness / 2), 1e-12);
    EXPECT_NEAR(corner(0, 2).x(), 2 * (1 + thickness / 2), 1e-12);
    // Area of the nine trapezoids: half of n sin(angle) (outer^2 - inner^2).
    double mass = 0;
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
        mass += massProperties(scene.bodies[i].shapes).mass;
    }
    const double area = 0.5 * 9 * std::sin(pi / 9) * 4 * (std::pow(1.15, 2) - std::pow(0.85, 2));
    EXPECT_NEAR(mass, 2000 * area, 1e-6);
}

TEST(Chain, JointsAreAtTheLinksEnds) {
    const Scene scene = makeScene("chain", {{"links", 20}, {"ratio", 1000}});
    ASSERT_EQ(scene.joints.size(), 20u);
    for (const SceneJoint& joint : scene.joints) {
        const auto& ball = std::get<BallDef>(joint.def);
        const BodyDef& link = scene.bodies[ball.b.index];
        const Aabb box = bounds(link.shapes, poseOf(link));
        EXPECT_NEAR(ball.anchor.x(), box.min.x(), 1e-12);
        EXPECT_NEAR(box.max.x() - box.min.x(), 1, 1e-12);
        EXPECT_EQ(ball.anchor.y(), link.position.y());
    }
    EXPECT_EQ(scene.bodies[19].mass, 1);
    EXPECT_EQ(scene.bodies[20].mass, 1000);
    EXPECT_FALSE(mayCollide(scene.bodies[3], scene.bodies[7]));
}

// Balls halfway between neighbours, none between two knots that are held.
void expectTiedHalfway(const Scene& scene, std::size_t joints) {
    EXPECT_EQ(scene.joints.size(), joints);
    for (const SceneJoint& joint : scene.joints) {
        const auto& ball = std::get<BallDef>(joint.def);
        const BodyDef& a = scene.bodies[ball.a.index];
        const BodyDef& b = scene.bodies[ball.b.index];
        EXPECT_LT((ball.anchor - 0.5 * (a.position + b.position)).norm(), 1e-12) << joint.name;
        EXPECT_TRUE(a.type == BodyType::Dynamic || b.type == BodyType::Dynamic) << joint.name;
        EXPECT_FALSE(mayCollide(a, b)) << joint.name;
    }
}

TEST(Net, IsTiedToAllNeighbours) {
    const Scene scene = makeScene("net", {{"side", 6}});
    ASSERT_EQ(scene.bodies.size(), 36u);
    expectTiedHalfway(scene, 60);
    EXPECT_NEAR((scene.bodies[1].position - scene.bodies[0].position).norm(), 0.5, 1e-12);
    expectTiedHalfway(makeScene("net", {{"side", 2}}), 3);
}

TEST(JointGrid, IsHeldInTheMiddleOfItsEdge) {
    const Scene scene = makeScene("joint_grid", {{"n", 9}, {"held", 3}});
    expectTiedHalfway(scene, 2 * 9 * 8 - 2);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        EXPECT_EQ(scene.bodies[i].type == BodyType::Static, i >= 3 && i <= 5) << i;
    }
    expectTiedHalfway(makeScene("joint_grid", {{"n", 9}}), 2 * 9 * 8 - 8);
}

TEST(Rain, FallsInGroups) {
    const Scene scene = makeScene("rain", {{"side", 2}, {"height", 4}});
    EXPECT_EQ(scene.joints.size(), 2u * 2 * 3 * 15);
    EXPECT_NEAR(bodyNamed(scene, "doll 3 head").position.y() - bodyNamed(scene, "doll 0 head").position.y(), 3, 0.2);
}

TEST(Bridge, HingesAreAPlankApart) {
    const Scene scene = makeScene("bridge");
    ASSERT_EQ(scene.joints.size(), 21u);
    for (std::size_t i = 0; i + 1 < scene.joints.size(); ++i) {
        const Vec3d from = std::get<HingeDef>(scene.joints[i].def).anchor;
        const Vec3d to = std::get<HingeDef>(scene.joints[i + 1].def).anchor;
        EXPECT_NEAR((to - from).norm(), 0.5, 1e-12);
        EXPECT_LT((scene.bodies[i + 3].position - 0.5 * (from + to)).norm(), 1e-12);
    }
    EXPECT_NEAR(std::get<HingeDef>(scene.joints.front().def).anchor.y(), 4, 1e-12);
    EXPECT_NEAR(std::get<HingeDef>(scene.joints.back().def).anchor.y(), 4, 1e-12);
}

TEST(Ragdoll, WeighsAndMeasuresAsAMan) {
    const Scene scene = makeScene("ragdoll", {{"height", 0}, {"lean", 0}});
    double mass = 0;
    Vec3d moment = Vec3d::Zero();
    double low = 1e9;
    double high = -1e9;
    int bodies = 0;
    for (const BodyDef& body : scene.bodies) {
        if (body.type != BodyType::Dynamic) {
            continue;
        }
        ++bodies;
        mass += body.mass;
        moment += body.mass * body.position;
        const Aabb box = bounds(body.shapes, poseOf(body));
        low = std::min(low, box.min.y());
        high = std::max(high, box.max.y());
    }
    EXPECT_EQ(bodies, 16);
    EXPECT_EQ(scene.joints.size(), 15u);
    EXPECT_NEAR(mass, 75, 1e-9);
    EXPECT_NEAR(low, 0, 1e-12);
    EXPECT_NEAR(high, 1.75, 1e-12);
    EXPECT_NEAR(moment.x() / mass, 0, 1e-12);
    // Standing men have their centre of mass at about 56 % of their height.
    EXPECT_NEAR(moment.y() / mass / 1.75, 0.56, 0.02);
}

TEST(Ragdoll, JointsHoldNeighbours) {
    const Scene scene = makeScene("ragdoll", {{"lean", 35}});
    for (const SceneJoint& joint : scene.joints) {
        std::visit(
            [&](const auto& def) {
                if constexpr (requires { def.anchor; }) {
                    for (const BodyId id : {def.a, def.b}) {
                        const BodyDef& body = scene.bodies[id.index];
                        const Aabb box = bounds(body.shapes, poseOf(body)).grown(0.1);
                        EXPECT_TRUE(box.overlaps({def.anchor, def.anchor})) << joint.name << ", " << body.name;
                    }
                }
            },
            joint.def);
    }
}

TEST(RagdollPile, HasItsDolls) {
    const Scene scene = makeScene("ragdoll_pile", {{"n", 3}});
    EXPECT_EQ(scene.joints.size(), 45u);
}

TEST(Cradle, StringsHaveOneLength) {
    const Scene scene = makeScene("cradle");
    ASSERT_EQ(scene.joints.size(), 10u);
    for (const SceneJoint& joint : scene.joints) {
        const auto& string = std::get<DistanceDef>(joint.def);
        EXPECT_NEAR((string.anchorA - string.anchorB).norm(), std::sqrt(5.0), 1e-12);
        EXPECT_EQ(string.anchorB, scene.bodies[string.b.index].position);
    }
    EXPECT_NEAR(scene.bodies[3].position.x() - scene.bodies[2].position.x(), 0.5, 1e-12);
}

TEST(Tops, StartInSteadyPrecession) {
    const double lean = 20 * pi / 180;
    const Scene scene = makeScene("tops", {{"spin", 60}, {"lean", 20}});
    const BodyDef& top = bodyNamed(scene, "held top");
    const MassProperties mass = massProperties(top.shapes);
    const Vec3d axis = top.rotation * Vec3d::UnitY();
    EXPECT_NEAR(axis.y(), std::cos(lean), 1e-12);
    const Vec3d pivot = std::get<BallDef>(scene.joints[0].def).anchor;
    const Vec3d centre = poseOf(top) * mass.centre;
    const double l = (centre - pivot).norm();
    // In steady precession the angular momentum about the tip turns about the vertical as fast as the axis does:
    // torque = W x L, with W the precession found from the axis' own motion.
    const Vec3d axisRate = top.angularVelocity.cross(axis);
    const double precession = Vec3d::UnitY().cross(axis).dot(axisRate) / Vec3d::UnitY().cross(axis).squaredNorm();
    const Mat3d turn = top.rotation.toRotationMatrix();
    const Mat3d aboutTip =
        turn * mass.inertia * turn.transpose() + mass.mass * l * l * (Mat3d::Identity() - axis * axis.transpose());
    const Vec3d torque = (centre - pivot).cross(mass.mass * scene.world.gravity);
    EXPECT_LT((precession * Vec3d::UnitY().cross(aboutTip * top.angularVelocity) - torque).norm(),
              1e-9 * torque.norm());
    EXPECT_NEAR(top.angularVelocity.dot(axis), 60, 1e-9);
    EXPECT_LT((top.linearVelocity - top.angularVelocity.cross(centre - pivot)).norm(), 1e-12);
}

TEST(Bounce, RestitutionRisesEvenly) {
    const Scene scene = makeScene("bounce");
    EXPECT_EQ(bodyNamed(scene, "ball 0").shapes[0].material.restitution, 0);
    EXPECT_NEAR(bodyNamed(scene, "ball 5").shapes[0].material.restitution, 0.5, 1e-12);
    EXPECT_EQ(bodyNamed(scene, "ball 10").shapes[0].material.restitution, 1);
    EXPECT_EQ(bodyNamed(scene, "ball 10").position.y(), 2.3);
}

TEST(Pile, SeedsDiffer) {
    const Scene one = makeScene("pile", {{"seed", 1}, {"n", 20}});
    const Scene two = makeScene("pile", {{"seed", 2}, {"n", 20}});
    EXPECT_NE(one.bodies.back().rotation.coeffs(), two.bodies.back().rotation.coeffs());
    bool rocks = false;
    for (const BodyDef& body : makeScene("pile", {{"hulls", 1}, {"n", 50}}).bodies) {
        rocks = rocks || body.name.starts_with("rock");
    }
    EXPECT_TRUE(rocks);
}

}  // namespace
}  // namespace cairn
