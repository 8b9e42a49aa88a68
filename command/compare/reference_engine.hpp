#pragma once
// An engine under comparison: a scene as a running world, seen by the poses and velocities of its bodies alone.
#include <cairn/assets.hpp>

#include <functional>

namespace cairn {

class ReferenceEngine {
public:
    virtual ~ReferenceEngine() = default;
    virtual void step(double dt) = 0;                    // s
    virtual Posed pose(std::size_t body) const = 0;      // of the body's frame; an index into Scene::bodies
    virtual Vec3d velocity(std::size_t body) const = 0;  // m/s, of a dynamic body's centre of mass
};

// One thing about an engine that trades error against cost. Sleep is off in all of them, so that the time of a step is
// that of a full step.
struct Dial {
    std::string name;            // empty: as it comes, at one value that means nothing
    std::vector<double> values;  // from the cheapest
    // Throws InputError naming what of the scene has no counterpart in the engine, with the remedy.
    std::function<std::unique_ptr<ReferenceEngine>(const Scene&, double value)> make;
};

struct Engine {
    std::string name;
    std::string missing;  // why it is not here and what to do about it; empty: it is
    std::vector<Dial> dials;
};

// Cairn, then the others; those that were not found when this was built have no dials. `isFloat`: Cairn's precision.
std::vector<Engine> engines(bool isFloat = false);

// One that was not found, and the package that it is in.
Engine absentEngine(const std::string& name, const std::string& package);

// An engine as it comes. Throws InputError as Dial::make does, and if it is not here.
std::unique_ptr<ReferenceEngine> makeReferenceEngine(const Engine& engine, const Scene& scene);

}  // namespace cairn
