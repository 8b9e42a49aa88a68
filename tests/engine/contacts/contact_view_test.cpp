// What a contact tells of the surfaces that meet: their materials, and of meshes and height fields the triangle.
#include "collision/shapes/height_field.hpp"
#include "tests/engine/engine_kit.hpp"

#include <set>

namespace cairn {
namespace {

constexpr double sixtieth = 1.0 / 60;
constexpr int cells = 24;      // along a side of the ground
constexpr double cell = 0.25;  // m

// m: what is within 2 degrees of one direction is one manifold, and its normal that of one of its triangles: under a
// ball of 0.3 m the place is known to 10 mm.
constexpr double ofWaves = 0.009;

double waves(double x, double z) {
    return 0.06 * std::sin(1.7 * x) * std::cos(1.3 * z);
}

// The same ground as triangles in an order that has nothing to do with their place, with two without area among them.
TriangleMesh shuffledGround(double (*height)(double, double)) {
    TriangleMesh ground;
    for (int row = 0; row <= cells; ++row) {
        for (int column = 0; column <= cells; ++column) {
            const double x = (column - 0.5 * cells) * cell;
            const double z = (row - 0.5 * cells) * cell;
            ground.vertices.emplace_back(x, height(x, z), z);
        }
    }
    for (int row = 0; row < cells; ++row) {
        for (int column = 0; column < cells; ++column) {
            const int corner = row * (cells + 1) + column;
            ground.triangles.push_back({corner, corner + cells + 1, corner + 1});
            ground.triangles.push_back({corner + 1, corner + cells + 1, corner + cells + 2});
        }
    }
    TestRandom random(3);
    for (std::size_t i = ground.triangles.size(); i-- > 1;) {
        std::swap(ground.triangles[i],
                  ground.triangles[static_cast<std::size_t>(random.uniform(0, static_cast<double>(i) + 0.999))]);
    }
    ground.triangles.insert(ground.triangles.begin(), {0, 0, 1});
    ground.triangles.insert(ground.triangles.begin() + 500, {0, 1, 2});
    return ground;
}

// m: how far a point lies from a triangle beside it, seen from above.
double beside(const std::array<Vec3d, 3>& corners, const Vec3d& point) {
    double outside = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        Vec3d side = corners[(k + 1) % 3] - corners[k];
        side.y() = 0;
        const Vec3d outward = side.cross(Vec3d::UnitY()).normalized();
        outside = std::max(outside, outward.dot(point - corners[k]));
    }
    return outside;
}

// Lets a ball roll and a box slide over the ground, and asks of each of their contacts for which triangle(index) gives
// the corners.
template <class Triangle>
void checkTriangles(const std::string& what, const Shape& ground, double bound, Triangle triangle) {
    Worldd world({.sleep = {.enabled = false}});
    const BodyId ball = world.add({.shapes = {withMaterial(sphere(0.3), 0.4)},
                                   .position = {-2, 0.4, -1.5},
                                   .linearVelocity = {2, 0, 1.3},
                                   .mass = 1});
    Shape below = sphere(0.1);
    below.pose.position.y() = -5;
    const BodyId floor = world.add({.type = BodyType::Static, .shapes = {below, withMaterial(ground, 0.9)}});
    const BodyId crate = world.add({.shapes = {withMaterial(box({0.3, 0.1, 0.2}), 0.01)},
                                    .position = {-2, 0.3, 1.5},
                                    .linearVelocity = {2, 0, -0.7},
                                    .mass = 1});
    std::set<int> underBall;
    std::set<int> underCrate;
    double worst = 0;
    for (int step = 0; step < 90; ++step) {
        world.step(sixtieth);
        for (const ContactView& contact : world.contacts()) {
            const bool isBall = contact.a == ball;
            ASSERT_TRUE(isBall ? contact.b == floor : contact.a == floor && contact.b == crate);
            const int index = isBall ? contact.triangleB : contact.triangleA;
            EXPECT_EQ(isBall ? contact.triangleA : contact.triangleB, -1) << "convex shapes have none";
            EXPECT_EQ(isBall ? contact.shapeB : contact.shapeA, 1U);
            EXPECT_EQ((isBall ? contact.materialB : contact.materialA).friction, 0.9);
            EXPECT_EQ((isBall ? contact.materialA : contact.materialB).friction, isBall ? 0.4 : 0.01);
            ASSERT_GE(index, 0);
            (isBall ? underBall : underCrate).insert(index);
            if (contact.isOver) {
                continue;  // both have moved on since
            }
            const double gap = contact.separation;
            const Vec3d onGround = isBall ? Vec3d(position(world, ball) + (0.3 + gap) * contact.normal)
                                          : Vec3d(contact.point - 0.5 * gap * contact.normal);
            worst = std::max(worst, beside(triangle(index), onGround) - 0.05 * std::abs(gap));
        }
    }
    expectBelow(what + ", beside its triangle, m", worst, bound);
    EXPECT_GT(underBall.size(), 15U);
    EXPECT_GT(underCrate.size(), 20U);
}

TEST(ContactViews, TellTheTriangleOfAFlatMesh) {
    const TriangleMesh ground = shuffledGround([](double, double) { return 0.0; });
    checkTriangles("flat mesh", mesh(ground), 3e-5, [&](int index) {
        const std::array<int, 3>& t = ground.triangles.at(static_cast<std::size_t>(index));
        return std::array<Vec3d, 3>{ground.vertices[static_cast<std::size_t>(t[0])],
                                    ground.vertices[static_cast<std::size_t>(t[1])],
                                    ground.vertices[static_cast<std::size_t>(t[2])]};
    });
}

TEST(ContactViews, TellTheTriangleOfAMeshOfWavesScaledAndTurned) {
    const TriangleMesh ground = shuffledGround(waves);
    Shape shape = mesh(ground);
    shape.size = {1, 0.5, 2};
    shape.pose = {Vec3d(0, 0.1, 0), Quatd(Eigen::AngleAxisd(0.4, Vec3d::UnitY()))};
    checkTriangles("mesh of waves", shape, ofWaves, [&](int index) {
        std::array<Vec3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const int vertex = ground.triangles.at(static_cast<std::size_t>(index))[k];
            corners[k] = shape.pose * Vec3d(ground.vertices[static_cast<std::size_t>(vertex)].cwiseProduct(shape.size));
        }
        return corners;
    });
}

TEST(ContactViews, TellTheTriangleOfAHeightField) {
    std::vector<double> heights;
    for (int row = 0; row <= cells; ++row) {
        for (int column = 0; column <= cells; ++column) {
            heights.push_back(waves((column - 0.5 * cells) * cell, (row - 0.5 * cells) * cell));
        }
    }
    const Shape field = heightField(cells + 1, cells + 1, heights, cell);
    checkTriangles("height field", field, ofWaves, [&](int index) {
        const std::array<int, 3> v = field.field->vertices(index);
        const int column = index / 2 % cells;
        const int row = index / 2 / cells;
        EXPECT_LE(std::abs(v[0] % (cells + 1) - column), 1);
        EXPECT_LE(std::abs(v[0] / (cells + 1) - row), 1);
        return std::array<Vec3d, 3>{field.field->vertex(v[0]), field.field->vertex(v[1]), field.field->vertex(v[2])};
    });
}

// Of two triangles that meet at a ridge a contact on the ridge is of the one that it pushes against.
TEST(ContactViews, OnAnEdgeTheTriangleThatFacesTheContact) {
    TriangleMesh roof;
    roof.vertices = {{-1, 0, -1}, {-1, 0, 1}, {0, 1, -1}, {0, 1, 1}, {1, 0, -1}, {1, 0, 1}};
    roof.triangles = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}};
    const Shape shape = mesh(roof);
    for (const double lean : {-0.3, 0.3}) {
        Worldd world({.gravity = Vec3d::Zero()});
        world.add({.type = BodyType::Static, .shapes = {shape}});
        const Vec3d away(std::sin(lean), std::cos(lean), 0);
        world.add({.shapes = {sphere(0.2)}, .position = Vec3d(0, 1, 0.1) + 0.2 * away, .mass = 1});
        world.step(sixtieth);
        ASSERT_EQ(world.contacts().size(), 1U);
        const int index = world.contacts().front().triangleA;
        EXPECT_TRUE(lean < 0 ? index == 1 || index == 0 : index == 2 || index == 3) << index;
    }
}

TEST(ContactViews, AnEndedContactTellsItsTriangleToo) {
    Worldd world;
    Shape ground = mesh(shuffledGround([](double, double) { return 0.0; }));
    ground.material.restitution = 1;
    world.add({.type = BodyType::Static, .shapes = {ground}});
    const BodyId ball = world.add({.shapes = {withMaterial(sphere(0.2), 0, 1)},
                                   .position = {0.1, 0.35, 0.06},
                                   .linearVelocity = {0, -8, 0},
                                   .mass = 1});
    bool ended = false;
    for (int step = 0; step < 10 && !ended; ++step) {
        world.step(sixtieth);
        for (const ContactView& contact : world.contacts()) {
            ended = ended || contact.isOver;
            EXPECT_GE(contact.triangleA, 0);
            EXPECT_EQ(contact.materialA.restitution, 1);
        }
    }
    EXPECT_TRUE(ended);
    world.remove(ball);
    EXPECT_TRUE(world.contacts().empty()) << "nothing is told of a body that is gone";
}

}  // namespace
}  // namespace cairn
