#pragma once
// A scene as a running world in either precision, seen in double, with bodies named by their place in the scene.
#include "demos/scenes/scenes.hpp"

namespace cairn {

enum class Precision { Float, Double };

const char* name(Precision precision);

class Simulation {
public:
    virtual ~Simulation() = default;

    virtual const StepReport& step(double dt) = 0;  // s
    virtual const StepReport& report() const = 0;   // of the last step
    // `body` is an index into Scene::bodies; after them come the particles of Scene::deformables, in order.
    virtual std::size_t bodyCount() const = 0;  // particles included
    virtual Posed pose(std::size_t body) const = 0;
    virtual Vec3d linearVelocity(std::size_t body) const = 0;   // m/s, of the centre of mass
    virtual Vec3d angularVelocity(std::size_t body) const = 0;  // rad/s, world axes
    virtual bool awake(std::size_t body) const = 0;
    virtual double mass(std::size_t body) const = 0;  // kg; 0 for static and kinematic bodies
    // Whether its moments of inertia differ, so that its spin turns by itself.
    virtual bool gyroscopic(std::size_t body) const = 0;
    virtual void setPose(std::size_t body, const Posed& pose) = 0;
    virtual void setVelocity(std::size_t body, const Vec3d& linear, const Vec3d& angular) = 0;  // m/s, rad/s
    virtual void setSolver(const SolverDef& solver) = 0;
    virtual void setAccuracy(const AccuracyDef& accuracy) = 0;
    virtual Diagnosis diagnose(double dt, double position) = 0;  // s, m: as World::diagnose
    virtual std::vector<ContactView> contacts() const = 0;
    virtual std::vector<JointView> jointViews() const = 0;
    virtual std::vector<LockView> lockViews() const = 0;
    virtual std::vector<BodyErrorView> bodyErrors() const = 0;
    virtual std::size_t deformableCount() const = 0;
    virtual TriangleMesh surface(std::size_t deformable) const = 0;  // world, closed
    virtual const Skin& skin(std::size_t deformable) const = 0;      // how that surface follows its particles
    // The `body` of its first particle; the others follow.
    virtual std::size_t firstParticle(std::size_t deformable) const = 0;
    virtual std::size_t particleCount(std::size_t deformable) const = 0;
    // Of an id found in contacts() or jointViews(): a body as above, or a place in Scene::joints; after these come the
    // joints of Scene::deformables.
    virtual std::size_t indexOf(BodyId id) const = 0;
    virtual std::size_t indexOf(JointId id) const = 0;
};

// Throws InputError as World and populate do.
std::unique_ptr<Simulation> makeSimulation(const Scene& scene, Precision precision = Precision::Double);

}  // namespace cairn
