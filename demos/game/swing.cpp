// A ball on a rod of 1 m swings once, with the game's own job system and the game's own engine/engine.hpp. Prints the
// time of the swing (s; a pendulum's is 2.367842 from 90 degrees) and how many loops the job system was given.
#include <cairn/cairn.hpp>
#include <engine/engine.hpp>

#include <atomic>
#include <cstdio>
#include <thread>
#include <vector>

namespace {

// Two threads, each a half of the range.
class GameJobs : public cairn::JobSystem {
public:
    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        ++loops;
        if (count <= grain) {
            body(0, count);
            return;
        }
        std::thread other([&] { body(count / 2, count); });
        body(0, count / 2);
        other.join();
    }
    int threadCount() const override { return 2; }

    std::atomic<int> loops = 0;
};

}  // namespace

int main() {
    const auto jobs = std::make_shared<GameJobs>();
    cairn::WorldDef def;
    def.jobs = jobs;
    def.sleep.enabled = false;
    cairn::Worldd world(def);
    const cairn::BodyId hook =
        world.add(cairn::BodyDef{.type = cairn::BodyType::Static, .shapes = {cairn::sphere(0.05)}});
    // Almost a point mass: the moment of inertia is that of 1 kg in 1 mm.
    const cairn::BodyId ball = world.add(cairn::BodyDef{
        .shapes = {cairn::sphere(0.1)}, .position = {1, 0, 0}, .mass = 1, .inertia = cairn::Vec3d::Constant(4e-7)});
    world.add(cairn::DistanceDef{.a = hook, .b = ball, .anchorA = {0, 0, 0}, .anchorB = {1, 0, 0}});
    // A second pair, so that there are two islands to share.
    const cairn::BodyId other =
        world.add(cairn::BodyDef{.shapes = {cairn::sphere(0.1)}, .position = {1, 0, 3}, .mass = 1});
    const cairn::BodyId otherHook = world.add(
        cairn::BodyDef{.type = cairn::BodyType::Static, .shapes = {cairn::sphere(0.05)}, .position = {0, 0, 3}});
    world.add(cairn::HingeDef{.a = otherHook, .b = other, .anchor = {0, 0, 3}, .axis = {0, 0, 1}});

    game::Clock clock(480);
    bool fallen = false;
    // Back where it started when its speed along y turns from up to down, near the starting side.
    double before = 0;
    while (clock.now() < 4) {
        world.step(clock.dt());
        clock.tick();
        const double speed = world.linearVelocity(ball).y();
        fallen = fallen || world.pose(ball).position.x() < -0.9;
        if (fallen && world.pose(ball).position.x() > 0.9 && before > 0 && speed <= 0) {
            break;
        }
        before = speed;
    }
    std::printf("%.4f %d\n", clock.now(), jobs->loops.load());
}
