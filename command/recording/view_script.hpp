#pragma once
// Inside recording/: the page's own style, elements and script, as text. The script is in three parts, in this order:
// what the run was, how it is drawn, and what a reader does with it.

namespace cairn::view_script {

extern const char* const style;
extern const char* const elements;
extern const char* const run;
extern const char* const drawing;
extern const char* const player;

}  // namespace cairn::view_script
