#pragma once
// GLSL 3.30. All positions are relative to the camera's target, so that a scene far from the origin is drawn as sharply
// as one near it. Light is computed linearly; the framebuffer encodes to sRGB.

namespace cairn::shaders {

// Mirrors FrameBlock in frame.hpp (std140).
inline constexpr const char* frame = R"(#version 330 core
layout(std140) uniform Frame {
    mat4 viewProjection;
    mat4 shadowMatrix;    // to shadow map coordinates and depth, all in [0, 1]
    vec4 eye;
    vec4 cameraX;         // to the right edge of the picture at unit depth
    vec4 cameraY;         // to its top edge
    vec4 cameraZ;         // forward, unit
    vec4 toSun;           // unit; w: 1 if there is a shadow map
    vec4 sunColour;
    vec4 groundColour;
    vec4 groundShape;     // height, side of a check, distances from the target where the fade begins and ends
    vec4 groundPhase;     // xy: x and z of the target modulo two checks
    vec4 backgroundBottom;
    vec4 backgroundTop;
    vec4 sizes;           // picture width and height (pixels), side of a shadow texel (m) and in map coordinates
    vec4 occlusion;       // radius (m), 1 if there is a map, width and height of the map (pixels)
    ivec4 taps;           // of shadow, occlusion and blur: constants, given late so that loops stay loops, because
                          // unrolled ones take software renderers a second to compile
};
)";

inline constexpr const char* bodyVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 row0;   // world = rows * (position, 1)
layout(location = 3) in vec4 row1;
layout(location = 4) in vec4 row2;
layout(location = 5) in vec4 colour;
uniform mat4 clipMatrix;
out vec3 worldPosition;
out vec3 worldNormal;
flat out vec4 bodyColour;
void main() {
    vec4 p = vec4(position, 1.0);
    worldPosition = vec3(dot(row0, p), dot(row1, p), dot(row2, p));
    // Normals go with the inverse transpose: each body axis divided by its squared scale.
    vec3 squaredScale = row0.xyz * row0.xyz + row1.xyz * row1.xyz + row2.xyz * row2.xyz;
    vec3 n = normal / squaredScale;
    worldNormal = vec3(dot(row0.xyz, n), dot(row1.xyz, n), dot(row2.xyz, n));
    bodyColour = colour;
    gl_Position = clipMatrix * vec4(worldPosition, 1.0);
}
)";

inline constexpr const char* light = R"(
uniform sampler2DShadow shadowMap;
uniform sampler2D occlusionMap;      // r: light that reaches the pixel, g: its view depth
const vec3 skyLight = vec3(0.34, 0.38, 0.44);
const vec3 bounceLight = vec3(0.20, 0.19, 0.18);

float sunShare(vec3 p, vec3 n) {
    float facing = dot(n, toSun.xyz);
    if (toSun.w == 0.0 || facing <= 0.0) {
        return 1.0;
    }
    // Pushed off the surface by a few texels where the light grazes it: no acne, and far less peter-panning than a
    // bias in depth.
    float slope = sqrt(max(0.0, 1.0 - facing * facing));
    vec3 q = (shadowMatrix * vec4(p + n * (sizes.z * (0.6 + 2.4 * slope)), 1.0)).xyz;
    vec2 rim = min(q.xy, 1.0 - q.xy);
    if (min(rim.x, rim.y) <= 0.0) {
        return 1.0;
    }
    q.z = clamp(q.z, 0.0, 1.0);
    float texel = sizes.w;
    float sum = texture(shadowMap, vec3(q.xy + texel * vec2(-1.95, -1.95), q.z)) +
                texture(shadowMap, vec3(q.xy + texel * vec2(1.95, -1.95), q.z)) +
                texture(shadowMap, vec3(q.xy + texel * vec2(-1.95, 1.95), q.z)) +
                texture(shadowMap, vec3(q.xy + texel * vec2(1.95, 1.95), q.z));
    if (sum > 0.0 && sum < 4.0) {
        // The other twelve of a 4 x 4 grid with these corners.
        for (int i = 0; i < taps.x; ++i) {
            int cell = i + 1 + int(i >= 2) + int(i >= 10);
            vec2 step = vec2(float(cell & 3), float(cell >> 2)) - 1.5;
            sum += texture(shadowMap, vec3(q.xy + 1.3 * texel * step, q.z));
        }
        sum *= 0.25;
    }
    float share = 0.25 * sum;
    float fade = clamp(min(rim.x, rim.y) * 100.0, 0.0, 1.0);
    return mix(1.0, share, fade);
}

// Four texels of the smaller map, weighted by nearness in the picture and in depth, so that no halo crosses an edge.
float ambientShare(float depth) {
    if (occlusion.y == 0.0) {
        return 1.0;
    }
    vec2 at = gl_FragCoord.xy * 0.5 - 0.5;
    ivec2 base = ivec2(floor(at));
    vec2 f = at - vec2(base);
    ivec2 last = ivec2(occlusion.zw) - 1;
    float sum = 0.0;
    float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        vec2 sampled = texelFetch(occlusionMap, clamp(base + corner, ivec2(0), last), 0).rg;
        vec2 near = mix(1.0 - f, f, vec2(corner));
        float weight = near.x * near.y * exp2(-abs(sampled.g - depth) / (0.04 * occlusion.x)) + 1e-7;
        sum += weight * sampled.r;
        total += weight;
    }
    return sum / total;
}

vec3 lit(vec3 albedo, vec3 p, vec3 n, float gloss) {
    vec3 toEye = normalize(eye.xyz - p);
    float facing = max(dot(n, toSun.xyz), 0.0);
    float sun = facing > 0.0 ? facing * sunShare(p, n) : 0.0;
    float ambient = ambientShare(dot(p - eye.xyz, cameraZ.xyz));
    vec3 hemisphere = mix(bounceLight, skyLight, 0.5 + 0.5 * n.y) * ambient;
    vec3 result = albedo * (hemisphere + sunColour.rgb * (sun * mix(1.0, ambient, 0.35)));
    vec3 halfway = normalize(toSun.xyz + toEye);
    float rim = pow(1.0 - max(dot(n, toEye), 0.0), 4.0);
    result += gloss * (sunColour.rgb * (sun * 0.10 * pow(max(dot(n, halfway), 0.0), 36.0)) +
                       hemisphere * (0.25 * rim));
    // Straight up to 0.8, then bent so that nothing clips.
    vec3 over = max(result - 0.8, 0.0);
    return min(result, 0.8) + 0.2 * over / (over + 0.2);
}
)";

inline constexpr const char* bodyFragment = R"(
in vec3 worldPosition;
in vec3 worldNormal;
flat in vec4 bodyColour;
out vec4 fragment;
void main() {
    vec3 n = normalize(worldNormal);
    // Open meshes show their inside: the face turns to whoever looks at it.
    vec3 face = cross(dFdx(worldPosition), dFdy(worldPosition));
    vec3 toEye = eye.xyz - worldPosition;
    if (dot(face, toEye) < 0.0) {
        face = -face;
    }
    if (dot(face, n) < 0.0) {
        n = -n;
    }
    fragment = vec4(lit(bodyColour.rgb, worldPosition, n, 1.0), bodyColour.a);
}
)";

inline constexpr const char* depthOnlyFragment = R"(
void main() {}
)";

// For ambient occlusion: normal and view depth.
inline constexpr const char* surfaceFragment = R"(
in vec3 worldPosition;
in vec3 worldNormal;
flat in vec4 bodyColour;
out vec4 surface;
void main() {
    vec3 n = normalize(worldNormal);
    vec3 toEye = eye.xyz - worldPosition;
    surface = vec4(dot(n, toEye) < 0.0 ? -n : n, dot(worldPosition - eye.xyz, cameraZ.xyz));
}
)";

inline constexpr const char* screenVertex = R"(
out vec2 ndc;
void main() {
    ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(ndc, 0.0, 1.0);
}
)";

inline constexpr const char* backgroundFragment = R"(
in vec2 ndc;
out vec4 fragment;
void main() {
    float t = smoothstep(-0.3, 1.2, ndc.y);
    fragment = vec4(mix(backgroundBottom.rgb, backgroundTop.rgb, t), 1.0);
}
)";

inline constexpr const char* groundVertex = R"(
out vec3 worldPosition;
void main() {
    vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
    worldPosition = vec3(corner.x, 0.0, corner.y) * groundShape.w;
    worldPosition.y = groundShape.x;
    gl_Position = viewProjection * vec4(worldPosition, 1.0);
}
)";

inline constexpr const char* groundFragment = R"(
in vec3 worldPosition;
out vec4 fragment;
float triangle(float x) { return abs(fract(x) * 2.0 - 1.0); }
void main() {
    float fade = 1.0 - smoothstep(groundShape.z, groundShape.w, length(worldPosition.xz));
    // The checks are the sign of a square wave in x times one in z. Each wave is averaged over the pixel through its
    // integral, a triangle wave, so that far checks melt into their mean instead of flickering.
    vec2 cells = (worldPosition.xz + groundPhase.xy) / (2.0 * groundShape.y);
    vec2 width = max(abs(dFdx(cells)) + abs(dFdy(cells)), 1e-5) * 2.0;
    vec2 from = cells - 0.5 * width;
    vec2 to = cells + 0.5 * width;
    vec2 wave = vec2(triangle(to.x) - triangle(from.x), triangle(to.y) - triangle(from.y)) / (2.0 * width);
    vec3 albedo = groundColour.rgb * (1.0 + 0.075 * wave.x * wave.y);
    fragment = vec4(lit(albedo, worldPosition, vec3(0.0, 1.0, 0.0), 0.0), fade);
}
)";

inline constexpr const char* groundSurfaceFragment = R"(
in vec3 worldPosition;
out vec4 surface;
void main() {
    surface = vec4(0.0, 1.0, 0.0, dot(worldPosition - eye.xyz, cameraZ.xyz));
}
)";

// Ambient occlusion: how much of the half-ball above a surface point is filled by its neighbours in the picture.
inline constexpr const char* occlusionFragment = R"(
in vec2 ndc;
uniform sampler2D surfaceMap;
out vec2 result;
vec3 place(ivec2 at, float depth) {
    vec2 p = (vec2(at) + 0.5) / occlusion.zw * 2.0 - 1.0;
    return depth * (cameraZ.xyz + p.x * cameraX.xyz + p.y * cameraY.xyz);
}
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 here = texelFetch(surfaceMap, at, 0);
    if (here.w <= 0.0) {
        result = vec2(1.0, 0.0);
        return;
    }
    vec3 p = place(at, here.w);
    float reach = occlusion.x / (here.w * length(cameraY.xyz)) * 0.5 * occlusion.w;
    reach = min(reach, 0.12 * occlusion.w);
    // Far off, where the radius shrinks to a few pixels, neighbours tell nothing.
    float strength = 2.2 * clamp((reach - 1.5) / 6.0, 0.0, 1.0);
    // Sixteen turns in a 4 x 4 pattern; the blur that follows averages just one pattern.
    int cell = (at.x & 3) * 4 + (at.y & 3);
    float turn = float((cell * 7) & 15) / 16.0;
    float filled = 0.0;
    ivec2 last = ivec2(occlusion.zw) - 1;
    for (int i = 0; i < taps.y; ++i) {
        float share = (float(i) + 0.5) / float(taps.y);
        float angle = 6.2831853 * (turn + 0.381966 * float(i));
        ivec2 there = at + ivec2(round(reach * share * vec2(cos(angle), sin(angle))));
        vec4 other = texelFetch(surfaceMap, clamp(there, ivec2(0), last), 0);
        if (other.w <= 0.0) {
            continue;
        }
        vec3 v = place(clamp(there, ivec2(0), last), other.w) - p;
        float squared = dot(v, v);
        float height = dot(v, here.xyz) * inversesqrt(squared + 1e-12);
        float near = max(0.0, 1.0 - squared / (occlusion.x * occlusion.x));
        filled += near * max(0.0, height - 0.10);
    }
    result = vec2(max(0.0, 1.0 - strength * filled / float(taps.y)), here.w);
}
)";

inline constexpr const char* blurFragment = R"(
in vec2 ndc;
uniform sampler2D rawMap;
out vec2 result;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 last = ivec2(occlusion.zw) - 1;
    float depth = texelFetch(rawMap, at, 0).g;
    float sum = 0.0;
    float total = 0.0;
    for (int i = 0; i < taps.z; ++i) {
        vec2 other = texelFetch(rawMap, clamp(at + ivec2(i & 3, i >> 2) - 2, ivec2(0), last), 0).rg;
        float weight = 1.0 / (0.01 + abs(other.g - depth) / occlusion.x);
        sum += weight * other.r;
        total += weight;
    }
    result = vec2(sum / total, depth);
}
)";

// Lines are quads as wide as asked plus a pixel of soft rim, cut at the near plane before they are widened.
inline constexpr const char* lineVertex = R"(
layout(location = 2) in vec3 from;
layout(location = 3) in vec3 to;
layout(location = 4) in vec4 colour;
layout(location = 5) in float width;
noperspective out float across;            // pixels from the middle of the line
flat out float halfWidth;
flat out vec4 lineColour;
void main() {
    vec4 a = viewProjection * vec4(from, 1.0);
    vec4 b = viewProjection * vec4(to, 1.0);
    float nearA = a.z + a.w;
    float nearB = b.z + b.w;
    if (nearA < 0.0 && nearB < 0.0) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        return;
    }
    if (nearA < 0.0) {
        a = mix(a, b, nearA / (nearA - nearB));
    } else if (nearB < 0.0) {
        b = mix(b, a, nearB / (nearB - nearA));
    }
    vec2 pixelA = a.xy / a.w * 0.5 * sizes.xy;
    vec2 pixelB = b.xy / b.w * 0.5 * sizes.xy;
    vec2 along = pixelB - pixelA;
    float size = length(along);
    along = size > 1e-6 ? along / size : vec2(1.0, 0.0);
    halfWidth = 0.5 * width;
    float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
    across = side * (halfWidth + 1.0);
    vec4 end = (gl_VertexID & 2) == 0 ? a : b;
    vec2 shift = vec2(-along.y, along.x) * across / (0.5 * sizes.xy);
    lineColour = colour;
    // A hair nearer than the surface it may lie on.
    gl_Position = vec4(end.xy + shift * end.w, end.z - 2e-5 * end.w, end.w);
}
)";

inline constexpr const char* lineFragment = R"(
noperspective in float across;
flat in float halfWidth;
flat in vec4 lineColour;
uniform float opacity;
out vec4 fragment;
void main() {
    fragment = vec4(lineColour.rgb, lineColour.a * opacity * clamp(halfWidth + 0.5 - abs(across), 0.0, 1.0));
}
)";

inline constexpr const char* pointVertex = R"(
layout(location = 2) in vec3 centre;
layout(location = 3) in vec4 colour;
layout(location = 4) in float size;
out vec2 offset;             // pixels from the centre
flat out float radius;
flat out vec4 pointColour;
void main() {
    vec4 p = viewProjection * vec4(centre, 1.0);
    radius = 0.5 * size;
    vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
    offset = corner * (radius + 1.0);
    pointColour = colour;
    gl_Position = vec4(p.xy + offset / (0.5 * sizes.xy) * p.w, p.z - 3e-5 * p.w, p.w);
}
)";

inline constexpr const char* pointFragment = R"(
in vec2 offset;
flat in float radius;
flat in vec4 pointColour;
uniform float opacity;
out vec4 fragment;
void main() {
    fragment = vec4(pointColour.rgb, pointColour.a * opacity * clamp(radius + 0.5 - length(offset), 0.0, 1.0));
}
)";

}  // namespace cairn::shaders
