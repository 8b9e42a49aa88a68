#pragma once
// A concave mesh as a few convex hulls, so that a moving body may have its shape.
#include <cairn/shapes.hpp>

namespace cairn {

struct DecompositionDef {
    int maxHulls = 32;        // in [1, 1024]; each costs contacts
    double tolerance = 0.05;  // >= 0: stop when the hulls' volume exceeds the mesh's by this part of it
    int resolution = 48;      // in [8, 256]: cells along the longest side by which cuts are weighed
    int maxVertices = 0;      // of a hull, see convexHull(); 0: no limit
};

struct Decomposition {
    std::vector<Shape> hulls;  // in the mesh's frame; they share faces but do not overlap
    double meshVolume = 0;     // m3
    double hullVolume = 0;     // m3, of all hulls together
    // The part of the mesh's volume that is wrongly filled: without a limit on vertices the hulls contain the mesh.
    double volumeError() const { return (hullVolume - meshVolume) / meshVolume; }
};

// Cuts the solid again and again by a plane across one of its axes, where the hulls of the two sides are smallest
// together, the part with the most empty room first. Throws InputError for a mesh that is not closed, encloses no
// volume or is turned inside out, and for a def out of its ranges.
Decomposition decompose(const TriangleMesh& mesh, const DecompositionDef& def = {});

}  // namespace cairn
