#include "render/gl_context.hpp"

#include <GL/osmesa.h>

#include <array>
#include <stdexcept>

namespace cairn {

struct GlContext::Handle {
    OSMesaContext context = nullptr;
    std::array<unsigned char, 4> pixel{};  // OSMesa insists on a buffer of its own; nothing is ever drawn to it
};

GlContext::GlContext() : handle_(std::make_unique<Handle>()) {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    handle_->context = OSMesaCreateContextAttribs(attributes, nullptr);
    if (handle_->context == nullptr) {
        throw std::runtime_error(
            "no off-screen OpenGL 3.3 context: install a Mesa with OSMesa and llvmpipe (Debian: libosmesa6), leave "
            "GALLIUM_DRIVER and MESA_GL_VERSION_OVERRIDE unset, or build with CAIRN_RENDER=OFF");
    }
}

GlContext::~GlContext() {
    OSMesaDestroyContext(handle_->context);
}

void GlContext::makeCurrent() {
    if (OSMesaMakeCurrent(handle_->context, handle_->pixel.data(), GL_UNSIGNED_BYTE, 1, 1) == GL_FALSE) {
        throw std::runtime_error(
            "the off-screen OpenGL context cannot be used: make sure that no libGL or libOpenGL is linked beside "
            "OSMesa, "
            "and that the renderer is used by one thread at a time");
    }
}

void GlContext::release() {
    OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0);
}

GlContext::Function GlContext::getProcAddress(const char* name) const {
    return OSMesaGetProcAddress(name);
}

}  // namespace cairn
