"use strict";
// Curves over time and errors over cell size, by uPlot.

const STROKES = { light: ["#222222", "#d9730d", "#2a6fb0", "#3c8d40", "#8a5fb5", "#c23b4e", "#1b9e9e", "#a3761b", "#d05fa0", "#6b4fd0"],
                  dark: ["#e8e8e8", "#f0a05a", "#6fb1ea", "#7cc880", "#bb9ae0", "#ef7f8f", "#5fcfcf", "#d8ae5c", "#eba0cb", "#a391f0"] };

/** Axes in the colours of the look. */
function axis(look, label, options = {}) {
  const line = { stroke: look.grid, width: 1 };
  return { stroke: look.text, grid: line, ticks: line, label, labelSize: label ? 24 : 0, labelGap: 2, font: look.font, labelFont: look.font, ...options };
}

const tickText = (_, values) => values.map((v) => (v === null ? "" : readable(v, 6)));

/** Lines over time: series is [{label, values}]; onmove(t) as the mouse moves, cursor(t) draws a mark at a time. */
function timePlot(box, look, time, series, label) {
  const strokes = STROKES[look.name];
  const sum = series.findIndex((one) => one.label === "sum");
  const stroke = (k) => (k === sum ? strokes[0] : strokes[1 + (k % (strokes.length - 1))]);
  const plot = new library.uPlot({
    width: box.clientWidth, height: 300, cursor: { drag: { x: true, y: false } },
    scales: { x: { time: false } },
    axes: [axis(look, "time, s", { values: tickText }), axis(look, label, { size: 76, values: tickText })],
    series: [{ label: "time", value: (_, v) => readable(v) },
             ...series.map((one, k) => ({ label: one.label, stroke: stroke(k), width: 1.6, points: { show: false }, value: (_, v) => readable(v) }))],
    hooks: { draw: [(u) => markTime(u, look)] },
  }, [time, ...series.map((one) => one.values)], box);
  new ResizeObserver(() => plot.setSize({ width: box.clientWidth, height: 300 })).observe(box);
  return plot;
}

/** A line at the time of the frame that is shown. */
function markTime(u, look) {
  if (u.shownTime === undefined) return;
  const x = u.valToPos(u.shownTime, "x", true);
  if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
  u.ctx.save();
  u.ctx.strokeStyle = look.mark;
  u.ctx.lineWidth = 2;
  u.ctx.beginPath();
  u.ctx.moveTo(x, u.bbox.top);
  u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
  u.ctx.stroke();
  u.ctx.restore();
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
    width: box.clientWidth, height: 340,
    scales: { x: { time: false, distr: 3, range: () => [sizes[0] / 1.15, top * 1.15] },
              y: { distr: 3, range: () => [decade(Math.min(...all), Math.floor), decade(Math.max(...all), Math.ceil)] } },
    axes: [axis(look, "cell size h, m", { splits: () => sizes, values: (_, values) => values.map((v) => readable(v, 3)), filter: (_, values) => values }),
           axis(look, label, { size: 72, values: powers, grid: lines, ticks: lines })],
    series: [{ label: "h", value: (_, v) => readable(v) },
             ...curves.map((one, k) => ({ label: one.label, stroke: strokes[1 + (k % (strokes.length - 1))], width: 1.8, spanGaps: true,
                                          points: { show: true, size: 7 }, value: (_, v) => readable(v) })),
             ...guides.map((one) => ({ label: one.label, stroke: look.faint, dash: [5, 5], width: 1, points: { show: false }, value: (_, v) => readable(v) }))],
  }, [sizes, ...rows, ...guides.map((one) => one.values)], box);
  new ResizeObserver(() => plot.setSize({ width: box.clientWidth, height: 340 })).observe(box);
  return plot;
}
