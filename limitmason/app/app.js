"use strict";
// The page of the application. It holds no physics: forms come from the server, which reads them from signatures; what is
// filled in goes back as a session, which the server turns into lines of Python. Text is only ever set as text.
const TABS = { "wall.png": "Structure", "mechanism.png": "Mechanism", "forces.png": "Forces", "curve.png": "Curve",
  "theories.png": "Chart", "scene.html": "Turn it", "report.html": "Report" };
const FILES = { "answer.json": "Answer (JSON)", "model.json": "Model (JSON)", "report.html": "Report (HTML)" };
const SECONDS = 4; // a drawing that takes longer is made on request only

let forms, drawn = null, solved = null, reported = null, tab = "", mine = new Set(), running = false, slow = false;
let timer = 0, stale = false, told = null;

async function ask(path, body, type = "application/json") {
  const response = await fetch(path, body === undefined ? {} : { method: "POST", body, headers: { "Content-Type": type } });
  const data = await response.json();
  if (!response.ok) {
    const error = typeof data.error === "string" ? { part: "structure", name: "refused", text: data.error } : data.error;
    throw Object.assign(new Error(error.text), error);
  }
  return data;
}

// --- the session
function session() {
  const structure = { kind: kind(), values: values($("structure")) };
  if (kind() === "wall") structure.openings = [...$("opening-rows").children].map((row) => values(row));
  if (kind() === "experiment") [structure.source, structure.specimen] = $("experiment").value.split("/");
  if (kind() === "file") structure.file = $("file").value;
  if (!$("other-joints").hidden) structure.other_joints = $("replace-joints").checked;
  return { structure, joint: values($("joint")),
    loads: { kind: $("loads-kind").value, values: values($("loads")),
      more: [...$("more-loads").children].map((row) => ({ kind: row.dataset.kind, values: values(row) })) },
    analysis: { kind: $("analysis-kind").value, values: values($("analysis")) } };
}

// a page that is loaded again goes on where it was
async function restore(s) {
  $("structure-kind").value = s.structure.kind;
  await structureChanged();
  if (s.structure.source) {
    $("experiment").value = `${s.structure.source}/${s.structure.specimen}`;
    await experimentChanged();
  }
  if (s.structure.file) { $("file").value = s.structure.file; fileChanged(); }
  $("replace-joints").checked = Boolean(s.structure.other_joints);
  joints();
  $("opening-rows").replaceChildren();
  for (const given of s.structure.openings || []) put(opening(), given);
  $("loads-kind").value = s.loads.kind;
  loadsChanged();
  for (const more of s.loads.more) put(addItem($("more-loads"), "more", forms.calls.more[more.kind], more.kind), more.values);
  $("analysis-kind").value = s.analysis.kind;
  analysisChanged();
  for (const part of ["structure", "loads", "analysis"]) put($(part), s[part].values);
  put($("joint"), s.joint);
  if (sessionStorage.job) mine.add(Number(sessionStorage.job));
  stale = Boolean(sessionStorage.job) && sessionStorage.solved !== sessionStorage.session;
}

const opening = () => addItem($("opening-rows"), "opening", forms.calls.opening.Opening, "Opening");

async function run(what) {
  clearTimeout(timer);
  if (kind() === "file" && !$("file").value) return;
  try {
    const found = await ask(`api/run?kind=${what}`, JSON.stringify(session()));
    mine.add(found.job);
    sessionStorage.session = JSON.stringify(session());
    if (what !== "draw") [sessionStorage.job, sessionStorage.solved] = [found.job, sessionStorage.session];
    if (what !== "draw") {
      problem(null);
      stale = false;
      script();
      if (innerWidth <= 850) $("headline").scrollIntoView();
    }
    if (told) state(told);
  } catch (error) {
    if (what !== "draw" || error.name !== "Busy") problem(error);
  }
}

async function script() {
  if (kind() === "file" && !$("file").value) return;
  try { $("script").textContent = (await ask("api/script", JSON.stringify(session()))).script; } catch (error) { problem(error); }
}

function changed() {
  stale = true;
  $("answer").classList.toggle("stale", Boolean(solved));
  $("go-text").textContent = solved ? "changed: solve again" : "";
  clearTimeout(timer);
  timer = setTimeout(() => { script(); if (!slow && !running) run("draw"); }, 400);
}

// --- what comes back
function problem(error) {
  for (const p of document.querySelectorAll("p.error")) p.textContent = "";
  for (const row of document.querySelectorAll(".wrong")) row.classList.remove("wrong");
  $("problem").hidden = !error;
  if (!error) return;
  $("problem-name").textContent = error.name;
  const text = error.text ?? error.message;
  $("problem-text").textContent = text;
  if (!error.part) return;
  const place = placeOf(error.part);
  const row = place && fieldIn(place, text);
  if (row) {
    row.classList.add("wrong");
    row.querySelector(".error").textContent = text;
    const more = row.closest("details");
    if (more) more.open = true;
  } else {
    const line = error.part.startsWith("more.") ? place && place.querySelector(":scope > .error")
      : document.querySelector(`p.error[data-part="${CSS.escape(error.part)}"]`);
    if (line) line.textContent = text;
  }
}

function placeOf(part) {
  if (part.startsWith("more.")) return $("more-loads").children[Number(part.slice(5))];
  return { openings: $("opening-rows"), joint: $("joint"), loads: $("loads"), structure: $("structure"),
    analysis: $("analysis") }[part];
}

// the field whose name comes first in the words of an error
function fieldIn(place, text) {
  let best = null, at = Infinity;
  for (const row of place.querySelectorAll(".field")) {
    const found = new RegExp(`(^|[^\\w])${row.dataset.name}([^\\w]|$)`).exec(text);
    if (found && found.index < at) [best, at] = [row, found.index];
  }
  return best;
}

async function finished(job) {
  const result = await ask(`api/result/${job}`), what = result.kind;
  if (result.state === "cancelled") {
    if (what !== "draw") $("go-text").textContent = "cancelled";
    return;
  }
  if (result.error) {
    problem(result.error);
    $("go-text").textContent = "";
    return;
  }
  problem(null);
  $("blocks").replaceChildren(...result.summary.blocks.map((b) => make("option", { value: b })));
  if (what === "draw") {
    slow = drawn !== null && result.seconds > SECONDS; // the first one also waits for imports
    drawn = result;
    if (!solved) shown(result);
    else $("go-text").textContent = stale ? "changed: solve again" : "";
  } else if (what === "report") {
    reported = result;
    tab = "report.html";
  } else {
    [solved, reported] = [result, null];
    if (!stale) $("script").textContent = result.script;
    shown(result);
    tab = result.summary.rows ? "table" : "";
  }
  tabs();
}

function shown(result) {
  const s = result.summary, lines = [];
  if (s.number !== undefined && s.number !== null) lines.push(make("p", { className: "number", textContent: shortly(s.number) }));
  if (s.rows) {
    const found = s.rows.map((r) => r[1]).filter((v) => v !== null);
    if (found.length) lines.push(make("p", { className: "number", textContent: [Math.min(...found), Math.max(...found)].map(shortly).join(" – ") }));
  }
  if (s.what) lines.push(make("p", { className: "what", textContent: s.what }));
  if (s.status) lines.push(make("span", { className: /^(solved|finished|limit point)/.test(s.status) ? "badge" : "badge doubt", textContent: s.status }));
  for (const text of [s.also, s.bound]) if (text) lines.push(make("p", { className: "bound", textContent: text }));
  for (const text of s.beside) lines.push(make("p", { textContent: text }));
  if (result.kind === "draw") lines.push(make("p", { className: "what", textContent: "Press Solve" }));
  lines.push(make("p", { className: "hint", textContent: s.structure + (result.kind === "draw" ? "" : `; ${result.seconds} s`) }));
  $("answer").replaceChildren(...lines);
  $("answer").classList.toggle("stale", stale && result === solved);
  $("go-text").textContent = "";
  const notes = [...new Set([...(s.warnings || []), ...result.notes])];
  $("notes").hidden = !notes.length;
  $("notes").querySelector("summary").textContent = notes.length === 1 ? "1 note" : `${notes.length} notes`;
  $("notes").querySelector("ul").replaceChildren(...notes.map((n) => make("li", { textContent: n })));
}

const shortly = (number) => (Math.abs(number) >= 1e5 || (number !== 0 && Math.abs(number) < 1e-3) ? number.toExponential(4)
  : String(Number(number.toPrecision(6))));

function tabs() {
  const found = [];
  const of = (result, names) => { for (const name of names) if (result && result.files.includes(name)) found.push([name, TABS[name], result]); };
  if (solved && solved.summary.rows) found.push(["table", "Theories", solved]);
  of(solved, ["mechanism.png", "curve.png", "theories.png", "forces.png", "scene.html", "report.html"]);
  of(reported, ["report.html"]);
  if (!found.some(([name]) => name === "scene.html")) of(drawn, ["scene.html"]);
  of(drawn, ["wall.png"]);
  if (!solved) found.reverse();
  if (solved && solved.summary.text) found.push(["text", "Text", solved]);
  if (!found.some(([name]) => name === tab)) tab = found.length ? found[0][0] : "";
  $("tabs").replaceChildren(...found.map(([name, title]) => {
    const button = make("button", { type: "button", textContent: title });
    button.setAttribute("role", "tab");
    button.setAttribute("aria-selected", String(name === tab));
    button.addEventListener("click", () => { tab = name; tabs(); });
    return button;
  }));
  const now = found.find(([name]) => name === tab);
  if (now) stage(now[0], now[2]);
  downloads();
}

function stage(name, result) {
  const address = `api/result/${result.job}/${name}`;
  const key = `${result.job}/${name}`;
  if ($("stage").dataset.key === key) return;
  $("stage").dataset.key = key;
  const line = (result.lines || []).find((l) => l.includes(`"${name}"`));
  $("stage-line").textContent = line || "";
  if (name === "text") $("stage").replaceChildren(make("pre", { textContent: result.summary.text }));
  else if (name === "table") $("stage").replaceChildren(table(result.summary.rows));
  else if (name.endsWith(".html")) $("stage").replaceChildren(make("iframe", { src: address, title: TABS[name] }));
  else $("stage").replaceChildren(make("img", { src: address, alt: TABS[name] }));
}

function table(rows) {
  const cell = (tag, text) => make(tag, { textContent: text });
  return make("table", {}, make("tr", {}, ...["theory", "λ [-]", "status", "what it is"].map((t) => cell("th", t))),
    ...rows.map((r) => make("tr", {}, cell("td", r[0]), cell("td", r[1] === null ? "–" : shortly(r[1])), cell("td", r[2]), cell("td", r[3]))));
}

function downloads() {
  const result = solved || drawn, links = [];
  if (result) {
    links.push(["session.py", "Script (.py)"], ...Object.entries(FILES).filter(([name]) => result.files.includes(name)));
  }
  const link = ([name, text], of) => make("a", { className: "button", textContent: text, href: `api/result/${of.job}/${name}?download=1` });
  const nodes = links.map((l) => link(l, result));
  if (reported) nodes.push(link(["report.html", FILES["report.html"]], reported));
  else if (solved && !solved.files.includes("report.html")) {
    const report = make("button", { type: "button", className: "quiet", textContent: "Make a report" });
    report.addEventListener("click", () => run("report"));
    nodes.push(report);
  }
  $("downloads").replaceChildren(...nodes);
}

function state(now) {
  told = now;
  if (!now.job) return; // nothing was asked for yet
  const active = now.state === "running" || now.state === "waiting";
  const wasRunning = running;
  running = Boolean(active) && now.kind !== "draw";
  $("running").hidden = !running;
  $("solve").disabled = running;
  if (running) {
    $("running-what").textContent = mine.has(now.job) ? (now.kind === "report" ? "writing the report" : "solving") : "another page is solving";
    const known = now.part !== null && now.part > 0;
    $("running-text").textContent = `${known ? `${Math.round(100 * now.part)} %, ` : ""}${now.text || `${Math.round(now.seconds)} s`}`;
    $("bar").parentElement.classList.toggle("unknown", !known);
    $("bar").style.width = known ? `${100 * now.part}%` : "";
  } else if (active) $("go-text").textContent = "drawing …";
  for (const job of [...mine]) {
    if (job > now.job || (job === now.job && active)) continue;
    mine.delete(job);
    finished(job).catch(problem);
  }
  if (wasRunning && !running && stale && !slow) changed();
}

async function begin() {
  forms = await ask("api/forms");
  $("about").textContent = `${forms.version} · folder ${forms.folder}`;
  options($("structure-kind"), [...Object.entries(forms.calls.structure).map(([name, call]) => [name, call.title]),
    ["experiment", "A packaged experiment"], ["file", "A model or a drawing from a file"]], "wall");
  options($("analysis-kind"), Object.entries(forms.calls.analysis).map(([name, call]) => [name, call.title]));
  options($("add-load"), [["", "+ load"], ...Object.entries(forms.calls.more).map(([name, call]) => [name, call.title])]);
  fill($("joint"), forms.calls.joint.Joint.fields, "joint");
  analysisChanged();
  opening();
  await structureChanged();
  if (sessionStorage.token !== location.pathname) { // of another run of the program: its jobs are gone
    delete sessionStorage.job;
    delete sessionStorage.solved;
    sessionStorage.token = location.pathname;
  }
  if (sessionStorage.session) await restore(JSON.parse(sessionStorage.session)).catch(() => sessionStorage.clear());
  $("structure-kind").addEventListener("change", async () => { await structureChanged(); changed(); });
  $("loads-kind").addEventListener("change", loadsChanged);
  $("analysis-kind").addEventListener("change", analysisChanged);
  $("replace-joints").addEventListener("change", joints);
  $("add-opening").addEventListener("click", () => { opening(); changed(); });
  $("add-load").addEventListener("change", () => {
    const name = $("add-load").value;
    if (name) addItem($("more-loads"), "more", forms.calls.more[name], name);
    $("add-load").value = "";
  });
  $("form").addEventListener("input", (event) => { if (event.target.id !== "upload") changed(); });
  $("form").addEventListener("submit", (event) => { event.preventDefault(); run("solve"); });
  $("draw").addEventListener("click", () => run("draw"));
  $("cancel").addEventListener("click", () => ask("api/cancel", "").catch(problem));
  $("copy").addEventListener("click", () => navigator.clipboard.writeText($("script").textContent));
  const events = new EventSource("api/events");
  events.addEventListener("message", (event) => { $("lost").hidden = true; state(JSON.parse(event.data)); });
  events.addEventListener("error", () => { $("lost").hidden = false; });
  await script();
  await run("draw");
}

begin().catch(problem);
