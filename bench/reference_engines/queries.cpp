// cairn_bench_queries: contact points of a pair, rays through a scene and rays at a mesh, Cairn's, Bullet's and ODE's,
// on the same poses in one run. Processor time of one thread, the least of several runs.
#include <cairn/cairn.hpp>

#include "base/so3.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"

#include <btBulletCollisionCommon.h>
#include <ode/ode.h>

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
double fastest(int repeats, Work work) {
    double smallest = 1e9;
    for (int i = 0; i < repeats; ++i) {
        const double start = processorTime();
        work();
        smallest = std::min(smallest, processorTime() - start);
    }
    return smallest;
}

btVector3 toBullet(const Vec3d& v) {
    return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

btTransform toBullet(const Posed& pose) {
    const Quatd& q = pose.rotation;
    const btQuaternion turn(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w()));
    return btTransform(turn, toBullet(pose.position));
}

// ODE's capsules and cylinders stand along z.
void place(dGeomID geom, const Posed& pose, bool standing) {
    const Quatd turned = turnBetween<double>(Vec3d::UnitZ(), Vec3d::UnitY());
    const Quatd q = standing ? pose.rotation * turned : pose.rotation;
    const dQuaternion ode = {q.w(), q.x(), q.y(), q.z()};
    dGeomSetPosition(geom, pose.position.x(), pose.position.y(), pose.position.z());
    dGeomSetQuaternion(geom, ode);
}

struct Kind {
    const char* name;
    Shape shape;
    std::unique_ptr<btCollisionShape> reference;
    dGeomID (*ode)();  // a new one; none: ODE has no such shape
    bool standing = false;
};

constexpr double tip = 0.35;  // m, of the octahedron

// In ODE's form, which is not copied: planes, points, and for each face its count of corners and them.
dGeomID odeOctahedron() {
    static const std::vector<double> points = {tip, 0, 0, -tip, 0, 0, 0, tip, 0, 0, -tip, 0, 0, 0, tip, 0, 0, -tip};
    static const std::vector<unsigned> faces = {3, 0, 2, 4, 3, 2, 1, 4, 3, 1, 3, 4, 3, 3, 0, 4,
                                                3, 2, 0, 5, 3, 1, 2, 5, 3, 3, 1, 5, 3, 0, 3, 5};
    static std::vector<double> planes;
    if (planes.empty()) {
        for (const double z : {1.0, -1.0}) {
            for (const auto& [x, y] : {std::pair{1.0, 1.0}, {-1.0, 1.0}, {-1.0, -1.0}, {1.0, -1.0}}) {
                const Vec3d normal = Vec3d(x, y, z).normalized();
                planes.insert(planes.end(), {normal.x(), normal.y(), normal.z(), tip / std::sqrt(3.0)});
            }
        }
    }
    return dCreateConvex(nullptr, planes.data(), 8, points.data(), 6, faces.data());
}

Shape octahedron(double r) {
    return hull({{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}},
                {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
}

std::vector<Kind> kinds() {
    std::vector<Kind> all;
    all.push_back({"sphere", sphere(0.3), std::make_unique<btSphereShape>(btScalar(0.3)),
                   [] { return dCreateSphere(nullptr, 0.3); }});
    all.push_back({"capsule", capsule(0.2, 0.25), std::make_unique<btCapsuleShape>(btScalar(0.2), btScalar(0.5)),
                   [] { return dCreateCapsule(nullptr, 0.2, 0.5); }, true});
    all.push_back({"box", box({0.3, 0.2, 0.25}), std::make_unique<btBoxShape>(btVector3(0.3F, 0.2F, 0.25F)),
                   [] { return dCreateBox(nullptr, 0.6, 0.4, 0.5); }});
    all.push_back({"cylinder", cylinder(0.25, 0.3), std::make_unique<btCylinderShape>(btVector3(0.25F, 0.3F, 0.25F)),
                   [] { return dCreateCylinder(nullptr, 0.25, 0.6); }, true});
    all.push_back({"cone", cone(0.3, 0.3), std::make_unique<btConeShape>(btScalar(0.3), btScalar(0.6)), nullptr});
    auto reference = std::make_unique<btConvexHullShape>();
    for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-tip, tip}) {
            reference->addPoint(toBullet(sign * Vec3d::Unit(axis)));
        }
    }
    all.push_back({"hull", octahedron(tip), std::move(reference), odeOctahedron});
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
    std::printf("%-20s %10s %10s %10s   ns a pair; contact points a pair\n", "pair", "Cairn", "Bullet", "ODE");
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
                    objects.back()->setCollisionShape(all[side].reference.get());
                    objects.back()->setWorldTransform(toBullet(place));
                }
                const std::size_t k = objects.size() - 2;
                const btCollisionObjectWrapper a(nullptr, all[i].reference.get(), objects[k].get(),
                                                 objects[k]->getWorldTransform(), -1, -1);
                const btCollisionObjectWrapper b(nullptr, all[j].reference.get(), objects[k + 1].get(),
                                                 objects[k + 1]->getWorldTransform(), -1, -1);
                manifolds.push_back(dispatcher.getNewManifold(objects[k].get(), objects[k + 1].get()));
                algorithms.push_back(dispatcher.findAlgorithm(&a, &b, manifolds.back(), BT_CONTACT_POINT_ALGORITHMS));
            }
            int referencePoints = 0;
            const auto references = [&] {
                referencePoints = 0;
                for (std::size_t k = 0; k < at.size(); ++k) {
                    const btCollisionObjectWrapper a(nullptr, all[i].reference.get(), objects[2 * k].get(),
                                                     objects[2 * k]->getWorldTransform(), -1, -1);
                    const btCollisionObjectWrapper b(nullptr, all[j].reference.get(), objects[2 * k + 1].get(),
                                                     objects[2 * k + 1]->getWorldTransform(), -1, -1);
                    btManifoldResult result(&a, &b);
                    algorithms[k]->processCollision(&a, &b, info, &result);
                    referencePoints += pointsOf(*algorithms[k]);
                }
            };
            std::vector<dGeomID> geoms;
            const bool odeToo = all[i].ode != nullptr && all[j].ode != nullptr;
            for (std::size_t k = 0; odeToo && k < at.size(); ++k) {
                for (const auto& [side, pose] : {std::pair{i, Posed{}}, std::pair{j, at[k]}}) {
                    geoms.push_back(all[side].ode());
                    place(geoms.back(), pose, all[side].standing);
                }
            }
            int odePoints = 0;
            const auto odes = [&] {
                odePoints = 0;
                std::array<dContactGeom, 16> contacts;
                for (std::size_t k = 0; k < geoms.size(); k += 2) {
                    odePoints += dCollide(geoms[k], geoms[k + 1], static_cast<int>(contacts.size()), contacts.data(),
                                          sizeof(dContactGeom));
                }
            };
            const double cairn = fastest(30, ours);
            const double bullet = fastest(30, references);
            const double ode = fastest(30, odes);
            std::printf("%-9s- %-9s %10.0f %10.0f", all[i].name, all[j].name, 1e9 * cairn / poses,
                        1e9 * bullet / poses);
            if (odeToo) {
                std::printf(" %10.0f", 1e9 * ode / poses);
            } else {
                std::printf(" %10s", "-");
            }
            std::printf("   %.2f %.2f %.2f\n", 1.0 * points / poses, 1.0 * referencePoints / poses,
                        1.0 * odePoints / poses);
            for (const dGeomID geom : geoms) {
                dGeomDestroy(geom);
            }
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
    btCollisionWorld reference(&dispatcher, &phase, &configuration);
    std::vector<std::unique_ptr<btCollisionObject>> objects;
    std::vector<Posed> poses;
    for (int i = 0; i < bodies; ++i) {
        const Kind& kind = all[static_cast<std::size_t>(i) % all.size()];
        const Posed& pose = poses.emplace_back(Posed{random.vector(reach), random.rotation()});
        world.add(
            {.type = BodyType::Static, .shapes = {kind.shape}, .position = pose.position, .rotation = pose.rotation});
        objects.push_back(std::make_unique<btCollisionObject>());
        objects.back()->setCollisionShape(kind.reference.get());
        objects.back()->setWorldTransform(toBullet(pose));
        reference.addCollisionObject(objects.back().get());
    }
    world.step(1.0 / 60);
    reference.updateAabbs();
    std::vector<Ray> asked;
    for (int i = 0; i < 2000; ++i) {
        asked.push_back({.origin = random.vector(reach), .direction = random.vector(1), .length = reach});
    }
    // ODE has no cone: its space holds the others, and its figure is for so many fewer.
    const dSpaceID space = dHashSpaceCreate(nullptr);
    for (int i = 0; i < bodies; ++i) {
        const Kind& kind = all[static_cast<std::size_t>(i) % all.size()];
        if (kind.ode != nullptr) {
            const dGeomID geom = kind.ode();
            place(geom, poses[static_cast<std::size_t>(i)], kind.standing);
            dSpaceAdd(space, geom);
        }
    }
    const WorldQuery query = world.query();
    int hits = 0;
    int referenceHits = 0;
    const double cairn = fastest(10, [&] {
        hits = 0;
        for (const Ray& ray : asked) {
            hits += query.rayCast(ray) ? 1 : 0;
        }
    });
    const double bullet = fastest(10, [&] {
        referenceHits = 0;
        for (const Ray& ray : asked) {
            const btVector3 from = toBullet(ray.origin);
            const btVector3 to = toBullet(ray.origin + ray.length * ray.direction.normalized());
            btCollisionWorld::ClosestRayResultCallback result(from, to);
            reference.rayTest(from, to, result);
            referenceHits += result.hasHit() ? 1 : 0;
        }
    });
    const dGeomID probe = dCreateRay(nullptr, reach);
    int odeHits = 0;
    const double ode = fastest(3, [&] {
        odeHits = 0;
        for (const Ray& ray : asked) {
            const Vec3d direction = ray.direction.normalized();
            dGeomRaySet(probe, ray.origin.x(), ray.origin.y(), ray.origin.z(), direction.x(), direction.y(),
                        direction.z());
            double nearest = unlimited;
            dSpaceCollide2(probe, dGeomID(space), &nearest, [](void* data, dGeomID one, dGeomID other) {
                dContactGeom hit;
                if (dCollide(one, other, 1, &hit, sizeof hit) > 0) {
                    double& smallest = *static_cast<double*>(data);
                    smallest = std::min(smallest, hit.depth);
                }
            });
            odeHits += std::isfinite(nearest) ? 1 : 0;
        }
    });
    const double count = static_cast<double>(asked.size());
    std::printf("%d bodies: closest hits a second: Cairn %.0f, Bullet %.0f, ODE %.0f (hits %d, %d, %d of %.0f)\n",
                bodies, count / cairn, count / bullet, count / ode, hits, referenceHits, odeHits, count);
    dGeomDestroy(probe);
    dSpaceDestroy(space);
    for (const auto& object : objects) {
        reference.removeCollisionObject(object.get());
    }
}

// Long slanted rays at waves of half a metre over `cells` x `cells` squares of half a metre.
void meshRays(int cells) {
    std::vector<double> heights;
    for (int i = 0; i <= cells; ++i) {
        for (int k = 0; k <= cells; ++k) {
            heights.push_back(0.5 * std::sin(0.05 * i) * std::cos(0.07 * k));
        }
    }
    const TriangleMesh triangles = surface(heightField(cells + 1, cells + 1, std::move(heights), 0.5));
    const Shape ground = mesh(triangles);
    btTriangleMesh soup;
    std::vector<double> vertices;
    std::vector<dTriIndex> indices;
    for (const Vec3d& v : triangles.vertices) {
        vertices.insert(vertices.end(), {v.x(), v.y(), v.z()});
    }
    for (const std::array<int, 3>& t : triangles.triangles) {
        const auto vertex = [&](std::size_t k) { return toBullet(triangles.vertices[static_cast<std::size_t>(t[k])]); };
        soup.addTriangle(vertex(0), vertex(1), vertex(2));
        for (const int corner : t) {
            indices.push_back(static_cast<dTriIndex>(corner));
        }
    }
    btBvhTriangleMeshShape reference(&soup, true);
    const dTriMeshDataID data = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildDouble(data, vertices.data(), 3 * sizeof(double), static_cast<int>(vertices.size() / 3),
                                indices.data(), static_cast<int>(indices.size()), 3 * sizeof(dTriIndex));
    const dGeomID odeMesh = dCreateTriMesh(nullptr, data, nullptr, nullptr, nullptr);
    const double half = 0.25 * cells;
    constexpr double length = 50;
    Random random;
    std::vector<Ray> asked(2000);
    for (Ray& ray : asked) {
        ray.origin = {random.uniform(-half, half), random.uniform(0.6, 10), random.uniform(-half, half)};
        ray.direction = Vec3d(random.uniform(-1, 1), random.uniform(-0.5, -0.01), random.uniform(-1, 1)).normalized();
        ray.length = length;
    }
    int hits = 0;
    int referenceHits = 0;
    int odeHits = 0;
    const double cairn = fastest(10, [&] {
        hits = 0;
        for (const Ray& ray : asked) {
            hits += rayCast({&ground, 1}, {}, ray) ? 1 : 0;
        }
    });
    btCollisionObject object;
    object.setCollisionShape(&reference);
    const double bullet = fastest(10, [&] {
        referenceHits = 0;
        for (const Ray& ray : asked) {
            const btTransform from(btQuaternion::getIdentity(), toBullet(ray.origin));
            const btTransform to(btQuaternion::getIdentity(), toBullet(ray.origin + length * ray.direction));
            btCollisionWorld::ClosestRayResultCallback result(from.getOrigin(), to.getOrigin());
            btCollisionWorld::rayTestSingle(from, to, &object, &reference, object.getWorldTransform(), result);
            referenceHits += result.hasHit() ? 1 : 0;
        }
    });
    const dGeomID probe = dCreateRay(nullptr, length);
    dGeomRaySetClosestHit(probe, 1);
    const double ode = fastest(10, [&] {
        odeHits = 0;
        for (const Ray& ray : asked) {
            const Vec3d& d = ray.direction;
            dGeomRaySet(probe, ray.origin.x(), ray.origin.y(), ray.origin.z(), d.x(), d.y(), d.z());
            dContactGeom hit;
            odeHits += dCollide(probe, odeMesh, 1, &hit, sizeof hit);
        }
    });
    const double count = static_cast<double>(asked.size());
    std::printf("mesh of %zu triangles: us a ray: Cairn %.2f, Bullet %.2f, ODE %.2f (hits %d, %d, %d of %.0f)\n",
                triangles.triangles.size(), 1e6 * cairn / count, 1e6 * bullet / count, 1e6 * ode / count, hits,
                referenceHits, odeHits, count);
    dGeomDestroy(probe);
    dGeomDestroy(odeMesh);
    dGeomTriMeshDataDestroy(data);
}

}  // namespace
}  // namespace cairn

int main() {
    dInitODE2(0);
    cairn::pairs();
    for (const int bodies : {100, 1000, 5000}) {
        cairn::rays(bodies);
    }
    for (const int cells : {100, 316}) {
        cairn::meshRays(cells);
    }
    dCloseODE();
    return 0;
}
