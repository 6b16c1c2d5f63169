// Shows the data of manikin.reports.player: a skinned body that moves in its scene. Needs no other file.
"use strict";
(function () {
  const root = document.getElementById("player");
  const data = JSON.parse(document.getElementById("player-data").textContent);
  const canvas = root.querySelector("canvas");
  const [button, slider, speed, clock] = ["button", "input", "select", "output"].map((name) => root.querySelector(name));
  const gl = canvas.getContext("webgl", { antialias: true });
  const wide = gl && gl.getExtension("OES_element_index_uint");
  if (!wide) {
    root.querySelector(".missing").hidden = false;
    return;
  }

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const tracks = new Float32Array(bytes(data.tracks));
  const bones = data.segments;
  const indices = data.skin.width === 4 ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;

  const LIGHT = `
    vec3 lit(vec3 colour, vec3 normal) {
      float lamp = max(dot(normal, normalize(lampward)), 0.0);
      return colour * (0.48 + 0.15 * (1.0 + normal.z) + 0.42 * lamp);
    }`;
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, "precision highp float;\n" + text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  };
  const person = program(`
    attribute vec3 place; attribute vec3 normal; attribute vec4 bone; attribute vec4 weight;
    uniform mat4 view; uniform vec3 low; uniform vec3 size; uniform vec4 rows[${3 * bones}];
    varying vec3 turned;
    void main() {
      vec4 a = vec4(0.0), b = vec4(0.0), c = vec4(0.0);
      for (int k = 0; k < 4; k++) {
        float w = k == 0 ? weight.x : k == 1 ? weight.y : k == 2 ? weight.z : weight.w;
        int i = 3 * int((k == 0 ? bone.x : k == 1 ? bone.y : k == 2 ? bone.z : bone.w) + 0.5);
        a += w * rows[i]; b += w * rows[i + 1]; c += w * rows[i + 2];
      }
      vec4 here = vec4(low + place * size, 1.0);
      turned = vec3(dot(a.xyz, normal), dot(b.xyz, normal), dot(c.xyz, normal));
      gl_Position = view * vec4(dot(a, here), dot(b, here), dot(c, here), 1.0);
    }`, `
    uniform vec4 colour; uniform vec3 lampward; varying vec3 turned;` + LIGHT + `
    void main() { gl_FragColor = vec4(lit(colour.rgb, normalize(turned)), colour.a); }`);
  const solid = program(`
    attribute vec3 place; attribute vec3 normal; attribute vec4 tint;
    uniform mat4 view; uniform vec3 low; uniform vec3 size; uniform vec3 eye;
    varying vec3 turned; varying vec4 paint;
    void main() {
      vec3 here = low + place * size;
      turned = dot(normal, eye - here) < 0.0 ? -normal : normal;
      paint = tint;
      gl_Position = view * vec4(here, 1.0);
    }`, `
    uniform vec3 lampward; varying vec3 turned; varying vec4 paint;` + LIGHT + `
    void main() { gl_FragColor = vec4(lit(paint.rgb, normalize(turned)), 1.0); }`);
  const line = program(`
    attribute vec3 place; uniform mat4 view;
    void main() { gl_Position = view * vec4(place, 1.0); }`, `
    uniform vec4 colour;
    void main() { gl_FragColor = colour; }`);

  const buffer = (content, kind = gl.ARRAY_BUFFER) => {
    const made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, content, gl.STATIC_DRAW);
    return made;
  };
  const use = (made, name, source, count, type, normal, stride) => {
    const where = gl.getAttribLocation(made, name);
    if (where < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, source);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, count, type, normal, stride, 0);
  };
  const at = (made, name) => gl.getUniformLocation(made, name);
  const mesh = (part) => ({
    places: buffer(bytes(part.places)), normals: buffer(bytes(part.normals)), low: part.low, size: part.size,
  });
  const skin = mesh(data.skin);
  skin.bones = buffer(bytes(data.skin.bones));
  skin.weights = buffer(bytes(data.skin.weights));
  skin.faces = buffer(bytes(data.skin.faces), gl.ELEMENT_ARRAY_BUFFER);
  const scene = data.scene && Object.assign(mesh(data.scene), { tints: buffer(bytes(data.scene.colours)) });
  const path = buffer(bytes(data.path));
  const [mx, my, mz] = data.middle;
  const grid = [];
  if (data.floor !== null) {
    const half = Math.ceil(data.reach + 1.5), x = Math.round(mx), y = Math.round(my);
    for (let k = -2 * half; k <= 2 * half; k++) {
      grid.push(x + k / 2, y - half, data.floor, x + k / 2, y + half, data.floor);
      grid.push(x - half, y + k / 2, data.floor, x + half, y + k / 2, data.floor);
    }
  }
  const lines = buffer(new Float32Array(grid));

  // The eye: turned about the middle by dragging, nearer by the wheel, moved aside with the shift key.
  const eye = { azimuth: data.azimuth, height: 0.25, distance: 1.1 * data.reach + 0.9, middle: [mx, my, mz] };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const axes = () => {
    const [c, s, e, z] = [Math.cos(eye.azimuth), Math.sin(eye.azimuth), Math.cos(eye.height), Math.sin(eye.height)];
    const away = [c * e, s * e, z], right = [-s, c, 0];
    return [right, cross(away, right), away];
  };
  const view = () => {
    const [right, up, away] = axes();
    const place = eye.middle.map((value, k) => value + eye.distance * away[k]);
    const aspect = canvas.width / canvas.height, near = 0.05 * eye.distance, far = 20.0 * eye.distance;
    const across = 2.2 / Math.max(aspect, 1.0), upward = 2.2 * Math.min(aspect, 1.0);
    const p = (far + near) / (near - far), q = (2.0 * far * near) / (near - far), m = [];
    const rows = [right, up, away].map((axis) => [...axis, -dot(axis, place)]);
    for (let k = 0; k < 4; k++) {
      m.push(across * rows[0][k], upward * rows[1][k], p * rows[2][k] + (k === 3 ? q : 0.0), -rows[2][k]);
    }
    return { matrix: new Float32Array(m), place, lamp: [up, away, right].reduce(
      (sum, axis, n) => sum.map((value, k) => value + [0.6, 0.7, -0.5][n] * axis[k]), [0, 0, 0.6]) };
  };

  // Rows of the segments' matrices between two frames: quaternions of the same half mixed and made unit.
  const matrices = (time) => {
    const exact = Math.min(Math.max(time / (data.duration || 1), 0), 1) * (data.frames - 1);
    const first = Math.min(Math.floor(exact), data.frames - 2), share = exact - first;
    const out = new Float32Array(12 * bones), v = new Float64Array(7);
    for (let bone = 0; bone < bones; bone++) {
      const i = 7 * (first * bones + bone), j = i + 7 * bones;
      for (let k = 0; k < 7; k++) v[k] = (1 - share) * tracks[i + k] + share * tracks[j + k];
      const size = Math.hypot(v[0], v[1], v[2], v[3]);
      const [x, y, z, w] = [v[0] / size, v[1] / size, v[2] / size, v[3] / size];
      out.set([
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), v[4],
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), v[5],
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), v[6],
      ], 12 * bone);
    }
    return out;
  };

  const begin = (made, seen) => {
    gl.useProgram(made);
    gl.uniformMatrix4fv(at(made, "view"), false, seen.matrix);
    if (made !== line) gl.uniform3fv(at(made, "lampward"), seen.lamp);
  };
  const place = (made, part) => {
    gl.uniform3fv(at(made, "low"), part.low);
    gl.uniform3fv(at(made, "size"), part.size);
    use(made, "place", part.places, 3, gl.UNSIGNED_SHORT, true, 8);
    use(made, "normal", part.normals, 3, gl.BYTE, true, 4);
  };
  const drawPerson = (seen, rows, opacity) => {
    begin(person, seen);
    place(person, skin);
    use(person, "bone", skin.bones, 4, gl.UNSIGNED_BYTE, false, 4);
    use(person, "weight", skin.weights, 4, gl.UNSIGNED_BYTE, true, 4);
    gl.uniform4fv(at(person, "rows"), rows);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, skin.faces);
    let start = 0;
    for (const [count, colour] of data.skin.parts) {
      gl.uniform4fv(at(person, "colour"), [...colour, opacity]);
      gl.drawElements(gl.TRIANGLES, 3 * count, indices, 3 * data.skin.width * start);
      start += count;
    }
  };
  const drawLines = (seen, source, mode, count, colour) => {
    begin(line, seen);
    use(line, "place", source, 3, gl.FLOAT, false, 0);
    gl.uniform4fv(at(line, "colour"), colour);
    gl.drawArrays(mode, 0, count);
  };
  const state = { time: 0, playing: true, before: null };
  const draw = () => {
    const scale = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.965, 0.972, 0.98, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const seen = view(), rows = matrices(state.time);
    if (grid.length) drawLines(seen, lines, gl.LINES, grid.length / 3, [0.8, 0.82, 0.85, 1]);
    if (scene) {
      begin(solid, seen);
      place(solid, scene);
      gl.uniform3fv(at(solid, "eye"), seen.place);
      use(solid, "tint", scene.tints, 4, gl.UNSIGNED_BYTE, true, 4);
      gl.drawArrays(gl.TRIANGLES, 0, data.scene.count);
    }
    // What the scene hides of the body shines through it faintly.
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthFunc(gl.GREATER);
    gl.depthMask(false);
    drawPerson(seen, rows, 0.35);
    gl.disable(gl.BLEND);
    gl.depthFunc(gl.LESS);
    gl.depthMask(true);
    drawPerson(seen, rows, 1);
    gl.disable(gl.DEPTH_TEST);
    drawLines(seen, path, gl.LINE_STRIP, data.frames, [0.835, 0.369, 0, 1]);
    slider.value = state.time;
    clock.textContent = (data.start + state.time).toFixed(2) + " s";
  };

  const step = (now) => {
    if (state.playing) {
      const passed = state.before === null ? 0 : (now - state.before) / 1000;
      state.time += Math.min(passed, 0.2) * Number(speed.value);
      if (state.time > data.duration) state.time = 0;
      state.before = now;
      draw();
    }
    requestAnimationFrame(step);
  };
  const play = (on) => {
    state.playing = on;
    state.before = null;
    button.textContent = on ? "Pause" : "Play";
    draw();
  };
  slider.max = data.duration;
  button.addEventListener("click", () => play(!state.playing));
  slider.addEventListener("input", () => {
    state.time = Number(slider.value);
    play(false);
  });
  let held = null;
  canvas.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointerup", () => (held = null));
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    const [dx, dy] = [event.clientX - held[0], event.clientY - held[1]];
    held = [event.clientX, event.clientY];
    if (event.shiftKey) {
      const [right, up] = axes(), unit = eye.distance / canvas.clientHeight;
      eye.middle = eye.middle.map((value, k) => value - unit * (dx * right[k] - dy * up[k]));
    } else {
      eye.azimuth -= 0.008 * dx;
      eye.height = Math.min(1.5, Math.max(-1.0, eye.height + 0.008 * dy));
    }
    draw();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    eye.distance *= Math.exp(0.001 * event.deltaY);
    draw();
  }, { passive: false });
  window.addEventListener("resize", draw);
  play(true);
  requestAnimationFrame(step);
})();
