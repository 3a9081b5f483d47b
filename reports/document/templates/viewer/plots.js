// Line plots and histograms as SVG, in the look of the report's own figures.

const kPlot = { height: 260, left: 66, right: 14, top: 12, bottom: 46 };

const niceTicks = (low, high, most) => {
  const raw = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= raw * 0.999);
  const ticks = [];
  for (let t = Math.ceil(low / step - 1e-9) * step; t <= high + step * 1e-6; t += step)
    ticks.push(Math.abs(t) < step * 1e-6 ? 0 : t);
  return ticks;
};

// Ticks share a power of ten, which goes into the axis title.
const tickPower = (ticks) => {
  const largest = Math.max(...ticks.map(Math.abs));
  const exponent = largest > 0 ? Math.floor(Math.log10(largest)) : 0;
  return exponent < -2 || exponent > 4 ? exponent : 0;
};
const tickText = (tick, ticks, power) => {
  const step = Math.abs(ticks[1] - ticks[0] || ticks[0] || 1) / 10 ** power;
  return (tick / 10 ** power).toFixed(Math.max(0, Math.min(8, -Math.floor(Math.log10(step) + 1e-9))));
};

// A plot's frame: { node, x(v), y(v) }; series are appended to `node`.
const plotFrame = (label, width, x, y, xTitle, yTitle) => {
  const { height, left, right, top, bottom } = kPlot;
  const spread = ([low, high]) => (high > low ? [low, high] : [low - Math.abs(low || 1) / 2, high + Math.abs(high || 1) / 2]);
  const [x0, x1] = spread(x), [y0, y1] = spread(y);
  const toX = (v) => left + ((v - x0) / (x1 - x0)) * (width - left - right);
  const toY = (v) => height - bottom - ((v - y0) / (y1 - y0)) * (height - top - bottom);
  const node = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label, fill: "currentColor", "font-size": 12 });
  const line = (d, opacity) => node.append(svg("path", { d, fill: "none", stroke: "currentColor", "stroke-opacity": opacity }));
  const xTicks = niceTicks(x0, x1, 6), yTicks = niceTicks(y0, y1, 4);
  const xPower = tickPower(xTicks), yPower = tickPower(yTicks);
  for (const t of yTicks) {
    line(`M${left} ${toY(t)}H${width - right}`, t === 0 ? 0.45 : 0.15);
    node.append(svg("text", { x: left - 6, y: toY(t) + 4, "text-anchor": "end" }, tickText(t, yTicks, yPower)));
  }
  for (const t of xTicks) {
    line(`M${toX(t)} ${height - bottom}v4`, 0.6);
    node.append(svg("text", { x: toX(t), y: height - bottom + 17, "text-anchor": "middle" }, tickText(t, xTicks, xPower)));
  }
  line(`M${left} ${height - bottom}H${width - right}`, 0.6);
  const title = (text, power) => (power ? `${text} × 10${superscript(-power)}` : text);
  node.append(
    svg("text", { x: (left + width - right) / 2, y: height - 8, "text-anchor": "middle" }, title(xTitle, xPower)),
    svg("text", { x: 0, y: 0, transform: `translate(10 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, title(yTitle, yPower)));
  return { node, x: toX, y: toY };
};

// User units as wide as the box in px, so that text keeps its size.
const plotWidth = (box) => Math.min(640, Math.max(280, box.clientWidth || 400));

const rangeOf = (values, withZero) => {
  let low = withZero ? 0 : Infinity, high = withZero ? 0 : -Infinity;
  for (const v of values) {
    if (!Number.isFinite(v)) continue;
    low = Math.min(low, v);
    high = Math.max(high, v);
  }
  return low <= high ? [low, high] : [0, 1];
};

// series: [{ name, y, u, colour, dashed, markers }] over common x.
const linePlot = (label, width, x, series, xTitle, yTitle) => {
  const all = series.flatMap((s) => [...s.y].concat(s.u ? [...s.y].map((v, i) => v + s.u[i]) : []));
  const [low, high] = rangeOf(all, true);
  const frame = plotFrame(label, width, rangeOf(x), [low, high + 0.08 * (high - low)], xTitle, yTitle);
  for (const s of series) {
    if (s.u) {
      const points = [...s.y].map((v, i) => [x[i], v, s.u[i]]).filter((p) => p.every(Number.isFinite));
      const edge = points.map(([a, v, u]) => `${frame.x(a)},${frame.y(v + u)}`)
        .concat(points.reverse().map(([a, v, u]) => `${frame.x(a)},${frame.y(Math.max(low, v - u))}`));
      frame.node.append(svg("polygon", { points: edge.join(" "), fill: s.colour, "fill-opacity": 0.22 }));
    }
    let d = "";
    let drawing = false;
    for (let i = 0; i < x.length; i++) {
      if (Number.isFinite(s.y[i])) d += `${drawing ? "L" : "M"}${frame.x(x[i]).toFixed(2)} ${frame.y(s.y[i]).toFixed(2)}`;
      drawing = Number.isFinite(s.y[i]);
    }
    frame.node.append(svg("path", { d, fill: "none", stroke: s.colour, "stroke-width": 1.8, "stroke-dasharray": s.dashed ? "6 4" : null, "stroke-linejoin": "round" }));
    if (s.markers)
      for (let i = 0; i < x.length; i++)
        if (Number.isFinite(s.y[i])) frame.node.append(svg("circle", { cx: frame.x(x[i]), cy: frame.y(s.y[i]), r: 2.8, fill: s.colour }));
  }
  return frame.node;
};

// A legend in HTML below a plot: a line sample and a name for each series.
const legend = (series) => html("p", { class: "legend" }, ...series.map((s) => html("span", {},
  svg("svg", { viewBox: "0 0 24 10", "aria-hidden": "true" },
    svg("path", { d: "M1 5H23", stroke: s.colour, "stroke-width": 2.4, "stroke-dasharray": s.dashed ? "6 4" : null })), s.name)));

// Counts in bins from -limit to limit, the outermost with the tails; `normal`: N(0, 1) to compare.
const histogram = (label, boxWidth, values, limit, normal, xTitle) => {
  const bins = 40, counts = new Float64Array(bins), width = (2 * limit) / bins;
  let total = 0;
  for (const v of values) {
    if (Number.isNaN(v)) continue;
    counts[Math.min(bins - 1, Math.max(0, Math.floor((v + limit) / width)))]++;
    total++;
  }
  const density = (z) => Math.exp(-z * z / 2) / Math.sqrt(2 * Math.PI);
  const expected = Array.from({ length: 121 }, (_, i) => -limit + (i * limit) / 60)
    .map((z) => [z, total * width * density(z)]);
  const top = Math.max(1, ...counts, ...(normal ? expected.map((p) => p[1]) : []));
  const frame = plotFrame(label, boxWidth, [-limit, limit], [0, 1.06 * top], xTitle, "pixels");
  counts.forEach((count, i) => {
    if (!count) return;
    const x = frame.x(-limit + i * width), right = frame.x(-limit + (i + 1) * width);
    frame.node.append(svg("rect", { x, y: frame.y(count), width: right - x - 0.8, height: frame.y(0) - frame.y(count), fill: "var(--series-0)", "fill-opacity": 0.75 }));
  });
  if (normal)
    frame.node.append(svg("polyline", { points: expected.map(([z, n]) => `${frame.x(z)},${frame.y(n)}`).join(" "), fill: "none", stroke: "var(--series-1)", "stroke-width": 2 }));
  return frame.node;
};
