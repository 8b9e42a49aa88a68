#pragma once
// What `cairn tune` found as one page (page.hpp): the front, each setting's error over time, pictures of the worst
// moments, all settings, and what to write into a scene file.
#include "command/advice/page.hpp"
#include "command/advice/tune.hpp"

namespace cairn {

struct TunePicture {
    std::size_t entry = 0;  // of TuneResult::entries
    std::string caption = {};
    std::string png = {};  // bytes of the file
};

// Of the scene's own setting and of those on the front, each at its worst moment, bodies coloured by their distance to
// the truth, or by the step's own error where that is the greater. Throws std::runtime_error if there is no
// OpenGL.
std::vector<TunePicture> tunePictures(const Scene& scene, const TuneResult& result);

// A whole HTML document.
std::string tunePage(const Scene& scene, const TuneResult& result, const std::vector<TunePicture>& pictures);

}  // namespace cairn
