// Two worlds that are told the same, of all shapes and deformables there are: one runs its loops from their beginning
// to their end, the other cuts them into single turns and runs these backwards. What both answer is the same to the
// last bit, and what they answer to many questions at once is what they answer to each.
#include "tests/fuzz/input.hpp"

#include <cairn/cairn.hpp>
#include <cairn/deformable.hpp>

#include <algorithm>
#include <optional>

namespace cairn::fuzz {
namespace {

constexpr std::size_t mostBodies = 60;
constexpr int mostCalls = 40;
constexpr int mostSteps = 10;

class BackwardJobs : public JobSystem {
public:
    void parallelFor(std::size_t count, std::size_t /*grain*/,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        for (std::size_t i = count; i > 0; --i) {
            body(i - 1, i);
        }
    }
    int threadCount() const override { return 4; }
};

Shape octahedron(const Vec3d& size) {
    std::vector<Vec3d> vertices;
    for (int axis = 0; axis < 3; ++axis) {
        vertices.emplace_back(size[axis] * Vec3d::Unit(axis));
        vertices.emplace_back(-vertices.back());
    }
    std::vector<std::vector<int>> faces;
    for (int k = 0; k < 8; ++k) {
        const int x = k & 1;
        const int y = 2 + (k >> 1 & 1);
        const int z = 4 + (k >> 2 & 1);
        const bool isTurned = ((k ^ k >> 1 ^ k >> 2) & 1) != 0;
        faces.push_back(isTurned ? std::vector<int>{x, z, y} : std::vector<int>{x, y, z});
    }
    return hull(vertices, faces);
}

TriangleMesh boxMesh(const Vec3d& half) {
    TriangleMesh made;
    for (int k = 0; k < 8; ++k) {
        const Vec3d corner((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
        made.vertices.emplace_back(corner.cwiseProduct(half));
    }
    made.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return made;
}

template <class S>
class Twins {
public:
    explicit Twins(Input input) : input_(input), worlds_{world(nullptr), world(std::make_shared<BackwardJobs>())} {}

    void run() {
        add({.type = BodyType::Static, .shapes = {ground()}});
        for (int call = 0; call < mostCalls && steps_ < mostSteps && !input_.isEmpty(); ++call) {
            act();
        }
        step();
        step();
    }

private:
    // Both read the same beginning.
    World<S> world(std::shared_ptr<JobSystem> jobs) {
        Input own = input_;
        const std::uint8_t how = own.byte();
        WorldDef def;
        def.solver = solverNamed(solverList()[own.below(solverList().size())].name);
        def.sleep.enabled = (how & 1) != 0;
        def.sleep.time = 0.05;
        def.narrowPhase = (how & 2) != 0 ? NarrowPhase::Fcl : NarrowPhase::Auto;
        if ((how & 4) != 0) {
            def.accuracy.position = 0.001;
            def.accuracy.maxSubdivisions = 4;
        }
        def.accuracy.coulomb = (how & 8) != 0;
        def.manifoldReuseDistance = (how & 16) != 0 ? 0 : 1e-4;
        if (jobs) {
            input_ = own;
            def.jobs = std::move(jobs);
        }
        return World<S>(def);
    }

    // What both answer to f; nothing where both refuse in the same words.
    template <class F>
    auto ask(F f) {
        using Answer = std::decay_t<decltype(f(worlds_[0]))>;
        std::array<std::optional<Answer>, 2> answers;
        std::array<std::string, 2> refusals;
        for (std::size_t k = 0; k < 2; ++k) {
            try {
                answers[k] = f(worlds_[k]);
            } catch (const InputError& error) {
                refusals[k] = error.what();
            }
        }
        claim(refusals[0] == refusals[1], "both refuse the same, in the same words");
        return answers;
    }
    template <class F>
    void tell(F f) {
        ask([&](World<S>& world) {
            f(world);
            return true;
        });
    }

    BodyId add(const BodyDef& def) {
        const auto ids = ask([&](World<S>& world) { return world.add(def); });
        if (ids[0]) {
            claim(ids[0]->index == ids[1]->index, "both name a body alike");
            bodies_.push_back({*ids[0], *ids[1]});
        }
        return ids[0].value_or(BodyId{});
    }

    std::array<BodyId, 2> body() {
        return bodies_.empty() ? std::array<BodyId, 2>{} : bodies_[input_.below(bodies_.size())];
    }
    // For each world its own: ids of one are strangers in the other.
    template <class F>
    void tellOf(F f) {
        const std::array<BodyId, 2> ids = body();
        tell([&](World<S>& world) { f(world, ids[&world == &worlds_[0] ? 0 : 1]); });
    }

    Shape convexShape() {
        const Vec3d size(input_.within(0.05, 0.6), input_.within(0.05, 0.6), input_.within(0.05, 0.6));
        switch (input_.below(7)) {
            case 0:
                return sphere(size.x());
            case 1:
                return capsule(size.x(), size.y());
            case 2:
                return cylinder(size.x(), size.y());
            case 3:
                return cone(size.x(), size.y());
            case 4:
                return ellipsoid(size);
            case 5:
                return octahedron(size);
            default:
                return box(size);
        }
    }

    Shape ground() {
        constexpr int side = 5;
        switch (input_.below(4)) {
            case 0: {
                std::vector<double> heights;
                for (int k = 0; k < side * side; ++k) {
                    const std::uint8_t byte = input_.byte();
                    heights.push_back(byte == 255 ? std::nan("") : byte / 256.0);
                }
                heights[0] = heights[1] = heights[side] = 0;
                return heightField(side, side, heights, 1.5);
            }
            case 1: {
                TriangleMesh floor = clothGrid({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, side - 1, side - 1);
                for (Vec3d& vertex : floor.vertices) {
                    vertex.y() = input_.byte() / 256.0;
                }
                return mesh(floor);
            }
            case 2:
                return mesh(boxMesh({4, 0.5, 4}));
            default:
                return halfSpace({input_.within(-0.3, 0.3), 1, 0}, 0);
        }
    }

    void addBody() {
        BodyDef def;
        for (std::size_t k = input_.byte() < 220 ? 1 : 1 + input_.below(3); k > 0; --k) {
            Shape made = convexShape();
            made.pose.position = input_.vectorWithin(0.3);
            def.shapes.push_back(made);
        }
        const std::uint8_t how = input_.byte();
        def.shapes[0].material.restitution = how % 4 == 1 ? 0.8 : 0;
        def.shapes[0].material.rollingFriction = how % 4 == 2 ? 0.01 : 0;
        def.type = how < 225 ? BodyType::Dynamic : how < 240 ? BodyType::Kinematic : BodyType::Static;
        if (how % 32 == 31) {
            def.type = BodyType::Static;
            def.shapes = {ground()};
        }
        def.continuous = static_cast<Continuous>(how % 3);
        def.lockAngular[how % 3] = how % 16 == 7;
        def.position = input_.vectorWithin(2) + Vec3d(0, 1.5, 0);
        def.rotation = input_.rotation();
        def.linearVelocity = input_.vectorWithin(how % 8 == 3 ? 60 : 2);
        def.angularVelocity = input_.vectorWithin(4);
        add(def);
    }

    void addJoint() {
        const std::array<BodyId, 2> a = body();
        const std::array<BodyId, 2> b = body();
        const Vec3d anchor = input_.vectorWithin(2);
        const Vec3d axis = input_.rotation() * Vec3d::UnitX();
        const std::size_t kind = input_.below(4);
        const double speed = input_.within(-3, 3);
        tell([&](World<S>& world) {
            const std::size_t k = &world == &worlds_[0] ? 0 : 1;
            switch (kind) {
                case 0:
                    world.addJoint(BallDef{.a = a[k], .b = b[k], .anchor = anchor});
                    break;
                case 1:
                    world.addJoint(HingeDef{
                        .a = a[k], .b = b[k], .anchor = anchor, .axis = axis, .motorSpeed = speed, .motorTorque = 2});
                    break;
                case 2:
                    world.addJoint(DistanceDef{.a = a[k], .b = b[k]});
                    break;
                default:
                    world.addJoint(WeldDef{.a = a[k], .b = b[k], .anchor = anchor});
            }
        });
    }

    void addDeformable() {
        const std::array<BodyId, 2> holder = body();
        const Vec3d place = input_.vectorWithin(1) + Vec3d(0, 1.5, 0);
        const double length = input_.within(0.2, 1);
        const int count = 1 + static_cast<int>(input_.below(4));
        const double stiffness = std::exp2(input_.within(0, 20));
        const std::size_t kind = input_.below(3);
        const bool isHeld = input_.flag();
        const auto made = ask([&](World<S>& world) {
            std::vector<Attachment> held;
            if (isHeld) {
                held.push_back({.body = holder[&world == &worlds_[0] ? 0 : 1], .position = place});
            }
            if (kind == 0) {
                return cairn::addDeformable(
                    world,
                    RopeDef{.from = place, .to = place + Vec3d(length, 0, 0), .segments = count, .attachments = held});
            }
            if (kind == 1) {
                return cairn::addDeformable(world,
                                            ClothDef{.mesh = clothGrid(place, {length, 0, 0}, {0, 0, length}, count, 2),
                                                     .stretchStiffness = stiffness,
                                                     .bendStiffness = 1e-6 * stiffness,
                                                     .attachments = held});
            }
            TriangleMesh surface = boxMesh(Vec3d::Constant(0.5 * length));
            for (Vec3d& vertex : surface.vertices) {
                vertex += place;
            }
            return cairn::addDeformable(world, SoftBodyDef{.surface = surface,
                                                           .cell = 0.9 * length,
                                                           .radius = 0.1 * length,
                                                           .youngModulus = 10 * stiffness,
                                                           .bulkModulus = 30 * stiffness,
                                                           .attachments = held});
        });
        if (!made[0]) {
            return;
        }
        for (std::size_t i = 0; i < made[0]->particles.size(); ++i) {
            bodies_.push_back({made[0]->particles[i], made[1]->particles[i]});
        }
        const TriangleMesh drawn = surfaceOf(worlds_[0], *made[0]);
        for (const Vec3d& vertex : drawn.vertices) {
            claim(vertex.allFinite(), "a surface is somewhere");
        }
    }

    void remove() {
        const std::array<BodyId, 2> ids = body();
        tell([&](World<S>& world) { world.remove(ids[&world == &worlds_[0] ? 0 : 1]); });
        std::erase(bodies_, ids);
    }

    void push() {
        const Vec3<S> by = input_.vectorWithin(20).template cast<S>();
        const Vec3<S> at = input_.vectorWithin(2).template cast<S>();
        switch (input_.below(5)) {
            case 0:
                return tellOf([&](World<S>& world, BodyId id) { world.applyForce(id, by, at); });
            case 1:
                return tellOf([&](World<S>& world, BodyId id) { world.applyImpulse(id, by, at); });
            case 2:
                return tellOf([&](World<S>& world, BodyId id) { world.setVelocity(id, by, at); });
            case 3:
                return tellOf([&](World<S>& world, BodyId id) { world.setPose(id, {at, world.pose(id).rotation}); });
            default:
                return tellOf([&](World<S>& world, BodyId id) { world.wake(id); });
        }
    }

    void moveWorlds() {
        for (World<S>& world : worlds_) {
            World<S> moved = std::move(world);
            // NOLINTNEXTLINE(bugprone-use-after-move): it says what a world does then
            claim((world.step(S(0.01)).flags & FlagRefused) != 0, "a world that was moved from refuses");
            world = std::move(moved);
        }
    }

    void setSolver() {
        const SolverInfo& info = solverList()[input_.below(solverList().size())];
        tell([&](World<S>& world) { world.setSolver(solverNamed(info.name)); });
    }

    void queryRays() {
        std::vector<Ray> rays(3);
        for (Ray& ray : rays) {
            ray = {.origin = input_.vectorWithin(4), .direction = input_.vectorWithin(1), .backFaces = input_.flag()};
            ray.direction += 0.001 * Vec3d::Ones();
        }
        const auto answers = ask([&](World<S>& world) {
            const WorldQuery query = world.query();
            auto many = query.rayCasts(rays);
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const auto one = query.rayCast(rays[i]);
                const auto all = query.rayCastAll(rays[i]);
                claim(one.has_value() == many[i].has_value() && one.has_value() == query.rayHits(rays[i]) &&
                          one.has_value() == !all.empty(),
                      "all ways to cast a ray agree on whether it hits");
                if (!one) {
                    continue;
                }
                claim(one->body == many[i]->body && one->distance == many[i]->distance, "many rays answer as one");
                double least = one->distance;
                for (const auto& hit : all) {
                    least = std::min(least, hit.distance);
                    claim(hit.body != one->body || hit.distance == one->distance, "one body is hit in one place");
                }
                claim(least == one->distance, "the first hit is the nearest of all");
                claim(
                    (rays[i].origin + one->distance * rays[i].direction.normalized() - one->point).norm() < 1e-9 * 100,
                    "a hit lies on its ray");
            }
            return many;
        });
        for (std::size_t i = 0; i < rays.size(); ++i) {
            claim((*answers[0])[i].has_value() == (*answers[1])[i].has_value() &&
                      (!(*answers[0])[i] || (*answers[0])[i]->distance == (*answers[1])[i]->distance),
                  "a ray meets the same in both");
        }
    }

    void queryProbe() {
        const std::vector<Shape> shapes = {convexShape()};
        const Probe probe{shapes, {input_.vectorWithin(2), input_.rotation()}};
        const std::vector<ProbeCast> casts = {{probe, input_.vectorWithin(4)}};
        ask([&](World<S>& world) {
            const WorldQuery query = world.query();
            const auto hit = query.shapeCast(probe, casts[0].displacement);
            const auto many = query.shapeCasts(casts);
            const auto all = query.shapeCastAll(probe, casts[0].displacement);
            claim(hit.has_value() == many[0].has_value() && hit.has_value() == !all.empty() &&
                      hit.has_value() == query.shapeCastHits(probe, casts[0].displacement),
                  "all ways to cast a shape agree on whether it hits");
            if (hit) {
                claim(hit->body == many[0]->body && hit->fraction == many[0]->fraction, "many casts answer as one");
                const auto least = std::min_element(
                    all.begin(), all.end(), [](const auto& p, const auto& q) { return p.fraction < q.fraction; });
                claim(least->fraction == hit->fraction, "the first impact is the earliest of all");
            }
            const std::vector<BodyId> over = query.overlapping(probe);
            claim(query.overlappings({&probe, 1})[0] == over, "many probes answer as one");
            const auto nearest = query.closest(probe);
            const auto again = query.closests({&probe, 1})[0];
            claim(nearest.has_value() == again.has_value() && (!nearest || nearest->distance == again->distance),
                  "many distances answer as one");
            claim(over.empty() || (nearest && nearest->distance < 1e-3), "what overlaps has no distance");
            claim(!nearest || nearest->distance > -1e-3 || !over.empty(), "what is deep in another overlaps it");
            return true;
        });
    }

    void act() {
        switch (input_.below(16)) {
            case 0:
            case 1:
            case 2:
            case 3:
            case 4:
                return bodies_.size() < mostBodies ? addBody() : step();
            case 5:
                return addJoint();
            case 6:
                return bodies_.size() < mostBodies ? addDeformable() : step();
            case 7:
                return remove();
            case 8:
                return push();
            case 9:
                return moveWorlds();
            case 10:
                return setSolver();
            case 11:
                return queryRays();
            case 12:
                return queryProbe();
            default:
                return step();
        }
    }

    void step() {
        ++steps_;
        const StepReport& one = worlds_[0].step(S(1.0 / 60));
        const StepReport& other = worlds_[1].step(S(1.0 / 60));
        claim(one.flags == other.flags, "both raise the same flags");
        claim(one.kineticEnergy == other.kineticEnergy && one.error.position == other.error.position &&
                  one.error.residualMomentum == other.error.residualMomentum,
              "both err the same");
        claim(one.counts.contacts == other.counts.contacts && one.counts.awake == other.counts.awake,
              "both count the same");
        for (const std::array<BodyId, 2>& ids : bodies_) {
            const Pose<S> pose = worlds_[0].pose(ids[0]);
            const Pose<S> twin = worlds_[1].pose(ids[1]);
            claim(pose.isFinite(), "a body is somewhere");
            claim(pose.position == twin.position && pose.rotation.coeffs() == twin.rotation.coeffs(),
                  "both move bodies alike");
            claim(worlds_[0].linearVelocity(ids[0]) == worlds_[1].linearVelocity(ids[1]) &&
                      worlds_[0].angularVelocity(ids[0]) == worlds_[1].angularVelocity(ids[1]),
                  "both speed bodies alike");
        }
        const std::vector<ContactView> contacts = worlds_[0].contacts();
        const std::vector<ContactView> twins = worlds_[1].contacts();
        claim(contacts.size() == twins.size(), "both have the same contacts");
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            claim(contacts[i].a.index == twins[i].a.index && contacts[i].impulse == twins[i].impulse,
                  "both give the same impulses");
        }
    }

    Input input_;
    int steps_ = 0;
    std::array<World<S>, 2> worlds_;
    std::vector<std::array<BodyId, 2>> bodies_;
};

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    cairn::fuzz::Input input(data, size);
    if (input.flag()) {
        cairn::fuzz::Twins<float>(input).run();
    } else {
        cairn::fuzz::Twins<double>(input).run();
    }
    return 0;
}
