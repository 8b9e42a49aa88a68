#pragma once
// Door of demos/: what the command, the tests and the benchmarks share.
#include "demos/base64.hpp"
#include "demos/drawn_shape.hpp"
#include "demos/run.hpp"
#include "demos/run_json.hpp"
#include "demos/scene_drawer.hpp"
#include "demos/scenes/scenes.hpp"
#include "demos/simulation.hpp"
