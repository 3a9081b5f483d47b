// The viewer of one pair of images. It takes the place of the still pictures on a screen; without
// this script, and on paper, those stay.

const makeViewer = (figure, set, data, id) => {
  const maps = colourMaps(), size = { width: set.width_px, height: set.height_px };
  const pixels = size.width * size.height, unit = unitText(set.unit), bandCount = set.bands.length;
  const names = { test: set.test_name, reference: set.reference_name, difference: `${set.test_name} − ${set.reference_name}` };
  const isColour = set.bands.some((b) => b.linear_rgb.some((w) => w !== 0));
  const isSpectral = set.bands.every((b) => b.wavelength_nm > 0);
  const hasSigma = set.test_uncertainty === "standard" || set.reference_uncertainty === "standard";
  const bandName = (b) => (isSpectral ? `${Number(set.bands[b].wavelength_nm.toFixed(1))} nm` : set.bands[b].name);
  const scales = [{ key: "absolute", name: "Absolute", unit }, { key: "relative", name: "Relative", unit: "%" }]
    .concat(hasSigma ? [{ key: "sigma", name: "In sigmas", unit: "" }] : []);
  const view = {
    view: "wipe", swap: "test", show: isColour ? "colour" : "false", scale: hasSigma ? "sigma" : "absolute",
    band: Math.floor(bandCount / 2), ev: 0, spread: 0, wipe: 0.5, tool: "look", mark: false, spectrum: "pixel",
    pixel: { x: Math.floor(size.width / 2), y: Math.floor(size.height / 2) }, hovered: null, drawn: false,
    line: { x0: Math.floor(0.1 * size.width), y0: Math.floor(size.height / 2), x1: Math.floor(0.9 * size.width), y1: Math.floor(size.height / 2) },
  };

  // Planes that are worked out once and kept.
  const kept = new Map();
  const keep = (key, make) => {
    if (!kept.has(key)) kept.set(key, make());
    return kept.get(key);
  };
  const linearRgb = (side) => keep(`rgb ${side}`, () => [0, 1, 2].map((c) => {
    const plane = new Float32Array(pixels);
    set.bands.forEach((band, b) => {
      const w = band.linear_rgb[c], values = data.bands[b][side];
      if (w !== 0) for (let i = 0; i < pixels; i++) plane[i] += w * values[i];
    });
    return plane;
  }));
  const baseGain = () => (view.show === "colour" && isColour ? set.exposure
    : keep(`white ${view.band}`, () => 1 / quantile(data.bands[view.band].reference, 0.99)));
  const gain = () => baseGain() * 2 ** view.ev;
  const sigmaAt = (b, i) => {
    const { testU, referenceU } = data.bands[b];
    return Math.hypot(set.test_uncertainty === "standard" ? testU[i] : 0, set.reference_uncertainty === "standard" ? referenceU[i] : 0);
  };
  const differenceAt = (scale, b, i) => {
    const d = data.bands[b].test[i] - data.bands[b].reference[i];
    if (scale === "absolute" || d === 0) return d;
    return scale === "relative" ? (100 * d) / Math.abs(data.bands[b].reference[i]) : d / sigmaAt(b, i);
  };
  const difference = () => keep(`difference ${view.scale} ${view.band}`, () =>
    Float32Array.from({ length: pixels }, (_, i) => differenceAt(view.scale, view.band, i)));
  const limit = () => 2 ** view.spread * keep(`limit ${view.scale} ${view.band}`, () =>
    (view.scale === "sigma" ? 4 : quantile(difference().map(Math.abs), 0.99)));

  // Where surfaces are known, the pixels that show one: the rest is nothing's difference.
  const isShown = (i) => !data.surfaceOf || data.surfaceOf[i] > 0;
  const largestAt = () => {
    const d = difference();
    let best = -1;
    for (let i = 0; i < pixels; i++)
      if (isShown(i) && Number.isFinite(d[i]) && (best < 0 || Math.abs(d[i]) > Math.abs(d[best]))) best = i;
    return best < 0 ? view.pixel : { x: best % size.width, y: Math.floor(best / size.width) };
  };
  view.pixel = largestAt();

  // Pictures, painted again only where something they show has changed.
  const canvases = {}, painted = {}, counts = {};
  const picture = (name) => {
    const key = name === "difference" ? [view.scale, view.band, limit()]
      : [view.show, view.show === "colour" ? "" : view.band, gain(), view.mark];
    if (painted[name] === String(key)) return canvases[name];
    painted[name] = String(key);
    canvases[name] ||= html("canvas", size);
    const context = canvases[name].getContext("2d"), image = context.createImageData(size.width, size.height);
    if (name === "difference") counts[name] = paintMap(image.data, difference(), maps.diverging, -limit(), limit());
    else if (view.show === "false") counts[name] = paintMap(image.data, data.bands[view.band][name], maps.sequential, 0, 1 / gain());
    else {
      const grey = data.bands[view.band][name];
      counts[name] = paintDisplay(image.data, view.show === "colour" ? linearRgb(name) : [grey, grey, grey], gain(), view.mark);
    }
    context.putImageData(image, 0, 0);
    return canvases[name];
  };

  // Controls.
  let waiting = false;
  const changed = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      update();
    });
  };
  const set_ = (key) => (value) => {
    view[key] = value;
    changed();
  };
  const choice = (label, key, options) => {
    const group = `${id}-${key}`;
    return html("fieldset", { class: "choice" }, html("legend", {}, label), ...options.map(([value, text]) => {
      const input = html("input", { type: "radio", name: group, value, id: `${group}-${value}`, change: () => set_(key)(value) });
      input.checked = view[key] === value;
      return html("span", {}, input, html("label", { for: input.id }, text));
    }));
  };
  const slider = (label, key, from, to, step, describe) => {
    const input = html("input", { type: "range", min: from, max: to, step, value: view[key], id: `${id}-${key}`, input: () => set_(key)(Number(input.value)) });
    const output = html("output", { for: input.id });
    const node = html("div", { class: "slider" }, html("label", { for: input.id }, label), output, input);
    return { node, update: () => {
      input.value = view[key];
      output.textContent = describe();
      input.setAttribute("aria-valuetext", describe());
    } };
  };
  const button = (text, label, click) => html("button", { type: "button", "aria-label": label, title: label, click }, text);

  const swapTo = (name) => {
    view.swap = name;
    changed();
    say(`Showing ${names[name]}`);
  };
  const viewChoice = choice("View", "view", [["wipe", "Wipe"], ["swap", "Swap"], ["side", "Side by side"], ["difference", "Difference"]]);
  const showChoice = choice("Show", "show", (isColour ? [["colour", "Colour"]] : []).concat([["grey", "Grey"], ["false", "False colour"]]));
  const scaleChoice = choice("Scale", "scale", scales.map((s) => [s.key, s.name]));
  const toolChoice = choice("Drag", "tool", [["look", "Pan"], ["profile", "Draw profile"]]);
  const bandSlider = slider("Band", "band", 0, bandCount - 1, 1, () => bandName(view.band));
  bandSlider.node.hidden = bandCount < 2;
  const evSlider = slider("Exposure", "ev", -10, 10, 0.1, () => `${view.ev < 0 ? "−" : "+"}${Math.abs(view.ev).toFixed(1)} EV`);
  const spreadSlider = slider("Scale ends at", "spread", -8, 8, 0.25, () => `±${withUnit(numberText(limit(), 3), scales.find((s) => s.key === view.scale).unit)}`);
  const wipeSlider = slider("Wipe", "wipe", 0, 1, 0.01, () => `${Math.round(100 * view.wipe)} %`);
  const swapButton = button("", "Swap the two images", () => swapTo(view.swap === "test" ? "reference" : "test"));
  swapButton.classList.add("swap");
  swapButton.removeAttribute("aria-label");  // its name is its text, which says what is shown
  const zoomOutput = html("output", {});
  const markBox = html("input", { type: "checkbox", id: `${id}-mark`, change: () => set_("mark")(markBox.checked) });
  const markLabel = html("span", { class: "check" }, markBox, html("label", { for: markBox.id }, "Mark clipped"));

  // What was picked.
  const live = html("p", { class: "visually-hidden", "aria-live": "polite" });
  const say = (text) => { live.textContent = text; };
  const shownPixel = () => view.hovered || view.pixel;
  const surfaceAt = (i) => (data.surfaceOf && data.surfaceOf[i] ? set.surfaces[data.surfaceOf[i] - 1] : "");
  const plusMinus = (kind, plane, i) => (kind === "none" ? 0 : plane[i]);
  const readout = ({ x, y }) => {
    const i = y * size.width + x, b = view.band, band = data.bands[b];
    const value = (side, kind, plane) => {
      const u = plusMinus(kind, plane, i);
      return estimateText(band[side][i], u);
    };
    const rows = [
      ["test", names.test, value("test", set.test_uncertainty, band.testU), set.test_uncertainty],
      ["reference", names.reference, value("reference", set.reference_uncertainty, band.referenceU), set.reference_uncertainty],
      ["difference", "Difference", numberText(differenceAt("absolute", b, i)), ""],
      ["relative", "Relative", `${numberText(differenceAt("relative", b, i), 3)} %`, ""]];
    if (hasSigma) rows.push(["sigma", "In sigmas", numberText(differenceAt("sigma", b, i), 3), ""]);
    const where = [`(${x * set.stride}, ${y * set.stride})`, surfaceAt(i), bandName(b)].filter(Boolean).join(", ");
    return { where, rows };
  };
  const pick = (x, y) => {
    view.pixel = { x, y };
    view.hovered = null;
    const { where, rows } = readout(view.pixel);
    say(`Pixel ${where}. ${rows.map(([key, name, text]) => `${name} ${withUnit(text, ["relative", "sigma"].includes(key) ? "" : unit)}`).join("; ")}`);
    changed();
  };

  const inspector = html("table", { class: "inspector" }), spectrum = html("div", {}), profile = html("div", {}), counted = html("div", {});
  const kindText = { standard: "±: standard uncertainty (k = 1)", bound: "±: error bound" };
  const updateInspector = () => {
    const { where, rows } = readout(shownPixel());
    inspector.replaceChildren(html("caption", {}, html("span", {}, "Pixel "), html("strong", { "data-value": "where" }, where), html("small", { "data-value": "unit" }, withUnit(set.quantity, unit && `in ${unit}`))),
      html("tbody", {}, ...rows.map(([key, name, text, kind]) => html("tr", {}, html("th", { scope: "row" }, name, ...(kindText[kind] ? [html("small", {}, kindText[kind])] : [])), html("td", { "data-value": key }, text)))));
  };
  const sides = [["test", "testU", "var(--series-1)", false], ["reference", "referenceU", "var(--series-0)", true]];
  const hasU = (side) => set[`${side}_uncertainty`] !== "none";
  const surfaceMean = (surface) => keep(`surface ${surface}`, () => Object.fromEntries(sides.map(([side]) => [side, data.bands.map((band) => {
    let sum = 0, count = 0;
    for (let i = 0; i < pixels; i++)
      if (data.surfaceOf[i] === surface && Number.isFinite(band[side][i])) {
        sum += band[side][i];
        count++;
      }
    return sum / count;
  })])));
  const updateSpectrum = () => {
    const { x, y } = shownPixel(), i = y * size.width + x, surface = data.surfaceOf ? data.surfaceOf[i] : 0;
    const ofSurface = view.spectrum === "surface" && surface > 0;
    const series = sides.map(([side, u, colour, dashed]) => ({
      name: names[side], colour, dashed, markers: bandCount < 40,
      y: ofSurface ? surfaceMean(surface)[side] : data.bands.map((band) => band[side][i]),
      u: !ofSurface && hasU(side) ? data.bands.map((band) => band[u][i]) : null }));
    const what = ofSurface ? `mean over ${surfaceAt(i)}` : `pixel (${x * set.stride}, ${y * set.stride})`;
    const at = set.bands.map((b, k) => (isSpectral ? b.wavelength_nm : k + 1));
    const title = `${isSpectral ? "Spectrum" : "Channels"}: ${what}`;
    spectrum.replaceChildren(html("p", { class: "figure-title" }, title), linePlot(title, plotWidth(spectrum), at, series, isSpectral ? "wavelength / nm" : "channel", withUnit(set.quantity, unit && `/ ${unit}`)), legend(series));
  };
  const updateProfile = () => {
    const { x0, y0, x1, y1 } = view.line, steps = Math.max(1, Math.round(Math.hypot(x1 - x0, y1 - y0)));
    const at = Array.from({ length: steps + 1 }, (_, k) => k);
    const index = at.map((k) => Math.round(y0 + ((y1 - y0) * k) / steps) * size.width + Math.round(x0 + ((x1 - x0) * k) / steps));
    const band = data.bands[view.band];
    const series = sides.map(([side, u, colour, dashed]) => ({ name: names[side], colour, dashed, y: index.map((i) => band[side][i]), u: hasU(side) ? index.map((i) => band[u][i]) : null }));
    const title = `Profile from (${x0 * set.stride}, ${y0 * set.stride}) to (${x1 * set.stride}, ${y1 * set.stride}), ${bandName(view.band)}`;
    profile.replaceChildren(html("p", { class: "figure-title" }, title), linePlot(title, plotWidth(profile), at.map((k) => k * set.stride), series.reverse(), "distance along the line / px", withUnit(set.quantity, unit && `/ ${unit}`)), legend(series));
  };
  const updateHistogram = () => {
    const scale = scales.find((s) => s.key === view.scale), normal = view.scale === "sigma";
    const title = `Histogram of the difference, ${scale.name.toLowerCase()}, ${bandName(view.band)}`;
    const shown = data.surfaceOf ? difference().filter((_, i) => isShown(i)) : difference();
    const series = [{ name: `${shown.length} pixels${data.surfaceOf ? " on surfaces" : ""}; the outermost bins hold the tails`, colour: "var(--series-0)" }]
      .concat(normal ? [{ name: "expected from N(0, 1)", colour: "var(--series-1)" }] : []);
    counted.replaceChildren(html("p", { class: "figure-title" }, title), histogram(title, plotWidth(counted), shown, limit(), normal, withUnit(normal ? "difference / sigma" : "difference", scale.unit && `/ ${scale.unit}`)), legend(series));
  };

  // The bar below the stage: what its colours stand for, and what they cannot show.
  const bar = html("div", { class: "bar" });
  const updateBar = () => {
    const off = view.view === "difference", shown = off ? ["difference"] : view.view === "swap" ? [view.swap] : ["test", "reference"];
    const share = (n) => `${numberText((100 * n) / pixels, 2)} %`;
    const notes = [];
    for (const name of shown) {
      const c = counts[name] || {}, parts = [];
      for (const [key, text] of [["clipped", "brighter than white"], ["gamut", "out of gamut"], ["above", "above the bar"], ["below", "below it"], ["notFinite", "not finite (magenta)"]])
        if (c[key]) parts.push(`${share(c[key])} ${text}`);
      if (parts.length) notes.push(`${names[name]}: ${parts.join(", ")}.`);
    }
    const isDisplay = !off && view.show !== "false";
    const scale = scales.find((s) => s.key === view.scale), end = off ? limit() : 1 / gain(), from = off ? -end : 0;
    const legendText = isDisplay
      ? `Shown: ${numberText(gain(), 3)} × ${view.show === "colour" ? "linear BT.709" : `${set.quantity} at ${bandName(view.band)}`}, sRGB, no tone curve, the same for both images.`
      : off ? `${names.difference}, ${bandName(view.band)}${view.scale === "sigma" ? ", in standard uncertainties" : ""}` : `${set.quantity}, ${bandName(view.band)}`;
    bar.replaceChildren();
    if (!isDisplay) {
      const strip = html("canvas", { width: 256, height: 1, class: "strip", "aria-hidden": "true" }), context = strip.getContext("2d");
      const image = context.createImageData(256, 1);
      paintMap(image.data, Float32Array.from({ length: 256 }, (_, i) => i / 255), off ? maps.diverging : maps.sequential, 0, 1);
      context.putImageData(image, 0, 0);
      const labels = [from, (from + end) / 2, end].map((v) => html("span", {}, numberText(v, 3)));
      bar.append(html("div", { class: "strip-box" }, strip, html("div", { class: "strip-labels" }, ...labels)));
    }
    const u = off ? scale.unit : unit;
    bar.append(html("p", { class: "note" }, isDisplay ? legendText : withUnit(legendText, u && `/ ${u}`)), ...(notes.length ? [html("p", { class: "note" }, notes.join(" "))] : []));
  };

  const clampTo = (v, extent) => Math.min(extent - 1, Math.max(0, Math.round(v)));
  const stage = makeStage(size, view, {
    id, label: `${names.test} and ${names.reference}, ${set.quantity}`, picture, nameOf: (name) => names[name], changed, pick,
    hover: (x, y) => { view.hovered = { x, y }; changed(); },
    leave: () => { view.hovered = null; changed(); },
    swap: () => swapTo(view.swap === "test" ? "reference" : "test"),
    line: (a, b) => { view.drawn = true; view.line = { x0: clampTo(a.x - 0.5, size.width), y0: clampTo(a.y - 0.5, size.height), x1: clampTo(b.x - 0.5, size.width), y1: clampTo(b.y - 0.5, size.height) }; },
  });
  const lineInputs = ["x0", "y0", "x1", "y1"].map((key, k) => {
    const extent = k % 2 ? size.height : size.width;
    const input = html("input", { type: "number", min: 0, max: (extent - 1) * set.stride, step: set.stride, "aria-label": `Profile ${k < 2 ? "from" : "to"} ${key[0]}, px`,
      change: () => { view.drawn = true; view.line = { ...view.line, [key]: clampTo(Number(input.value) / set.stride, extent) }; changed(); } });
    return { input, update: () => { if (document.activeElement !== input) input.value = view.line[key] * set.stride; } };
  });
  const spectrumChoice = choice("Spectrum of", "spectrum", [["pixel", "Pixel"], ["surface", "Surface"]]);

  const update = () => {
    const off = view.view === "difference", isDisplay = !off && view.show !== "false";
    wipeSlider.node.hidden = view.view !== "wipe";
    showChoice.hidden = evSlider.node.hidden = off;
    scaleChoice.hidden = spreadSlider.node.hidden = !off;
    swapButton.hidden = view.view !== "swap";
    swapButton.textContent = `Showing: ${names[view.swap]}`;
    markLabel.hidden = !isDisplay;
    markBox.checked = view.mark;
    for (const s of [bandSlider, evSlider, spreadSlider, wipeSlider, ...lineInputs]) s.update();
    stage.draw();
    zoomOutput.textContent = stage.zoomText();
    for (const refresh of [updateBar, updateInspector, updateSpectrum, updateProfile, updateHistogram]) refresh();
  };

  const largestButton = html("button", { type: "button", class: "largest", click: () => { const p = largestAt(); pick(p.x, p.y); } }, "Go to the largest difference");
  const zoomGroup = html("div", { class: "zoom", role: "group", "aria-label": "Zoom" },
    button("−", "Zoom out", () => stage.zoomBy(1 / 1.5)), zoomOutput, button("+", "Zoom in", () => stage.zoomBy(1.5)), button("Fit", "Fit to the window", () => stage.fit()));
  const node = html("div", { class: "viewer", role: "group", "aria-label": `Viewer: ${names.test} against ${names.reference}` },
    html("div", { class: "controls" }, viewChoice, showChoice, scaleChoice, toolChoice, zoomGroup),
    html("div", { class: "controls sliders" }, bandSlider.node, evSlider.node, spreadSlider.node, wipeSlider.node, swapButton),
    html("div", { class: "viewer-body" },
      html("div", { class: "viewer-main" }, stage.node,
        html("div", { class: "under-stage" }, bar, markLabel)),
      html("div", { class: "viewer-side" }, inspector, largestButton, ...(data.surfaceOf ? [spectrumChoice] : []), spectrum)),
    html("div", { class: "viewer-plots" },
      html("div", {}, profile, html("p", { class: "line-inputs note" }, "From x ", lineInputs[0].input, " y ", lineInputs[1].input, " to x ", lineInputs[2].input, " y ", lineInputs[3].input)),
      counted),
    ...(set.stride > 1 ? [html("p", { class: "note" }, `The page holds every ${set.stride}th pixel in x and in y; positions are those of the full images.`)] : []),
    live);
  figure.prepend(node);
  figure.classList.add("has-viewer");
  update();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
};

for (const [index, node] of [...document.querySelectorAll("script.image-set")].entries()) {
  const figure = node.closest("figure"), set = JSON.parse(node.textContent);
  decodeSet(set).then((data) => makeViewer(figure, set, data, `viewer-${index + 1}`)).catch((error) => {
    figure.append(html("p", { class: "note", role: "status" }, `The pictures above are still: the numbers behind them could not be unpacked (${error.message}).`));
  });
}
