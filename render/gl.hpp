#pragma once
// The OpenGL functions that the renderer calls, found at run time through a GlContext: no GL library is linked, because
// the vendor-neutral one would win over OSMesa and have no context.
#include "render/gl_context.hpp"

#include <GL/glcorearb.h>

namespace cairn {

// clang-format off
#define CAIRN_GL_FUNCTIONS(X) \
    X(ActiveTexture, ACTIVETEXTURE) X(AttachShader, ATTACHSHADER) X(BindBuffer, BINDBUFFER) \
    X(BindBufferBase, BINDBUFFERBASE) X(BindFramebuffer, BINDFRAMEBUFFER) X(BindRenderbuffer, BINDRENDERBUFFER) \
    X(BindTexture, BINDTEXTURE) X(BindVertexArray, BINDVERTEXARRAY) X(BlendFuncSeparate, BLENDFUNCSEPARATE) \
    X(BlitFramebuffer, BLITFRAMEBUFFER) X(BufferData, BUFFERDATA) X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS) \
    X(Clear, CLEAR) X(ClearBufferfv, CLEARBUFFERFV) X(ColorMask, COLORMASK) X(CompileShader, COMPILESHADER) \
    X(CreateProgram, CREATEPROGRAM) X(CreateShader, CREATESHADER) X(DeleteBuffers, DELETEBUFFERS) \
    X(DeleteShader, DELETESHADER) X(DepthFunc, DEPTHFUNC) X(DepthMask, DEPTHMASK) X(Disable, DISABLE) \
    X(DrawArrays, DRAWARRAYS) X(DrawArraysInstanced, DRAWARRAYSINSTANCED) X(DrawBuffer, DRAWBUFFER) \
    X(DrawElementsInstanced, DRAWELEMENTSINSTANCED) X(Enable, ENABLE) \
    X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY) X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER) \
    X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D) X(GenBuffers, GENBUFFERS) X(GenFramebuffers, GENFRAMEBUFFERS) \
    X(GenRenderbuffers, GENRENDERBUFFERS) X(GenTextures, GENTEXTURES) X(GenVertexArrays, GENVERTEXARRAYS) \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS) X(GetError, GETERROR) X(GetIntegerv, GETINTEGERV) \
    X(GetProgramInfoLog, GETPROGRAMINFOLOG) X(GetProgramiv, GETPROGRAMIV) X(GetShaderInfoLog, GETSHADERINFOLOG) \
    X(GetShaderiv, GETSHADERIV) X(GetUniformBlockIndex, GETUNIFORMBLOCKINDEX) \
    X(GetUniformLocation, GETUNIFORMLOCATION) X(LinkProgram, LINKPROGRAM) X(PixelStorei, PIXELSTOREI) \
    X(PolygonOffset, POLYGONOFFSET) X(ReadBuffer, READBUFFER) X(ReadPixels, READPIXELS) \
    X(RenderbufferStorage, RENDERBUFFERSTORAGE) X(RenderbufferStorageMultisample, RENDERBUFFERSTORAGEMULTISAMPLE) \
    X(ShaderSource, SHADERSOURCE) X(TexImage2D, TEXIMAGE2D) X(TexParameteri, TEXPARAMETERI) X(Uniform1f, UNIFORM1F) \
    X(Uniform1i, UNIFORM1I) X(UniformBlockBinding, UNIFORMBLOCKBINDING) X(UniformMatrix4fv, UNIFORMMATRIX4FV) \
    X(UseProgram, USEPROGRAM) X(VertexAttribDivisor, VERTEXATTRIBDIVISOR) \
    X(VertexAttribPointer, VERTEXATTRIBPOINTER) X(Viewport, VIEWPORT)
// clang-format on

struct Gl {
#define CAIRN_GL_MEMBER(name, upper) PFNGL##upper##PROC name = nullptr;
    CAIRN_GL_FUNCTIONS(CAIRN_GL_MEMBER)
#undef CAIRN_GL_MEMBER

    // std::runtime_error naming the first function that is missing.
    explicit Gl(const GlContext& context);
};

}  // namespace cairn
