#include <cairn/render/draw_scene.hpp>

#include "base/so3.hpp"
#include "render/view.hpp"

#include <cmath>

namespace cairn {

void addContact(DrawScene& scene, const Vec3f& point, const Vec3f& normal, float length, const Colour& colour) {
    scene.points.push_back({.position = point, .colour = colour, .size = 7});
    if (length > 0) {
        addArrow(scene, point, point + length * normal, colour);
    }
}

void addArrow(DrawScene& scene, const Vec3f& from, const Vec3f& to, const Colour& colour, float width) {
    scene.lines.push_back({from, to, colour, width, true});
    const Vec3f along = to - from;
    const float length = along.norm();
    if (!(length > 0)) {
        return;
    }
    const Vec3f n = along / length;
    Vec3f side;
    Vec3f other;
    completeBasis(n, side, other);
    for (int i = 0; i < 3; ++i) {
        const float angle = 2.0943951f * static_cast<float>(i);
        const Vec3f out = std::cos(angle) * side + std::sin(angle) * other;
        scene.lines.push_back({to, to - 0.25f * length * n + 0.10f * length * out, colour, width, true});
    }
}

void addFrame(DrawScene& scene, const Posef& pose, float length, float width) {
    for (int axis = 0; axis < 3; ++axis) {
        const Colour colour = axis == 0   ? Colour{0.87f, 0.18f, 0.16f, 1}
                              : axis == 1 ? Colour{0.15f, 0.65f, 0.20f, 1}
                                          : Colour{0.15f, 0.35f, 0.90f, 1};
        addArrow(scene, pose.position, pose * Vec3f(length * Vec3f::Unit(axis)), colour, width);
    }
}

void addBoxOutline(DrawScene& scene, const Posef& pose, const Vec3f& halfExtents, const Colour& colour, float width) {
    const auto corner = [&](int bits) {
        return pose * Vec3f((bits & 1) != 0 ? halfExtents.x() : -halfExtents.x(),
                            (bits & 2) != 0 ? halfExtents.y() : -halfExtents.y(),
                            (bits & 4) != 0 ? halfExtents.z() : -halfExtents.z());
    };
    for (int bits = 0; bits < 8; ++bits) {
        for (int axis = 0; axis < 3; ++axis) {
            const int other = bits | (1 << axis);
            if (other != bits) {
                scene.lines.push_back({corner(bits), corner(other), colour, width, true});
            }
        }
    }
}

Camera cameraThatSees(const Vec3f& low, const Vec3f& high, const Vec3f& from, float aspect, float verticalFov) {
    if (!low.allFinite() || !high.allFinite() || (high - low).minCoeff() < 0) {
        throw InputError("cameraThatSees", "box", "give a finite box whose low corner is below its high corner");
    }
    if (!from.allFinite() || !(from.norm() > 0) || !(aspect > 0) || !(verticalFov > 0) || !(verticalFov < 3.1f)) {
        throw InputError("cameraThatSees", "view",
                         "give a direction that is not 0, a positive aspect and a field of view in (0, 3.1) rad");
    }
    Camera camera;
    camera.verticalFov = verticalFov;
    camera.target = 0.5f * (low + high);
    const Vec3f back = from.normalized();
    if (std::abs(back.y()) > 0.99f) {
        camera.up = {0, 0, -1};
    }
    camera.eye = camera.target + back;
    const View view = makeView(camera, aspect);
    // Each corner asks for a distance at which it stays inside both pairs of side planes.
    float distance = 1e-3f;
    for (int bits = 0; bits < 8; ++bits) {
        const Vec3f corner((bits & 1) != 0 ? high.x() : low.x(), (bits & 2) != 0 ? high.y() : low.y(),
                           (bits & 4) != 0 ? high.z() : low.z());
        const Vec3f r = corner - camera.target;
        const float toward = r.dot(back);
        distance = std::max(distance, toward + 1.1f * std::abs(r.dot(view.right)) / view.tanX);
        distance = std::max(distance, toward + 1.1f * std::abs(r.dot(view.up)) / view.tanY);
    }
    camera.eye = camera.target + distance * back;
    return camera;
}

std::optional<Eigen::Vector2f> toPixel(const DrawScene& scene, const Vec3f& point) {
    const float width = static_cast<float>(scene.width);
    const float height = static_cast<float>(scene.height);
    const View view = makeView(scene.camera, width / height);
    const Vec3f r = point - scene.camera.eye;
    const float depth = r.dot(view.forward);
    if (!(depth > 0)) {
        return std::nullopt;
    }
    return Eigen::Vector2f(width * (0.5f + 0.5f * r.dot(view.right) / (depth * view.tanX)),
                           height * (0.5f - 0.5f * r.dot(view.up) / (depth * view.tanY)));
}

}  // namespace cairn
