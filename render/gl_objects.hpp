#pragma once
// Programs and textures of OpenGL. The context is current.
#include "render/gl.hpp"

#include <initializer_list>

namespace cairn {

// Each shader is shaders::frame and these pieces one after the other. std::runtime_error with OpenGL's own words.
GLuint makeProgram(const Gl& gl, std::initializer_list<const char*> vertex,
                   std::initializer_list<const char*> fragment);
// Of floats, held at its rim; left bound.
GLuint makeTexture(const Gl& gl, GLint internalFormat, int width, int height, GLenum format, GLenum filter);

}  // namespace cairn
