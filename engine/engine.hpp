#pragma once
// Door of engine/: other folders include this header only.
#include <cairn/engine/world.hpp>
