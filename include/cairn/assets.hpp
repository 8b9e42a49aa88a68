#pragma once
// Door of assets/: other folders include this header only.
#include <cairn/assets/convex_decomposition.hpp>
#include <cairn/assets/convex_hull.hpp>
#include <cairn/assets/mesh_file.hpp>
#include <cairn/assets/scene.hpp>
#include <cairn/assets/scene_files.hpp>
