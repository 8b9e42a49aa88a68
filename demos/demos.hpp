#pragma once
// Door of demos/: what the command, the tests and the benchmarks share.
#include <cairn/demos/base64.hpp>
#include <cairn/demos/drawn_shape.hpp>
#include <cairn/demos/run.hpp>
#include <cairn/demos/run_json.hpp>
#include <cairn/demos/scene_drawer.hpp>
#include <cairn/demos/scenes/scenes.hpp>
#include <cairn/demos/simulation.hpp>
