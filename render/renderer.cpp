// One picture, in passes: shadow map from the sun; a half-size map of normals and depths for ambient occlusion; the
// picture itself with 4 samples a pixel (background, ground, opaque bodies, see-through bodies, lines and points); then
// resolve and read back. Bodies are drawn instanced, one call a mesh and pass.
#include <cairn/render/renderer.hpp>

#include "base/slot_table.hpp"
#include "base/so3.hpp"
#include "render/gl.hpp"
#include "render/shaders.hpp"
#include "render/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace cairn {

namespace {

constexpr int shadowSize = 2048;
constexpr int samples = 4;
constexpr int largestPicture = 8192;
constexpr float hiddenOpacity = 0.4f;  // of lines and points behind bodies

using Mat4f = Eigen::Matrix4f;
using Vec4f = Eigen::Vector4f;

struct FrameBlock {  // std140, mirrors shaders::frame
    std::array<float, 16> viewProjection;
    std::array<float, 16> shadowMatrix;
    std::array<float, 4> eye, cameraX, cameraY, cameraZ, toSun, sunColour, groundColour, groundShape, groundPhase,
        backgroundBottom, backgroundTop, sizes, occlusion;
    std::array<int, 4> taps;
};

struct Vertex {
    std::array<float, 3> position;
    std::array<float, 3> normal;
};

struct InstanceData {
    std::array<float, 12> rows;
    std::array<float, 4> colour;  // linear
};

struct LineData {
    std::array<float, 3> from, to;
    std::array<float, 4> colour;
    float width;
};

struct PointData {
    std::array<float, 3> centre;
    std::array<float, 4> colour;
    float size;
};

struct GpuMesh {
    GLuint vertexArray = 0;
    GLuint vertices = 0;
    GLuint indices = 0;
    GLsizei indexCount = 0;
    Vec3f centre = Vec3f::Zero();
    Vec3f halfSize = Vec3f::Zero();
};

struct Batch {  // consecutive instances of one mesh
    MeshHandle mesh;
    bool castsShadow = true;
    std::size_t first = 0;
    std::size_t count = 0;
};

struct Ball {
    Vec3f centre;
    float radius = 0;
};

// OpenGL takes the offset into the bound buffer where a pointer used to stand.
const void* bufferOffset(std::size_t bytes) {
    return reinterpret_cast<const void*>(bytes);  // NOLINT(performance-no-int-to-ptr)
}

std::array<float, 3> parts(const Vec3f& v) {
    return {v.x(), v.y(), v.z()};
}
std::array<float, 4> parts(const Vec3f& v, float w) {
    return {v.x(), v.y(), v.z(), w};
}
std::array<float, 4> linear(const Colour& c) {
    return {srgbToLinear(c.r), srgbToLinear(c.g), srgbToLinear(c.b), c.a};
}
std::array<float, 16> parts(const Mat4f& m) {
    std::array<float, 16> out;
    std::copy(m.data(), m.data() + 16, out.begin());
    return out;
}

struct SmoothMesh {
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> indices;
};

// Each corner's normal is the mean of the triangles that meet there within the crease angle, weighted by their angle at
// the corner, so that how a face was cut into triangles does not show.
SmoothMesh withNormals(const TriangleMesh& mesh, double crease) {
    const double creaseCosine = std::cos(crease);
    // Vertices at one place count as one, however often the file repeats them.
    std::vector<int> order(mesh.vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        order[i] = static_cast<int>(i);
    }
    const auto key = [&](int i) {
        const Vec3d& v = mesh.vertices[static_cast<std::size_t>(i)];
        return std::array<double, 3>{v.x(), v.y(), v.z()};
    };
    std::sort(order.begin(), order.end(), [&](int i, int j) {
        const auto a = key(i);
        const auto b = key(j);
        return a != b ? a < b : i < j;
    });
    std::vector<std::size_t> place(order.size());
    std::size_t places = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i > 0 && key(order[i]) != key(order[i - 1])) {
            ++places;
        }
        place[static_cast<std::size_t>(order[i])] = places;
    }
    ++places;

    struct Corner {
        std::size_t triangle;
        double angle;
    };
    std::vector<Vec3d> faceNormal(mesh.triangles.size(), Vec3d::Zero());
    std::vector<std::vector<Corner>> around(places);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<Vec3d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][k])];
        }
        const Vec3d area = (p[1] - p[0]).cross(p[2] - p[0]);
        if (!(area.norm() > 0)) {
            continue;
        }
        faceNormal[t] = area.normalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = p[(k + 1) % 3] - p[k];
            const Vec3d b = p[(k + 2) % 3] - p[k];
            const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
            around[place[static_cast<std::size_t>(mesh.triangles[t][k])]].push_back({t, angle});
        }
    }

    SmoothMesh out;
    // One place has few different normals; vertices that agree in both are shared.
    std::vector<std::vector<std::uint32_t>> made(places);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (faceNormal[t].isZero()) {
            continue;  // a triangle without area covers no pixel
        }
        for (const int index : mesh.triangles[t]) {
            const std::size_t at = place[static_cast<std::size_t>(index)];
            Vec3d sum = Vec3d::Zero();
            for (const Corner& corner : around[at]) {
                if (faceNormal[corner.triangle].dot(faceNormal[t]) >= creaseCosine) {
                    sum += corner.angle * faceNormal[corner.triangle];
                }
            }
            const Vec3f position = mesh.vertices[static_cast<std::size_t>(index)].cast<float>();
            const Vec3f normal = sum.normalized().cast<float>();
            const auto same = std::find_if(made[at].begin(), made[at].end(),
                                           [&](std::uint32_t i) { return out.vertices[i].normal == parts(normal); });
            if (same != made[at].end()) {
                out.indices.push_back(*same);
                continue;
            }
            made[at].push_back(static_cast<std::uint32_t>(out.vertices.size()));
            out.indices.push_back(made[at].back());
            out.vertices.push_back({parts(position), parts(normal)});
        }
    }
    return out;
}

void requireColour(const Colour& c, const std::string& field) {
    for (const float part : {c.r, c.g, c.b, c.a}) {
        if (!(part >= 0 && part <= 1)) {
            throw InputError(field, std::to_string(part), "each part of a colour must be in [0, 1]");
        }
    }
}

void requireFinite(const Vec3f& v, const std::string& field) {
    if (!v.allFinite()) {
        throw InputError(field, "not finite",
                         "must be finite numbers (m); a body that left the world must not be drawn");
    }
}

std::string item(const char* list, std::size_t i, const char* field) {
    return std::string(list) + "[" + std::to_string(i) + "]." + field;
}

template <class Range>
void requirePixels(float pixels, const Range& field) {
    if (!(pixels > 0 && pixels <= 1000)) {
        throw InputError(field, std::to_string(pixels), "must be in (0, 1000] pixels");
    }
}

void check(const DrawScene& scene) {
    if (scene.width < 1 || scene.height < 1 || scene.width > largestPicture || scene.height > largestPicture) {
        throw InputError("picture size", std::to_string(scene.width) + " x " + std::to_string(scene.height),
                         "each side must be from 1 to " + std::to_string(largestPicture) + " pixels");
    }
    if (!scene.sun.direction.allFinite() || !(scene.sun.direction.norm() > 0)) {
        throw InputError("sun.direction", "0 or not finite", "must be a finite vector that is not 0");
    }
    if (!(scene.sun.intensity >= 0 && scene.sun.intensity <= 100)) {
        throw InputError("sun.intensity", std::to_string(scene.sun.intensity), "must be in [0, 100]");
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
        requireFinite(instance.pose.position, item("instances", i, "pose.position"));
        const float norm = instance.pose.rotation.norm();
        if (!(std::abs(norm - 1) < 1e-3f)) {
            throw InputError(item("instances", i, "pose.rotation"), "norm " + std::to_string(norm),
                             "must be a unit quaternion");
        }
        if (!instance.scale.allFinite() || !(instance.scale.cwiseAbs().minCoeff() > 0)) {
            throw InputError(item("instances", i, "scale"), "0 or not finite", "each part must be finite and not 0");
        }
        requireColour(instance.colour, item("instances", i, "colour"));
    }
    for (std::size_t i = 0; i < scene.lines.size(); ++i) {
        requireFinite(scene.lines[i].from, item("lines", i, "from"));
        requireFinite(scene.lines[i].to, item("lines", i, "to"));
        requireColour(scene.lines[i].colour, item("lines", i, "colour"));
        requirePixels(scene.lines[i].width, item("lines", i, "width"));
    }
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
        requireFinite(scene.points[i].position, item("points", i, "position"));
        requireColour(scene.points[i].colour, item("points", i, "colour"));
        requirePixels(scene.points[i].size, item("points", i, "size"));
    }
}

}  // namespace

class Renderer::Impl {
public:
    Impl();

    MeshHandle addMesh(const TriangleMesh& mesh, float crease);
    void removeMesh(MeshHandle mesh);
    Image render(const DrawScene& scene);

private:
    // Binds the context for one call and lets go of it after, so that the next call may come from another thread.
    class Use {
    public:
        explicit Use(GlContext& context) : context_(context) { context_.makeCurrent(); }
        ~Use() { context_.release(); }
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;

    private:
        GlContext& context_;
    };

    GLuint program(std::initializer_list<const char*> vertex, std::initializer_list<const char*> fragment);
    GLuint texture(GLint internalFormat, int width, int height, GLenum format, GLenum filter);
    void target(GLuint framebuffer, GLuint colour, GLuint depthRenderbuffer, bool multisampled, const char* what);
    void resize(int width, int height);
    void collect(const DrawScene& scene);
    void fillFrame(const DrawScene& scene);
    void fitShadow(const DrawScene& scene, const View& view, float farthest);
    void drawBatches(GLuint program, const Mat4f& clip, const std::vector<Batch>& batches);
    void drawScreen(GLuint program);
    void drawOverlays(const DrawScene& scene);
    void setInt(GLuint program, const char* name, int value);

    GlContext context_;
    Use setup_;  // current while the members below are made; released at the end of the constructor
    Gl gl_;
    SlotTable<GpuMesh, MeshHandle> meshes_;

    GLuint shadowProgram_ = 0, surfaceProgram_ = 0, groundSurfaceProgram_ = 0, occlusionProgram_ = 0, blurProgram_ = 0,
           backgroundProgram_ = 0, groundProgram_ = 0, bodyProgram_ = 0, lineProgram_ = 0, pointProgram_ = 0;
    GLuint frameBuffer_ = 0, instanceBuffer_ = 0, emptyArray_ = 0, overlayArray_ = 0, overlayBuffer_ = 0;
    GLuint shadowTarget_ = 0, shadowMap_ = 0;
    GLuint pictureTarget_ = 0, pictureColour_ = 0, pictureDepth_ = 0;
    GLuint resolvedTarget_ = 0, resolvedColour_ = 0;
    GLuint surfaceTarget_ = 0, surfaceMap_ = 0, surfaceDepth_ = 0;
    GLuint rawTarget_ = 0, rawMap_ = 0, occlusionTarget_ = 0, occlusionMap_ = 0;
    int width_ = 0, height_ = 0;

    // Of the scene being drawn.
    Vec3f origin_ = Vec3f::Zero();
    std::vector<InstanceData> instances_;
    std::vector<Ball> casters_, allBalls_;
    std::vector<Batch> opaque_, seeThrough_;
    FrameBlock frame_{};
    Mat4f viewProjection_, shadowProjection_;
    bool hasShadow_ = false;
    bool groundSeen_ = false;
};

Renderer::Impl::Impl() : setup_(context_), gl_(context_) {
    using namespace shaders;
    shadowProgram_ = program({bodyVertex}, {depthOnlyFragment});
    surfaceProgram_ = program({bodyVertex}, {surfaceFragment});
    groundSurfaceProgram_ = program({groundVertex}, {groundSurfaceFragment});
    occlusionProgram_ = program({screenVertex}, {occlusionFragment});
    blurProgram_ = program({screenVertex}, {blurFragment});
    backgroundProgram_ = program({screenVertex}, {backgroundFragment});
    groundProgram_ = program({groundVertex}, {light, groundFragment});
    bodyProgram_ = program({bodyVertex}, {light, bodyFragment});
    lineProgram_ = program({lineVertex}, {lineFragment});
    pointProgram_ = program({pointVertex}, {pointFragment});
    for (const GLuint lit : {groundProgram_, bodyProgram_}) {
        setInt(lit, "shadowMap", 0);
        setInt(lit, "occlusionMap", 1);
    }
    setInt(occlusionProgram_, "surfaceMap", 1);
    setInt(blurProgram_, "rawMap", 1);

    gl_.GenBuffers(1, &frameBuffer_);
    gl_.GenBuffers(1, &instanceBuffer_);
    gl_.GenBuffers(1, &overlayBuffer_);
    gl_.GenVertexArrays(1, &emptyArray_);
    gl_.GenVertexArrays(1, &overlayArray_);

    shadowMap_ = texture(GL_DEPTH_COMPONENT32F, shadowSize, shadowSize, GL_DEPTH_COMPONENT, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    gl_.GenFramebuffers(1, &shadowTarget_);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, shadowTarget_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadowMap_, 0);
    gl_.DrawBuffer(GL_NONE);
    gl_.ReadBuffer(GL_NONE);

    for (GLuint* framebuffer : {&pictureTarget_, &resolvedTarget_, &surfaceTarget_, &rawTarget_, &occlusionTarget_}) {
        gl_.GenFramebuffers(1, framebuffer);
    }
    for (GLuint* renderbuffer : {&pictureColour_, &pictureDepth_, &resolvedColour_, &surfaceDepth_}) {
        gl_.GenRenderbuffers(1, renderbuffer);
    }
    surfaceMap_ = texture(GL_RGBA32F, 1, 1, GL_RGBA, GL_NEAREST);
    rawMap_ = texture(GL_RG32F, 1, 1, GL_RG, GL_NEAREST);
    occlusionMap_ = texture(GL_RG32F, 1, 1, GL_RG, GL_NEAREST);
    context_.release();
}

GLuint Renderer::Impl::program(std::initializer_list<const char*> vertex, std::initializer_list<const char*> fragment) {
    const auto compile = [&](GLenum kind, std::initializer_list<const char*> pieces) {
        std::vector<const char*> source = {shaders::frame};
        source.insert(source.end(), pieces.begin(), pieces.end());
        const GLuint shader = gl_.CreateShader(kind);
        gl_.ShaderSource(shader, static_cast<GLsizei>(source.size()), source.data(), nullptr);
        gl_.CompileShader(shader);
        GLint ok = 0;
        gl_.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
        if (ok == 0) {
            std::array<char, 4096> log{};
            gl_.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
            throw std::runtime_error(std::string("this OpenGL refuses a shader of Cairn: ") + log.data());
        }
        return shader;
    };
    const GLuint vertexShader = compile(GL_VERTEX_SHADER, vertex);
    const GLuint fragmentShader = compile(GL_FRAGMENT_SHADER, fragment);
    const GLuint result = gl_.CreateProgram();
    gl_.AttachShader(result, vertexShader);
    gl_.AttachShader(result, fragmentShader);
    gl_.LinkProgram(result);
    gl_.DeleteShader(vertexShader);
    gl_.DeleteShader(fragmentShader);
    GLint ok = 0;
    gl_.GetProgramiv(result, GL_LINK_STATUS, &ok);
    if (ok == 0) {
        std::array<char, 4096> log{};
        gl_.GetProgramInfoLog(result, static_cast<GLsizei>(log.size()), nullptr, log.data());
        throw std::runtime_error(std::string("this OpenGL refuses a shader program of Cairn: ") + log.data());
    }
    const GLuint block = gl_.GetUniformBlockIndex(result, "Frame");
    if (block != GL_INVALID_INDEX) {
        gl_.UniformBlockBinding(result, block, 0);
    }
    return result;
}

void Renderer::Impl::setInt(GLuint program, const char* name, int value) {
    gl_.UseProgram(program);
    gl_.Uniform1i(gl_.GetUniformLocation(program, name), value);
}

GLuint Renderer::Impl::texture(GLint internalFormat, int width, int height, GLenum format, GLenum filter) {
    GLuint name = 0;
    gl_.GenTextures(1, &name);
    gl_.BindTexture(GL_TEXTURE_2D, name);
    gl_.TexImage2D(GL_TEXTURE_2D, 0, internalFormat, width, height, 0, format, GL_FLOAT, nullptr);
    for (const GLenum parameter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
        gl_.TexParameteri(GL_TEXTURE_2D, parameter, static_cast<GLint>(filter));
    }
    for (const GLenum parameter : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) {
        gl_.TexParameteri(GL_TEXTURE_2D, parameter, GL_CLAMP_TO_EDGE);
    }
    return name;
}

MeshHandle Renderer::Impl::addMesh(const TriangleMesh& mesh, float crease) {
    if (!std::isfinite(crease)) {
        throw InputError("crease", std::to_string(crease), "give an angle in rad");
    }
    if (mesh.triangles.empty() || mesh.vertices.empty()) {
        throw InputError("mesh", "empty", "give at least one triangle");
    }
    Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity());
    Vec3f high = -low;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3f v = mesh.vertices[i].cast<float>();
        requireFinite(v, item("mesh.vertices", i, "position"));
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const int index : mesh.triangles[t]) {
            if (index < 0 || static_cast<std::size_t>(index) >= mesh.vertices.size()) {
                throw InputError(item("mesh.triangles", t, "index"), std::to_string(index),
                                 "must be from 0 to " + std::to_string(mesh.vertices.size() - 1));
            }
        }
    }
    const SmoothMesh smooth = withNormals(mesh, static_cast<double>(crease));

    const Use use(context_);
    GpuMesh out;
    out.centre = 0.5f * (low + high);
    out.halfSize = 0.5f * (high - low);
    out.indexCount = static_cast<GLsizei>(smooth.indices.size());
    gl_.GenVertexArrays(1, &out.vertexArray);
    gl_.GenBuffers(1, &out.vertices);
    gl_.GenBuffers(1, &out.indices);
    gl_.BindVertexArray(out.vertexArray);
    gl_.BindBuffer(GL_ARRAY_BUFFER, out.vertices);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(smooth.vertices.size() * sizeof(Vertex)),
                   smooth.vertices.data(), GL_STATIC_DRAW);
    gl_.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), nullptr);
    gl_.VertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), bufferOffset(offsetof(Vertex, normal)));
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, out.indices);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(smooth.indices.size() * sizeof(std::uint32_t)),
                   smooth.indices.data(), GL_STATIC_DRAW);
    for (GLuint location = 0; location < 6; ++location) {
        gl_.EnableVertexAttribArray(location);
        gl_.VertexAttribDivisor(location, location < 2 ? 0 : 1);
    }
    gl_.BindVertexArray(0);
    return meshes_.add(out);
}

void Renderer::Impl::removeMesh(MeshHandle mesh) {
    if (!meshes_.contains(mesh)) {
        throw InputError("mesh", std::to_string(mesh.index), "is not (or no longer) a mesh of this renderer");
    }
    const Use use(context_);
    GpuMesh& old = meshes_[mesh.index];
    gl_.DeleteVertexArrays(1, &old.vertexArray);
    gl_.DeleteBuffers(1, &old.vertices);
    gl_.DeleteBuffers(1, &old.indices);
    meshes_.remove(mesh);
}

void Renderer::Impl::target(GLuint framebuffer, GLuint colour, GLuint depthRenderbuffer, bool colourIsTexture,
                            const char* what) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    if (colourIsTexture) {
        gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
    } else {
        gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour);
    }
    if (depthRenderbuffer != 0) {
        gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depthRenderbuffer);
    }
    if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
        width_ = 0;
        throw std::runtime_error(std::string("this OpenGL cannot draw to ") + what +
                                 ": use a smaller picture, or a Mesa with llvmpipe");
    }
}

void Renderer::Impl::resize(int width, int height) {
    if (width == width_ && height == height_) {
        return;
    }
    const int halfWidth = (width + 1) / 2;
    const int halfHeight = (height + 1) / 2;
    gl_.BindRenderbuffer(GL_RENDERBUFFER, pictureColour_);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_SRGB8_ALPHA8, width, height);
    gl_.BindRenderbuffer(GL_RENDERBUFFER, pictureDepth_);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT32F, width, height);
    gl_.BindRenderbuffer(GL_RENDERBUFFER, resolvedColour_);
    gl_.RenderbufferStorage(GL_RENDERBUFFER, GL_SRGB8_ALPHA8, width, height);
    gl_.BindRenderbuffer(GL_RENDERBUFFER, surfaceDepth_);
    gl_.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, halfWidth, halfHeight);
    gl_.BindTexture(GL_TEXTURE_2D, surfaceMap_);
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, halfWidth, halfHeight, 0, GL_RGBA, GL_FLOAT, nullptr);
    for (const GLuint map : {rawMap_, occlusionMap_}) {
        gl_.BindTexture(GL_TEXTURE_2D, map);
        gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, halfWidth, halfHeight, 0, GL_RG, GL_FLOAT, nullptr);
    }
    width_ = width;
    height_ = height;
    target(pictureTarget_, pictureColour_, pictureDepth_, false, "a multisampled sRGB picture");
    target(resolvedTarget_, resolvedColour_, 0, false, "an sRGB picture");
    target(surfaceTarget_, surfaceMap_, surfaceDepth_, true, "a map of floats");
    target(rawTarget_, rawMap_, 0, true, "a map of floats");
    target(occlusionTarget_, occlusionMap_, 0, true, "a map of floats");
}

// Sorts the instances into batches: opaque ones by mesh, see-through ones from far to near.
void Renderer::Impl::collect(const DrawScene& scene) {
    instances_.clear();
    casters_.clear();
    allBalls_.clear();
    opaque_.clear();
    seeThrough_.clear();
    std::vector<std::size_t> order(scene.instances.size());
    std::vector<Ball> balls(scene.instances.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const DrawInstance& instance = scene.instances[i];
        if (!meshes_.contains(instance.mesh)) {
            throw InputError(item("instances", i, "mesh"), std::to_string(instance.mesh.index),
                             "is not (or no longer) a mesh of this renderer: use a handle from its addMesh");
        }
        const GpuMesh& mesh = meshes_[instance.mesh.index];
        order[i] = i;
        balls[i].centre =
            instance.pose.position - origin_ + instance.pose.rotation * instance.scale.cwiseProduct(mesh.centre).eval();
        balls[i].radius = instance.scale.cwiseProduct(mesh.halfSize).norm();
    }
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
        const DrawInstance& a = scene.instances[i];
        const DrawInstance& b = scene.instances[j];
        const bool clearA = a.colour.a < 1;
        const bool clearB = b.colour.a < 1;
        if (clearA != clearB) {
            return clearB;
        }
        if (clearA) {
            const Vec3f eye = scene.camera.eye - origin_;
            const float farA = (balls[i].centre - eye).squaredNorm();
            const float farB = (balls[j].centre - eye).squaredNorm();
            return farA != farB ? farA > farB : i < j;
        }
        if (a.mesh != b.mesh) {
            return a.mesh < b.mesh;
        }
        return a.castsShadow != b.castsShadow ? a.castsShadow : i < j;
    });
    for (const std::size_t i : order) {
        const DrawInstance& instance = scene.instances[i];
        const bool clear = instance.colour.a < 1;
        std::vector<Batch>& batches = clear ? seeThrough_ : opaque_;
        // A see-through body is its own batch: its nearest surface is found before it is blended.
        if (batches.empty() || clear || batches.back().mesh != instance.mesh ||
            batches.back().castsShadow != instance.castsShadow) {
            batches.push_back({instance.mesh, instance.castsShadow, instances_.size(), 0});
        }
        ++batches.back().count;
        const Eigen::Matrix3f axes = instance.pose.rotation.toRotationMatrix() * instance.scale.asDiagonal();
        InstanceData data;
        Eigen::Map<Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> rows(data.rows.data());
        rows.leftCols<3>() = axes;
        rows.col(3) = instance.pose.position - origin_;
        data.colour = linear(instance.colour);
        instances_.push_back(data);
        allBalls_.push_back(balls[i]);
        if (!clear && instance.castsShadow) {
            casters_.push_back(balls[i]);
        }
    }
}

// The light's box: as small as the casters in sight allow, because its texels set how sharp shadows are. Bodies far
// larger than the rest stretch it only while a texel is a sixteenth of the middle body's radius: a bowl does, a floor
// or a hill does not. Its size moves in steps of a quarter octave and its place in whole texels, so that shadows do not
// crawl from one picture of a film to the next.
void Renderer::Impl::fitShadow(const DrawScene& scene, const View& view, float farthest) {
    hasShadow_ = scene.sun.shadows && !casters_.empty() && scene.sun.intensity > 0;
    frame_.toSun[3] = 0;
    if (!hasShadow_) {
        return;
    }
    const Vec3f toSun = -scene.sun.direction.normalized();
    Vec3f x;
    Vec3f y;
    completeBasis(toSun, x, y);

    std::vector<float> radii;
    for (const Ball& ball : casters_) {
        radii.push_back(ball.radius);
    }
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>((radii.size() - 1) / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    const float largest = 12 * *middle;
    const float widest = static_cast<float>(shadowSize) / 16 * *middle;  // m

    constexpr float infinity = std::numeric_limits<float>::infinity();
    Eigen::Array3f low = Eigen::Array3f::Constant(infinity);
    Eigen::Array3f high = -low;
    float lowZ = infinity;
    float highZ = -infinity;
    float reach = 0;
    const Vec3f eye = scene.camera.eye - origin_;
    for (const bool large : {false, true}) {
        for (const Ball& ball : casters_) {
            const Eigen::Array3f at(ball.centre.dot(x), ball.centre.dot(y), ball.centre.dot(toSun));
            const Eigen::Array3f grownLow = low.min(at - ball.radius);
            const Eigen::Array3f grownHigh = high.max(at + ball.radius);
            lowZ = std::min(lowZ, at.z() - ball.radius);
            highZ = std::max(highZ, at.z() + ball.radius);
            if (large == (ball.radius > largest) && (!large || (grownHigh - grownLow).head<2>().maxCoeff() <= widest)) {
                low = grownLow;
                high = grownHigh;
                reach = std::max(reach, (ball.centre - eye).dot(view.forward) + ball.radius);
            }
        }
    }
    // What the camera sees, out to well behind the farthest fitted caster, where its shadow may fall.
    reach = std::clamp(2 * reach, 0.f, farthest);
    Eigen::Array3f seenLow(eye.dot(x), eye.dot(y), 0);
    Eigen::Array3f seenHigh = seenLow;
    for (int corner = 0; corner < 4; ++corner) {
        const Vec3f p = eye + reach * (view.forward + ((corner & 1) != 0 ? view.tanX : -view.tanX) * view.right +
                                       ((corner & 2) != 0 ? view.tanY : -view.tanY) * view.up);
        const Eigen::Array3f at(p.dot(x), p.dot(y), 0);
        seenLow = seenLow.min(at);
        seenHigh = seenHigh.max(at);
    }
    const Eigen::Array3f rim = 0.03f * (seenHigh - seenLow);
    const Eigen::Array3f cutLow = low.max(seenLow - rim);
    const Eigen::Array3f cutHigh = high.min(seenHigh + rim);
    if (cutLow.x() < cutHigh.x() && cutLow.y() < cutHigh.y()) {
        low = cutLow;
        high = cutHigh;
    }
    float side = 1.02f * std::max(high.x() - low.x(), high.y() - low.y());
    side = std::exp2(std::ceil(4 * std::log2(side)) / 4);
    side *= 1.0f + 12.0f / static_cast<float>(shadowSize);  // room for the filter and for snapping
    const float texel = side / static_cast<float>(shadowSize);
    // Snapped in world coordinates, of which origin_ is the shift.
    const auto snap = [&](float centre, const Vec3f& axis) {
        const double world = static_cast<double>(centre) + origin_.cast<double>().dot(axis.cast<double>());
        const double snapped = std::round(world / static_cast<double>(texel)) * static_cast<double>(texel);
        return static_cast<float>(snapped - origin_.cast<double>().dot(axis.cast<double>()));
    };
    const float centreX = snap(0.5f * (low.x() + high.x()), x);
    const float centreY = snap(0.5f * (low.y() + high.y()), y);
    const float margin = 1e-3f * (highZ - lowZ) + 4 * texel;
    const float depth = highZ - lowZ + 2 * margin;

    Mat4f& m = shadowProjection_;
    m.setZero();
    m.block<1, 3>(0, 0) = 2 / side * x.transpose();
    m(0, 3) = -2 / side * centreX;
    m.block<1, 3>(1, 0) = 2 / side * y.transpose();
    m(1, 3) = -2 / side * centreY;
    m.block<1, 3>(2, 0) = -2 / depth * toSun.transpose();
    m(2, 3) = 2 * (highZ + margin) / depth - 1;
    m(3, 3) = 1;
    Mat4f toUnit = Mat4f::Identity() * 0.5f;
    toUnit.col(3) = Vec4f(0.5f, 0.5f, 0.5f, 1);
    frame_.shadowMatrix = parts(Mat4f(toUnit * m));
    frame_.toSun[3] = 1;
    frame_.sizes[2] = texel;
    frame_.sizes[3] = 1.0f / static_cast<float>(shadowSize);
}

void Renderer::Impl::fillFrame(const DrawScene& scene) {
    const float width = static_cast<float>(scene.width);
    const float height = static_cast<float>(scene.height);
    const View view = makeView(scene.camera, width / height);
    const Vec3f eye = scene.camera.eye - origin_;
    const float distance = eye.norm();

    // Near and far planes just around what is there.
    float extent = distance;
    float nearest = std::numeric_limits<float>::infinity();
    float farthest = 0;
    const auto include = [&](const Vec3f& p, float radius) {
        const float depth = (p - eye).dot(view.forward);
        nearest = std::min(nearest, depth - radius);
        farthest = std::max(farthest, depth + radius);
    };
    for (const Ball& ball : allBalls_) {
        include(ball.centre, ball.radius);
    }
    for (const DrawLine& line : scene.lines) {
        include(line.from - origin_, 0);
        include(line.to - origin_, 0);
    }
    for (const DrawPoint& point : scene.points) {
        include(point.position - origin_, 0);
    }
    extent = std::max(extent, std::min(farthest, 20 * distance));
    const float groundY = scene.ground.height - origin_.y();
    groundSeen_ = scene.ground.visible && eye.y() > groundY;
    const float fadeFrom = 0.8f * extent;
    const float fadeTo = 4.5f * extent;
    if (groundSeen_) {
        include(eye, 0);
        farthest = std::max(farthest, distance + fadeTo);
        nearest = std::max(nearest, 0.1f * (eye.y() - groundY));
    }
    farthest = std::max(1.01f * farthest, 1e-3f * distance);
    nearest = std::clamp(0.98f * nearest, 2e-4f * farthest, 0.9f * farthest);

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
    viewProjection_ = projection * look;

    frame_.viewProjection = parts(viewProjection_);
    frame_.eye = parts(eye, 1);
    frame_.cameraX = parts(Vec3f(view.tanX * view.right), 0);
    frame_.cameraY = parts(Vec3f(view.tanY * view.up), 0);
    frame_.cameraZ = parts(view.forward, 0);
    frame_.toSun = parts(Vec3f(-scene.sun.direction.normalized()), 0);
    frame_.sunColour = linear(scene.sun.colour);
    for (std::size_t i = 0; i < 3; ++i) {
        frame_.sunColour[i] *= 0.78f * scene.sun.intensity;
    }
    frame_.groundColour = linear(scene.ground.colour);
    frame_.groundShape = {groundY, scene.ground.cell, fadeFrom, fadeTo};
    const float period = 2 * scene.ground.cell;
    frame_.groundPhase = {std::fmod(origin_.x(), period), std::fmod(origin_.z(), period), 0, 0};
    frame_.backgroundBottom = linear(scene.background.bottom);
    frame_.backgroundTop = linear(scene.background.top);
    frame_.sizes = {width, height, 0, 0};
    const int halfWidth = (scene.width + 1) / 2;
    const int halfHeight = (scene.height + 1) / 2;
    // A twentieth of the picture at the target: wide enough for contacts to read, narrow enough to stay local.
    frame_.occlusion = {0.1f * distance * view.tanY, scene.ambientOcclusion ? 1.f : 0.f, static_cast<float>(halfWidth),
                        static_cast<float>(halfHeight)};
    frame_.taps = {12, 10, 16, 0};
    fitShadow(scene, view, farthest);

    gl_.BindBuffer(GL_UNIFORM_BUFFER, frameBuffer_);
    gl_.BufferData(GL_UNIFORM_BUFFER, sizeof(FrameBlock), &frame_, GL_STREAM_DRAW);
    gl_.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer_);
}

void Renderer::Impl::drawBatches(GLuint program, const Mat4f& clip, const std::vector<Batch>& batches) {
    gl_.UseProgram(program);
    gl_.UniformMatrix4fv(gl_.GetUniformLocation(program, "clipMatrix"), 1, GL_FALSE, clip.data());
    for (const Batch& batch : batches) {
        const GpuMesh& mesh = meshes_[batch.mesh.index];
        gl_.BindVertexArray(mesh.vertexArray);
        gl_.BindBuffer(GL_ARRAY_BUFFER, instanceBuffer_);
        for (GLuint row = 0; row < 4; ++row) {
            const std::size_t offset = batch.first * sizeof(InstanceData) + 4 * sizeof(float) * row;
            gl_.VertexAttribPointer(2 + row, 4, GL_FLOAT, GL_FALSE, sizeof(InstanceData), bufferOffset(offset));
        }
        gl_.DrawElementsInstanced(GL_TRIANGLES, mesh.indexCount, GL_UNSIGNED_INT, nullptr,
                                  static_cast<GLsizei>(batch.count));
    }
}

void Renderer::Impl::drawScreen(GLuint program) {
    gl_.UseProgram(program);
    gl_.BindVertexArray(emptyArray_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

// Twice: what is hidden, faintly, then what is seen.
void Renderer::Impl::drawOverlays(const DrawScene& scene) {
    struct Attribute {
        GLint size;
        std::size_t offset;
    };
    const auto draw = [&](GLuint program, const auto& data, std::initializer_list<Attribute> attributes,
                          std::size_t throughCount) {
        using Element = typename std::decay_t<decltype(data)>::value_type;
        if (data.empty()) {
            return;
        }
        gl_.UseProgram(program);
        gl_.BindVertexArray(overlayArray_);
        gl_.BindBuffer(GL_ARRAY_BUFFER, overlayBuffer_);
        gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(Element)), data.data(),
                       GL_STREAM_DRAW);
        GLuint location = 2;
        for (const Attribute& attribute : attributes) {
            gl_.EnableVertexAttribArray(location);
            gl_.VertexAttribDivisor(location, 1);
            gl_.VertexAttribPointer(location, attribute.size, GL_FLOAT, GL_FALSE, sizeof(Element),
                                    bufferOffset(attribute.offset));
            ++location;
        }
        const GLint opacity = gl_.GetUniformLocation(program, "opacity");
        if (throughCount > 0) {
            gl_.DepthFunc(GL_GREATER);
            gl_.Uniform1f(opacity, hiddenOpacity);
            gl_.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(throughCount));
        }
        gl_.DepthFunc(GL_LEQUAL);
        gl_.Uniform1f(opacity, 1);
        gl_.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(data.size()));
    };
    // Those that show through bodies come first, so that one call draws just them.
    std::vector<LineData> lines;
    std::vector<PointData> points;
    std::size_t throughLines = 0;
    std::size_t throughPoints = 0;
    for (const bool through : {true, false}) {
        for (const DrawLine& line : scene.lines) {
            if (line.throughBodies == through) {
                lines.push_back({parts(Vec3f(line.from - origin_)), parts(Vec3f(line.to - origin_)),
                                 linear(line.colour), line.width});
                throughLines += through ? 1 : 0;
            }
        }
        for (const DrawPoint& point : scene.points) {
            if (point.throughBodies == through) {
                points.push_back({parts(Vec3f(point.position - origin_)), linear(point.colour), point.size});
                throughPoints += through ? 1 : 0;
            }
        }
    }
    gl_.DepthMask(GL_FALSE);
    draw(lineProgram_, lines,
         {{3, offsetof(LineData, from)},
          {3, offsetof(LineData, to)},
          {4, offsetof(LineData, colour)},
          {1, offsetof(LineData, width)}},
         throughLines);
    draw(pointProgram_, points,
         {{3, offsetof(PointData, centre)}, {4, offsetof(PointData, colour)}, {1, offsetof(PointData, size)}},
         throughPoints);
    gl_.DepthMask(GL_TRUE);
}

Image Renderer::Impl::render(const DrawScene& scene) {
    check(scene);
    origin_ = scene.camera.target;
    makeView(scene.camera, 1);  // refuses a bad camera before anything is drawn
    collect(scene);

    const Use use(context_);
    resize(scene.width, scene.height);
    gl_.BindBuffer(GL_ARRAY_BUFFER, instanceBuffer_);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances_.size() * sizeof(InstanceData)),
                   instances_.data(), GL_STREAM_DRAW);
    fillFrame(scene);

    gl_.Disable(GL_BLEND);
    gl_.Disable(GL_FRAMEBUFFER_SRGB);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(GL_LEQUAL);
    gl_.DepthMask(GL_TRUE);
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    const float farDepth = 1;

    if (hasShadow_) {
        gl_.BindFramebuffer(GL_FRAMEBUFFER, shadowTarget_);
        gl_.Viewport(0, 0, shadowSize, shadowSize);
        gl_.ClearBufferfv(GL_DEPTH, 0, &farDepth);
        gl_.Enable(GL_POLYGON_OFFSET_FILL);
        gl_.PolygonOffset(1.1f, 4.0f);
        std::vector<Batch> casting;
        std::copy_if(opaque_.begin(), opaque_.end(), std::back_inserter(casting),
                     [](const Batch& batch) { return batch.castsShadow; });
        drawBatches(shadowProgram_, shadowProjection_, casting);
        gl_.Disable(GL_POLYGON_OFFSET_FILL);
    }

    if (scene.ambientOcclusion) {
        const int halfWidth = (width_ + 1) / 2;
        const int halfHeight = (height_ + 1) / 2;
        const std::array<float, 4> nothing{};
        gl_.ActiveTexture(GL_TEXTURE1);
        gl_.BindTexture(GL_TEXTURE_2D, 0);
        gl_.BindFramebuffer(GL_FRAMEBUFFER, surfaceTarget_);
        gl_.Viewport(0, 0, halfWidth, halfHeight);
        gl_.ClearBufferfv(GL_COLOR, 0, nothing.data());
        gl_.ClearBufferfv(GL_DEPTH, 0, &farDepth);
        if (groundSeen_) {
            gl_.UseProgram(groundSurfaceProgram_);
            gl_.BindVertexArray(emptyArray_);
            gl_.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
        }
        drawBatches(surfaceProgram_, viewProjection_, opaque_);
        gl_.Disable(GL_DEPTH_TEST);
        gl_.BindFramebuffer(GL_FRAMEBUFFER, rawTarget_);
        gl_.BindTexture(GL_TEXTURE_2D, surfaceMap_);
        drawScreen(occlusionProgram_);
        gl_.BindFramebuffer(GL_FRAMEBUFFER, occlusionTarget_);
        gl_.BindTexture(GL_TEXTURE_2D, rawMap_);
        drawScreen(blurProgram_);
    }
    gl_.ActiveTexture(GL_TEXTURE1);
    gl_.BindTexture(GL_TEXTURE_2D, occlusionMap_);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, shadowMap_);

    gl_.BindFramebuffer(GL_FRAMEBUFFER, pictureTarget_);
    gl_.Viewport(0, 0, width_, height_);
    gl_.Enable(GL_MULTISAMPLE);
    gl_.Enable(GL_FRAMEBUFFER_SRGB);
    gl_.ClearBufferfv(GL_DEPTH, 0, &farDepth);
    gl_.Disable(GL_DEPTH_TEST);
    drawScreen(backgroundProgram_);
    gl_.Enable(GL_DEPTH_TEST);
    // Bodies before the ground, so that the ground under them is not shaded in vain.
    drawBatches(bodyProgram_, viewProjection_, opaque_);
    gl_.Enable(GL_BLEND);
    gl_.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    if (groundSeen_) {
        gl_.UseProgram(groundProgram_);
        gl_.BindVertexArray(emptyArray_);
        gl_.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
    for (const Batch& batch : seeThrough_) {
        gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        drawBatches(bodyProgram_, viewProjection_, {batch});
        gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        drawBatches(bodyProgram_, viewProjection_, {batch});
    }
    drawOverlays(scene);

    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, pictureTarget_);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, resolvedTarget_);
    gl_.BlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, resolvedTarget_);
    Image flipped(width_, height_);
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, flipped.rgba.data());
    const GLenum error = gl_.GetError();
    if (error != GL_NO_ERROR) {
        throw std::runtime_error("OpenGL reports error " + std::to_string(error) +
                                 " while drawing: use a smaller picture or fewer bodies");
    }
    Image image(width_, height_);
    for (int y = 0; y < height_; ++y) {
        std::memcpy(image.pixel(0, y), flipped.pixel(0, height_ - 1 - y), 4 * static_cast<std::size_t>(width_));
    }
    return image;
}

Renderer::Renderer() : impl_(std::make_unique<Impl>()) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
MeshHandle Renderer::addMesh(const TriangleMesh& mesh, float crease) {
    return impl_->addMesh(mesh, crease);
}
void Renderer::removeMesh(MeshHandle mesh) {
    impl_->removeMesh(mesh);
}
Image Renderer::render(const DrawScene& scene) {
    return impl_->render(scene);
}

}  // namespace cairn
