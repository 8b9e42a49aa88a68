// What bodies turn onto each other within a step is a contact from its start; what they only fly through, or do not
// reach, is none.
#include "engine/contacts/look_ahead.hpp"

#include "base/parallel.hpp"
#include "tests/engine/engine_kit.hpp"

#include <random>

namespace cairn {
namespace {

// Two bodies and what is known of their contacts, 5 mm ahead.
class Two {
public:
    Two(const BodyDef& a, const BodyDef& b) {
        add(a);
        add(b);
        contacts_.update({{0, 1}}, bodies_, CommonDrift<double>(), {.margin = 0.005}, *jobs_);
        known_ = pair().manifolds.size();
    }
    // The points that a look ahead finds.
    std::vector<ContactPointState<double>> foreseen() {
        NarrowCounts counts;
        const std::array<std::uint32_t, 1> pairs{0};
        foreseeContacts<double>(contacts_, pairs, bodies_, 1.0 / 60, NarrowPhase::Auto, *jobs_, counts);
        std::vector<ContactPointState<double>> points;
        for (std::size_t m = known_; m < pair().manifolds.size(); ++m) {
            for (const ContactPointState<double>& point : pair().manifolds[m].inForce()) {
                points.push_back(point);
            }
        }
        return points;
    }
    std::size_t known() const { return known_; }

private:
    void add(const BodyDef& def) { bodies_.add(BodyMaker<double>(0.5).make(def)); }
    const PairContacts<double>& pair() const { return contacts_.pairs()[0]; }

    std::shared_ptr<JobSystem> jobs_ = makeTbbJobSystem(1);
    BodyTable<double> bodies_;
    ContactTable<double> contacts_;
    std::size_t known_ = 0;
};

// It touches the top of the box with its left end, and its right end, .3 m above, comes down in the step.
BodyDef turningRod(double spin) {
    constexpr double tilt = 0.4;
    const Quatd lying(Eigen::AngleAxisd(tilt - 0.5 * std::numbers::pi, Vec3d::UnitZ()));
    return {.shapes = {capsule(0.1, 0.4)},
            .position = {0, 0.6 + 0.4 * std::sin(tilt) - 1e-3, 0},
            .rotation = lying,
            .linearVelocity = {0, -12, 0},
            .angularVelocity = {0, 0, spin}};
}

TEST(LookAhead, FindsTheFarEndOfARodThatTurnsOntoABox) {
    Two two({.shapes = {box(Vec3d::Constant(0.5))}}, turningRod(-24));
    ASSERT_EQ(two.known(), 1U);
    const auto points = two.foreseen();
    ASSERT_EQ(points.size(), 1U);
    EXPECT_GT(points[0].onB.y(), 0.3);  // of the rod's own axis
    EXPECT_GT(points[0].separation, 0.25);
    EXPECT_EQ(points[0].normalForce, 0.0);
}

TEST(LookAhead, FindsNothingOfWhatGoesTooSlowlyOrAway) {
    Two slow({.shapes = {box(Vec3d::Constant(0.5))}}, {.shapes = {box(Vec3d::Constant(0.3))},
                                                       .position = {0, 0.802, 0},
                                                       .linearVelocity = {0, -1, 0},
                                                       .angularVelocity = {0, 0, 1}});
    EXPECT_EQ(slow.foreseen().size(), 0U);
    BodyDef leaving = turningRod(-24);
    leaving.linearVelocity = -leaving.linearVelocity;
    Two away({.shapes = {box(Vec3d::Constant(0.5))}}, leaving);
    EXPECT_EQ(away.foreseen().size(), 0U);
}

// At the end of the step it would be beyond the middle, whence the other side is nearer: that must not draw it through.
TEST(LookAhead, DrawsNothingThroughAPlate) {
    Two two({.shapes = {box({2, 0.1, 2})}}, {.shapes = {box(Vec3d::Constant(0.2))},
                                             .position = {0, 0.302, 0},
                                             .linearVelocity = {0, -24, 0},
                                             .angularVelocity = {0, 0, 3}});
    for (const ContactPointState<double>& point : two.foreseen()) {
        EXPECT_GE(point.separation, 0.0);
    }
}

// Layers of rods, boxes and balls fall into a bin at up to 15 m/s, one island of more than a thousand pairs. Without a
// look ahead 129 of the contact points that steps end with are deeper than 5 cm.
TEST(LookAhead, HeapsGetLessDeep) {
    int deep = 0;
    for (const unsigned seed : {1U, 2U}) {
        Worldd world({.sleep = {.enabled = false}});
        world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
        for (const double side : {-1.0, 1.0}) {
            world.add({.type = BodyType::Static, .shapes = {box({0.5, 20, 7})}, .position = {6.5 * side, 20, 0}});
            world.add({.type = BodyType::Static, .shapes = {box({6, 20, 0.5})}, .position = {0, 20, 6.5 * side}});
        }
        std::mt19937 random(seed);
        const auto uniform = [&](double low, double high) {
            return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
        };
        for (int i = 0; i < 1000; ++i) {
            const double size = uniform(0.3, 0.5);
            const std::array shapes{box(size * Vec3d(0.7, 0.55, 0.6)), capsule(0.5 * size, 0.5 * size), sphere(size)};
            const Vec3d turn(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2));
            const int k = i % 100;
            const Vec3d corner(1.2 * (k % 10) - 5.4, 0.8 + 1.2 * (i / 100), 1.2 * (k / 10) - 5.4);
            world.add({.shapes = {shapes[static_cast<std::size_t>(i % 3)]},
                       .position = corner + 0.05 * Vec3d(uniform(-1, 1), 0, uniform(-1, 1)),
                       .rotation = Quatd(Eigen::AngleAxisd(turn.norm(), turn.normalized()))});
        }
        for (int step = 0; step < 150; ++step) {
            world.step(1.0 / 60);
            for (const ContactView& contact : world.contacts()) {
                deep += contact.separation < -0.05 ? 1 : 0;
            }
        }
    }
    expectBelow("contact points deeper than 5 cm", deep, 102);
}

}  // namespace
}  // namespace cairn
