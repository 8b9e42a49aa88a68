#pragma once
// A run as JSON. The field names are Cairn's promise to scripts: add, never rename.
#include "demos/run.hpp"

#include <nlohmann/json.hpp>

namespace cairn {

// A field that was not computed is null.
nlohmann::ordered_json resultJson(const RunResult& result);
// Every body of the scene as it is now: name, position, rotation (x, y, z, w), linearVelocity, angularVelocity, awake.
nlohmann::ordered_json bodiesJson(const SceneRun& run);

}  // namespace cairn
