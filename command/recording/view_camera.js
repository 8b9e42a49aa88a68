// Vectors, matrices, the camera that a reader turns, and the grid that tells up from down where there is no ground.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const unit = a => {
    const n = Math.hypot(...a) || 1;
    return [a[0] / n, a[1] / n, a[2] / n];
};
// Matrices by columns, as WebGL has them.
const times = (a, b) => {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; ++c)
        for (let r = 0; r < 4; ++r)
            for (let k = 0; k < 4; ++k)
                out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    return out;
};
const frameOf = (x, y, z, eye) =>
    [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];

// The direction to the sun, and that of the pictures of cairn render.
const toSun = unit([-.55, 1, .5]);

const camera = {
    target: [0, 0, 0],
    yaw: 0,
    pitch: 0,
    distance: 1
};
const lookFromStart = () => {
    const way = minus(data.view.eye, data.view.target), distance = Math.hypot(...way) || 1;
    Object.assign(camera, {
        target: [...data.view.target],
        distance,
        pitch: Math.asin(way[1] / distance),
        yaw: Math.atan2(way[0], way[2])
    });
};
// Relative to the target. A narrow picture sees as much from left to right as a wide one.
const viewOf = aspect => {
    const c = Math.cos(camera.pitch),
          back = [c * Math.sin(camera.yaw), Math.sin(camera.pitch), c * Math.cos(camera.yaw)];
    const right = [Math.cos(camera.yaw), 0, -Math.sin(camera.yaw)], up = cross(back, right);
    const eye = back.map(x => x * camera.distance);
    const tall = Math.tan(data.view.fov * Math.PI / 360) * Math.max(1, 1.35 / aspect), wide = tall * aspect;
    const near = camera.distance * .01, far = camera.distance * 60 + 100;
    const lens = [
        1 / wide, 0, 0, 0, 0, 1 / tall, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
        2 * far * near / (near - far), 0
    ];
    return {eye, right, up, back, tall, wide, clip: times(lens, frameOf(right, up, back, eye))};
};

// Where nothing lies below the bodies, a grid of lines does, to tell up from down and large from small.
const gridBelow = () => {
    const {eye, target} = data.view, distance = Math.hypot(...minus(eye, target)) || 1;
    if (data.ground !== null ||
        meshes.some(
            m => m.parts.some(p => !moves(p.body) && (m.oneSided || m.radius * Math.max(...p.scale) > .3 * distance))))
        return [];
    let low = target[1];
    poses.forEach((p, body) => {
        for (let i = 1; moves(body) && i < p.length; i += 7)
            low = Math.min(low, p[i]);
    });
    const cell = 10 ** Math.round(Math.log10(distance / 10)),
          y = Math.floor(Math.max(low, target[1] - distance) / cell) * cell, list = [];
    const [x, z] = [target[0], target[2]].map(c => Math.round(c / cell) * cell), most = 12 * cell;
    for (let k = -12; k <= 12; ++k)
        list.push(
            x - most, y, z + k * cell, x + most, y, z + k * cell, x + k * cell, y, z - most, x + k * cell, y, z + most);
    return list;
};
