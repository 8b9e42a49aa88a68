#pragma once
// How an island would converge under sweeps, found out by sweeping its rows a little and reckoning on from there.
#include <cairn/engine/diagnose.hpp>
#include <cairn/engine/island.hpp>

namespace cairn {

// Of a step of dt (s) from no forces, until no body is further than `position` (m) from where the step would put it.
// Uses up the island's bodies and rows; forces of joints and contacts stay as they are.
template <class S>
IslandForecast forecast(Island<S>& island, S dt, double position);

}  // namespace cairn
