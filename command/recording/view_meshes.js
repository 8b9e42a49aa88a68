// What is drawn, as triangles: the meshes that bodies share, and surfaces that follow particles.

// Corners with normals: smooth over edges blunter than 30 degrees, hard at others. Six numbers a corner.
const withNormals = (vertices, triangles) => {
    const places = new Map(), place = new Uint32Array(vertices.length / 3);
    for (let i = 0; i < place.length; ++i) {
        const key = vertices[3 * i] + ',' + vertices[3 * i + 1] + ',' + vertices[3 * i + 2];
        if (!places.has(key))
            places.set(key, places.size);
        place[i] = places.get(key);
    }
    const at = i => [vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]];
    const around = Array.from({length: places.size}, () => []), faces = [];
    for (let t = 0; t < triangles.length; t += 3) {
        const p = [at(triangles[t]), at(triangles[t + 1]), at(triangles[t + 2])];
        faces.push(unit(cross(minus(p[1], p[0]), minus(p[2], p[0]))));
        for (let k = 0; k < 3; ++k) {
            const angle = Math.acos(
                Math.min(1, Math.max(-1, dot(unit(minus(p[(k + 1) % 3], p[k])), unit(minus(p[(k + 2) % 3], p[k]))))));
            around[place[triangles[t + k]]].push([faces.length - 1, angle]);
        }
    }
    const out = new Float32Array(6 * triangles.length);
    for (let c = 0; c < triangles.length; ++c) {
        const face = faces[Math.floor(c / 3)], sum = [0, 0, 0];
        for (const [other, angle] of around[place[triangles[c]]]) {
            if (dot(faces[other], face) >= Math.cos(Math.PI / 6))
                for (let k = 0; k < 3; ++k)
                    sum[k] += angle * faces[other][k];
        }
        out.set(at(triangles[c]), 6 * c);
        out.set(unit(sum), 6 * c + 3);
    }
    return out;
};

const meshes = data.meshes.map(m => {
    const vertices = verticesOf(m.vertices), triangles = indicesOf(m.triangles);
    let radius = 0;
    for (let i = 0; i < vertices.length; i += 3)
        radius = Math.max(radius, Math.hypot(vertices[i], vertices[i + 1], vertices[i + 2]));
    return {vertices, triangles, radius, oneSided: m.one_sided, parts: []};
});
data.bodies.forEach(
    (body, i) => body.parts.forEach(
        ([mesh, scale, position, rotation]) =>
            meshes[mesh].parts.push({body: i, scale, position, rotation: rotation || [0, 0, 0, 1]})));
// What moves comes first, so that it can be drawn alone.
for (const mesh of meshes)
    mesh.parts.sort((a, b) => moves(b.body) - moves(a.body));

// Surfaces that follow particles: tubes about ropes, sheets and skins.
const surfaces = data.deformables.map(d => {
    const tube = d.weights.length === 0, sides = 8;
    let triangles = indicesOf(d.triangles);
    if (tube) {
        const list = [];
        for (let i = 0; i + 1 < d.count; ++i)
            for (let k = 0; k < sides; ++k) {
                const a = i * sides + k, b = i * sides + (k + 1) % sides;
                list.push(a, b, a + sides, b, b + sides, a + sides);
            }
        triangles = Uint32Array.from(list);
    }
    const count = tube ? d.count * sides : d.weights.length;
    return {def: d, tube, sides, triangles, corners: new Float32Array(6 * count)};
});
const follow = (surface, now) => {
    const {def, corners, triangles} = surface, pose = new Float64Array(7), at = [];
    for (let i = 0; i < def.count; ++i) {
        poseAt(def.first + i, now, pose);
        at.push([pose[0], pose[1], pose[2]]);
    }
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
        for (let j = 0; j < list.length; j += 2)
            for (let k = 0; k < 3; ++k)
                corners[6 * v + k] += list[j + 1] * at[list[j]][k];
    });
    const corner = v => [corners[6 * v], corners[6 * v + 1], corners[6 * v + 2]];
    for (let t = 0; t < triangles.length; t += 3) {
        const a = corner(triangles[t]);
        const area = cross(minus(corner(triangles[t + 1]), a), minus(corner(triangles[t + 2]), a));
        for (let k = 0; k < 3; ++k)
            for (let c = 0; c < 3; ++c)
                corners[6 * triangles[t + k] + 3 + c] += area[c];
    }
};
