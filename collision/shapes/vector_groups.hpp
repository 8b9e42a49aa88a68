#pragma once
#include <cairn/shapes.hpp>

#include "base/base.hpp"

#include <vector>

namespace cairn {

// Vectors by groups of eight, the last one filled up with the first vector: which of them reaches farthest is found
// without a branch for each, by the vector unit, with the same bits on every machine.
class VectorGroups {
public:
    void add(const Vec3d& v);
    // Index of the vector whose dot product with `direction` is the largest; of equal ones the first. One at least.
    int farthest(const Vec3d& direction) const;
    // The dot product of each with `v`, and as many more as fill the last group up.
    void dots(const Vec3d& v, std::vector<double>& out) const;
    // The least and the largest dot product with each row of `axes`. One vector at least.
    Aabb extents(const Mat3d& axes) const;

    static constexpr std::size_t lanes = 8;

private:
    std::vector<double> groups_;  // of each group the x, then the y, then the z
    std::size_t count_ = 0;
};

// What does it, for tests: as those above, of `groups` of 3 times `lanes` numbers each.
struct VectorGroupKernels {
    const char* instructionSet;
    int (*farthest)(const double* numbers, std::size_t groups, const double* direction);
    void (*dots)(const double* numbers, std::size_t groups, const double* v, double* out);
    // axes: one after the other; out: the three least, then the three largest.
    void (*extents)(const double* numbers, std::size_t groups, const double* axes, double* out);
};
// All that this machine can run.
std::vector<VectorGroupKernels> allVectorGroupKernels();

}  // namespace cairn
