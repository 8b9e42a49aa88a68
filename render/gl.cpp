#include "render/gl.hpp"

#include <stdexcept>
#include <string>

namespace cairn {

namespace {

template <class Pointer>
void load(const GlContext& context, const char* name, Pointer& pointer) {
    pointer = reinterpret_cast<Pointer>(context.getProcAddress(name));
    if (pointer == nullptr) {
        throw std::runtime_error(std::string("the off-screen OpenGL lacks ") + name +
                                 ": install a Mesa with OpenGL 3.3 (Debian: libosmesa6)");
    }
}

}  // namespace

Gl::Gl(const GlContext& context) {
#define CAIRN_GL_LOAD(name, upper) load(context, "gl" #name, name);
    CAIRN_GL_FUNCTIONS(CAIRN_GL_LOAD)
#undef CAIRN_GL_LOAD
}

}  // namespace cairn
