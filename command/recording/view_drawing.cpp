// WebGL 2 by hand: instanced meshes, one shadow map, lines. All places are relative to what the camera looks at, so
// that a scene far from the origin is drawn as sharply as one near it.
#include "command/recording/view_script.hpp"

namespace cairn::view_script {

const char* const drawing = R"page(
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const unit = a => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
// Matrices by columns, as WebGL has them.
const times = (a, b) => {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c) for (let r = 0; r < 4; ++r) for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
};
const frameOf = (x, y, z, eye) => [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];

// The direction to the sun, and that of the pictures of cairn render.
const toSun = unit([-.55, 1, .5]);

const camera = { target: [0, 0, 0], yaw: 0, pitch: 0, distance: 1 };
const lookFromStart = () => {
  const way = minus(data.view.eye, data.view.target), distance = Math.hypot(...way) || 1;
  Object.assign(camera, { target: [...data.view.target], distance, pitch: Math.asin(way[1] / distance), yaw: Math.atan2(way[0], way[2]) });
};
// Relative to the target. A narrow picture sees as much from left to right as a wide one.
const viewOf = aspect => {
  const c = Math.cos(camera.pitch), back = [c * Math.sin(camera.yaw), Math.sin(camera.pitch), c * Math.cos(camera.yaw)];
  const right = [Math.cos(camera.yaw), 0, -Math.sin(camera.yaw)], up = cross(back, right);
  const eye = back.map(x => x * camera.distance);
  const tall = Math.tan(data.view.fov * Math.PI / 360) * Math.max(1, 1.35 / aspect), wide = tall * aspect;
  const near = camera.distance * .01, far = camera.distance * 60 + 100;
  const lens = [1 / wide, 0, 0, 0, 0, 1 / tall, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
  return { eye, right, up, back, tall, wide, clip: times(lens, frameOf(right, up, back, eye)) };
};

// Where nothing lies below the bodies, a grid of lines does, to tell up from down and large from small.
const gridBelow = () => {
  const { eye, target } = data.view, distance = Math.hypot(...minus(eye, target)) || 1;
  if (data.ground !== null || meshes.some(m => m.parts.some(p => !moves(p.body) && (m.oneSided || m.radius * Math.max(...p.scale) > .3 * distance)))) return [];
  let low = target[1];
  poses.forEach((p, body) => { for (let i = 1; moves(body) && i < p.length; i += 7) low = Math.min(low, p[i]); });
  const cell = 10 ** Math.round(Math.log10(distance / 10)), y = Math.floor(Math.max(low, target[1] - distance) / cell) * cell, list = [];
  const [x, z] = [target[0], target[2]].map(c => Math.round(c / cell) * cell), most = 12 * cell;
  for (let k = -12; k <= 12; ++k) list.push(x - most, y, z + k * cell, x + most, y, z + k * cell, x + k * cell, y, z - most, x + k * cell, y, z + most);
  return list;
};

// Corners with normals: smooth over edges blunter than 30 degrees, hard at others. Six numbers a corner.
const withNormals = (vertices, triangles) => {
  const places = new Map(), place = new Uint32Array(vertices.length / 3);
  for (let i = 0; i < place.length; ++i) {
    const key = vertices[3 * i] + ',' + vertices[3 * i + 1] + ',' + vertices[3 * i + 2];
    if (!places.has(key)) places.set(key, places.size);
    place[i] = places.get(key);
  }
  const at = i => [vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]];
  const around = Array.from({ length: places.size }, () => []), faces = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const p = [at(triangles[t]), at(triangles[t + 1]), at(triangles[t + 2])];
    faces.push(unit(cross(minus(p[1], p[0]), minus(p[2], p[0]))));
    for (let k = 0; k < 3; ++k) {
      const angle = Math.acos(Math.min(1, Math.max(-1, dot(unit(minus(p[(k + 1) % 3], p[k])), unit(minus(p[(k + 2) % 3], p[k]))))));
      around[place[triangles[t + k]]].push([faces.length - 1, angle]);
    }
  }
  const out = new Float32Array(6 * triangles.length);
  for (let c = 0; c < triangles.length; ++c) {
    const face = faces[Math.floor(c / 3)], sum = [0, 0, 0];
    for (const [other, angle] of around[place[triangles[c]]]) {
      if (dot(faces[other], face) >= Math.cos(Math.PI / 6)) for (let k = 0; k < 3; ++k) sum[k] += angle * faces[other][k];
    }
    out.set(at(triangles[c]), 6 * c);
    out.set(unit(sum), 6 * c + 3);
  }
  return out;
};

const meshes = data.meshes.map(m => {
  const vertices = verticesOf(m.vertices), triangles = indicesOf(m.triangles);
  let radius = 0;
  for (let i = 0; i < vertices.length; i += 3) radius = Math.max(radius, Math.hypot(vertices[i], vertices[i + 1], vertices[i + 2]));
  return { vertices, triangles, radius, oneSided: m.one_sided, parts: [] };
});
data.bodies.forEach((body, i) => body.parts.forEach(([mesh, scale, position, rotation]) =>
  meshes[mesh].parts.push({ body: i, scale, position, rotation: rotation || [0, 0, 0, 1] })));
// What moves comes first, so that it can be drawn alone.
for (const mesh of meshes) mesh.parts.sort((a, b) => moves(b.body) - moves(a.body));

// Surfaces that follow particles: tubes about ropes, sheets and skins.
const surfaces = data.deformables.map(d => {
  const tube = d.weights.length === 0, sides = 8;
  let triangles = indicesOf(d.triangles);
  if (tube) {
    const list = [];
    for (let i = 0; i + 1 < d.count; ++i) for (let k = 0; k < sides; ++k) {
      const a = i * sides + k, b = i * sides + (k + 1) % sides;
      list.push(a, b, a + sides, b, b + sides, a + sides);
    }
    triangles = Uint32Array.from(list);
  }
  const count = tube ? d.count * sides : d.weights.length;
  return { def: d, tube, sides, triangles, corners: new Float32Array(6 * count) };
});
const follow = (surface, now) => {
  const { def, corners, triangles } = surface, pose = new Float64Array(7), at = [];
  for (let i = 0; i < def.count; ++i) { poseAt(def.first + i, now, pose); at.push([pose[0], pose[1], pose[2]]); }
  if (surface.tube) {
    let side = null;
    for (let i = 0; i < def.count; ++i) {
      const along = unit(minus(at[Math.min(i + 1, def.count - 1)], at[Math.max(i - 1, 0)]));
      const seed = side || (Math.abs(along[1]) < .9 ? [0, 1, 0] : [1, 0, 0]);
      side = unit(plus(seed, along, -dot(seed, along)));
      const third = cross(along, side);
      for (let k = 0; k < surface.sides; ++k) {
        const turn = 2 * Math.PI * k / surface.sides;
        const out = plus(side.map(x => x * Math.cos(turn)), third, Math.sin(turn));
        corners.set(plus(at[i], out, def.thickness / 2), 6 * (i * surface.sides + k));
        corners.set(out, 6 * (i * surface.sides + k) + 3);
      }
    }
    return;
  }
  corners.fill(0);
  def.weights.forEach((list, v) => {
    for (let j = 0; j < list.length; j += 2) for (let k = 0; k < 3; ++k) corners[6 * v + k] += list[j + 1] * at[list[j]][k];
  });
  const corner = v => [corners[6 * v], corners[6 * v + 1], corners[6 * v + 2]];
  for (let t = 0; t < triangles.length; t += 3) {
    const a = corner(triangles[t]);
    const area = cross(minus(corner(triangles[t + 1]), a), minus(corner(triangles[t + 2]), a));
    for (let k = 0; k < 3; ++k) for (let c = 0; c < 3; ++c) corners[6 * triangles[t + k] + 3 + c] += area[c];
  }
};

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
// colour.w: 0 for what moves, -1 for the chosen of these, 1 for what does not move: it has checks of a metre where it is
// about level and fades far away. Where `ghost` is on, only the chosen body is drawn, see-through.
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
  for (int i = 0; i < 9; ++i) sum += texture(map, vec3(q.xy + side * vec2(float(i % 3) - 1.0, float(i / 3) - 1.0), q.z));
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
  if (colour.w < 0.5) light += 0.07 * sun * pow(max(dot(n, normalize(toSun + toEye)), 0.0), 36.0) + 0.2 * sky * pow(1.0 - max(dot(n, toEye), 0.0), 4.0);
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

// Gives back draw(now, chosen, bare), or null where there is no WebGL 2. `bare`: only what moves, and the ground.
const makeDrawing = canvas => {
  const gl = canvas.getContext('webgl2', { antialias: true, alpha: false });
  if (!gl) return null;
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const places = new Map();
    return { made, at: name => { if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name)); return places.get(name); } };
  };
  const body = program(bodyVertex, bodyFragment), caster = program(bodyVertex, nothing), line = program(lineVertex, lineFragment);
  const buffer = (kind, contents) => { const made = gl.createBuffer(); gl.bindBuffer(kind, made); if (contents) gl.bufferData(kind, contents, gl.STATIC_DRAW); return made; };
  const attribute = (place, size, stride, offset, divisor) => {
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset); gl.vertexAttribDivisor(place, divisor);
  };

  const square = { vertices: new Float32Array([-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1]), triangles: new Uint32Array([0, 1, 2, 0, 2, 3]), oneSided: true, parts: [] };
  const batches = [...meshes, ...(data.ground === null ? [] : [square])].map(mesh => {
    const corners = withNormals(mesh.vertices, mesh.triangles), array = gl.createVertexArray();
    gl.bindVertexArray(array);
    buffer(gl.ARRAY_BUFFER, corners);
    attribute(0, 3, 24, 0, 0); attribute(1, 3, 24, 12, 0);
    const count = mesh === square ? 1 : mesh.parts.length, instances = new Float32Array(16 * count);
    const instanceBuffer = buffer(gl.ARRAY_BUFFER, instances);
    for (let k = 0; k < 4; ++k) attribute(2 + k, 4, 64, 16 * k, 1);
    return { mesh, array, instances, instanceBuffer, corners: corners.length / 6, count, moving: mesh.parts.filter(p => moves(p.body)).length, ground: mesh === square };
  });
  for (const surface of surfaces) {
    surface.array = gl.createVertexArray();
    gl.bindVertexArray(surface.array);
    surface.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffer);
    attribute(0, 3, 24, 0, 0); attribute(1, 3, 24, 12, 0);
    buffer(gl.ELEMENT_ARRAY_BUFFER, surface.triangles);
  }
  const lines = gl.createVertexArray(), lineBuffer = gl.createBuffer();
  gl.bindVertexArray(lines);
  gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
  attribute(0, 3, 12, 0, 0);
  gl.bindVertexArray(null);

  const side = 2048, map = gl.createTexture(), mapTarget = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, map);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, side, side);
  for (const [key, value] of [[gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
    [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, key, value);
  gl.bindFramebuffer(gl.FRAMEBUFFER, mapTarget);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, map, 0);

  const pose = new Float64Array(7), grid = gridBelow();
  const lit = (colour, on) => on ? colour.map((c, k) => .35 * c + .65 * [1, .42, .02][k]) : colour;
  const fill = (now, chosen, reach) => {
    for (const batch of batches) {
      const out = batch.instances;
      if (batch.ground) out.set([reach, 0, 0, 0, 0, 1, 0, data.ground - camera.target[1], 0, 0, reach, 0, .6, .61, .64, 1]);
      else batch.mesh.parts.forEach((part, i) => {
        poseAt(part.body, now, pose);
        const q = [pose[3], pose[4], pose[5], pose[6]], p = part.rotation;
        const [x, y, z, w] = [
          q[3] * p[0] + q[0] * p[3] + q[1] * p[2] - q[2] * p[1], q[3] * p[1] - q[0] * p[2] + q[1] * p[3] + q[2] * p[0],
          q[3] * p[2] + q[0] * p[1] - q[1] * p[0] + q[2] * p[3], q[3] * p[3] - q[0] * p[0] - q[1] * p[1] - q[2] * p[2]];
        const shift = part.position ? rotated(q, part.position) : [0, 0, 0], [a, b, c] = part.scale;
        part.origin = [pose[0] + shift[0], pose[1] + shift[1], pose[2] + shift[2]];
        out.set([
          a * (1 - 2 * (y * y + z * z)), b * 2 * (x * y - w * z), c * 2 * (x * z + w * y), part.origin[0] - camera.target[0],
          a * 2 * (x * y + w * z), b * (1 - 2 * (x * x + z * z)), c * 2 * (y * z - w * x), part.origin[1] - camera.target[1],
          a * 2 * (x * z - w * y), b * 2 * (y * z + w * x), c * (1 - 2 * (x * x + y * y)), part.origin[2] - camera.target[2],
          ...lit(data.bodies[part.body].colour, part.body === chosen), part.body === chosen ? -1 : moves(part.body) ? 0 : 1], 16 * i);
      });
      gl.bindBuffer(gl.ARRAY_BUFFER, batch.instanceBuffer);
      gl.bufferData(gl.ARRAY_BUFFER, out, gl.DYNAMIC_DRAW);
    }
    for (const surface of surfaces) {
      follow(surface, now);
      gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffer);
      gl.bufferData(gl.ARRAY_BUFFER, surface.corners, gl.DYNAMIC_DRAW);
    }
  };
  const solids = (chosen, pass, bare) => {
    for (const batch of batches) {
      if (pass === 'shadow' && batch.mesh.oneSided) continue;
      const count = bare && !batch.ground ? batch.moving : batch.count;
      if (count === 0) continue;
      batch.mesh.oneSided || pass === 'ghost' ? gl.enable(gl.CULL_FACE) : gl.disable(gl.CULL_FACE);
      gl.bindVertexArray(batch.array);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, batch.corners, count);
    }
    if (pass !== 'ghost') gl.disable(gl.CULL_FACE);
    for (const surface of surfaces) {
      gl.bindVertexArray(surface.array);
      for (let k = 0; k < 3; ++k) gl.vertexAttrib4f(2 + k, k === 0 ? 1 : 0, k === 1 ? 1 : 0, k === 2 ? 1 : 0, -camera.target[k]);
      const on = surface.def === deformableOf(chosen);
      gl.vertexAttrib4f(5, ...lit(surface.def.colour, on), on ? -1 : 0);
      gl.drawElements(gl.TRIANGLES, surface.triangles.length, gl.UNSIGNED_INT, 0);
    }
    gl.disable(gl.CULL_FACE);
  };
  const stroke = (kind, points, ink) => {
    if (points.length < 6) return;
    gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(points), gl.DYNAMIC_DRAW);
    gl.uniform4f(line.at('ink'), ...ink);
    gl.drawArrays(kind, 0, points.length / 3);
  };

  return (now, chosen, bare) => {
    const dense = Math.min(devicePixelRatio || 1, 2);
    const W = Math.max(1, Math.round(canvas.clientWidth * dense)), H = Math.max(1, Math.round(canvas.clientHeight * dense));
    if (canvas.width !== W || canvas.height !== H) { canvas.width = W; canvas.height = H; }
    const view = viewOf(W / H), reach = 14 * camera.distance;
    const dark = matchMedia('(prefers-color-scheme: dark)').matches;
    const paper = dark ? [.105, .12, .14] : [.88, .905, .93];
    fill(now, chosen, reach);

    // The shadow map covers what is near the target; it moves in whole texels, so that edges do not crawl.
    const half = 1.5 * camera.distance, across = unit(cross([0, 0, 1], toSun)), up = cross(toSun, across), size = 2 * half / side;
    const snap = axis => { const d = dot(camera.target, axis); return d - Math.round(d / size) * size; };
    const sunEye = plus(plus([0, 0, 0], across, -snap(across)), up, -snap(up));
    const depth = 6 * half;
    const shadow = times([1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -1 / depth, 0, 0, 0, 0, 1], frameOf(across, up, toSun, sunEye));
    gl.bindFramebuffer(gl.FRAMEBUFFER, mapTarget);
    gl.viewport(0, 0, side, side);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(caster.made);
    gl.uniformMatrix4fv(caster.at('clip'), false, shadow);
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1.5, 3);
    solids(chosen, 'shadow', bare);
    gl.disable(gl.POLYGON_OFFSET_FILL);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, W, H);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(body.made);
    gl.uniformMatrix4fv(body.at('clip'), false, view.clip);
    gl.uniformMatrix4fv(body.at('shadow'), false, shadow);
    gl.uniform3f(body.at('eye'), ...view.eye);
    gl.uniform3f(body.at('toSun'), ...toSun);
    gl.uniform1f(body.at('texel'), size);
    gl.uniform2f(body.at('phase'), camera.target[0] % 2, camera.target[2] % 2);
    gl.uniform1f(body.at('reach'), reach);
    gl.uniform3f(body.at('paper'), ...paper);
    gl.uniform1f(body.at('dim'), dark ? .45 : 1);
    gl.bindTexture(gl.TEXTURE_2D, map);
    gl.uniform1i(body.at('ghost'), 0);
    solids(chosen, 'light', bare);
    // What is chosen shines through what hides it.
    if (chosen >= 0 && moves(chosen)) {
      gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthFunc(gl.GREATER); gl.depthMask(false);
      gl.uniform1i(body.at('ghost'), 1);
      solids(chosen, 'ghost', true);
      gl.depthFunc(gl.LESS); gl.depthMask(true);
      gl.disable(gl.BLEND);
    }

    gl.useProgram(line.made);
    gl.bindVertexArray(lines);
    gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
    gl.uniformMatrix4fv(line.at('clip'), false, view.clip);
    gl.uniform3f(line.at('origin'), ...camera.target);
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    stroke(gl.LINES, grid, [.5, .55, .6, .5]);
    gl.disable(gl.BLEND);
    const strings = [];
    for (const string of data.strings) for (const [end, anchor] of string) {
      poseAt(end, now, pose);
      strings.push(...plus([pose[0], pose[1], pose[2]], rotated([pose[3], pose[4], pose[5], pose[6]], anchor)));
    }
    stroke(gl.LINES, strings, dark ? [.85, .87, .9, 1] : [.15, .15, .17, 1]);
    if (chosen >= 0 && moves(chosen)) {
      const way = from => { const list = []; for (let f = from[0]; f <= from[1]; ++f) list.push(...poses[chosen].subarray(7 * f, 7 * f + 3)); return list; };
      const was = way([0, now.frame]), will = way([now.frame, data.frames - 1]), grey = dark ? [.6, .6, .65] : [.5, .5, .55];
      gl.disable(gl.DEPTH_TEST); gl.enable(gl.BLEND);
      stroke(gl.LINE_STRIP, will, [...grey, .8]);
      stroke(gl.LINE_STRIP, was, [1, .42, .02, .9]);
      gl.disable(gl.BLEND); gl.enable(gl.DEPTH_TEST);
    }
    gl.bindVertexArray(null);
  };
};

// What is at a pixel: a body, or the particle nearest to where a surface is hit; -1: nothing.
const hitTriangle = (from, way, corner, triangles) => {
  let best = Infinity;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = corner(triangles[t]), e = minus(corner(triangles[t + 1]), a), f = minus(corner(triangles[t + 2]), a);
    const p = cross(way, f), det = dot(e, p);
    if (Math.abs(det) < 1e-14) continue;
    const s = minus(from, a), u = dot(s, p) / det;
    if (u < 0 || u > 1) continue;
    const q = cross(s, e), v = dot(way, q) / det, at = dot(f, q) / det;
    if (v >= 0 && u + v <= 1 && at > 0 && at < best) best = at;
  }
  return best;
};
const pick = (canvas, x, y, now, bare) => {
  const W = canvas.clientWidth, H = canvas.clientHeight, view = viewOf(W / H);
  const way = unit(plus(plus(view.back.map(c => -c), view.right, (2 * x / W - 1) * view.wide), view.up, (1 - 2 * y / H) * view.tall));
  const eye = plus(view.eye, camera.target), pose = new Float64Array(7);
  let body = -1, best = Infinity;
  for (const mesh of meshes) for (const part of mesh.oneSided ? [] : mesh.parts) {
    if (bare && !moves(part.body)) continue;
    poseAt(part.body, now, pose);
    const q = [pose[3], pose[4], pose[5], pose[6]], back = r => [-r[0], -r[1], -r[2], r[3]];
    const origin = plus([pose[0], pose[1], pose[2]], rotated(q, part.position || [0, 0, 0]));
    const toCentre = minus(origin, eye), along = dot(toCentre, way), radius = mesh.radius * Math.max(...part.scale);
    if (dot(toCentre, toCentre) - along * along > radius * radius || along < -radius) continue;
    const local = v => rotated(back(part.rotation), rotated(back(q), v)).map((c, k) => c / part.scale[k]);
    const at = hitTriangle(local(minus(eye, origin)), local(way), i => [mesh.vertices[3 * i], mesh.vertices[3 * i + 1], mesh.vertices[3 * i + 2]], mesh.triangles);
    if (at < best) { best = at; body = part.body; }
  }
  for (const surface of surfaces) {
    const c = surface.corners, at = hitTriangle(eye, way, i => [c[6 * i], c[6 * i + 1], c[6 * i + 2]], surface.triangles);
    if (!(at < best)) continue;
    best = at;
    const place = plus(eye, way, at);
    let nearest = Infinity;
    for (let i = surface.def.first; i < surface.def.first + surface.def.count; ++i) {
      poseAt(i, now, pose);
      const far = Math.hypot(pose[0] - place[0], pose[1] - place[1], pose[2] - place[2]);
      if (far < nearest) { nearest = far; body = i; }
    }
  }
  return body;
};
)page";

}  // namespace cairn::view_script
