// One picture, in passes: shadow map from the sun; a half-size map of normals and depths for ambient occlusion; the
// picture itself with 4 samples a pixel (background, ground, opaque bodies, see-through bodies, lines and points); then
// resolve and read back. Bodies are drawn instanced, one call a mesh and pass.
#include <cairn/render/renderer.hpp>

#include "base/slot_table.hpp"
#include "render/check_scene.hpp"
#include "render/frame.hpp"
#include "render/gl_objects.hpp"
#include "render/shaders.hpp"
#include "render/smooth_mesh.hpp"
#include "render/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace cairn {

namespace {

constexpr int samples = 4;
constexpr float hiddenOpacity = 0.4f;  // of lines and points behind bodies
constexpr float farDepth = 1;

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

// OpenGL takes the offset into the bound buffer where a pointer used to stand.
const void* bufferOffset(std::size_t bytes) {
    return reinterpret_cast<const void*>(bytes);  // NOLINT(performance-no-int-to-ptr)
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

    void target(GLuint framebuffer, GLuint colour, GLuint depthRenderbuffer, bool multisampled, const char* what);
    void resize(int width, int height);
    void collect(const DrawScene& scene);
    void drawBatches(GLuint program, const Mat4f& clip, const std::vector<Batch>& batches);
    void drawScreen(GLuint program);
    void drawGround(GLuint program);
    void send(const DrawScene& scene);
    void drawShadow();
    void drawOcclusion();
    void drawPicture(const DrawScene& scene);
    Image readBack();
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
    Frame frame_;
};

Renderer::Impl::Impl() : setup_(context_), gl_(context_) {
    using namespace shaders;
    shadowProgram_ = makeProgram(gl_, {bodyVertex}, {depthOnlyFragment});
    surfaceProgram_ = makeProgram(gl_, {bodyVertex}, {surfaceFragment});
    groundSurfaceProgram_ = makeProgram(gl_, {groundVertex}, {groundSurfaceFragment});
    occlusionProgram_ = makeProgram(gl_, {screenVertex}, {occlusionFragment});
    blurProgram_ = makeProgram(gl_, {screenVertex}, {blurFragment});
    backgroundProgram_ = makeProgram(gl_, {screenVertex}, {backgroundFragment});
    groundProgram_ = makeProgram(gl_, {groundVertex}, {light, groundFragment});
    bodyProgram_ = makeProgram(gl_, {bodyVertex}, {light, bodyFragment});
    lineProgram_ = makeProgram(gl_, {lineVertex}, {lineFragment});
    pointProgram_ = makeProgram(gl_, {pointVertex}, {pointFragment});
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

    shadowMap_ = makeTexture(gl_, GL_DEPTH_COMPONENT32F, shadowSize, shadowSize, GL_DEPTH_COMPONENT, GL_LINEAR);
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
    surfaceMap_ = makeTexture(gl_, GL_RGBA32F, 1, 1, GL_RGBA, GL_NEAREST);
    rawMap_ = makeTexture(gl_, GL_RG32F, 1, 1, GL_RG, GL_NEAREST);
    occlusionMap_ = makeTexture(gl_, GL_RG32F, 1, 1, GL_RG, GL_NEAREST);
    context_.release();
}

void Renderer::Impl::setInt(GLuint program, const char* name, int value) {
    gl_.UseProgram(program);
    gl_.Uniform1i(gl_.GetUniformLocation(program, name), value);
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
        requireFinite(v, fieldOf("mesh.vertices", i, "position"));
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const int index : mesh.triangles[t]) {
            if (index < 0 || static_cast<std::size_t>(index) >= mesh.vertices.size()) {
                throw InputError(fieldOf("mesh.triangles", t, "index"), std::to_string(index),
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
            throw InputError(fieldOf("instances", i, "mesh"), std::to_string(instance.mesh.index),
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

void Renderer::Impl::drawGround(GLuint program) {
    gl_.UseProgram(program);
    gl_.BindVertexArray(emptyArray_);
    gl_.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
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

// The bodies and what the shaders are told.
void Renderer::Impl::send(const DrawScene& scene) {
    gl_.BindBuffer(GL_ARRAY_BUFFER, instanceBuffer_);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances_.size() * sizeof(InstanceData)),
                   instances_.data(), GL_STREAM_DRAW);
    frame_ = makeFrame(scene, origin_, allBalls_, casters_);
    gl_.BindBuffer(GL_UNIFORM_BUFFER, frameBuffer_);
    gl_.BufferData(GL_UNIFORM_BUFFER, sizeof(FrameBlock), &frame_.block, GL_STREAM_DRAW);
    gl_.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer_);
}

void Renderer::Impl::drawShadow() {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, shadowTarget_);
    gl_.Viewport(0, 0, shadowSize, shadowSize);
    gl_.ClearBufferfv(GL_DEPTH, 0, &farDepth);
    gl_.Enable(GL_POLYGON_OFFSET_FILL);
    gl_.PolygonOffset(1.1f, 4.0f);
    std::vector<Batch> casting;
    std::copy_if(opaque_.begin(), opaque_.end(), std::back_inserter(casting),
                 [](const Batch& batch) { return batch.castsShadow; });
    drawBatches(shadowProgram_, frame_.shadowProjection, casting);
    gl_.Disable(GL_POLYGON_OFFSET_FILL);
}

void Renderer::Impl::drawOcclusion() {
    const int halfWidth = (width_ + 1) / 2;
    const int halfHeight = (height_ + 1) / 2;
    const std::array<float, 4> nothing{};
    gl_.ActiveTexture(GL_TEXTURE1);
    gl_.BindTexture(GL_TEXTURE_2D, 0);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, surfaceTarget_);
    gl_.Viewport(0, 0, halfWidth, halfHeight);
    gl_.ClearBufferfv(GL_COLOR, 0, nothing.data());
    gl_.ClearBufferfv(GL_DEPTH, 0, &farDepth);
    if (frame_.groundSeen) {
        drawGround(groundSurfaceProgram_);
    }
    drawBatches(surfaceProgram_, frame_.viewProjection, opaque_);
    gl_.Disable(GL_DEPTH_TEST);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, rawTarget_);
    gl_.BindTexture(GL_TEXTURE_2D, surfaceMap_);
    drawScreen(occlusionProgram_);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, occlusionTarget_);
    gl_.BindTexture(GL_TEXTURE_2D, rawMap_);
    drawScreen(blurProgram_);
}

void Renderer::Impl::drawPicture(const DrawScene& scene) {
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
    drawBatches(bodyProgram_, frame_.viewProjection, opaque_);
    gl_.Enable(GL_BLEND);
    gl_.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    if (frame_.groundSeen) {
        drawGround(groundProgram_);
    }
    for (const Batch& batch : seeThrough_) {
        gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        drawBatches(bodyProgram_, frame_.viewProjection, {batch});
        gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        drawBatches(bodyProgram_, frame_.viewProjection, {batch});
    }
    drawOverlays(scene);
}

Image Renderer::Impl::readBack() {
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

Image Renderer::Impl::render(const DrawScene& scene) {
    requireDrawable(scene);
    origin_ = scene.camera.target;
    makeView(scene.camera, 1);  // refuses a bad camera before anything is drawn
    collect(scene);

    const Use use(context_);
    resize(scene.width, scene.height);
    send(scene);
    gl_.Disable(GL_BLEND);
    gl_.Disable(GL_FRAMEBUFFER_SRGB);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(GL_LEQUAL);
    gl_.DepthMask(GL_TRUE);
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    if (frame_.hasShadow) {
        drawShadow();
    }
    if (scene.ambientOcclusion) {
        drawOcclusion();
    }
    drawPicture(scene);
    return readBack();
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
