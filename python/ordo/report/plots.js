"use strict";
// Curves over time and errors over cell size, by uPlot.

const STROKES = { light: ["#222222", "#d9730d", "#2a6fb0", "#3c8d40", "#8a5fb5", "#c23b4e", "#1b9e9e", "#a3761b", "#d05fa0", "#6b4fd0"],
                  dark: ["#e8e8e8", "#f0a05a", "#6fb1ea", "#7cc880", "#bb9ae0", "#ef7f8f", "#5fcfcf", "#d8ae5c", "#eba0cb", "#a391f0"] };

/** Axes in the colours of the look. */
function axis(look, label, options = {}) {
  const line = { stroke: look.grid, width: 1 };
  return { stroke: look.text, grid: line, ticks: line, label, labelSize: label ? 24 : 0, labelGap: 2, font: look.font, labelFont: look.font, ...options };
}

/** Of a plot in a box; uPlot never ends where there is no room for a tick. */
const widthOf = (box) => Math.max(box.clientWidth, 300);

const tickText = (_, values) => values.map((v) => (v === null ? "" : readable(v, 6)));

/** Lines over time: series is [{label, values}]. `plot.mark(t)` shows a time. */
function timePlot(box, look, time, series, label) {
  const strokes = STROKES[look.name];
  const sum = series.findIndex((one) => one.label === "sum");
  const stroke = (k) => (k === sum ? strokes[0] : strokes[1 + (k % (strokes.length - 1))]);
  const line = element("div", { class: "mark", hidden: true });
  const place = (u) => {
    const x = u.shownTime === undefined ? NaN : u.valToPos(u.shownTime, "x");
    line.hidden = !(x >= 0 && x <= u.over.clientWidth);
    line.style.transform = `translateX(${x}px)`;
  };
  const plot = new library.uPlot({
    width: widthOf(box), height: 300, cursor: { drag: { x: true, y: false } },
    scales: { x: { time: false } },
    axes: [axis(look, "time, s", { values: tickText }), axis(look, label, { size: 76, values: tickText })],
    series: [{ label: "time", value: (_, v) => readable(v, 6) },
             ...series.map((one, k) => ({ label: one.label, stroke: stroke(k), width: 1.6, points: { show: one.values.length === 1 }, value: (_, v) => readable(v, 6) }))],
    hooks: { ready: [(u) => u.over.append(line)], draw: [place] },
  }, [time, ...series.map((one) => one.values)], box);
  plot.mark = (t) => { plot.shownTime = t; place(plot); };
  return plot;
}

/** Errors over cell size, both logarithmic, with lines of some orders below: curves is [{label, points: [[h, error], ..]}]. */
function convergencePlot(box, look, curves, label, orders) {
  const sizes = [...new Set(curves.flatMap((one) => one.points.map(([h]) => h)))].sort((a, b) => a - b);
  const rows = curves.map((one) => sizes.map((h) => one.points.find((p) => p[0] === h)?.[1] ?? null));
  const top = sizes[sizes.length - 1];
  const lowest = Math.min(...curves.map((one) => one.points[one.points.length - 1][1]));  // on the coarsest meshes
  const guides = sizes.length > 1 ? orders.map((order) => ({ label: `order ${order}`, values: sizes.map((h) => 0.4 * lowest * (h / top) ** order) })) : [];
  const strokes = STROKES[look.name];
  const all = [...rows.flat(), ...guides.flatMap((one) => one.values)].filter((v) => v > 0);
  const decade = (v, round) => 10 ** round(Math.log10(v));
  const isPower = (v) => v !== null && Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6;
  const powers = (_, values) => values.map((v) => (isPower(v) ? readable(v) : ""));
  const lines = { stroke: look.grid, width: 1, filter: (_, values) => values.map((v) => (isPower(v) ? v : null)) };
  const plot = new library.uPlot({
    width: widthOf(box), height: 340,
    scales: { x: { time: false, distr: 3, range: () => [sizes[0] / 1.15, top * 1.15] },
              y: { distr: 3, range: () => [decade(Math.min(...all), Math.floor), decade(Math.max(...all), Math.ceil)] } },
    axes: [axis(look, "cell size h, m", { splits: () => sizes, values: (_, values) => values.map((v) => readable(v, 3)), filter: (_, values) => values }),
           axis(look, label, { size: 72, values: powers, grid: lines, ticks: lines })],
    series: [{ label: "h", value: (_, v) => readable(v) },
             ...curves.map((one, k) => ({ label: one.label, stroke: strokes[1 + (k % (strokes.length - 1))], width: 1.8, spanGaps: true,
                                          points: { show: true, size: 7 }, value: (_, v) => readable(v) })),
             ...guides.map((one) => ({ label: one.label, stroke: look.faint, dash: [5, 5], width: 1, points: { show: false }, value: (_, v) => readable(v) }))],
  }, [sizes, ...rows, ...guides.map((one) => one.values)], box);
  return plot;
}
