#pragma once
// Door of base/: other folders include this header only.
#include <cairn/base/check.hpp>
#include <cairn/base/id.hpp>
#include <cairn/base/mesh.hpp>
#include <cairn/base/parallel.hpp>
#include <cairn/base/pose.hpp>
#include <cairn/base/profile.hpp>
#include <cairn/base/so3.hpp>
#include <cairn/base/types.hpp>
