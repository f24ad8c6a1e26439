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
  return { name: lookName, text: of("--text"), grid: of("--grid"), faint: of("--faint"), line: of("--line"), page: of("--page"), font: "12px system-ui, sans-serif", up: upward() };
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

const seen = new IntersectionObserver((entries) => entries.forEach((entry) => entry.isIntersecting && entry.target.make()), { rootMargin: "300px" });
const resized = new ResizeObserver((entries) => entries.forEach(({ target }) => target.plot?.setSize({ width: widthOf(target), height: target.plot.height })));
const plots = new Set();  // boxes of plots that are drawn

/** A box for a plot, which is made when it comes into sight, and anew when the look changes. */
function plotBox(make) {
  const box = element("div", { class: "plot" });
  box.make = () => {
    if (box.plot) return;
    box.plot = make(box);
    box.plot.mark?.(shownTime);
    plots.add(box);
  };
  seen.observe(box);
  resized.observe(box);
  return box;
}

redraws.push(() => [...plots].forEach((box) => {
  box.plot.destroy();
  box.plot = null;
  plots.delete(box);
  if (box.isConnected) box.make();
}));

let shownTime;
function markTimes(time) {
  shownTime = time;
  plots.forEach((box) => box.plot.mark?.(time));
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
  const last = tables.history?.columns.time?.at(-1) ?? particles?.times.at(-1);
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

/** Values of a choice in all frames, above its `base`, so that small differences of large values stay; MISSING where there is none. */
async function valuesOf(choice, fields) {
  const parts = [];
  for (const k of choice.parts) parts.push([fields[k], await unpacked(`field ${k}`)]);
  const values = new Float32Array(parts[0][1].length);
  if (parts.length === 1) {
    const [{ low, step }, codes] = parts[0];
    choice.base = choice.whole ? 0 : low;
    for (let k = 0; k < values.length; ++k) {
      const above = step * (codes[k] - 1);
      values[k] = codes[k] === 0 ? MISSING : choice.whole ? Math.round(low + above) : above;
    }
    return values;
  }
  choice.base = 0;
  for (let k = 0; k < values.length; ++k) {
    let sum = 0;
    for (const [field, codes] of parts) sum += codes[k] === 0 ? NaN : (field.low + field.step * (codes[k] - 1)) ** 2;
    values[k] = Number.isNaN(sum) ? MISSING : Math.sqrt(sum);
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
  box.append(ruler, tip);
  const state = { frame: 0, playing: false, fields: choices(about.fields), map: "viridis", speed: Math.min(30, Math.max(5, about.times.length / 6)) };

  const slider = element("input", { type: "range", min: 0, max: about.times.length - 1, value: 0, id: "time", "aria-label": "time", oninput: (e) => go(Number(e.target.value)) });
  const play = element("button", { id: "play", onclick: () => setPlaying(!state.playing) }, "Play");
  const clock = element("output", { id: "clock" });
  const end = (name, what) => element("input", { type: "text", inputmode: "decimal", size: 11, id: name, "aria-label": what, onchange: (e) => typed(name, e.target) });
  const low = end("low", "lower end of the colours"), high = end("high", "upper end of the colours");
  const fieldBox = select(state.fields.map((f) => f.label), (label) => pickField(state.fields.find((f) => f.label === label)), "Colour");
  fieldBox.querySelector("select").id = "field";
  const mapBox = select(Object.keys(MAPS), (name) => { state.map = name; paint(); }, "Map");
  const button = (text, onclick, title) => element("button", { onclick, title }, text);
  const toggle = (text, on, onchange) => element("label", {}, element("input", { type: "checkbox", checked: on, onchange: (e) => onchange(e.target.checked) }), ` ${text}`);
  const speed = element("label", {}, "Frames a second ", element("input", { type: "number", min: 1, max: 60, value: Math.round(state.speed), onchange: (e) => { state.speed = Math.max(1, Number(e.target.value) || 1); } }));
  const size = element("label", {}, "Size ", element("input", { type: "range", min: 0.2, max: 3, step: 0.05, value: 1, oninput: (e) => { viewer.radius = Number(e.target.value); } }));

  section("Particles", element("div", { class: "stage" }, box, bar),
    element("div", { class: "controls" }, play, slider, clock),
    element("div", { class: "controls" }, fieldBox, mapBox, element("span", {}, "from ", low, " to ", high),
      button("All frames", () => fit(state.values)), button("This frame", () => fit(here())),
      button("98 %", () => fit(state.values, 0.01), "The colours span all values but one per cent at both ends")),
    element("div", { class: "controls" }, speed, about.kind === "points" ? size : toggle("outlines", true, (on) => { viewer.outlines = on; }),
      toggle("box", true, (on) => { viewer.boxShown = on; }),
      about.obstacles.length ? toggle("obstacles", true, (on) => { viewer.obstaclesShown = on; }) : null, button("View all", () => viewer.home()), button("Save picture", () => save())));

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
    [state.low, state.high] = rangeOf(values, share).map((v) => v + state.choice.base);
    paint();
  }
  /** Takes a number that was typed; what is none, or on the wrong side of the other end, stays marked. */
  function typed(name, input) {
    const value = input.value.trim() === "" ? NaN : Number(input.value.replace(",", "."));
    const ends = { low: state.low, high: state.high, [name]: value };
    const isGood = Number.isFinite(value) && ends.low < ends.high;
    input.classList.toggle("bad", !isGood);
    if (!isGood) return;
    state[name] = value;
    paint();
  }
  const digits = () => digitsOf(state.low, state.high);
  function paint() {
    for (const [input, value] of [[low, state.low], [high, state.high]]) {
      input.classList.remove("bad");
      input.value = readable(value, digits() + 2);
    }
    const { base } = state.choice;
    viewer.colour(state.values, state.low - base, state.high - base, state.choice.whole ? null : state.map);
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
    const ticks = [1, 0.75, 0.5, 0.25, 0].map((at) => element("span", {}, readable(state.low + at * (state.high - state.low), digits())));
    bar.replaceChildren(title, element("div", { class: "scale" }, element("div", { class: "ramp", style: `background:linear-gradient(to top, ${stops})` }),
      element("div", { class: "ticks" }, ...ticks)));
  }
  function go(frame) {
    state.frame = frame;
    slider.value = frame;
    clock.textContent = `${readable(about.times[frame], digitsOf(0, about.times.at(-1), 5))} s`;
    viewer.show(frame);
    showPicked();
    markTimes(about.times[frame]);
  }
  function setPlaying(is) {
    state.playing = is;
    play.textContent = is ? "Pause" : "Play";
    if (is) {
      if (state.frame === about.times.length - 1) go(0);
      state.last = performance.now();
      cancelAnimationFrame(state.next);
      state.next = requestAnimationFrame(tick);
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
    state.next = requestAnimationFrame(tick);
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
    const place = x ? ["x", "y", "z"].slice(0, about.dim).map((a) => `${a} ${readable(x[a], digitsOf(viewer.low[a], viewer.high[a], 5))}`).join(", ") : "nowhere";
    const shown = value > MISSING ? readable(value + state.choice.base, digits() + 2) : "–";
    tip.textContent = `particle ${about.ids ? about.ids[k] : k}: ${place} m; ${state.choice.label} ${shown} ${state.choice.unit}`;
  }
  /** A picture of the view with the colour bar and the time. */
  function save() {
    viewer.draw();
    const ratio = viewer.canvas.width / viewer.canvas.clientWidth, wide = 170;
    const canvas = element("canvas", { width: viewer.canvas.width + wide * ratio, height: viewer.canvas.height });
    const look = lookNow(), pen = canvas.getContext("2d");
    pen.fillStyle = look.page;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(viewer.canvas, 0, 0);
    pen.scale(ratio, ratio);
    pen.translate(viewer.canvas.clientWidth + 10, 24);
    pen.fillStyle = look.text;
    pen.font = look.font;
    pen.fillText(bar.querySelector(".title").textContent, 0, 0, wide - 14);
    if (state.choice.whole) {
      bar.querySelectorAll(".kind").forEach((kind, k) => {
        pen.fillStyle = kind.firstChild.style.backgroundColor;
        pen.fillRect(0, 14 + 18 * k, 12, 12);
        pen.fillStyle = look.text;
        pen.fillText(kind.textContent, 18, 24 + 18 * k, wide - 34);
      });
    } else {
      const ramp = pen.createLinearGradient(0, 194, 0, 14);
      MAPS[state.map].split(" ").forEach((hex, k, all) => ramp.addColorStop(k / (all.length - 1), `#${hex}`));
      pen.fillStyle = ramp;
      pen.fillRect(0, 14, 16, 180);
      pen.fillStyle = look.text;
      bar.querySelectorAll(".ticks span").forEach((tick, k) => pen.fillText(tick.textContent, 22, 18 + 45 * k));
    }
    pen.fillText(`t = ${clock.textContent}`, 0, 224);
    const link = element("a", { href: canvas.toDataURL("image/png"), download: `${DATA.name}-${state.choice.name}-${about.times[state.frame]}s.png` });
    link.click();
    return canvas;
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
  return { viewer, state, go, setPlaying, pickField, save };
}

// ---- curves ----

function plotOverTime(time, series, label) {
  return plotBox((box) => timePlot(box, lookNow(), time, series, label));
}

/** Plots of some curves. */
function curvesOf(tableData, groups) {
  return groups.filter(([, series]) => series.length).map(([label, series]) => plotOverTime(tableData.columns.time, series, label));
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
    section("Energy", element("p", {}, "Work is positive where it was taken from the bodies, so that the sum changes only by the error of the method. Drag over a plot to enlarge a part, double-click to see all."),
      ...curvesOf(history, [[`energy, ${history.units.kinetic_energy}`, energies]]));
    const momenta = ["momentum_x", "momentum_y", "momentum_z"].filter((name) => isMoving(history.columns[name] ?? []));
    if (momenta.length) section("Momentum", ...curvesOf(history, [[`momentum, ${history.units.momentum_x}`, momenta.map((name) => ({ label: name, values: history.columns[name] }))]]));
    showAnyColumn(history);
  }
  for (const tableData of Object.values(others)) {
    const names = Object.keys(tableData.columns).filter((name) => name !== "time");
    if (!names.length || !tableData.columns.time.length) continue;
    const title = tableData.file.replace(/\.csv$/, "").replace("_", " ");
    const curves = curvesOf(tableData, groupsOf(tableData, names));
    if (title.startsWith("probe")) section(title, ...curves);
    else main.append(element("details", { class: "card" }, element("summary", {}, title), ...curves));
  }
}

/** Any column of history.csv, of the user's choice. */
function showAnyColumn(history) {
  const names = Object.keys(history.columns).filter((name) => name !== "time" && isMoving(history.columns[name]));
  if (!names.length) return;
  const made = section("Columns of history.csv");
  const first = names.find((name) => name.includes("_force_")) ?? names[0];
  const holder = element("div");
  const show = (name) => {
    plots.delete(holder.firstChild);
    holder.firstChild?.plot?.destroy();
    holder.replaceChildren(plotOverTime(history.columns.time, [{ label: name, values: history.columns[name] }],
      history.units[name] ? `${name}, ${history.units[name]}` : name));
  };
  const box = select(names, show, "Column");
  box.querySelector("select").value = first;
  made.append(box, holder);
  show(first);
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
    const errors = element("div", { class: "plots" });
    const isRelative = studies[0].case.startsWith("contact-");
    for (const name of names) {
      const curves = studies.map((study) => ({ label: label(study), points: study.rows.filter((row) => row.error[name] > 0).map((row) => [row.h, row.error[name]]).sort((a, b) => a[0] - b[0]) })).filter((one) => one.points.length);
      if (!curves.length) continue;
      const best = Math.max(...studies.flatMap((study) => study.rows.map((row) => row.order?.[name] ?? 0)));
      const title = isRelative ? `relative error of ${name}` : `error of ${name}${ERROR_UNITS[name] ?? ""}`;
      errors.append(plotBox((box) => convergencePlot(box, lookNow(), curves, title, best > 2.6 ? [2, 3, 4] : [1, 2])));
    }
    made.append(errors);
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
  let shown = null, broken = null;
  if (notes) main.append(notes);
  if (DATA.particles) {
    try {
      shown = await showParticles();
    } catch (error) {
      main.append(element("p", { class: "bad" }, `The particles cannot be shown: ${error.message}. They need a browser with WebGL 2.`));
      broken = error;
    }
  }
  if (DATA.case) {
    showTables();
    showCase();
  }
  if (DATA.studies) showStudies();
  document.getElementById("licences-shown").textContent = document.getElementById("licences").textContent;
  if (broken) throw broken;
  return shown;
}

/** Resolves when everything is drawn; with particles, to their controls. */
window.report = showAll();
window.report.catch((error) => { main.prepend(element("p", { class: "bad" }, `Not all of this page can be shown: ${error.message}`)); });
