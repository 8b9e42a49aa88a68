// What a reader points at.

// What is at a pixel: a body, or the particle nearest to where a surface is hit; -1: nothing.
const hitTriangle = (from, way, corner, triangles) => {
    let best = Infinity;
    for (let t = 0; t < triangles.length; t += 3) {
        const a = corner(triangles[t]), e = minus(corner(triangles[t + 1]), a), f = minus(corner(triangles[t + 2]), a);
        const p = cross(way, f), det = dot(e, p);
        if (Math.abs(det) < 1e-14)
            continue;
        const s = minus(from, a), u = dot(s, p) / det;
        if (u < 0 || u > 1)
            continue;
        const q = cross(s, e), v = dot(way, q) / det, at = dot(f, q) / det;
        if (v >= 0 && u + v <= 1 && at > 0 && at < best)
            best = at;
    }
    return best;
};
const pick = (canvas, x, y, now, bare) => {
    const W = canvas.clientWidth, H = canvas.clientHeight, view = viewOf(W / H);
    const way = unit(plus(
        plus(view.back.map(c => -c), view.right, (2 * x / W - 1) * view.wide), view.up, (1 - 2 * y / H) * view.tall));
    const eye = plus(view.eye, camera.target), pose = new Float64Array(7);
    let body = -1, best = Infinity;
    for (const mesh of meshes)
        for (const part of mesh.oneSided ? [] : mesh.parts) {
            if (bare && !moves(part.body))
                continue;
            poseAt(part.body, now, pose);
            const q = [pose[3], pose[4], pose[5], pose[6]], back = r => [-r[0], -r[1], -r[2], r[3]];
            const origin = plus([pose[0], pose[1], pose[2]], rotated(q, part.position || [0, 0, 0]));
            const toCentre = minus(origin, eye), along = dot(toCentre, way),
                  radius = mesh.radius * Math.max(...part.scale);
            if (dot(toCentre, toCentre) - along * along > radius * radius || along < -radius)
                continue;
            const local = v => rotated(back(part.rotation), rotated(back(q), v)).map((c, k) => c / part.scale[k]);
            const at = hitTriangle(
                local(minus(eye, origin)), local(way),
                i => [mesh.vertices[3 * i], mesh.vertices[3 * i + 1], mesh.vertices[3 * i + 2]], mesh.triangles);
            if (at < best) {
                best = at;
                body = part.body;
            }
        }
    for (const surface of surfaces) {
        const c = surface.corners,
              at = hitTriangle(eye, way, i => [c[6 * i], c[6 * i + 1], c[6 * i + 2]], surface.triangles);
        if (!(at < best))
            continue;
        best = at;
        const place = plus(eye, way, at);
        let nearest = Infinity;
        for (let i = surface.def.first; i < surface.def.first + surface.def.count; ++i) {
            poseAt(i, now, pose);
            const far = Math.hypot(pose[0] - place[0], pose[1] - place[1], pose[2] - place[2]);
            if (far < nearest) {
                nearest = far;
                body = i;
            }
        }
    }
    return body;
};
