#pragma once
#include <cmath>
#include <limits>
#include <numbers>

namespace cairn {

inline constexpr double pi = std::numbers::pi;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
// Convex edges of ground that are flatter than this, a degree, are no obstacle worth a contact of their own.
inline const double cosFlat = std::cos(pi / 180);

}  // namespace cairn
