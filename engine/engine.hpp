#pragma once
// Door of engine/: other folders include this header only.
#include <cairn/engine/deformable.hpp>
#include <cairn/engine/solver_list.hpp>
#include <cairn/engine/world.hpp>
