#pragma once
// The scenes whose cost cairn_bench_core measures. Of Cairn they see <cairn/cairn.hpp> alone, and few fields of it, so
// that one source measures older and newer trees.
#include <cairn/cairn.hpp>

#include <span>

namespace cairn::bench {

// What scenes are built into: a world of either precision.
class Filler {
public:
    virtual ~Filler() = default;
    virtual BodyId add(const BodyDef& def) = 0;
    virtual void add(const BallDef& def) = 0;

    void addStatic(const Vec3d& half, const Vec3d& position);
    void addFloor();
};

struct Scene {
    const char* name;
    void (*fill)(Filler&, int count);
    int count;  // of what `help` says, unless told otherwise
    int steps;
    bool sleep;
    const char* help;
};

std::span<const Scene> scenes();

}  // namespace cairn::bench
