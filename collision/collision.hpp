#pragma once
// Door of collision/: other folders include this header only.
#include <cairn/shape_query.hpp>
#include <cairn/shapes.hpp>

#include "collision/broad_phase/broad_phase.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/queries/body_query.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/validate.hpp"
