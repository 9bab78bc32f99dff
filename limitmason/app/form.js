"use strict";
// The form: fields as the server reads them from signatures, and what is typed into them.
const $ = (id) => document.getElementById(id);
const make = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in node && key !== "list") node[key] = value; else node.setAttribute(key, value);
  }
  node.append(...children);
  return node;
};

function fieldRow(field, part) {
  const id = `${part}.${field.name}`;
  const title = field.hint || field.name;
  let input;
  if (field.kind === "word" && field.choices.length) {
    input = make("select", { id, title });
    const none = field.default || "–";
    options(input, [["", `${none}`], ...field.choices.filter((c) => c !== field.default).map((c) => [c, c])], field.value);
  } else if (field.kind === "list" && field.choices.length > 1) {
    const chosen = field.value.split(",").map((v) => v.trim());
    input = make("div", { id, title, className: "ticks" }, ...field.choices.map((c) => make("label", { className: "tick" },
      make("input", { type: "checkbox", value: c, checked: chosen.includes(c) }), c)));
  } else if (field.kind === "tick") input = make("input", { type: "checkbox", id, title });
  else if (field.kind === "lines") input = make("textarea", { id, value: field.value, title, spellcheck: false });
  else input = make("input", { id, value: field.value, placeholder: field.default, title, spellcheck: false,
    inputMode: field.kind === "number" ? "decimal" : "text" });
  if (field.name === "block" || field.name === "blocks" || field.name === "fixed") input.setAttribute("list", "blocks");
  const row = make("div", { className: "field" },
    make("label", { htmlFor: id, title, textContent: field.name.replace(/_deg$/, "").replaceAll("_", " ") }), input,
    make("span", { className: "unit", textContent: field.unit || "" }), make("p", { className: "error", id: `${id}!` }));
  row.dataset.name = field.name;
  return row;
}

function fill(place, fields, part) {
  const rest = fields.filter((f) => !f.first);
  place.replaceChildren(...fields.filter((f) => f.first).map((f) => fieldRow(f, part)));
  if (rest.length) {
    place.append(make("details", { className: "more" }, make("summary", { textContent: "more" }),
      ...rest.map((f) => fieldRow(f, part))));
  }
}

function values(place) {
  const out = {};
  for (const row of place.querySelectorAll(".field")) {
    const input = row.querySelector("input, textarea, select");
    const ticks = row.querySelector(".ticks");
    const value = ticks ? [...ticks.querySelectorAll(":checked")].map((c) => c.value).join(", ")
      : input.type === "checkbox" ? input.checked : input.value;
    if (value !== "" && value !== false) out[row.dataset.name] = value;
  }
  return out;
}

function put(place, given) {
  for (const row of place.querySelectorAll(".field")) {
    const value = given[row.dataset.name] ?? "";
    const ticks = row.querySelector(".ticks");
    if (ticks) for (const c of ticks.querySelectorAll("input")) c.checked = value.split(", ").includes(c.value);
    else {
      const input = row.querySelector("input, textarea, select");
      if (input.type === "checkbox") input.checked = Boolean(value); else input.value = value;
    }
  }
}

function options(select, pairs, kept) {
  select.replaceChildren(...pairs.map(([value, text]) => make("option", { value, textContent: text })));
  if (pairs.some(([value]) => value === kept)) select.value = kept;
}

const kind = () => $("structure-kind").value;
const isDrawing = () => kind() === "file" && !/\.json$/i.test($("file") ? $("file").value : "");

async function structureChanged() {
  const place = $("structure-more");
  if (kind() === "experiment") {
    const at = make("select", { id: "experiment" });
    for (const [source, names] of Object.entries(forms.experiments)) {
      at.append(make("optgroup", { label: source },
        ...names.map((n) => make("option", { value: `${source}/${n}`, textContent: `${n} (${source})` }))));
    }
    at.value = "ferris-tin-loi-2001/wall-3";
    place.replaceChildren(at, make("div", { id: "structure" }), make("details", { className: "more" },
      make("summary", { textContent: "data sheet" }), make("pre", { id: "sheet", className: "sheet" })));
    at.addEventListener("change", experimentChanged);
    await experimentChanged();
  } else if (kind() === "file") {
    const upload = make("input", { type: "file", id: "upload", accept: ".json,.dxf,.svg,.obj,.ply,.stl,.off" });
    place.replaceChildren(make("p", { className: "hint", textContent:
      `A model (.json) or a drawing (.dxf, .svg, .obj, .ply, .stl, .off) of the folder ${forms.folder}, or one to keep there:` }),
      make("select", { id: "file" }), upload, make("div", { id: "structure" }));
    fileNames();
    $("file").addEventListener("change", fileChanged);
    upload.addEventListener("change", send);
    fileChanged();
  } else {
    place.replaceChildren(make("div", { id: "structure" }));
    fill($("structure"), forms.calls.structure[kind()].fields, "structure");
  }
  const own = ["experiment", "file"].includes(kind());
  $("openings").hidden = kind() !== "wall";
  const bases = Object.entries(forms.calls.loads).map(([name, call]) => [name, call.title]);
  options($("loads-kind"), own ? [["own", "As it brings them"], ...bases] : bases, own ? "own" : "horizontal");
  loadsChanged();
  joints();
}

function joints() {
  const brings = kind() === "experiment" || (kind() === "file" && !isDrawing());
  $("other-joints").hidden = !brings;
  $("joint").hidden = brings && !$("replace-joints").checked;
}

async function experimentChanged() {
  const [source, specimen] = $("experiment").value.split("/");
  const query = new URLSearchParams({ source, specimen });
  try {
    const found = await ask(`api/experiment?${query}`);
    fill($("structure"), found.fields, "structure");
    $("sheet").textContent = found.text;
  } catch (error) { problem(error); }
}

function fileNames(chosen) {
  options($("file"), forms.files.map((f) => [f, f]), chosen || $("file").value);
}

function fileChanged() {
  if (isDrawing() && $("file").value) fill($("structure"), forms.calls.drawing.drawing.fields, "structure");
  else $("structure").replaceChildren();
  joints();
}

async function send() {
  const file = $("upload").files[0];
  if (!file) return;
  try {
    if (file.size > forms.largest) throw { part: "structure", name: "refused", text: `${file.name} is too large: at most ${forms.largest / 1e6} MB` };
    const kept = await ask(`api/upload?${new URLSearchParams({ name: file.name })}`, file, "application/octet-stream");
    forms.files = (await ask("api/files")).files;
    fileNames(kept.file);
    fileChanged();
    changed();
  } catch (error) { problem(error); }
}

function loadsChanged() {
  const call = forms.calls.loads[$("loads-kind").value];
  fill($("loads"), call ? call.fields : [], "loads");
}

function addItem(place, part, call, name) {
  const item = make("div", { className: "item" });
  const drop = make("button", { type: "button", className: "quiet", textContent: "remove" });
  const body = make("div");
  item.dataset.kind = name;
  item.append(make("div", { className: "row" }, make("h3", { textContent: call.title }), drop), body,
    make("p", { className: "error" }));
  place.append(item);
  fill(body, call.fields, `${part}.${place.childElementCount - 1}.${Math.random().toString(36).slice(2)}`);
  drop.addEventListener("click", () => { item.remove(); changed(); });
  return item;
}

function analysisChanged() {
  fill($("analysis"), forms.calls.analysis[$("analysis-kind").value].fields, "analysis");
}
