#pragma once
// What `cairn tune` found as one page that needs nothing else: style, script, plot and pictures are in it.
#include <cairn/demos/advice/tune.hpp>
#include <cairn/render/render.hpp>

namespace cairn {

struct PagePicture {
    std::string caption = {};
    std::string png = {};  // bytes of the file
};

// Pictures of the scene by its own setting and by the chosen one, each at its worst moment, bodies coloured by their
// error on one scale. Throws std::runtime_error if there is no OpenGL.
std::vector<PagePicture> tunePictures(const Scene& scene, const TuneResult& result);

// A whole HTML document.
std::string tunePage(const Scene& scene, const TuneResult& result, const std::vector<PagePicture>& pictures);

}  // namespace cairn
