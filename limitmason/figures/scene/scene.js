"use strict";
// Draws the blocks of the page's data with WebGL alone. Positions of a frame are worked out here:
// x = c + s t + R(s theta) (X - c), with the factor s of the slider.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const at = (id) => document.getElementById(id);
  const vertices = floats(data.vertices), normals = floats(data.normals), owner = floats(data.owner);
  const lines = floats(data.lines), lineOwner = floats(data.line_owner), centroids = floats(data.centroids);
  const motion = floats(data.motion), forces = floats(data.forces.rows);
  const corners = floats(data.joints.corners), normal = floats(data.joints.normals), joints = data.joints;
  const blocks = data.names.length, frames = data.captions.length, size = data.size, centre = data.centre;
  const canvas = at("scene"), gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { at("failed").style.display = "block"; return; }

  const shader = (kind, text) => {
    const s = gl.createShader(kind);
    gl.shaderSource(s, text); gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    return s;
  };
  const linked = (vertex, fragment) => {
    const p = gl.createProgram();
    gl.attachShader(p, shader(gl.VERTEX_SHADER, vertex)); gl.attachShader(p, shader(gl.FRAGMENT_SHADER, fragment));
    gl.linkProgram(p);
    return p;
  };
  const program = linked(`
    attribute vec3 place, normal, before, colour;
    uniform mat4 view; uniform vec3 light;
    varying vec3 vColour; varying vec3 vBefore;
    void main() {
      gl_Position = view * vec4(place, 1.0);
      float lit = dot(normal, normal) > 0.0 ? 0.62 + 0.38 * abs(dot(normalize(normal), light)) : 1.0;
      vColour = colour * lit; vBefore = before;
    }`, `
    precision mediump float;
    uniform vec4 section;
    varying vec3 vColour; varying vec3 vBefore;
    void main() {
      if (dot(section.xyz, vBefore) > section.w) discard;
      gl_FragColor = vec4(vColour, 1.0);
    }`);
  // lines of some pixels, which WebGL has not: a rectangle along each, towards the viewer by a hair
  const strokes = linked(`
    attribute vec3 from, to, before, colour; attribute vec3 side; // end, side, width in pixels
    uniform mat4 view; uniform vec2 page;
    varying vec3 vColour; varying vec3 vBefore;
    void main() {
      vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
      vec2 along = (b.xy - a.xy) * page;
      along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
      gl_Position = mix(a, b, side.x);
      gl_Position.xy += side.y * side.z * vec2(-along.y, along.x) / page;
      gl_Position.z -= 0.002;
      vColour = colour; vBefore = before;
    }`, `
    precision mediump float;
    uniform vec4 section; varying vec3 vColour; varying vec3 vBefore;
    void main() {
      if (dot(section.xyz, vBefore) > section.w) discard;
      gl_FragColor = vec4(vColour, 1.0);
    }`);
  gl.useProgram(program);
  const uniform = (n) => gl.getUniformLocation(program, n);
  const uView = uniform("view"), uLight = uniform("light"), uSection = uniform("section");

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
  const HELD = [0.72, 0.72, 0.72], STILL = [0.95, 0.95, 0.95], MOVES = [0.93, 0.79, 0.58], FOUND = [0.15, 0.5, 0.85];
  const INK = [0.1, 0.1, 0.1], GHOST = [0.6, 0.6, 0.6], OPENS = [0.835, 0.369, 0], SLIDES = [0, 0.447, 0.698];
  const solidCount = vertices.length / 3, lineCount = lines.length / 3;
  const solids = new Mesh(gl.TRIANGLES, solidCount), picking = new Mesh(gl.TRIANGLES, solidCount);
  const edges = new Mesh(gl.LINES, lineCount), before = new Mesh(gl.LINES, lineCount);
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

  const state = { frame: 0, scale: data.scale || 1, azimuth: data.azimuth, elevation: data.elevation, zoom: 1, shift: [0, 0], find: "", playing: false };
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const unit = (v) => { const l = Math.hypot(...v) || 1; return v.map((x) => x / l); };
  const placed = (frame, factor) => { // displacement and rotation matrix of every block
    const out = new Float32Array(12 * blocks);
    for (let i = 0; i < blocks; i++) {
      const m = 6 * (frame * blocks + i), w = [0, 1, 2].map((r) => factor * motion[m + 3 + r]);
      const angle = Math.hypot(...w), k = unit(w), c = Math.cos(angle), s = Math.sin(angle);
      for (let r = 0; r < 3; r++) out[12 * i + r] = factor * motion[m + r];
      for (let r = 0; r < 3; r++) for (let j = 0; j < 3; j++) {
        const skew = r === j ? 0 : ((j - r + 3) % 3 === 1 ? -1 : 1) * k[3 - r - j];
        out[12 * i + 3 + 3 * r + j] = (r === j ? c : 0) + (1 - c) * k[r] * k[j] + s * skew;
      }
    }
    return out;
  };
  const mover = (at) => (b, p, isVector) => { // a point or a vector carried by a block
    const m = 12 * b, c = isVector ? [0, 0, 0] : [centroids[3 * b], centroids[3 * b + 1], centroids[3 * b + 2]];
    const x = p[0] - c[0], y = p[1] - c[1], z = p[2] - c[2];
    return [0, 1, 2].map((r) => at[m + 3 + 3 * r] * x + at[m + 4 + 3 * r] * y + at[m + 5 + 3 * r] * z + (isVector ? 0 : c[r] + at[m + r]));
  };
  const carried = (move, points, owners, isVector) => {
    const out = new Float32Array(points.length);
    for (let i = 0; i < owners.length; i++) out.set(move(owners[i], [points[3 * i], points[3 * i + 1], points[3 * i + 2]], isVector), 3 * i);
    return out;
  };
  const movesAtAll = new Array(blocks).fill(false);
  for (let f = 0; f < frames; f++) for (let b = 0; b < blocks; b++) {
    const m = 6 * (f * blocks + b), w = 0.5 * size * Math.hypot(motion[m + 3], motion[m + 4], motion[m + 5]);
    if (state.scale * (Math.hypot(motion[m], motion[m + 1], motion[m + 2]) + w) > 2e-3 * size) movesAtAll[b] = true;
  }
  const colourOf = (b) => {
    if (state.find && data.names[b].toLowerCase().includes(state.find)) return FOUND;
    return data.held[b] ? HELD : movesAtAll[b] && !at("forces").checked ? MOVES : STILL;
  };

  const lineArray = gl.createBuffer();
  const drawLines = (list) => { // of {from, to, before, colour, width}
    if (!list.length) return;
    const values = new Float32Array(list.length * 6 * 15);
    list.forEach((l, n) => [[0, 1], [0, -1], [1, 1], [1, 1], [0, -1], [1, -1]].forEach(([end, side], v) =>
      values.set([...l.from, ...l.to, ...l.before, ...l.colour, end, side, l.width], 15 * (6 * n + v))));
    gl.useProgram(strokes);
    gl.bindBuffer(gl.ARRAY_BUFFER, lineArray); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    ["from", "to", "before", "colour", "side"].forEach((name, k) => {
      const place = gl.getAttribLocation(strokes, name);
      gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 60, 12 * k);
    });
    const ratio = window.devicePixelRatio || 1;
    gl.uniformMatrix4fv(gl.getUniformLocation(strokes, "view"), false, matrix());
    gl.uniform2f(gl.getUniformLocation(strokes, "page"), canvas.width / ratio, canvas.height / ratio);
    gl.uniform4f(gl.getUniformLocation(strokes, "section"), ...section());
    gl.drawArrays(gl.TRIANGLES, 0, 6 * list.length);
    gl.useProgram(program);
  };
  let cracked = [], marks = { opens: false, slides: false };
  const crackLines = (move) => { // outlines of the joints that have opened or slid, on both blocks
    const truth = mover(placed(state.frame, 1)), out = [];
    marks = { opens: false, slides: false };
    for (let j = 0, first = 0; j < joints.a.length; first += joints.count[j], j++) {
      const a = joints.a[j], b = joints.b[j], n = truth(a, [normal[3 * j], normal[3 * j + 1], normal[3 * j + 2]], true);
      const points = [];
      let opening = 0, sliding = 0;
      for (let i = first; i < first + joints.count[j]; i++) {
        const p = [corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]], u = truth(a, p), v = truth(b, p);
        const jump = v.map((x, r) => x - u[r]), apart = jump[0] * n[0] + jump[1] * n[1] + jump[2] * n[2];
        points.push(p);
        opening = Math.max(opening, apart);
        sliding = Math.max(sliding, Math.hypot(...jump.map((x, r) => x - apart * n[r])));
      }
      if (!(data.crack > 0 && Math.max(opening, sliding) > data.crack)) continue;
      const colour = opening >= sliding ? OPENS : SLIDES;
      marks[opening >= sliding ? "opens" : "slides"] = true;
      [a, b].forEach((block) => points.forEach((p, i) => out.push({
        from: move(block, p), to: move(block, points[(i + 1) % points.length]), before: p, colour, width: 2.2 })));
    }
    return out;
  };
  const forceLines = () => {
    const out = [];
    for (let i = 0; i < forces.length; i += 8) {
      const from = [...forces.slice(i, i + 3)], to = [...forces.slice(i + 3, i + 6)];
      out.push({ from, to, before: from, colour: forces[i + 7] ? SLIDES : INK, width: Math.max(9 * forces[i + 6], 0.8) });
    }
    return out.sort((l, m) => m.width - l.width); // small ones are not buried
  };
  const pushLines = () => { // the live load from where it acts, with a head that the viewer sees from anywhere
    if (!data.push.length) return [];
    const from = data.push.slice(0, 3), d = data.push.slice(3), p = unit(cross(d, axes()[2])), long = 0.14 * size;
    const to = from.map((x, r) => x + long * d[r]);
    const barb = (s) => to.map((x, r) => x - 0.28 * long * d[r] + s * 0.14 * long * p[r]);
    const both = (colour, width) => [from, barb(1), barb(-1)].map((f) => ({ from: f, to, before: from, colour, width }));
    return [...both([1, 1, 1], 4.5), ...both(INK, 2.2)];
  };
  const explain = () => { // the legend names what is to be seen
    const shown = new Set(data.names.map((_, b) => colourOf(b))), lines = [];
    const far = Number((1e3 * data.crack).toPrecision(2)) + " mm";
    [[MOVES, "moves"], [STILL, "stands still"], [HELD, "held"], [FOUND, "found"]].forEach(([c, t]) => shown.has(c) && lines.push([c, at("forces").checked && c === STILL ? "block" : t]));
    if (at("cracks").checked) [[OPENS, "opens"], [SLIDES, "slides"]].forEach(([c, t]) => marks[t] && lines.push([c, `joint ${t}${data.scale ? " by more than " + far : ""}`, "line"]));
    if (at("forces").checked) lines.push([INK, `joint force, thickest ${data.forces.largest}`, "line"], [SLIDES, "at friction limit", "line"]);
    if (data.push.length) lines.push([INK, "live load", "arrow"]);
    at("legend").replaceChildren(...lines.map(([c, t, kind]) => {
      const row = document.createElement("div"), mark = document.createElement("i");
      mark.className = kind || "area";
      if (kind === "arrow") mark.textContent = "\u2192"; else mark.style.background = `rgb(${c.map((v) => 255 * v)})`;
      row.append(mark, t);
      return row;
    }));
  };
  const pose = () => {
    const move = mover(placed(state.frame, state.scale)), place = carried(move, vertices, owner, false);
    solids.set("place", place); picking.set("place", place);
    solids.set("normal", carried(move, normals, owner, true));
    edges.set("place", carried(move, lines, lineOwner, false));
    at("caption").textContent = data.captions[state.frame];
    at("frame").value = state.frame;
    document.body.dataset.frame = state.frame;
    at("factor").textContent = "× " + Number(state.scale.toPrecision(2));
    cracked = crackLines(move);
    explain();
  };
  const paint = () => { solids.set("colour", painted(solidCount, (i) => colourOf(owner[i]))); explain(); };

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
    gl.uniform4f(uSection, ...section());
  };
  const section = () => { // what lies beyond this plane is not drawn
    const axis = Number(at("axis").value), cut = Number(at("cut").value), out = [0, 0, 0, 1];
    if (axis >= 0) { out[axis] = 1; out[3] = data.low[axis] + cut * (data.high[axis] - data.low[axis]); }
    return out;
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
    if (at("cracks").checked) drawLines(cracked);
    gl.disable(gl.DEPTH_TEST);
    if (at("forces").checked) drawLines(forceLines());
    drawLines(pushLines());
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
  ["edges", "ghost", "cracks", "axis", "cut"].forEach((id) => at(id).addEventListener("input", () => { explain(); later(); }));
  const withForces = () => { paint(); show(at("forces").checked ? 0 : data.start); }; // they are those at rest
  at("forces").addEventListener("input", withForces);
  at("scale").addEventListener("input", (e) => { state.scale = 10 ** Number(e.target.value); pose(); later(); });
  at("find").addEventListener("input", (e) => { state.find = e.target.value.trim().toLowerCase(); paint(); later(); });
  at("front").addEventListener("click", () => { state.azimuth = data.front; state.elevation = 0; state.shift = [0, 0]; state.zoom = 1; later(); });
  at("space").addEventListener("click", () => { state.azimuth = data.azimuth; state.elevation = data.elevation; state.shift = [0, 0]; state.zoom = 1; later(); });
  at("play").addEventListener("click", () => { state.playing = !state.playing; at("play").innerHTML = state.playing ? "&#9632;" : "&#9654;"; if (state.playing) tick(); });
  const tick = () => { if (state.playing) { show((state.frame + 1) % frames); setTimeout(tick, 70); } };
  if (frames < 2) at("time").style.visibility = "hidden";
  if (!forces.length) at("forces-label").style.display = "none";
  if (!data.crack) at("cracks-label").style.display = "none";
  if (!data.scale) at("scale-label").style.display = "none";
  else {
    at("scale").min = Math.min(0, Math.log10(data.scale)); at("scale").max = Math.log10(10 * Math.max(data.scale, 10));
  }
  window.addEventListener("resize", later);
  // page.html#frame=12&forces=1&azimuth=..: a state to link to
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.has("azimuth")) state.azimuth = Number(asked.get("azimuth")) * Math.PI / 180;
  if (asked.has("elevation")) state.elevation = Number(asked.get("elevation")) * Math.PI / 180;
  ["forces", "cracks"].forEach((id) => { if (asked.has(id)) at(id).checked = asked.get(id) === "1"; });
  if (asked.has("find")) { at("find").value = asked.get("find"); state.find = asked.get("find").toLowerCase(); }
  if (asked.has("scale")) state.scale = Number(asked.get("scale"));
  at("scale").value = Math.log10(state.scale);
  paint();
  show(asked.has("frame") ? Number(asked.get("frame")) : at("forces").checked ? 0 : data.start);
  document.body.dataset.ready = "yes";
})();
