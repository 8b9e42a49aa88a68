#pragma once
// Door of collision/: other folders include this header only.
#include <cairn/collision/body_query.hpp>
#include <cairn/collision/broad_phase.hpp>
#include <cairn/collision/collision_mesh.hpp>
#include <cairn/collision/height_field.hpp>
#include <cairn/collision/hull.hpp>
#include <cairn/collision/narrow_phase.hpp>
#include <cairn/collision/queries.hpp>
#include <cairn/collision/shape.hpp>
#include <cairn/collision/sweep.hpp>
