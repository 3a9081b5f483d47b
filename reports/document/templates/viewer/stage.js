// The stage: one pane, or two side by side, that zoom and pan in step. What is painted comes from
// `picture(name)` ("test", "reference", "difference"), a canvas of the images' own size.

const makeStage = (size, view, hooks) => {
  const panes = [0, 1].map((index) => {
    const canvas = html("canvas", {});
    const labels = [html("span", { class: "pane-label left" }), html("span", { class: "pane-label right" })];
    const node = html("div", { class: "pane" }, canvas, ...labels);
    if (index) node.hidden = true;
    return { node, canvas, labels };
  });
  const help = html("p", { class: "visually-hidden", id: `${hooks.id}-help` },
    "Arrow keys move the marked pixel, with Shift by ten. Plus and minus zoom, 0 fits. Space swaps the two images.");
  const node = html("div", { class: "stage", tabindex: 0, role: "application", "aria-label": hooks.label, "aria-describedby": help.id },
    ...panes.map((p) => p.node), help);
  const place = { zoom: 1, x: 0, y: 0 };  // zoom 1 fits; x, y: image position at the pane's centre
  let fit = 1;
  place.x = size.width / 2;
  place.y = size.height / 2;

  const scale = () => fit * place.zoom;
  const keepInside = () => {
    for (const [axis, extent, shown] of [["x", size.width, panes[0].canvas.clientWidth], ["y", size.height, panes[0].canvas.clientHeight]]) {
      const half = Math.min(extent, shown / scale()) / 2;
      place[axis] = Math.min(extent - half, Math.max(half, place[axis]));
    }
  };
  const toImage = (canvas, clientX, clientY) => {
    const box = canvas.getBoundingClientRect();
    return { x: place.x + (clientX - box.left - box.width / 2) / scale(), y: place.y + (clientY - box.top - box.height / 2) / scale() };
  };
  const inside = (p) => p.x >= 0 && p.y >= 0 && p.x < size.width && p.y < size.height;

  const drawPane = (pane, names) => {
    const { canvas } = pane, ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d"), s = scale() * ratio;
    const left = width / 2 - place.x * s, top = height / 2 - place.y * s;
    context.clearRect(0, 0, width, height);
    context.imageSmoothingEnabled = s < 1;
    const put = (name) => context.drawImage(hooks.picture(name), left, top, size.width * s, size.height * s);
    put(names[0]);
    if (names[1]) {
      const at = Math.round(left + view.wipe * size.width * s);
      context.save();
      context.beginPath();
      context.rect(at, 0, width - at, height);
      context.clip();
      context.clearRect(at, 0, width - at, height);
      put(names[1]);
      context.restore();
      for (const [offset, colour] of [[-1, "#000"], [0, "#fff"]]) {
        context.fillStyle = colour;
        context.fillRect(at + offset * ratio, 0, ratio, height);
      }
    }
    const outline = (draw) => {
      for (const [w, colour] of [[3.5, "#000"], [1.5, "#fff"]]) {
        context.lineWidth = w * ratio;
        context.strokeStyle = colour;
        context.beginPath();
        draw();
        context.stroke();
      }
    };
    if (view.tool === "profile" || view.drawn) outline(() => {
      context.moveTo(left + (view.line.x0 + 0.5) * s, top + (view.line.y0 + 0.5) * s);
      context.lineTo(left + (view.line.x1 + 0.5) * s, top + (view.line.y1 + 0.5) * s);
    });
    const box = Math.max(s, 7 * ratio);
    outline(() => context.rect(left + (view.pixel.x + 0.5) * s - box / 2, top + (view.pixel.y + 0.5) * s - box / 2, box, box));
    pane.labels.forEach((label, i) => {
      label.textContent = names[i] ? hooks.nameOf(names[i]) : "";
      label.hidden = !names[i];
    });
  };
  const draw = () => {
    const side = view.view === "side";
    panes[1].node.hidden = !side;
    node.classList.toggle("two", side);
    const width = panes[0].canvas.clientWidth;
    node.style.setProperty("--pane-height", `${Math.round(Math.min(width * size.height / size.width, 0.72 * window.innerHeight))}px`);
    fit = Math.min(width / size.width, panes[0].canvas.clientHeight / size.height) || 1;
    keepInside();
    const shown = { swap: [[view.swap]], wipe: [["test", "reference"]], side: [["test"], ["reference"]], difference: [["difference"]] }[view.view];
    shown.forEach((names, i) => drawPane(panes[i], names));
    node.style.touchAction = place.zoom > 1 || view.tool === "profile" ? "none" : "pan-y";
    node.style.cursor = view.tool === "profile" ? "crosshair" : place.zoom > 1 ? "grab" : "default";
  };
  const zoomTo = (zoom, about) => {
    const next = Math.min(64 / fit, Math.max(1, zoom)), factor = next / place.zoom;
    if (about) {
      place.x = about.x + (place.x - about.x) / factor;
      place.y = about.y + (place.y - about.y) / factor;
    }
    place.zoom = next;
    hooks.changed();
  };

  const held = new Map();
  let start = null;
  for (const { canvas, node: pane } of panes) {
    pane.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      pane.setPointerCapture(event.pointerId);
      held.set(event.pointerId, event);
      const p = toImage(canvas, event.clientX, event.clientY);
      const divider = canvas.getBoundingClientRect().left + canvas.clientWidth / 2 + (view.wipe * size.width - place.x) * scale();
      const near = view.view === "wipe" && Math.abs(event.clientX - divider) < 14;
      start = { p, x: place.x, y: place.y, clientX: event.clientX, clientY: event.clientY, moved: false, near, apart: 0, zoom: place.zoom };
    });
    pane.addEventListener("pointermove", (event) => {
      const p = toImage(canvas, event.clientX, event.clientY);
      if (!held.has(event.pointerId)) {
        if (inside(p)) hooks.hover(Math.floor(p.x), Math.floor(p.y));
        return;
      }
      held.set(event.pointerId, event);
      if (held.size === 2) {
        const [a, b] = [...held.values()];
        const apart = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (start.apart) zoomTo(start.zoom * apart / start.apart, start.p);
        else Object.assign(start, { apart, zoom: place.zoom });
        return;
      }
      const dx = event.clientX - start.clientX, dy = event.clientY - start.clientY;
      start.moved ||= Math.hypot(dx, dy) > 3;
      if (!start.moved) return;
      if (start.near) view.wipe = Math.min(1, Math.max(0, p.x / size.width));
      else if (view.tool === "profile") hooks.line(start.p, p);
      else Object.assign(place, { x: start.x - dx / scale(), y: start.y - dy / scale() });
      hooks.changed();
    });
    const release = (event) => {
      if (!held.delete(event.pointerId) || event.type === "pointercancel") return;
      if (start && !start.moved && held.size === 0 && inside(start.p)) hooks.pick(Math.floor(start.p.x), Math.floor(start.p.y));
    };
    pane.addEventListener("pointerup", release);
    pane.addEventListener("pointercancel", release);
    pane.addEventListener("pointerleave", () => hooks.leave());
    pane.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== node) return;  // the page scrolls otherwise
      event.preventDefault();
      zoomTo(place.zoom * Math.exp(-event.deltaY / 300), toImage(canvas, event.clientX, event.clientY));
    }, { passive: false });
  }
  node.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 10 : 1;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const centre = { x: view.pixel.x + 0.5, y: view.pixel.y + 0.5 };
    if (event.target !== node || event.ctrlKey || event.metaKey || event.altKey) return;
    if (moves[event.key]) {
      const [dx, dy] = moves[event.key];
      hooks.pick(Math.min(size.width - 1, Math.max(0, view.pixel.x + dx)), Math.min(size.height - 1, Math.max(0, view.pixel.y + dy)));
    } else if (event.key === "+" || event.key === "=") zoomTo(place.zoom * 1.5, centre);
    else if (event.key === "-") zoomTo(place.zoom / 1.5, centre);
    else if (event.key === "0") zoomTo(1);
    else if (event.key === " ") hooks.swap();
    else return;
    event.preventDefault();
  });
  new ResizeObserver(() => hooks.changed()).observe(node);
  return {
    node, draw,
    zoomBy: (factor) => zoomTo(place.zoom * factor, { x: view.pixel.x + 0.5, y: view.pixel.y + 0.5 }),
    fit: () => zoomTo(1),
    zoomText: () => `${Math.round(100 * scale())} %`,
  };
};
