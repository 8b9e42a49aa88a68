#pragma once
// Scenes by which other engines are known too, so that figures can be set beside theirs; the first seven have the sizes
// of Box3D's benchmarks of these names, the last two of Jolt's.
#include "core_scenes.hpp"

namespace cairn::bench {

void jointGrid(Filler& world, int side);
void pyramids(Filler& world, int n);
void convexPile(Filler& world, int n);
void junkyard(Filler& world, int layers);
void washer(Filler& world, int side);
void trees(Filler& world, int n);
void largeWorld(Filler& world, int side);
void rain(Filler& world, int n);
void convexOnMesh(Filler& world, int side);
void dollPile(Filler& world, int n);

}  // namespace cairn::bench
