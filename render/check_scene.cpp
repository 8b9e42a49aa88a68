#include "render/check_scene.hpp"

#include "base/digits.hpp"

#include <cmath>

namespace cairn {
namespace {

void requireColour(const Colour& c, const std::string& field) {
    for (const float part : {c.r, c.g, c.b, c.a}) {
        if (!(part >= 0 && part <= 1)) {
            throw InputError(field, digits(part), "each part of a colour must be in [0, 1]");
        }
    }
}

template <class Range>
void requirePixels(float pixels, const Range& field) {
    if (!(pixels > 0 && pixels <= 1000)) {
        throw InputError(field, digits(pixels), "must be in (0, 1000] pixels");
    }
}

}  // namespace

std::string fieldOf(const char* list, std::size_t i, const char* field) {
    return std::string(list) + "[" + std::to_string(i) + "]." + field;
}

void requireFinite(const Vec3f& v, const std::string& field) {
    if (!v.allFinite()) {
        throw InputError(field, "not finite",
                         "must be finite numbers (m); a body that left the world must not be drawn");
    }
}

void requireDrawable(const DrawScene& scene) {
    if (scene.width < 1 || scene.height < 1 || scene.width > largestPicture || scene.height > largestPicture) {
        throw InputError("picture size", std::to_string(scene.width) + " x " + std::to_string(scene.height),
                         "each side must be from 1 to " + std::to_string(largestPicture) + " pixels");
    }
    if (!scene.sun.direction.allFinite() || !(scene.sun.direction.norm() > 0)) {
        throw InputError("sun.direction", "0 or not finite", "must be a finite vector that is not 0");
    }
    if (!(scene.sun.intensity >= 0 && scene.sun.intensity <= 100)) {
        throw InputError("sun.intensity", digits(scene.sun.intensity), "must be in [0, 100]");
    }
    requireColour(scene.sun.colour, "sun.colour");
    requireColour(scene.ground.colour, "ground.colour");
    requireColour(scene.background.bottom, "background.bottom");
    requireColour(scene.background.top, "background.top");
    if (!std::isfinite(scene.ground.height) || !(scene.ground.cell > 0) || !std::isfinite(scene.ground.cell)) {
        throw InputError("ground", "height or cell", "height must be finite and cell positive (m)");
    }
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const DrawInstance& instance = scene.instances[i];
        requireFinite(instance.pose.position, fieldOf("instances", i, "pose.position"));
        const float norm = instance.pose.rotation.norm();
        if (!(std::abs(norm - 1) < 1e-3f)) {
            throw InputError(fieldOf("instances", i, "pose.rotation"), "norm " + digits(norm),
                             "must be a unit quaternion");
        }
        if (!instance.scale.allFinite() || !(instance.scale.cwiseAbs().minCoeff() > 0)) {
            throw InputError(fieldOf("instances", i, "scale"), "0 or not finite", "each part must be finite and not 0");
        }
        requireColour(instance.colour, fieldOf("instances", i, "colour"));
    }
    for (std::size_t i = 0; i < scene.lines.size(); ++i) {
        requireFinite(scene.lines[i].from, fieldOf("lines", i, "from"));
        requireFinite(scene.lines[i].to, fieldOf("lines", i, "to"));
        requireColour(scene.lines[i].colour, fieldOf("lines", i, "colour"));
        requirePixels(scene.lines[i].width, fieldOf("lines", i, "width"));
    }
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
        requireFinite(scene.points[i].position, fieldOf("points", i, "position"));
        requireColour(scene.points[i].colour, fieldOf("points", i, "colour"));
        requirePixels(scene.points[i].size, fieldOf("points", i, "size"));
    }
}

}  // namespace cairn
