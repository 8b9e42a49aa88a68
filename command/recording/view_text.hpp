#pragma once
// Inside recording/: the page's own style, elements and script, which are files of these names beside this one. The
// parts of the script stand in the page in this order.
#include <string_view>

namespace cairn::view_text {

extern const std::string_view style;
extern const std::string_view elements;

extern const std::string_view run;
extern const std::string_view camera;
extern const std::string_view meshes;
extern const std::string_view shaders;
extern const std::string_view drawing;
extern const std::string_view pick;
extern const std::string_view player;

}  // namespace cairn::view_text
