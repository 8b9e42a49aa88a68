#pragma once
// Inside collision/ only. From a normal to contact points: clip the incident outline by the reference face, keep what
// is within the margin, and reduce to four points that stay the same from step to step.
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/convex.hpp"

namespace cairn {

// A manifold in the work frame of its pair of shapes; both points of a contact are in that frame.
struct WorkManifold {
    Vec3d normal = Vec3d::UnitY();  // from the first shape to the second
    int count = 0;
    std::array<ContactPoint, 4> points;
    std::int8_t reference = -1;  // the side that held the reference face: 0, 1; -1: none did
    bool isReduced = false;      // whether candidates were left out
    double deeper = 0;           // as Manifold's
    double apart = 0;            // m; where no point is within the margin: as far apart as the shapes are at least
    std::uint32_t id = 0;
};

// A point that may enter a manifold. `inner` lies on the reference face's plane, `outer` on the other shape.
struct Candidate {
    Vec3d inner;
    Vec3d outer;
    double separation = 0;
    std::uint64_t feature = 0;
};

// Buffers reused from call to call, so that a steady state allocates nothing.
struct Scratch {
    Face face;
    std::vector<OutlineVertex> incident;
    std::vector<OutlineVertex> clipped;
    std::vector<OutlineVertex> clipping;
    std::vector<Candidate> candidates;
    std::vector<Vec3d> normals;
    std::vector<double> depths;
    std::vector<int> triangles;
};

// Mixes two ids into one; equal inputs give equal outputs, others differ but for one in 2^64.
std::uint64_t mixIds(std::uint64_t a, std::uint64_t b);

// Appends to scratch.candidates where scratch.incident, rounded by `radius`, is within `margin` of scratch.face.
void clipToFace(Scratch& scratch, double radius, double margin);

// Whether a feature of a candidate is a corner of the incident outline itself.
constexpr bool isCorner(std::uint64_t feature) {
    return feature < 0x40000000u;
}

// At most four of the candidates: the deepest, and those that spread along the face's fixed diagonals.
// Returns their count and indices.
int reduceCandidates(const std::vector<Candidate>& candidates, const Vec3d& tangent1, const Vec3d& tangent2,
                     std::array<int, 4>& chosen);

// Reduces scratch.candidates, of which none is less than `least` (m) apart, into `out`. outward: the reference face's
// normal; side: which shape holds it (0 or 1).
void fillManifold(const Scratch& scratch, double least, const Vec3d& outward, int side, WorkManifold& out);

// m: the least separation of the candidates.
double leastSeparation(const std::vector<Candidate>& candidates);

}  // namespace cairn
