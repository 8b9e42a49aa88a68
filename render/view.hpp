#pragma once
// The camera as the renderer needs it: an orthonormal frame and the half sizes of the picture at unit depth.
#include <cairn/render/draw_scene.hpp>

#include <cmath>

namespace cairn {

struct View {
    Vec3f right;
    Vec3f up;
    Vec3f forward;
    float tanX = 1;
    float tanY = 1;
};

// InputError if the camera looks nowhere: eye at target, or up along the line of sight.
inline View makeView(const Camera& camera, float aspect) {
    if (!camera.eye.allFinite() || !camera.target.allFinite() || !camera.up.allFinite()) {
        throw InputError("camera", "not finite", "eye, target and up must be finite");
    }
    if (!(camera.verticalFov > 1e-3f) || !(camera.verticalFov < 3.14f)) {
        throw InputError("camera.verticalFov", std::to_string(camera.verticalFov), "must be in (0.001, 3.14) rad");
    }
    View view;
    view.forward = camera.target - camera.eye;
    const float distance = view.forward.norm();
    view.forward /= distance;
    view.right = view.forward.cross(camera.up.normalized());
    const float sine = view.right.norm();
    if (!(distance > 0) || !(sine > 1e-4f)) {
        throw InputError("camera", "degenerate", "eye and target must differ, and up must not lie along the view");
    }
    view.right /= sine;
    view.up = view.right.cross(view.forward);
    view.tanY = std::tan(0.5f * camera.verticalFov);
    view.tanX = view.tanY * aspect;
    return view;
}

}  // namespace cairn
