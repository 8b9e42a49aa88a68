#pragma once
// Door of render/: off-screen images of meshes at poses. It knows nothing of bodies, joints or contacts; who calls it
// turns those into instances, lines and points.
#include <cairn/render/colour.hpp>
#include <cairn/render/compare.hpp>
#include <cairn/render/draw_scene.hpp>
#include <cairn/render/film.hpp>
#include <cairn/render/image.hpp>
#include <cairn/render/primitives.hpp>
#include <cairn/render/renderer.hpp>
#include <cairn/render/text.hpp>
