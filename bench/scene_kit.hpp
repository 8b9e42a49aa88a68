#pragma once
// What several of the measured scenes are made of.
#include "core_scenes.hpp"

#include <functional>

namespace cairn::bench {

class Random {  // the same numbers with every compiler and library
public:
    double uniform(double low, double high) {
        state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
        return low + (high - low) * static_cast<double>(state_ >> 11) * 0x1p-53;
    }

private:
    std::uint64_t state_ = 1;
};

// Place i of n on a square grid about the origin, on the plane y = 0.
Vec3d onSquare(int i, int n, double pitch);

// A doll of 75 kg, 16 boxes and 15 ball joints; `middle` is 0.9 m above its soles.
void addDoll(Filler& world, const Vec3d& middle, const Quatd& rotation);

// side x side bodies, def(i) the i-th of them, each tied to the one before it in its row and in its column by a ball
// joint halfway between; two static ones are not tied.
void addTied(Filler& world, int side, const std::function<BodyDef(int)>& def);

// Points spread evenly over a sphere, along a spiral about z.
std::vector<Vec3d> spiral(int points, double radius);

// The hull of points on a sphere, of which no four share a plane.
Shape hullOnSphere(const std::vector<Vec3d>& points);

// What lies between two loops of as many points each; the second is on the side that the first, counter-clockwise,
// faces away from.
Shape prism(const std::vector<Vec3d>& front, const std::vector<Vec3d>& back);

}  // namespace cairn::bench
