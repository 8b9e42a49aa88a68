// cairn_bench_queries: contact points of a pair and rays through a scene, Cairn's and Bullet's, on the same poses in
// one run. Processor time of one thread, the least of several rounds.
#include <btBulletCollisionCommon.h>
#include <cairn/engine/engine.hpp>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <random>

namespace cairn {
namespace {

double processorTime() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// s, of one call of `work` at its fastest.
template <class Work>
double fastest(int rounds, Work work) {
    double least = 1e9;
    for (int i = 0; i < rounds; ++i) {
        const double start = processorTime();
        work();
        least = std::min(least, processorTime() - start);
    }
    return least;
}

btVector3 toBullet(const Vec3d& v) {
    return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

btTransform toBullet(const Posed& pose) {
    const Quatd& q = pose.rotation;
    const btQuaternion turn(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w()));
    return btTransform(turn, toBullet(pose.position));
}

struct Kind {
    const char* name;
    Shape shape;
    std::unique_ptr<btCollisionShape> peer;
};

Shape octahedron(double r) {
    return hull({{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}},
                {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
}

std::vector<Kind> kinds() {
    std::vector<Kind> all;
    all.push_back({"sphere", sphere(0.3), std::make_unique<btSphereShape>(btScalar(0.3))});
    all.push_back({"capsule", capsule(0.2, 0.25), std::make_unique<btCapsuleShape>(btScalar(0.2), btScalar(0.5))});
    all.push_back({"box", box({0.3, 0.2, 0.25}), std::make_unique<btBoxShape>(btVector3(0.3F, 0.2F, 0.25F))});
    all.push_back({"cylinder", cylinder(0.25, 0.3), std::make_unique<btCylinderShape>(btVector3(0.25F, 0.3F, 0.25F))});
    all.push_back({"cone", cone(0.3, 0.3), std::make_unique<btConeShape>(btScalar(0.3), btScalar(0.6))});
    auto peer = std::make_unique<btConvexHullShape>();
    for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-0.35, 0.35}) {
            peer->addPoint(toBullet(sign * Vec3d::Unit(axis)));
        }
    }
    all.push_back({"hull", octahedron(0.35), std::move(peer)});
    return all;
}

class Random {
public:
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    Vec3d vector(double reach) { return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)}; }
    Quatd rotation() { return expQuat<double>(vector(2)); }

private:
    std::mt19937 engine_{1};
};

int pointsOf(btCollisionAlgorithm& algorithm) {
    btManifoldArray manifolds;
    algorithm.getAllContactManifolds(manifolds);
    int points = 0;
    for (int k = 0; k < manifolds.size(); ++k) {
        points += manifolds[k]->getNumContacts();
    }
    return points;
}

void pairs() {
    const std::vector<Kind> all = kinds();
    constexpr int poses = 200;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    const btDispatcherInfo info;
    std::printf("%-20s %10s %10s   ns a pair; contact points a pair\n", "pair", "Cairn", "Bullet");
    for (std::size_t i = 0; i < all.size(); ++i) {
        for (std::size_t j = i; j < all.size(); ++j) {
            Random random;
            std::vector<Posed> at;
            for (int k = 0; k < poses; ++k) {
                at.push_back({0.45 * random.vector(1).normalized(), random.rotation()});
            }
            std::vector<PairCache> caches(poses);
            std::vector<Manifold> found;
            NarrowCounts counts;
            int points = 0;
            const auto ours = [&] {
                points = 0;
                for (std::size_t k = 0; k < at.size(); ++k) {
                    found.clear();
                    collide({&all[i].shape, 1}, {&all[j].shape, 1}, at[k], 0.02, caches[k], found, counts);
                    points += found.empty() ? 0 : found[0].count;
                }
            };
            // A pair each, that keeps its algorithm and manifold as in a world.
            std::vector<std::unique_ptr<btCollisionObject>> objects;
            std::vector<btCollisionAlgorithm*> algorithms;
            std::vector<btPersistentManifold*> manifolds;
            for (const Posed& pose : at) {
                for (const auto& [side, place] : {std::pair{i, Posed{}}, std::pair{j, pose}}) {
                    objects.push_back(std::make_unique<btCollisionObject>());
                    objects.back()->setCollisionShape(all[side].peer.get());
                    objects.back()->setWorldTransform(toBullet(place));
                }
                const std::size_t k = objects.size() - 2;
                const btCollisionObjectWrapper a(nullptr, all[i].peer.get(), objects[k].get(),
                                                 objects[k]->getWorldTransform(), -1, -1);
                const btCollisionObjectWrapper b(nullptr, all[j].peer.get(), objects[k + 1].get(),
                                                 objects[k + 1]->getWorldTransform(), -1, -1);
                manifolds.push_back(dispatcher.getNewManifold(objects[k].get(), objects[k + 1].get()));
                algorithms.push_back(dispatcher.findAlgorithm(&a, &b, manifolds.back(), BT_CONTACT_POINT_ALGORITHMS));
            }
            int peerPoints = 0;
            const auto peers = [&] {
                peerPoints = 0;
                for (std::size_t k = 0; k < at.size(); ++k) {
                    const btCollisionObjectWrapper a(nullptr, all[i].peer.get(), objects[2 * k].get(),
                                                     objects[2 * k]->getWorldTransform(), -1, -1);
                    const btCollisionObjectWrapper b(nullptr, all[j].peer.get(), objects[2 * k + 1].get(),
                                                     objects[2 * k + 1]->getWorldTransform(), -1, -1);
                    btManifoldResult result(&a, &b);
                    algorithms[k]->processCollision(&a, &b, info, &result);
                    peerPoints += pointsOf(*algorithms[k]);
                }
            };
            const double cairn = fastest(30, ours);
            const double bullet = fastest(30, peers);
            std::printf("%-9s- %-9s %10.0f %10.0f   %.2f %.2f\n", all[i].name, all[j].name, 1e9 * cairn / poses,
                        1e9 * bullet / poses, 1.0 * points / poses, 1.0 * peerPoints / poses);
            for (std::size_t k = 0; k < at.size(); ++k) {
                algorithms[k]->~btCollisionAlgorithm();
                dispatcher.freeCollisionAlgorithm(algorithms[k]);
                dispatcher.releaseManifold(manifolds[k]);
            }
        }
    }
}

void rays(int bodies) {
    const std::vector<Kind> all = kinds();
    Random random;
    const double reach = 0.9 * std::cbrt(bodies);  // m
    Worldd world;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase phase;
    btCollisionWorld peer(&dispatcher, &phase, &configuration);
    std::vector<std::unique_ptr<btCollisionObject>> objects;
    for (int i = 0; i < bodies; ++i) {
        const Kind& kind = all[static_cast<std::size_t>(i) % all.size()];
        const Posed pose{random.vector(reach), random.rotation()};
        world.add(
            {.type = BodyType::Static, .shapes = {kind.shape}, .position = pose.position, .rotation = pose.rotation});
        objects.push_back(std::make_unique<btCollisionObject>());
        objects.back()->setCollisionShape(kind.peer.get());
        objects.back()->setWorldTransform(toBullet(pose));
        peer.addCollisionObject(objects.back().get());
    }
    world.step(1.0 / 60);
    peer.updateAabbs();
    std::vector<Ray> asked;
    for (int i = 0; i < 2000; ++i) {
        asked.push_back({.origin = random.vector(reach), .direction = random.vector(1), .length = reach});
    }
    const WorldQuery query = world.query();
    int hits = 0;
    int peerHits = 0;
    const double cairn = fastest(10, [&] {
        hits = 0;
        for (const Ray& ray : asked) {
            hits += query.rayCast(ray) ? 1 : 0;
        }
    });
    const double bullet = fastest(10, [&] {
        peerHits = 0;
        for (const Ray& ray : asked) {
            const btVector3 from = toBullet(ray.origin);
            const btVector3 to = toBullet(ray.origin + ray.length * ray.direction.normalized());
            btCollisionWorld::ClosestRayResultCallback result(from, to);
            peer.rayTest(from, to, result);
            peerHits += result.hasHit() ? 1 : 0;
        }
    });
    const double count = static_cast<double>(asked.size());
    std::printf("%d bodies: closest hits a second: Cairn %.0f, Bullet %.0f (hits %d, %d of %.0f)\n", bodies,
                count / cairn, count / bullet, hits, peerHits, count);
    for (const auto& object : objects) {
        peer.removeCollisionObject(object.get());
    }
}

}  // namespace
}  // namespace cairn

int main() {
    cairn::pairs();
    for (const int bodies : {100, 1000, 5000}) {
        cairn::rays(bodies);
    }
    return 0;
}
