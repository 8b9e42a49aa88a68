#include "render/gl_objects.hpp"

#include "render/shaders.hpp"

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace cairn {

GLuint makeProgram(const Gl& gl, std::initializer_list<const char*> vertex,
                   std::initializer_list<const char*> fragment) {
    const auto compile = [&](GLenum kind, std::initializer_list<const char*> pieces) {
        std::vector<const char*> source = {shaders::frame};
        source.insert(source.end(), pieces.begin(), pieces.end());
        const GLuint shader = gl.CreateShader(kind);
        gl.ShaderSource(shader, static_cast<GLsizei>(source.size()), source.data(), nullptr);
        gl.CompileShader(shader);
        GLint ok = 0;
        gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
        if (ok == 0) {
            std::array<char, 4096> log{};
            gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
            throw std::runtime_error(std::string("this OpenGL refuses a shader of Cairn: ") + log.data());
        }
        return shader;
    };
    const GLuint vertexShader = compile(GL_VERTEX_SHADER, vertex);
    const GLuint fragmentShader = compile(GL_FRAGMENT_SHADER, fragment);
    const GLuint result = gl.CreateProgram();
    gl.AttachShader(result, vertexShader);
    gl.AttachShader(result, fragmentShader);
    gl.LinkProgram(result);
    gl.DeleteShader(vertexShader);
    gl.DeleteShader(fragmentShader);
    GLint ok = 0;
    gl.GetProgramiv(result, GL_LINK_STATUS, &ok);
    if (ok == 0) {
        std::array<char, 4096> log{};
        gl.GetProgramInfoLog(result, static_cast<GLsizei>(log.size()), nullptr, log.data());
        throw std::runtime_error(std::string("this OpenGL refuses a shader program of Cairn: ") + log.data());
    }
    const GLuint block = gl.GetUniformBlockIndex(result, "Frame");
    if (block != GL_INVALID_INDEX) {
        gl.UniformBlockBinding(result, block, 0);
    }
    return result;
}

GLuint makeTexture(const Gl& gl, GLint internalFormat, int width, int height, GLenum format, GLenum filter) {
    GLuint name = 0;
    gl.GenTextures(1, &name);
    gl.BindTexture(GL_TEXTURE_2D, name);
    gl.TexImage2D(GL_TEXTURE_2D, 0, internalFormat, width, height, 0, format, GL_FLOAT, nullptr);
    for (const GLenum parameter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
        gl.TexParameteri(GL_TEXTURE_2D, parameter, static_cast<GLint>(filter));
    }
    for (const GLenum parameter : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) {
        gl.TexParameteri(GL_TEXTURE_2D, parameter, GL_CLAMP_TO_EDGE);
    }
    return name;
}

}  // namespace cairn
