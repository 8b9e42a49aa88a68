#pragma once
// What one picture shows: a plain description that the caller fills in. World frame, metres, +y is up.
#include <cairn/id.hpp>
#include <cairn/render/colour.hpp>

#include <optional>

namespace cairn {

// A mesh that a Renderer holds (Renderer::addMesh). Valid for that renderer only.
using MeshHandle = Id<struct DrawMeshTag>;

struct DrawInstance {
    MeshHandle mesh = {};
    Posef pose = {};  // body frame to world
    Colour colour = {0.7f, 0.7f, 0.7f, 1};
    Vec3f scale = Vec3f::Ones();  // applied in the body frame before the pose; each part not 0. Lets one mesh of a
                                  // unit box or ball stand for all sizes, which is what makes big scenes fast.
    bool castsShadow = true;      // false for what bounds the scene: the sun shines through it
};                                // colour.a < 1 draws the body see-through and without a shadow

// Lines and points keep their width in pixels at any distance. With `throughBodies` the parts hidden behind bodies are
// drawn too, at 40 % of their opacity; without it they are hidden.
struct DrawLine {
    Vec3f from = Vec3f::Zero();
    Vec3f to = Vec3f::Zero();
    Colour colour = {0, 0, 0, 1};
    float width = 2;  // pixels
    bool throughBodies = true;
};

struct DrawPoint {
    Vec3f position = Vec3f::Zero();
    Colour colour = {0, 0, 0, 1};
    float size = 8;  // diameter in pixels
    bool throughBodies = true;
};

struct Camera {
    Vec3f eye = {6, 4, 8};
    Vec3f target = {0, 1, 0};
    Vec3f up = {0, 1, 0};
    float verticalFov = 0.7f;  // rad, full angle from bottom to top, in (0, pi)
};

struct Sun {
    Vec3f direction = {0.55f, -1.0f, -0.5f};  // the way the light travels; any length but 0
    Colour colour = {1, 0.97f, 0.92f, 1};
    float intensity = 1;  // 1 exposes a surface that faces the sun just below white
    bool shadows = true;
};

// A horizontal plane that fades into the background, seen from above only (so that a camera under it still sees the
// bodies). Its checks tell the scale.
struct Ground {
    bool visible = true;
    float height = 0;  // m, world y
    float cell = 1;    // m, side of one check
    Colour colour = {0.80f, 0.81f, 0.83f, 1};
};

// A studio backdrop: shaded from the bottom of the picture to its top, whatever the camera looks at.
struct Background {
    Colour bottom = {0.90f, 0.92f, 0.94f, 1};
    Colour top = {0.56f, 0.67f, 0.80f, 1};
};

struct DrawScene {
    int width = 1280;  // pixels
    int height = 720;  // pixels
    Camera camera = {};
    Sun sun = {};
    Ground ground = {};
    Background background = {};
    std::vector<DrawInstance> instances = {};
    std::vector<DrawLine> lines = {};
    std::vector<DrawPoint> points = {};
    bool ambientOcclusion = true;  // darkens creases and contacts
};

// Overlays for physics, all drawn through bodies.

// A contact: a dot at `point`, and an arrow of `length` (m) along the unit `normal`.
void addContact(DrawScene& scene, const Vec3f& point, const Vec3f& normal, float length,
                const Colour& colour = {0.85f, 0.1f, 0.1f, 1});
// A line with a head of three strokes at `to`.
void addArrow(DrawScene& scene, const Vec3f& from, const Vec3f& to, const Colour& colour, float width = 2);
// Axes of a frame, x red, y green, z blue, each `length` (m) long.
void addFrame(DrawScene& scene, const Posef& pose, float length, float width = 3);
// The twelve edges of a box.
void addBoxOutline(DrawScene& scene, const Posef& pose, const Vec3f& halfExtents, const Colour& colour,
                   float width = 1);

// A camera that sees the whole box [low, high] (m) from the side that `from` points to (any length but 0), with a
// margin of a tenth; `aspect` is width over height.
Camera cameraThatSees(const Vec3f& low, const Vec3f& high, const Vec3f& from = {0.5f, 0.35f, 1},
                      float aspect = 16.f / 9, float verticalFov = 0.7f);

// Where a world point lands in the picture, in pixels from the top left corner (pixel centres at .5); nothing if it is
// behind the camera.
std::optional<Eigen::Vector2f> toPixel(const DrawScene& scene, const Vec3f& point);

}  // namespace cairn
