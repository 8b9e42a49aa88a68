#pragma once

namespace cairn {

inline constexpr double dt = 1.0 / 60;  // s, the step of most tests

}  // namespace cairn
