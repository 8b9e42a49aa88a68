// What the graphics card does, in GLSL ES 3: bodies in sun and shadow, and lines.

const bodyVertex = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 row0;
layout(location = 3) in vec4 row1;
layout(location = 4) in vec4 row2;
layout(location = 5) in vec4 tint;
uniform mat4 clip;
out vec3 place;
out vec3 facing;
flat out vec4 colour;
void main() {
    vec4 p = vec4(position, 1.0);
    place = vec3(dot(row0, p), dot(row1, p), dot(row2, p));
    vec3 n = normal / (row0.xyz * row0.xyz + row1.xyz * row1.xyz + row2.xyz * row2.xyz);
    facing = vec3(dot(row0.xyz, n), dot(row1.xyz, n), dot(row2.xyz, n));
    colour = tint;
    gl_Position = clip * vec4(place, 1.0);
}`;
// colour.w: 0 for what moves, -1 for the chosen of these, 1 for what does not move: it has checks of a metre where it
// is about level and fades far away. Where `ghost` is on, only the chosen body is drawn, see-through.
const bodyFragment = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 place;
in vec3 facing;
flat in vec4 colour;
uniform vec3 eye;
uniform vec3 toSun;
uniform mat4 shadow;
uniform sampler2DShadow map;
uniform float texel;
uniform vec2 phase;
uniform float reach;
uniform vec3 paper;
uniform float dim;
uniform bool ghost;
out vec4 fragment;
float triangle(float x) { return abs(fract(x) * 2.0 - 1.0); }
float sunShare(vec3 n) {
    float facingSun = dot(n, toSun);
    float slope = sqrt(max(0.0, 1.0 - facingSun * facingSun));
    vec3 q = (shadow * vec4(place + n * texel * (0.6 + 2.4 * slope), 1.0)).xyz * 0.5 + 0.5;
    vec2 rim = min(q.xy, 1.0 - q.xy);
    if (min(rim.x, rim.y) <= 0.0 || q.z >= 1.0) return 1.0;
    float side = 1.0 / float(textureSize(map, 0).x), sum = 0.0;
    for (int i = 0; i < 9; ++i)
        sum += texture(map, vec3(q.xy + side * vec2(float(i % 3) - 1.0, float(i / 3) - 1.0), q.z));
    return mix(1.0, sum / 9.0, clamp(min(rim.x, rim.y) * 20.0, 0.0, 1.0));
}
void main() {
    if (ghost) {
        if (colour.w > -0.5) discard;
        fragment = vec4(1.0, 0.45, 0.1, 0.3);
        return;
    }
    vec3 n = normalize(facing);
    if (!gl_FrontFacing) n = -n;
    vec3 albedo = colour.rgb;
    if (colour.w > 0.5) {
        albedo *= dim;
        vec2 cells = (place.xz + phase) * 0.5, width = max(fwidth(cells), 1e-5) * 2.0;
        vec2 from = cells - 0.5 * width, to = cells + 0.5 * width;
        vec2 wave = vec2(triangle(to.x) - triangle(from.x), triangle(to.y) - triangle(from.y)) / (2.0 * width);
        albedo *= 1.0 + 0.12 * smoothstep(0.6, 0.9, n.y) * wave.x * wave.y;
    }
    float sun = max(dot(n, toSun), 0.0);
    if (sun > 0.0) sun *= sunShare(n);
    vec3 toEye = normalize(eye - place);
    vec3 sky = mix(vec3(0.20, 0.19, 0.18), vec3(0.34, 0.38, 0.44), 0.5 + 0.5 * n.y);
    vec3 light = albedo * (sky + vec3(0.66, 0.64, 0.60) * sun);
    if (colour.w < 0.5)
        light += 0.07 * sun * pow(max(dot(n, normalize(toSun + toEye)), 0.0), 36.0) +
            0.2 * sky * pow(1.0 - max(dot(n, toEye), 0.0), 4.0);
    vec3 shown = pow(clamp(light, 0.0, 1.0), vec3(1.0 / 2.2));
    float fade = colour.w > 0.5 ? smoothstep(0.4 * reach, reach, length(place.xz)) : 0.0;
    fragment = vec4(mix(shown, paper, fade), 1.0);
}`;
const nothing = `#version 300 es
precision highp float;
void main() {}`;
const lineVertex = `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 clip;
uniform vec3 origin;
void main() { gl_Position = clip * vec4(position - origin, 1.0); gl_Position.z -= 2e-4 * gl_Position.w; }`;
const lineFragment = `#version 300 es
precision highp float;
uniform vec4 ink;
out vec4 fragment;
void main() { fragment = ink; }`;
