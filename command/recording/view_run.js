// What the run was: poses, times and names from the page's data. Tracks are read as pose_track.hpp says.

const bytesOf = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
// Whole numbers of as many bytes as they need.
const reader = bytes => {
    let at = 0;
    const whole = () => {
        for (let x = 0, scale = 1;; scale *= 128) {
            const b = bytes[at++];
            x += (b & 127) * scale;
            if (!(b & 128))
                return x;
        }
    };
    return {whole, done: () => at >= bytes.length};
};
const fromZigzag = z => z % 2 ? -(z + 1) / 2 : z / 2;
const verticesOf = text => {
    const from = reader(bytesOf(text)), out = [];
    for (const last = [0, 0, 0]; !from.done();)
        out.push((last[out.length % 3] += fromZigzag(from.whole())) * data.unit_m);
    return Float32Array.from(out);
};
const indicesOf = text => {
    const from = reader(bytesOf(text)), out = [];
    for (let last = 0; !from.done();)
        out.push(last += fromZigzag(from.whole()));
    return Uint32Array.from(out);
};

const poses = data.tracks.map(text => {
    const {whole} = reader(bytesOf(text)), out = new Float32Array(7 * data.frames);
    const last = new Float64Array(7), before = new Float64Array(7);
    let zeros = 0;
    for (let i = 0; i < out.length; ++i) {
        let residual = 0;
        if (zeros > 0)
            --zeros;
        else {
            residual = fromZigzag(whole());
            if (residual === 0)
                zeros = whole();
        }
        const k = i % 7, value = 2 * last[k] - before[k] + residual;
        before[k] = last[k];
        last[k] = value;
        out[i] = value * (k < 3 ? data.unit_m : data.unit_rotation);
    }
    return out;
});
data.tracks = null;

const stepOf = frame => Math.min(frame * data.every, data.steps);
const timeOf = frame => stepOf(frame) * data.dt;
const seconds = data.steps * data.dt;
// The frame at or before a time, and how far it is to the next.
const frameAt = time => {
    const frame = Math.max(0, Math.min(Math.floor(time / (data.every * data.dt) + 1e-6), data.frames - 1));
    const gap = timeOf(frame + 1) - timeOf(frame);
    return {frame, share: frame < data.frames - 1 ? Math.min(Math.max((time - timeOf(frame)) / gap, 0), 1) : 0};
};
// Between two frames in a straight line.
const poseAt = (body, {frame, share}, out) => {
    const p = poses[body], a = 7 * frame, b = share > 0 ? a + 7 : a;
    const turn = p[a + 3] * p[b + 3] + p[a + 4] * p[b + 4] + p[a + 5] * p[b + 5] + p[a + 6] * p[b + 6] < 0 ? -1 : 1;
    for (let k = 0; k < 7; ++k)
        out[k] = p[a + k] * (1 - share) + (k < 3 ? 1 : turn) * p[b + k] * share;
    const size = Math.hypot(out[3], out[4], out[5], out[6]) || 1;
    for (let k = 3; k < 7; ++k)
        out[k] /= size;
    return out;
};
const velocityAt = (body, frame) => {
    const b = Math.max(frame, 1), p = poses[body], span = timeOf(b) - timeOf(b - 1);
    return data.frames < 2 ? [0, 0, 0] : [0, 1, 2].map(k => (p[7 * b + k] - p[7 * b - 7 + k]) / span);
};
const deformableOf = body => data.deformables.find(d => body >= d.first && body < d.first + d.count);
const nameOf = body => {
    if (body < data.bodies.length)
        return data.bodies[body].name;
    const d = deformableOf(body);
    return `${d.name}, particle ${body - d.first}`;
};
const moves = body => body >= data.bodies.length || data.bodies[body].type !== 'static';
const rotated = (q, v) => {
    const [x, y, z, w] = q, t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
    return [
        v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
        v[2] + w * t[2] + x * t[1] - y * t[0]
    ];
};
