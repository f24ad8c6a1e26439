"use strict";
// The page: facts of the case, particles with their controls, curves, errors.

const main = document.querySelector("main");
const dark = window.matchMedia("(prefers-color-scheme: dark)");
let lookName = dark.matches ? "dark" : "light";
const redraws = [];  // what must be made again in other colours

/** Colours that scripts draw with, from the style sheet. */
function lookNow() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { name: lookName, text: of("--text"), grid: of("--grid"), faint: of("--faint"), mark: of("--mark"), line: of("--line"), font: "12px system-ui, sans-serif", up: upward() };
}

/** Against gravity, else z. */
function upward() {
  const gravity = (DATA.case?.gravity ?? []).concat(0, 0).slice(0, 3);
  const size = Math.hypot(...gravity);
  return size > 0 ? gravity.map((g) => -g / size) : [0, 0, 1];
}

function setLook(name) {
  lookName = name;
  document.documentElement.dataset.look = name;
  document.getElementById("look").textContent = name === "dark" ? "Light" : "Dark";
  redraws.forEach((redraw) => redraw());
}

function section(title, ...children) {
  const made = element("section", {}, element("h2", {}, title), ...children);
  main.append(made);
  return made;
}

/** A box whose content is made anew when the look changes. */
function drawnBox(make) {
  const box = element("div", { class: "plot" });
  const redraw = () => { box.replaceChildren(); make(box); };
  redraws.push(redraw);
  return [box, redraw];
}

function table(head, rows) {
  return element("div", { class: "scroll" }, element("table", {},
    element("thead", {}, element("tr", {}, ...head.map((h) => element("th", {}, h)))),
    element("tbody", {}, ...rows.map((row) => element("tr", {}, ...row.map((cell) => (cell instanceof Node ? cell : element("td", {}, String(cell)))))))));
}

function select(names, onchange, label) {
  return element("label", {}, `${label} `, element("select", { onchange: (e) => onchange(e.target.value), "aria-label": label },
    ...names.map((name) => element("option", { value: name }, name))));
}

// ---- the case ----

function listed(values) {
  return Array.isArray(values) ? values.map((v) => (typeof v === "number" ? readable(v) : v)).join(" × ") : readable(values);
}

function showCase() {
  const { case: input, particles, tables, program } = DATA;
  const method = input.method ?? {}, time = input.time ?? {};
  const last = tables.history?.columns.time?.at(-1);
  const facts = [
    ["Method", `${method.preset}: ${[method.domain, method.basis, `velocity by ${method.projection}`, method.scheme].join(", ")}`],
    ["Grid", `${input.grid?.dim ?? ""}D, ${listed(input.grid?.size)} m, spacing ${listed([...new Set(input.grid?.spacing ?? [])])} m`],
    ["Particles", particles ? `${particles.count.toLocaleString("en")} in ${particles.times.length} frames` : "no frames"],
    ["Time", `${readable(last ?? 0)} of ${readable(time.end)} s${typeof time.dt === "number" ? `, steps of ${readable(time.dt)} s` : ""}`],
    ["Materials", (input.material ?? []).map((m) => `${m.name} (${m.model})`).join(", ")],
    ["Bodies", (input.body ?? []).map((b, k) => `${b.name ?? k}: ${b.shape}`).join(", ")],
    ["Program", program],
  ];
  section("Case", element("dl", { class: "facts" }, ...facts.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)])),
    element("details", {}, element("summary", {}, "The case with every default, as ordo run takes it"), element("pre", {}, DATA.toml)));
}

// ---- particles ----

const WHOLE = ["body", "material"];

/** What can be coloured: components, and the size of vectors. */
function choices(fields) {
  const found = [];
  fields.forEach((field, k) => {
    const parts = fields.filter((other) => other.array === field.array);
    if (parts.length > 1 && parts[0] === field && field.name.length === field.array.length + 2)
      found.push({ name: field.array, label: `${field.array} (size)`, unit: field.unit, parts: parts.map((p) => fields.indexOf(p)) });
    found.push({ name: field.name, label: field.name.replace(/_(?=[xyz]{1,2}$)/, " "), unit: field.unit, parts: [k], whole: WHOLE.includes(field.name) });
  });
  return found;
}

/** Values of a choice in all frames; MISSING where there is none. */
async function valuesOf(choice, fields) {
  const parts = [];
  for (const k of choice.parts) parts.push([fields[k], await unpacked(`field ${fields[k].name}`)]);
  const values = new Float32Array(parts[0][1].length);
  for (let k = 0; k < values.length; ++k) {
    let sum = 0;
    for (const [field, codes] of parts) {
      if (codes[k] === 0) { sum = NaN; break; }
      const value = field.low + field.step * (codes[k] - 1);
      sum = parts.length > 1 ? sum + value * value : value;
    }
    values[k] = Number.isNaN(sum) ? MISSING : parts.length > 1 ? Math.sqrt(sum) : choice.whole ? Math.round(sum) : sum;
  }
  return values;
}

/** Smallest and largest value of a part of the frames, of these all but a share at both ends. */
function rangeOf(values, share = 0) {
  const there = values.filter((v) => v > MISSING);
  if (!there.length) return [0, 1];
  if (share) {
    there.sort();
    return [there[Math.floor(share * (there.length - 1))], there[Math.ceil((1 - share) * (there.length - 1))]];
  }
  let low = Infinity, high = -Infinity;
  for (const v of there) { if (v < low) low = v; if (v > high) high = v; }
  return [low, high];
}

async function showParticles() {
  const about = DATA.particles;
  const box = element("div", { class: "view", tabindex: 0, "aria-label": "Particles; drag to turn or move, scroll to zoom, click for numbers" });
  const bar = element("div", { class: "bar" });
  const ruler = element("div", { class: "ruler" });
  const tip = element("div", { class: "tip", hidden: true });
  box.append(bar, ruler, tip);
  const state = { frame: 0, playing: false, fields: choices(about.fields), map: "viridis", speed: Math.min(30, Math.max(5, about.times.length / 6)) };

  const slider = element("input", { type: "range", min: 0, max: about.times.length - 1, value: 0, id: "time", "aria-label": "time", oninput: (e) => go(Number(e.target.value)) });
  const play = element("button", { id: "play", onclick: () => setPlaying(!state.playing) }, "Play");
  const clock = element("output", { id: "clock" });
  const low = element("input", { type: "text", inputmode: "decimal", size: 9, "aria-label": "lower end of the colours", onchange: () => typed() });
  const high = element("input", { type: "text", inputmode: "decimal", size: 9, "aria-label": "upper end of the colours", onchange: () => typed() });
  const fieldBox = select(state.fields.map((f) => f.label), (label) => pickField(state.fields.find((f) => f.label === label)), "Colour");
  fieldBox.querySelector("select").id = "field";
  const mapBox = select(Object.keys(MAPS), (name) => { state.map = name; paint(); }, "Map");
  const button = (text, onclick, title) => element("button", { onclick, title }, text);
  const toggle = (text, on, onchange) => element("label", {}, element("input", { type: "checkbox", checked: on, onchange: (e) => onchange(e.target.checked) }), ` ${text}`);
  const speed = element("label", {}, "Frames a second ", element("input", { type: "number", min: 1, max: 60, value: Math.round(state.speed), onchange: (e) => { state.speed = Math.max(1, Number(e.target.value) || 1); } }));
  const size = element("label", {}, "Size ", element("input", { type: "range", min: 0.2, max: 3, step: 0.05, value: 1, oninput: (e) => { viewer.radius = Number(e.target.value); } }));

  section("Particles", box,
    element("div", { class: "controls" }, play, slider, clock),
    element("div", { class: "controls" }, fieldBox, mapBox, element("span", {}, "from ", low, " to ", high),
      button("All frames", () => fit(state.values)), button("This frame", () => fit(here())),
      button("98 %", () => fit(state.values, 0.01), "The colours span all values but one per cent at both ends")),
    element("div", { class: "controls" }, speed, about.kind === "points" ? size : toggle("outlines", true, (on) => { viewer.outlines = on; }),
      toggle("box", true, (on) => { viewer.boxShown = on; }), button("View all", () => viewer.home()), button("Save picture", () => save())));

  const viewer = new Viewer(box, about, lookNow());
  redraws.push(() => { viewer.setLook(lookNow()); paintBar(); });
  await viewer.load();
  viewer.ondraw = () => drawRuler();

  const here = () => state.values.subarray(state.frame * about.count, (state.frame + 1) * about.count);

  async function pickField(choice) {
    state.choice = choice;
    fieldBox.querySelector("select").value = choice.label;
    const values = await valuesOf(choice, about.fields);
    if (state.choice !== choice) return;  // another was picked meanwhile
    state.values = values;
    fit(values);
  }
  function fit(values, share) {
    [state.low, state.high] = rangeOf(values, share);
    paint();
  }
  function typed() {
    const ends = [Number(low.value.replace(",", ".")), Number(high.value.replace(",", "."))];
    if (ends.every(Number.isFinite) && ends[0] < ends[1]) [state.low, state.high] = ends;
    paint();
  }
  function paint() {
    low.value = readable(state.low);
    high.value = readable(state.high);
    viewer.colour(state.values, state.low, state.high, state.choice.whole ? null : state.map);
    paintBar();
    showPicked();
  }
  function paintBar() {
    const { choice } = state;
    if (!choice) return;
    const title = element("div", { class: "title" }, choice.unit ? `${choice.label}, ${choice.unit}` : choice.label);
    if (choice.whole) {
      const names = (DATA.case[choice.name] ?? []).map((one, k) => one.name ?? `${choice.name} ${k}`);
      bar.replaceChildren(title, ...names.slice(0, 20).map((name, k) => element("div", { class: "kind" },
        element("span", { style: `background:#${KINDS[k % KINDS.length]}` }), name)));
      return;
    }
    const stops = MAPS[state.map].split(" ").map((hex) => `#${hex}`).join(", ");
    const ticks = [1, 0.75, 0.5, 0.25, 0].map((at) => element("span", {}, readable(state.low + at * (state.high - state.low), 3)));
    bar.replaceChildren(title, element("div", { class: "scale" }, element("div", { class: "ramp", style: `background:linear-gradient(to top, ${stops})` }),
      element("div", { class: "ticks" }, ...ticks)));
  }
  function go(frame) {
    state.frame = frame;
    slider.value = frame;
    clock.textContent = `${readable(about.times[frame], 5)} s`;
    viewer.show(frame);
    showPicked();
    timePlots.forEach((plot) => { plot.shownTime = about.times[frame]; plot.redraw(false, false); });
  }
  function setPlaying(is) {
    state.playing = is;
    play.textContent = is ? "Pause" : "Play";
    if (is) {
      if (state.frame === about.times.length - 1) go(0);
      state.last = performance.now();
      requestAnimationFrame(tick);
    }
  }
  function tick(now) {
    if (!state.playing) return;
    const due = Math.floor((now - state.last) * state.speed / 1000);
    if (due > 0) {
      state.last += due * 1000 / state.speed;
      go(Math.min(state.frame + due, about.times.length - 1));
      if (state.frame === about.times.length - 1) return setPlaying(false);
    }
    requestAnimationFrame(tick);
  }
  function drawRuler() {
    if (about.dim === 3) { ruler.hidden = true; return; }
    const metre = viewer.pixelsPerMetre();
    const most = 140 / metre, power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((m) => m * power).find((l) => l <= most) ?? power;
    ruler.style.width = `${(length * metre).toFixed(1)}px`;
    ruler.textContent = `${readable(length)} m`;
  }
  function showPicked() {
    tip.hidden = state.picked === undefined || state.picked === null;
    if (tip.hidden) return;
    const k = state.picked, x = viewer.at(k);
    const value = state.values[state.frame * about.count + k];
    const place = x ? ["x", "y", "z"].slice(0, about.dim).map((a) => `${a} ${readable(x[a])}`).join(", ") : "nowhere";
    tip.textContent = `particle ${about.ids ? about.ids[k] : k}: ${place} m; ${state.choice.label} ${value > MISSING ? readable(value) : "–"} ${state.choice.unit}`;
  }
  function save() {
    viewer.draw();
    const link = element("a", { href: viewer.canvas.toDataURL("image/png"), download: `${DATA.name}-${state.choice.name}-${state.frame}.png` });
    link.click();
  }
  let pressed = null;
  viewer.canvas.addEventListener("pointerdown", (e) => { pressed = [e.clientX, e.clientY]; });
  viewer.canvas.addEventListener("pointerup", (e) => {
    if (!pressed || Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) > 4) return;
    const edges = viewer.canvas.getBoundingClientRect();
    state.picked = viewer.pick(e.clientX - edges.left, e.clientY - edges.top);
    showPicked();
  });
  box.addEventListener("keydown", (e) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
    if (e.key === " ") setPlaying(!state.playing);
    else if (step) go(Math.min(Math.max(state.frame + step, 0), about.times.length - 1));
    else return;
    e.preventDefault();
  });
  const first = ["von_mises", "velocity", "stress_xx"].map((name) => state.fields.find((f) => f.name === name)).find(Boolean);
  await pickField(first ?? state.fields[0]);
  go(about.times.length - 1);
  return { viewer, state, go, setPlaying, pickField };
}

// ---- curves ----

const timePlots = [];

function plotOverTime(time, series, label) {
  let plot = null;
  const [box, redraw] = drawnBox((box) => {
    const shown = plot?.shownTime;
    if (plot) timePlots.splice(timePlots.indexOf(plot), 1);
    plot = timePlot(box, lookNow(), time, series, label);
    plot.shownTime = shown;
    timePlots.push(plot);
  });
  return [box, redraw];
}

/** A section of curves; drawn once its box has a width. */
function showCurves(title, tableData, groups, note) {
  const made = section(title);
  if (note) made.append(element("p", {}, note));
  for (const [label, series] of groups) {
    if (!series.length) continue;
    const [box, redraw] = plotOverTime(tableData.columns.time, series, label);
    made.append(box);
    redraw();
  }
  return made;
}

/** Columns by their unit, each group a plot. */
function groupsOf(tableData, names) {
  const byUnit = new Map();
  for (const name of names) {
    const stem = name.replace(/_[xyz]{1,2}$/, "");
    const key = `${stem.replace(/_/g, " ")}${tableData.units[name] ? `, ${tableData.units[name]}` : ""}`;
    if (!byUnit.has(key)) byUnit.set(key, []);
    byUnit.get(key).push({ label: name, values: tableData.columns[name] });
  }
  return [...byUnit];
}

const isMoving = (values) => values.some((v) => v !== null && Math.abs(v) > 0);

function showTables() {
  const { history, ...others } = DATA.tables;
  if (history?.energies) {
    const energies = history.energies.map(([label, values]) => ({ label, values }));
    showCurves("Energy", history, [[`energy, ${history.units.kinetic_energy}`, energies]],
      "Work is positive where it was taken from the bodies, so that the sum changes only by the error of the method. Drag over a plot to enlarge a part, double-click to see all.");
    const momenta = ["momentum_x", "momentum_y", "momentum_z"].filter((name) => isMoving(history.columns[name] ?? []));
    if (momenta.length) showCurves("Momentum", history, [[`momentum, ${history.units.momentum_x}`, momenta.map((name) => ({ label: name, values: history.columns[name] }))]]);
    showAnyColumn(history);
  }
  for (const tableData of Object.values(others)) {
    const names = Object.keys(tableData.columns).filter((name) => name !== "time");
    if (names.length && tableData.columns.time.length) showCurves(tableData.file.replace(/\.csv$/, "").replace("_", " "), tableData, groupsOf(tableData, names));
  }
}

/** Any column of history.csv, of the user's choice. */
function showAnyColumn(history) {
  const names = Object.keys(history.columns).filter((name) => name !== "time" && isMoving(history.columns[name]));
  if (!names.length) return;
  const made = section("Columns of history.csv");
  let chosen = names.find((name) => name.includes("_force_")) ?? names[0];
  const holder = element("div");
  const show = (name) => {
    chosen = name;
    const [box, redraw] = plotOverTime(history.columns.time, [{ label: chosen, values: history.columns[chosen] }],
      history.units[chosen] ? `${chosen}, ${history.units[chosen]}` : chosen);
    holder.replaceChildren(box);
    redraw();
  };
  const box = select(names, show, "Column");
  box.querySelector("select").value = chosen;
  made.append(box, holder);
  show(chosen);
}

// ---- ordo verify ----

const ERROR_UNITS = { displacement: ", m", velocity: ", m/s", stress: ", Pa", density: ", kg/m³" };

function showStudies() {
  const byCase = new Map();
  for (const study of DATA.studies) {
    const { ppc, ...others } = study.parameters;
    const key = JSON.stringify([study.case, others]);
    if (!byCase.has(key)) byCase.set(key, []);
    byCase.get(key).push(study);
  }
  for (const studies of byCase.values()) {
    const parameters = Object.entries(studies[0].parameters).filter(([name]) => name !== "ppc").map(([name, value]) => `${name} = ${typeof value === "number" ? readable(value) : value}`);
    const made = section(studies[0].case, element("p", {}, parameters.join(", ")));
    const label = (study) => (studies.filter((other) => other.method === study.method).length > 1 ? `${study.method}, ppc ${study.parameters.ppc}` : study.method);
    const names = [...new Set(studies.flatMap((study) => study.rows.flatMap((row) => Object.keys(row.error))))];
    const plots = element("div", { class: "plots" });
    for (const name of names) {
      const curves = studies.map((study) => ({ label: label(study), points: study.rows.filter((row) => row.error[name] > 0).map((row) => [row.h, row.error[name]]).sort((a, b) => a[0] - b[0]) })).filter((one) => one.points.length);
      if (!curves.length) continue;
      const best = Math.max(...studies.flatMap((study) => study.rows.map((row) => row.order?.[name] ?? 0)));
      const [box, redraw] = drawnBox((box) => convergencePlot(box, lookNow(), curves, `error of ${name}${ERROR_UNITS[name] ?? ""}`, best > 2.6 ? [2, 3, 4] : [1, 2]));
      plots.append(box);
      redraws.first = redraws.first ?? [];
      redraws.first.push(redraw);
    }
    made.append(plots);
    redraws.first?.forEach((redraw) => redraw());
    redraws.first = [];
    for (const study of studies) {
      const head = ["cells", "particles", "steps", ...names.flatMap((name) => [name, "order"])];
      const rows = study.rows.map((row) => [row.cells, row.particles, row.steps, ...(row.failed
        ? [element("td", { colspan: 2 * names.length, class: "bad" }, `failed: ${row.failed}`)]
        : names.flatMap((name) => [readable(row.error[name], 5), row.order?.[name] === undefined || row.order[name] === null ? "" : row.order[name].toFixed(2)]))]);
      made.append(element("h3", {}, label(study)), table(head, rows));
      if (study.bars.length) made.append(table(["limit", "", "measured", ""], study.bars.map((bar) => [bar.what, bar.limit ?? "", readable(bar.value),
        element("td", { class: bar.pass === false ? "bad" : bar.pass ? "good" : "" }, bar.pass === null ? "not run" : bar.pass ? "pass" : "FAIL")])));
    }
  }
}

// ---- all ----

async function showAll() {
  document.getElementById("look").addEventListener("click", () => setLook(lookName === "dark" ? "light" : "dark"));
  setLook(lookName);
  const notes = DATA.notes.length ? element("p", { class: "notes" }, DATA.notes.join(" ")) : null;
  document.getElementById("title").textContent = DATA.case?.title || DATA.name;
  let shown = null;
  if (notes) main.append(notes);
  if (DATA.particles) shown = await showParticles();
  if (DATA.case) {
    showTables();
    showCase();
  }
  if (DATA.studies) showStudies();
  document.getElementById("licences-shown").textContent = document.getElementById("licences").textContent;
  if (shown) shown.go(shown.state.frame);
  return shown;
}

/** Resolves when everything is drawn; with particles, to their controls. */
window.report = showAll();
window.report.catch((error) => { main.prepend(element("p", { class: "bad" }, `This page cannot be shown: ${error.message}`)); });
