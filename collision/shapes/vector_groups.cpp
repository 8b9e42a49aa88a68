#include "collision/shapes/vector_groups.hpp"
#include "base/vector_targets.hpp"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/shapes/vector_groups.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t lanes = VectorGroups::lanes;
using Lanes = hn::CappedTag<double, lanes>;

// x, y and z of a vector in all lanes.
struct Direction {
    explicit HWY_INLINE Direction(const double* v)
        : x(hn::Set(Lanes(), v[0])), y(hn::Set(Lanes(), v[1])), z(hn::Set(Lanes(), v[2])) {}
    // With those of a group from `at` on.
    HWY_INLINE hn::Vec<Lanes> dot(const double* at) const {
        const Lanes d;
        return hn::Add(hn::Add(hn::Mul(hn::LoadU(d, at), x), hn::Mul(hn::LoadU(d, at + lanes), y)),
                       hn::Mul(hn::LoadU(d, at + 2 * lanes), z));
    }
    hn::Vec<Lanes> x, y, z;
};

int farthest(const double* numbers, std::size_t groups, const double* direction) {
    constexpr std::size_t groupsAtOnce = 8;
    const Lanes d;
    const Direction to(direction);
    alignas(64) double along[lanes * groupsAtOnce];
    std::size_t best = 0;
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t from = 0; from < groups; from += groupsAtOnce) {
        const std::size_t count = std::min(groupsAtOnce, groups - from);
        auto most = hn::Set(d, largest);
        for (std::size_t g = 0; g < count; ++g) {
            for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
                const auto one = to.dot(numbers + 3 * lanes * (from + g) + lane);
                hn::Store(one, d, along + lanes * g + lane);
                most = hn::Max(most, one);
            }
        }
        const auto top = hn::MaxOfLanes(d, most);
        if (!(hn::GetLane(top) > largest)) {
            continue;
        }
        largest = hn::GetLane(top);
        for (std::size_t i = 0; i < lanes * count; i += hn::Lanes(d)) {
            const auto first = hn::FindFirstTrue(d, hn::Eq(hn::Load(d, along + i), top));
            if (first >= 0) {
                best = from * lanes + i + static_cast<std::size_t>(first);
                break;
            }
        }
    }
    return static_cast<int>(best);
}

void dots(const double* numbers, std::size_t groups, const double* v, double* out) {
    const Lanes d;
    const Direction to(v);
    for (std::size_t g = 0; g < groups; ++g) {
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            hn::StoreU(to.dot(numbers + 3 * lanes * g + lane), d, out + lanes * g + lane);
        }
    }
}

void extents(const double* numbers, std::size_t groups, const double* axes, double* out) {
    const Lanes d;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Direction along(axes + 3 * axis);
        auto least = along.dot(numbers);
        auto most = least;
        for (std::size_t g = 0; g < groups; ++g) {
            for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
                const auto one = along.dot(numbers + 3 * lanes * g + lane);
                least = hn::Min(least, one);
                most = hn::Max(most, one);
            }
        }
        out[axis] = hn::GetLane(hn::MinOfLanes(d, least));
        out[3 + axis] = hn::GetLane(hn::MaxOfLanes(d, most));
    }
}

VectorGroupKernels groupKernels() {
    return {hwy::TargetName(HWY_TARGET), farthest, dots, extents};
}

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace cairn {
namespace {

HWY_EXPORT(groupKernels);

VectorGroupKernels chosen() {
    return HWY_DYNAMIC_DISPATCH(groupKernels)();
}

const VectorGroupKernels& best() {
    static const VectorGroupKernels kernels = chosen();
    return kernels;
}

}  // namespace

std::vector<VectorGroupKernels> allVectorGroupKernels() {
    return ofEachTarget(chosen);
}

void VectorGroups::add(const Vec3d& v) {
    const std::size_t lane = count_++ % lanes;
    const std::size_t group = groups_.size() - (lane == 0 ? 0 : 3 * lanes);
    if (lane == 0) {
        for (int axis = 0; axis < 3; ++axis) {
            const double first = group == 0 ? v[axis] : groups_[static_cast<std::size_t>(axis) * lanes];
            groups_.insert(groups_.end(), lanes, first);
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        groups_[group + axis * lanes + lane] = v[static_cast<int>(axis)];
    }
}

int VectorGroups::farthest(const Vec3d& direction) const {
    return best().farthest(groups_.data(), groups_.size() / (3 * lanes), direction.data());
}

void VectorGroups::dots(const Vec3d& v, std::vector<double>& out) const {
    out.resize(groups_.size() / 3);
    best().dots(groups_.data(), groups_.size() / (3 * lanes), v.data(), out.data());
}

Aabb VectorGroups::extents(const Mat3d& axes) const {
    const Mat3d byRow = axes.transpose();
    double out[6];
    best().extents(groups_.data(), groups_.size() / (3 * lanes), byRow.data(), out);
    return {{out[0], out[1], out[2]}, {out[3], out[4], out[5]}};
}

}  // namespace cairn
#endif
