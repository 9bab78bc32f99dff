"use strict";
// Draws the blocks of the page's data with WebGL alone. Positions of a frame are worked out here: x = c + t + R (X - c).
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const at = (id) => document.getElementById(id);
  const vertices = floats(data.vertices), normals = floats(data.normals), owner = floats(data.owner);
  const lines = floats(data.lines), lineOwner = floats(data.line_owner), centroids = floats(data.centroids);
  const motion = floats(data.motion), forces = floats(data.forces);
  const blocks = data.names.length, frames = data.captions.length, size = data.size, centre = data.centre;
  const canvas = at("scene"), gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { at("failed").style.display = "block"; return; }

  const shader = (kind, text) => {
    const s = gl.createShader(kind);
    gl.shaderSource(s, text); gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    return s;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    attribute vec3 place, normal, before, colour;
    uniform mat4 view; uniform vec3 light;
    varying vec3 vColour; varying vec3 vBefore;
    void main() {
      gl_Position = view * vec4(place, 1.0);
      float lit = dot(normal, normal) > 0.0 ? 0.62 + 0.38 * abs(dot(normalize(normal), light)) : 1.0;
      vColour = colour * lit; vBefore = before;
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    precision mediump float;
    uniform vec4 section; uniform float alpha;
    varying vec3 vColour; varying vec3 vBefore;
    void main() {
      if (dot(section.xyz, vBefore) > section.w) discard;
      gl_FragColor = vec4(vColour, alpha);
    }`));
  gl.linkProgram(program); gl.useProgram(program);
  const uniform = (n) => gl.getUniformLocation(program, n);
  const uView = uniform("view"), uLight = uniform("light"), uSection = uniform("section"), uAlpha = uniform("alpha");

  const attributes = ["place", "normal", "before", "colour"];
  class Mesh { // arrays of three floats a vertex
    constructor(mode, count) { this.mode = mode; this.count = count; this.buffers = {}; }
    set(name, values) {
      if (!this.buffers[name]) this.buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    }
    draw() {
      attributes.forEach((name) => {
        const place = gl.getAttribLocation(program, name);
        if (place < 0) return;
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
      });
      gl.drawArrays(this.mode, 0, this.count);
    }
  }
  const zeros = (n) => new Float32Array(3 * n);
  const painted = (n, ofVertex) => {
    const out = zeros(n);
    for (let i = 0; i < n; i++) out.set(ofVertex(i), 3 * i);
    return out;
  };
  const HELD = [0.55, 0.55, 0.55], STILL = [0.93, 0.89, 0.82], MOVES = [0.83, 0.58, 0.38], FOUND = [0.15, 0.5, 0.85];
  const INK = [0.15, 0.15, 0.15], GHOST = [0.6, 0.6, 0.6], FORCE = [0.75, 0.1, 0.12];
  const solidCount = vertices.length / 3, lineCount = lines.length / 3;
  const solids = new Mesh(gl.TRIANGLES, solidCount), picking = new Mesh(gl.TRIANGLES, solidCount);
  const edges = new Mesh(gl.LINES, lineCount), before = new Mesh(gl.LINES, lineCount);
  const arrows = new Mesh(gl.TRIANGLES, forces.length / 3);
  const nothing = zeros(solidCount);
  solids.set("before", vertices);
  [picking].forEach((m) => { m.set("before", vertices); m.set("normal", nothing); });
  picking.set("colour", painted(solidCount, (i) => {
    const k = owner[i] + 1;
    return [(k & 255) / 255, ((k >> 8) & 255) / 255, ((k >> 16) & 255) / 255];
  }));
  edges.set("before", lines); edges.set("normal", zeros(lineCount)); edges.set("colour", painted(lineCount, () => INK));
  before.set("before", lines); before.set("normal", zeros(lineCount)); before.set("colour", painted(lineCount, () => GHOST));
  before.set("place", lines);
  ["place", "before"].forEach((n) => arrows.set(n, forces));
  arrows.set("normal", zeros(forces.length / 3)); arrows.set("colour", painted(forces.length / 3, () => FORCE));

  const state = { frame: 0, azimuth: data.azimuth, elevation: data.elevation, zoom: 1, shift: [0, 0], find: "", playing: false };
  const carried = (points, owners, isVector) => {
    const out = new Float32Array(points.length), base = state.frame * blocks * 12;
    for (let i = 0; i < owners.length; i++) {
      const b = owners[i], m = base + 12 * b, c = 3 * b, p = 3 * i;
      const x = points[p] - (isVector ? 0 : centroids[c]), y = points[p + 1] - (isVector ? 0 : centroids[c + 1]);
      const z = points[p + 2] - (isVector ? 0 : centroids[c + 2]);
      for (let r = 0; r < 3; r++) {
        const turned = motion[m + 3 + 3 * r] * x + motion[m + 4 + 3 * r] * y + motion[m + 5 + 3 * r] * z;
        out[p + r] = turned + (isVector ? 0 : centroids[c + r] + motion[m + r]);
      }
    }
    return out;
  };
  const movesAtAll = new Array(blocks).fill(false);
  for (let f = 0; f < frames; f++) for (let b = 0; b < blocks; b++) {
    const m = 12 * (f * blocks + b);
    const travel = Math.hypot(motion[m], motion[m + 1], motion[m + 2]) + 0.5 * size * Math.abs(3 - motion[m + 3] - motion[m + 7] - motion[m + 11]);
    if (travel > 2e-4 * size) movesAtAll[b] = true;
  }
  const colourOf = (b) => {
    if (state.find && data.names[b].toLowerCase().includes(state.find)) return FOUND;
    return data.held[b] ? HELD : movesAtAll[b] ? MOVES : STILL;
  };
  const pose = () => {
    const place = carried(vertices, owner, false);
    solids.set("place", place); picking.set("place", place);
    solids.set("normal", carried(normals, owner, true));
    edges.set("place", carried(lines, lineOwner, false));
    at("caption").textContent = data.captions[state.frame];
    at("frame").value = state.frame;
    document.body.dataset.frame = state.frame;
  };
  const paint = () => solids.set("colour", painted(solidCount, (i) => colourOf(owner[i])));

  const axes = () => { // right, up and towards the viewer, z upright
    const ca = Math.cos(state.azimuth), sa = Math.sin(state.azimuth), ce = Math.cos(state.elevation), se = Math.sin(state.elevation);
    const towards = [ce * ca, ce * sa, se];
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], towards];
  };
  const matrix = () => { // parallel projection, column-major
    const [right, up, towards] = axes(), w = canvas.width, h = canvas.height;
    const half = 0.54 * size / state.zoom, sx = (1 / half) * Math.min(1, h / w), sy = sx * w / h, sz = -0.2 / size;
    const rows = [right.map((v) => v * sx), up.map((v) => v * sy), towards.map((v) => v * sz)];
    const offset = rows.map((r) => -(r[0] * centre[0] + r[1] * centre[1] + r[2] * centre[2]));
    offset[0] += state.shift[0]; offset[1] += state.shift[1];
    return new Float32Array([0, 1, 2].flatMap((j) => [rows[0][j], rows[1][j], rows[2][j], 0]).concat([...offset, 1]));
  };
  const prepare = () => {
    const ratio = window.devicePixelRatio || 1, w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clearColor(1, 1, 1, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.uniformMatrix4fv(uView, false, matrix());
    const [right, up, towards] = axes();
    const light = [0, 1, 2].map((i) => -0.28 * right[i] + 0.55 * up[i] + 0.79 * towards[i]);
    gl.uniform3fv(uLight, light);
    const axis = Number(at("axis").value), cut = Number(at("cut").value);
    if (axis < 0) gl.uniform4f(uSection, 0, 0, 0, 1);
    else {
      const normal = [0, 0, 0]; normal[axis] = 1;
      gl.uniform4f(uSection, ...normal, data.low[axis] + cut * (data.high[axis] - data.low[axis]));
    }
    gl.uniform1f(uAlpha, 1);
  };
  let due = false;
  const draw = () => {
    due = false;
    prepare();
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1, 1);
    solids.draw();
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (at("edges").checked) edges.draw();
    if (at("ghost").checked) before.draw();
    if (at("forces").checked && forces.length) { gl.disable(gl.DEPTH_TEST); arrows.draw(); }
  };
  const later = () => { if (!due) { due = true; requestAnimationFrame(draw); } };
  const blockAt = (x, y) => {
    prepare(); gl.clearColor(0, 0, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    picking.draw();
    const pixel = new Uint8Array(4), box = canvas.getBoundingClientRect();
    const scale = canvas.width / box.width;
    gl.readPixels((x - box.left) * scale, canvas.height - (y - box.top) * scale, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    draw();
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
  };

  const show = (k) => { state.frame = Math.max(0, Math.min(frames - 1, Math.round(k))); pose(); later(); };
  let held = null, last = 0;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); at("tip").style.display = "none"; });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (held) {
      const dx = e.clientX - held[0], dy = e.clientY - held[1];
      held = [e.clientX, e.clientY];
      if (e.shiftKey || e.buttons === 4) {
        state.shift[0] += 2 * dx / canvas.clientWidth; state.shift[1] -= 2 * dy / canvas.clientHeight;
      } else {
        state.azimuth -= 0.008 * dx;
        state.elevation = Math.max(-1.57, Math.min(1.57, state.elevation + 0.008 * dy));
      }
      later();
    } else if (performance.now() - last > 60 && !state.playing) {
      last = performance.now();
      const b = blockAt(e.clientX, e.clientY), tip = at("tip"), box = canvas.getBoundingClientRect();
      tip.style.display = b >= 0 ? "block" : "none";
      if (b >= 0) {
        tip.textContent = data.names[b] + "\n" + data.notes[b];
        tip.style.left = e.clientX - box.left + 14 + "px"; tip.style.top = e.clientY - box.top + 10 + "px";
      }
    }
  });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); state.zoom *= Math.exp(-0.001 * e.deltaY); later(); }, { passive: false });
  at("frame").max = frames - 1;
  at("frame").addEventListener("input", (e) => show(Number(e.target.value)));
  ["edges", "ghost", "forces", "axis", "cut"].forEach((id) => at(id).addEventListener("input", later));
  at("find").addEventListener("input", (e) => { state.find = e.target.value.trim().toLowerCase(); paint(); later(); });
  at("front").addEventListener("click", () => { state.azimuth = data.front; state.elevation = 0; state.shift = [0, 0]; state.zoom = 1; later(); });
  at("space").addEventListener("click", () => { state.azimuth = data.azimuth; state.elevation = data.elevation; state.shift = [0, 0]; state.zoom = 1; later(); });
  at("play").addEventListener("click", () => { state.playing = !state.playing; at("play").innerHTML = state.playing ? "&#9632;" : "&#9654;"; if (state.playing) tick(); });
  const tick = () => { if (state.playing) { show((state.frame + 1) % frames); setTimeout(tick, 70); } };
  if (frames < 2) at("time").style.visibility = "hidden";
  if (!forces.length) at("forces-label").style.display = "none";
  window.addEventListener("resize", later);
  // page.html#frame=12&forces=1&azimuth=..: a state to link to
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.has("azimuth")) state.azimuth = Number(asked.get("azimuth")) * Math.PI / 180;
  if (asked.has("elevation")) state.elevation = Number(asked.get("elevation")) * Math.PI / 180;
  if (asked.has("forces")) at("forces").checked = asked.get("forces") === "1";
  if (asked.has("find")) { at("find").value = asked.get("find"); state.find = asked.get("find").toLowerCase(); }
  paint();
  show(Number(asked.get("frame") || 0));
  document.body.dataset.ready = "yes";
})();
