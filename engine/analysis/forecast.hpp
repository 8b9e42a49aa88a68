#pragma once
// How an island would converge under sweeps, found out by sweeping its rows a little and reckoning on from there.
#include <cairn/diagnosis.hpp>

#include "engine/problem/problem.hpp"

namespace cairn {

// Of a step of dt (s), until no body is further than `position` (m) from where the step would put it. Forces of joints
// and contacts stay as they are; the rows are left linearised.
template <class S>
IslandForecast forecast(Problem<S>& problem, S dt, double position);

}  // namespace cairn
