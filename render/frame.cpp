#include "render/frame.hpp"

#include "base/so3.hpp"
#include "render/view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

struct Depths {  // m, along the line of sight
    float nearest = infinity;
    float farthest = 0;
    float fadeFrom = 0;  // of the ground
    float fadeTo = 0;
};

// Near and far planes just around what is there.
Depths depthsOf(const DrawScene& scene, const Vec3f& origin, const View& view, const std::vector<Ball>& bodies,
                bool groundSeen) {
    const Vec3f eye = scene.camera.eye - origin;
    const float distance = eye.norm();
    Depths depths;
    const auto include = [&](const Vec3f& p, float radius) {
        const float depth = (p - eye).dot(view.forward);
        depths.nearest = std::min(depths.nearest, depth - radius);
        depths.farthest = std::max(depths.farthest, depth + radius);
    };
    for (const Ball& ball : bodies) {
        include(ball.centre, ball.radius);
    }
    for (const DrawLine& line : scene.lines) {
        include(line.from - origin, 0);
        include(line.to - origin, 0);
    }
    for (const DrawPoint& point : scene.points) {
        include(point.position - origin, 0);
    }
    const float extent = std::max(distance, std::min(depths.farthest, 20 * distance));
    depths.fadeFrom = 0.8f * extent;
    depths.fadeTo = 4.5f * extent;
    if (groundSeen) {
        include(eye, 0);
        depths.farthest = std::max(depths.farthest, distance + depths.fadeTo);
        depths.nearest = std::max(depths.nearest, 0.1f * (eye.y() - (scene.ground.height - origin.y())));
    }
    depths.farthest = std::max(1.01f * depths.farthest, 1e-3f * distance);
    depths.nearest = std::clamp(0.98f * depths.nearest, 2e-4f * depths.farthest, 0.9f * depths.farthest);
    return depths;
}

Mat4f projectionOf(const View& view, const Vec3f& eye, float nearest, float farthest) {
    Mat4f look = Mat4f::Identity();
    look.block<1, 3>(0, 0) = view.right.transpose();
    look.block<1, 3>(1, 0) = view.up.transpose();
    look.block<1, 3>(2, 0) = -view.forward.transpose();
    look.block<3, 1>(0, 3) = -look.block<3, 3>(0, 0) * eye;
    Mat4f projection = Mat4f::Zero();
    projection(0, 0) = 1 / view.tanX;
    projection(1, 1) = 1 / view.tanY;
    projection(2, 2) = -(farthest + nearest) / (farthest - nearest);
    projection(2, 3) = -2 * farthest * nearest / (farthest - nearest);
    projection(3, 2) = -1;
    return projection * look;
}

// The light's axes, and what it must light along them, m.
struct LightBox {
    Vec3f x;
    Vec3f y;
    Vec3f toSun;
    Eigen::Array3f low = Eigen::Array3f::Constant(infinity);
    Eigen::Array3f high = Eigen::Array3f::Constant(-infinity);
    float lowZ = infinity;  // of all casters; low and high hold those that the box fits
    float highZ = -infinity;
};

// Fits the casters in, but for those far larger than the rest; answers how far along the line of sight they reach.
float fitCasters(const std::vector<Ball>& casters, const Vec3f& eye, const View& view, LightBox& box) {
    std::vector<float> radii;
    radii.reserve(casters.size());
    for (const Ball& ball : casters) {
        radii.push_back(ball.radius);
    }
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>((radii.size() - 1) / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    const float largest = 12 * *middle;
    const float widest = static_cast<float>(shadowSize) / 16 * *middle;  // m
    float reach = 0;
    for (const bool large : {false, true}) {
        for (const Ball& ball : casters) {
            const Eigen::Array3f at(ball.centre.dot(box.x), ball.centre.dot(box.y), ball.centre.dot(box.toSun));
            const Eigen::Array3f grownLow = box.low.min(at - ball.radius);
            const Eigen::Array3f grownHigh = box.high.max(at + ball.radius);
            box.lowZ = std::min(box.lowZ, at.z() - ball.radius);
            box.highZ = std::max(box.highZ, at.z() + ball.radius);
            if (large == (ball.radius > largest) && (!large || (grownHigh - grownLow).head<2>().maxCoeff() <= widest)) {
                box.low = grownLow;
                box.high = grownHigh;
                reach = std::max(reach, (ball.centre - eye).dot(view.forward) + ball.radius);
            }
        }
    }
    return reach;
}

// Cuts off what the camera does not see as far as `reach`.
void cutToSight(const Vec3f& eye, const View& view, float reach, LightBox& box) {
    Eigen::Array3f seenLow(eye.dot(box.x), eye.dot(box.y), 0);
    Eigen::Array3f seenHigh = seenLow;
    for (int corner = 0; corner < 4; ++corner) {
        const Vec3f p = eye + reach * (view.forward + ((corner & 1) != 0 ? view.tanX : -view.tanX) * view.right +
                                       ((corner & 2) != 0 ? view.tanY : -view.tanY) * view.up);
        const Eigen::Array3f at(p.dot(box.x), p.dot(box.y), 0);
        seenLow = seenLow.min(at);
        seenHigh = seenHigh.max(at);
    }
    const Eigen::Array3f rim = 0.03f * (seenHigh - seenLow);
    const Eigen::Array3f cutLow = box.low.max(seenLow - rim);
    const Eigen::Array3f cutHigh = box.high.min(seenHigh + rim);
    if (cutLow.x() < cutHigh.x() && cutLow.y() < cutHigh.y()) {
        box.low = cutLow;
        box.high = cutHigh;
    }
}

// To OpenGL's cube; answers the side of a texel, m.
float projectLight(const LightBox& box, const Vec3f& origin, Mat4f& m) {
    float side = 1.02f * std::max(box.high.x() - box.low.x(), box.high.y() - box.low.y());
    side = std::exp2(std::ceil(4 * std::log2(side)) / 4);
    side *= 1.0f + 12.0f / static_cast<float>(shadowSize);  // room for the filter and for snapping
    const float texel = side / static_cast<float>(shadowSize);
    // Snapped in world coordinates, of which origin is the shift.
    const auto snap = [&](float centre, const Vec3f& axis) {
        const double world = static_cast<double>(centre) + origin.cast<double>().dot(axis.cast<double>());
        const double snapped = std::round(world / static_cast<double>(texel)) * static_cast<double>(texel);
        return static_cast<float>(snapped - origin.cast<double>().dot(axis.cast<double>()));
    };
    const float centreX = snap(0.5f * (box.low.x() + box.high.x()), box.x);
    const float centreY = snap(0.5f * (box.low.y() + box.high.y()), box.y);
    const float margin = 1e-3f * (box.highZ - box.lowZ) + 4 * texel;
    const float depth = box.highZ - box.lowZ + 2 * margin;
    m.setZero();
    m.block<1, 3>(0, 0) = 2 / side * box.x.transpose();
    m(0, 3) = -2 / side * centreX;
    m.block<1, 3>(1, 0) = 2 / side * box.y.transpose();
    m(1, 3) = -2 / side * centreY;
    m.block<1, 3>(2, 0) = -2 / depth * box.toSun.transpose();
    m(2, 3) = 2 * (box.highZ + margin) / depth - 1;
    m(3, 3) = 1;
    return texel;
}

// The light's box: as small as the casters in sight allow, because its texels set how sharp shadows are. Bodies far
// larger than the rest stretch it only while a texel is a sixteenth of the middle body's radius: a bowl does, a floor
// or a hill does not. Its size moves in steps of a quarter octave and its place in whole texels, so that shadows do not
// crawl from one picture of a film to the next.
void fitShadow(const DrawScene& scene, const Vec3f& origin, const View& view, float farthest,
               const std::vector<Ball>& casters, Frame& frame) {
    frame.hasShadow = scene.sun.shadows && !casters.empty() && scene.sun.intensity > 0;
    if (!frame.hasShadow) {
        return;
    }
    LightBox box;
    box.toSun = -scene.sun.direction.normalized();
    completeBasis(box.toSun, box.x, box.y);
    const Vec3f eye = scene.camera.eye - origin;
    const float reach = fitCasters(casters, eye, view, box);
    // Out to well behind the farthest fitted caster, where its shadow may fall.
    cutToSight(eye, view, std::clamp(2 * reach, 0.f, farthest), box);
    const float texel = projectLight(box, origin, frame.shadowProjection);
    Mat4f toUnit = Mat4f::Identity() * 0.5f;
    toUnit.col(3) = Eigen::Vector4f(0.5f, 0.5f, 0.5f, 1);
    frame.block.shadowMatrix = parts(Mat4f(toUnit * frame.shadowProjection));
    frame.block.toSun[3] = 1;
    frame.block.sizes[2] = texel;
    frame.block.sizes[3] = 1.0f / static_cast<float>(shadowSize);
}

}  // namespace

Frame makeFrame(const DrawScene& scene, const Vec3f& origin, const std::vector<Ball>& bodies,
                const std::vector<Ball>& casters) {
    const float width = static_cast<float>(scene.width);
    const float height = static_cast<float>(scene.height);
    const View view = makeView(scene.camera, width / height);
    const Vec3f eye = scene.camera.eye - origin;
    const float distance = eye.norm();
    const float groundY = scene.ground.height - origin.y();
    Frame frame;
    frame.groundSeen = scene.ground.visible && eye.y() > groundY;
    const Depths depths = depthsOf(scene, origin, view, bodies, frame.groundSeen);
    frame.viewProjection = projectionOf(view, eye, depths.nearest, depths.farthest);

    FrameBlock& block = frame.block;
    block.viewProjection = parts(frame.viewProjection);
    block.eye = parts(eye, 1);
    block.cameraX = parts(Vec3f(view.tanX * view.right), 0);
    block.cameraY = parts(Vec3f(view.tanY * view.up), 0);
    block.cameraZ = parts(view.forward, 0);
    block.toSun = parts(Vec3f(-scene.sun.direction.normalized()), 0);
    block.sunColour = linear(scene.sun.colour);
    for (std::size_t i = 0; i < 3; ++i) {
        block.sunColour[i] *= 0.78f * scene.sun.intensity;
    }
    block.groundColour = linear(scene.ground.colour);
    block.groundShape = {groundY, scene.ground.cell, depths.fadeFrom, depths.fadeTo};
    const float period = 2 * scene.ground.cell;
    block.groundPhase = {std::fmod(origin.x(), period), std::fmod(origin.z(), period), 0, 0};
    block.backgroundBottom = linear(scene.background.bottom);
    block.backgroundTop = linear(scene.background.top);
    block.sizes = {width, height, 0, 0};
    const int halfWidth = (scene.width + 1) / 2;
    const int halfHeight = (scene.height + 1) / 2;
    // A twentieth of the picture at the target: wide enough for contacts to read, narrow enough to stay local.
    block.occlusion = {0.1f * distance * view.tanY, scene.ambientOcclusion ? 1.f : 0.f, static_cast<float>(halfWidth),
                       static_cast<float>(halfHeight)};
    block.taps = {12, 10, 16, 0};
    fitShadow(scene, origin, view, depths.farthest, casters, frame);
    return frame;
}

}  // namespace cairn
