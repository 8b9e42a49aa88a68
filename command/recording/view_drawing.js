// WebGL 2 by hand: instanced meshes, one shadow map, lines. All places are relative to what the camera looks at, so
// that a scene far from the origin is drawn as sharply as one near it.

// Gives back draw(now, chosen, bare), or null where there is no WebGL 2. `bare`: only what moves, and the ground.
const makeDrawing = canvas => {
    const gl = canvas.getContext('webgl2', {antialias: true, alpha: false});
    if (!gl)
        return null;
    const program = (vertex, fragment) => {
        const made = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
                throw new Error(gl.getShaderInfoLog(shader));
            gl.attachShader(made, shader);
        }
        gl.linkProgram(made);
        if (!gl.getProgramParameter(made, gl.LINK_STATUS))
            throw new Error(gl.getProgramInfoLog(made));
        const places = new Map();
        return {
            made,
            at: name => {
                if (!places.has(name))
                    places.set(name, gl.getUniformLocation(made, name));
                return places.get(name);
            }
        };
    };
    const body = program(bodyVertex, bodyFragment), caster = program(bodyVertex, nothing),
          line = program(lineVertex, lineFragment);
    const buffer = (kind, contents) => {
        const made = gl.createBuffer();
        gl.bindBuffer(kind, made);
        if (contents)
            gl.bufferData(kind, contents, gl.STATIC_DRAW);
        return made;
    };
    const attribute = (place, size, stride, offset, divisor) => {
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
        gl.vertexAttribDivisor(place, divisor);
    };

    const square = {
        vertices: new Float32Array([-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1]),
        triangles: new Uint32Array([0, 1, 2, 0, 2, 3]),
        oneSided: true,
        parts: []
    };
    const batches = [...meshes, ...(data.ground === null ? [] : [square])].map(mesh => {
        const corners = withNormals(mesh.vertices, mesh.triangles), array = gl.createVertexArray();
        gl.bindVertexArray(array);
        buffer(gl.ARRAY_BUFFER, corners);
        attribute(0, 3, 24, 0, 0);
        attribute(1, 3, 24, 12, 0);
        const count = mesh === square ? 1 : mesh.parts.length, instances = new Float32Array(16 * count);
        const instanceBuffer = buffer(gl.ARRAY_BUFFER, instances);
        for (let k = 0; k < 4; ++k)
            attribute(2 + k, 4, 64, 16 * k, 1);
        return {
            mesh,
            array,
            instances,
            instanceBuffer,
            corners: corners.length / 6,
            count,
            moving: mesh.parts.filter(p => moves(p.body)).length,
            ground: mesh === square
        };
    });
    for (const surface of surfaces) {
        surface.array = gl.createVertexArray();
        gl.bindVertexArray(surface.array);
        surface.buffer = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffer);
        attribute(0, 3, 24, 0, 0);
        attribute(1, 3, 24, 12, 0);
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
    for (const [key, value] of [
             [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
             [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
             [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
        gl.texParameteri(gl.TEXTURE_2D, key, value);
    gl.bindFramebuffer(gl.FRAMEBUFFER, mapTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, map, 0);

    const pose = new Float64Array(7), grid = gridBelow();
    const lit = (colour, on) => on ? colour.map((c, k) => .35 * c + .65 * [1, .42, .02][k]) : colour;
    const fill = (now, chosen, reach) => {
        for (const batch of batches) {
            const out = batch.instances;
            if (batch.ground)
                out.set([reach, 0, 0, 0, 0, 1, 0, data.ground - camera.target[1], 0, 0, reach, 0, .6, .61, .64, 1]);
            else
                batch.mesh.parts.forEach((part, i) => {
                    poseAt(part.body, now, pose);
                    const q = [pose[3], pose[4], pose[5], pose[6]], p = part.rotation;
                    const [x, y, z, w] = [
                        q[3] * p[0] + q[0] * p[3] + q[1] * p[2] - q[2] * p[1],
                        q[3] * p[1] - q[0] * p[2] + q[1] * p[3] + q[2] * p[0],
                        q[3] * p[2] + q[0] * p[1] - q[1] * p[0] + q[2] * p[3],
                        q[3] * p[3] - q[0] * p[0] - q[1] * p[1] - q[2] * p[2]
                    ];
                    const shift = part.position ? rotated(q, part.position) : [0, 0, 0], [a, b, c] = part.scale;
                    part.origin = [pose[0] + shift[0], pose[1] + shift[1], pose[2] + shift[2]];
                    out.set(
                        [
                            a * (1 - 2 * (y * y + z * z)), b * 2 * (x * y - w * z), c * 2 * (x * z + w * y),
                            part.origin[0] - camera.target[0], a * 2 * (x * y + w * z), b * (1 - 2 * (x * x + z * z)),
                            c * 2 * (y * z - w * x), part.origin[1] - camera.target[1], a * 2 * (x * z - w * y),
                            b * 2 * (y * z + w * x), c * (1 - 2 * (x * x + y * y)), part.origin[2] - camera.target[2],
                            ...lit(data.bodies[part.body].colour, part.body === chosen),
                            part.body === chosen ? -1 :
                                moves(part.body) ? 0 :
                                                   1
                        ],
                        16 * i);
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
            if (pass === 'shadow' && batch.mesh.oneSided)
                continue;
            const count = bare && !batch.ground ? batch.moving : batch.count;
            if (count === 0)
                continue;
            batch.mesh.oneSided || pass === 'ghost' ? gl.enable(gl.CULL_FACE) : gl.disable(gl.CULL_FACE);
            gl.bindVertexArray(batch.array);
            gl.drawArraysInstanced(gl.TRIANGLES, 0, batch.corners, count);
        }
        if (pass !== 'ghost')
            gl.disable(gl.CULL_FACE);
        for (const surface of surfaces) {
            gl.bindVertexArray(surface.array);
            for (let k = 0; k < 3; ++k)
                gl.vertexAttrib4f(2 + k, k === 0 ? 1 : 0, k === 1 ? 1 : 0, k === 2 ? 1 : 0, -camera.target[k]);
            const on = surface.def === deformableOf(chosen);
            gl.vertexAttrib4f(5, ...lit(surface.def.colour, on), on ? -1 : 0);
            gl.drawElements(gl.TRIANGLES, surface.triangles.length, gl.UNSIGNED_INT, 0);
        }
        gl.disable(gl.CULL_FACE);
    };
    const stroke = (kind, points, ink) => {
        if (points.length < 6)
            return;
        gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(points), gl.DYNAMIC_DRAW);
        gl.uniform4f(line.at('ink'), ...ink);
        gl.drawArrays(kind, 0, points.length / 3);
    };

    return (now, chosen, bare) => {
        const dense = Math.min(devicePixelRatio || 1, 2);
        const W = Math.max(1, Math.round(canvas.clientWidth * dense)),
              H = Math.max(1, Math.round(canvas.clientHeight * dense));
        if (canvas.width !== W || canvas.height !== H) {
            canvas.width = W;
            canvas.height = H;
        }
        const view = viewOf(W / H), reach = 14 * camera.distance;
        const dark = matchMedia('(prefers-color-scheme: dark)').matches;
        const paper = dark ? [.105, .12, .14] : [.88, .905, .93];
        fill(now, chosen, reach);

        // The shadow map covers what is near the target; it moves in whole texels, so that edges do not crawl.
        const half = 1.5 * camera.distance, across = unit(cross([0, 0, 1], toSun)), up = cross(toSun, across),
              size = 2 * half / side;
        const snap = axis => {
            const d = dot(camera.target, axis);
            return d - Math.round(d / size) * size;
        };
        const sunEye = plus(plus([0, 0, 0], across, -snap(across)), up, -snap(up));
        const depth = 6 * half;
        const shadow = times(
            [1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -1 / depth, 0, 0, 0, 0, 1],
            frameOf(across, up, toSun, sunEye));
        gl.bindFramebuffer(gl.FRAMEBUFFER, mapTarget);
        gl.viewport(0, 0, side, side);
        gl.enable(gl.DEPTH_TEST);
        gl.clear(gl.DEPTH_BUFFER_BIT);
        gl.useProgram(caster.made);
        gl.uniformMatrix4fv(caster.at('clip'), false, shadow);
        gl.enable(gl.POLYGON_OFFSET_FILL);
        gl.polygonOffset(1.5, 3);
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
            gl.enable(gl.BLEND);
            gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
            gl.depthFunc(gl.GREATER);
            gl.depthMask(false);
            gl.uniform1i(body.at('ghost'), 1);
            solids(chosen, 'ghost', true);
            gl.depthFunc(gl.LESS);
            gl.depthMask(true);
            gl.disable(gl.BLEND);
        }

        gl.useProgram(line.made);
        gl.bindVertexArray(lines);
        gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
        gl.uniformMatrix4fv(line.at('clip'), false, view.clip);
        gl.uniform3f(line.at('origin'), ...camera.target);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        stroke(gl.LINES, grid, [.5, .55, .6, .5]);
        gl.disable(gl.BLEND);
        const strings = [];
        for (const string of data.strings)
            for (const [end, anchor] of string) {
                poseAt(end, now, pose);
                strings.push(
                    ...plus([pose[0], pose[1], pose[2]], rotated([pose[3], pose[4], pose[5], pose[6]], anchor)));
            }
        stroke(gl.LINES, strings, dark ? [.85, .87, .9, 1] : [.15, .15, .17, 1]);
        if (chosen >= 0 && moves(chosen)) {
            const way = from => {
                const list = [];
                for (let f = from[0]; f <= from[1]; ++f)
                    list.push(...poses[chosen].subarray(7 * f, 7 * f + 3));
                return list;
            };
            const was = way([0, now.frame]), will = way([now.frame, data.frames - 1]),
                  grey = dark ? [.6, .6, .65] : [.5, .5, .55];
            gl.disable(gl.DEPTH_TEST);
            gl.enable(gl.BLEND);
            stroke(gl.LINE_STRIP, will, [...grey, .8]);
            stroke(gl.LINE_STRIP, was, [1, .42, .02, .9]);
            gl.disable(gl.BLEND);
            gl.enable(gl.DEPTH_TEST);
        }
        gl.bindVertexArray(null);
    };
};
