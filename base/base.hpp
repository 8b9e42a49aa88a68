#pragma once
// Door of base/: other folders include this header, or what they need of it.
#include <cairn/id.hpp>
#include <cairn/input_error.hpp>
#include <cairn/jobs.hpp>
#include <cairn/pose.hpp>
#include <cairn/triangle_mesh.hpp>
#include <cairn/types.hpp>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "base/profile.hpp"
#include "base/slot_table.hpp"
#include "base/so3.hpp"
