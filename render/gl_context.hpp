#pragma once
// The one place that knows how an OpenGL context without a display comes to be. Today OSMesa; Mesa drops it from 25.1
// on, and an EGL surfaceless context then replaces gl_context.cpp alone: nothing is drawn to a default framebuffer.
#include <memory>

namespace cairn {

class GlContext {
public:
    // OpenGL 3.3 core. std::runtime_error with the remedy if there is none.
    GlContext();
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    void makeCurrent();  // for the calling thread
    void release();      // so that another thread may take it

    using Function = void (*)();
    Function getProcAddress(const char* name) const;  // null if unknown

private:
    struct Handle;
    std::unique_ptr<Handle> handle_;
};

}  // namespace cairn
