// Draws the solution that stands in #solution. Numbers: radiosity in each band at the vertices.
(async () => {
  'use strict';
  const byId = (id) => document.getElementById(id);
  const fail = (text) => {
    byId('message').textContent = text;
    byId('message').hidden = false;
    byId('controls').hidden = true;
  };

  const solution = JSON.parse(byId('solution').textContent);
  byId('title').textContent = solution.source;
  byId('subtitle').textContent = `Predicted radiosity (simulated), ${solution.vertices} vertices, ` +
    `${solution.bands.length} bands` +
    (solution.boundIsReliable ? '' : '. The mesh is coarse: error bounds are estimates.');

  const bytesOf = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const words = (base64) => new Uint32Array(bytesOf(base64).buffer);

  async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // IEEE 754 binary16.
  function halfValue(bits) {
    const exponent = (bits >> 10) & 31, fraction = bits & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24
      : exponent === 31 ? (fraction ? NaN : Infinity) : (1 + fraction / 1024) * 2 ** (exponent - 15);
    return bits & 0x8000 ? -size : size;
  }

  // Planes of low bytes and high bytes; those of the radiosity are differences to the band before.
  function unpack(bytes, vertices, bands, exponents) {
    const table = new Float32Array(65536);
    for (let k = 0; k < 65536; ++k) table[k] = halfValue(k);
    const planes = [];
    let before = new Uint16Array(vertices);
    for (let p = 0; p < 2 * bands; ++p) {
      const low = 2 * p * vertices, bits = new Uint16Array(vertices), plane = new Float32Array(vertices);
      const scale = 2 ** exponents[p];
      for (let i = 0; i < vertices; ++i) {
        const difference = bytes[low + i] | (bytes[low + vertices + i] << 8);
        bits[i] = p > 0 && p < bands ? before[i] + difference : difference;
        plane[i] = table[bits[i]] * scale;
      }
      before = bits;
      planes.push(plane);
    }
    return { radiosity: planes.slice(0, bands), bound: planes.slice(bands) };
  }

  if (typeof DecompressionStream === 'undefined') {
    fail('This browser is too old to unpack the solution. Chromium 80, Firefox 113 or Safari 16.4 can.');
    return;
  }
  const canvas = byId('view');
  const context = canvas.getContext('webgl', { antialias: true, preserveDrawingBuffer: true });
  if (!context) {
    fail('This page draws with WebGL, which this browser does not offer here. Another browser, or ' +
      'the .vtu file of the same solution in ParaView, shows the same numbers.');
    return;
  }
  const renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true });

  const bandCount = solution.bands.length;
  const planes = unpack(await inflate(bytesOf(solution.values)), solution.vertices, bandCount, solution.exponents);
  const triangles = words(solution.triangles), surfaceOf = words(solution.surfaceOfTriangle);

  const colours = new Float32Array(3 * solution.vertices);
  for (let b = 0; b < bandCount; ++b)
    for (let c = 0; c < 3; ++c) {
      const weight = solution.colourWeights[3 * b + c], plane = planes.radiosity[b];
      for (let i = 0; i < solution.vertices; ++i) colours[3 * i + c] += weight * plane[i];
    }

  const shines = new Uint8Array(solution.vertices);
  for (let t = 0; t < surfaceOf.length; ++t)
    if (solution.shines[surfaceOf[t]]) for (let k = 0; k < 3; ++k) shines[triangles[3 * t + k]] = 1;
  // The end of a scale: what 98 % of the vertices that do not shine themselves stay below.
  function scaleFor(values, components) {
    const reflecting = values.filter((v, i) => !shines[Math.floor(i / components)]);
    const sorted = (reflecting.some((v) => v > 0) ? reflecting : values.slice()).sort();
    return sorted[Math.floor(0.98 * (sorted.length - 1))] || sorted[sorted.length - 1] || 1;
  }

  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(bytesOf(solution.positions).buffer), 3));
  geometry.setAttribute('radiance', new THREE.BufferAttribute(colours, 3));
  geometry.setAttribute('value', new THREE.BufferAttribute(planes.radiosity[0].slice(), 1));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  geometry.computeBoundingBox();
  geometry.computeBoundingSphere();
  const centre = geometry.boundingSphere.center, size = geometry.boundingSphere.radius || 1;

  const mapBytes = bytesOf(solution.colourMap), mapTexture = new THREE.DataTexture(mapBytes, 256, 1, THREE.RGBFormat);
  mapTexture.magFilter = THREE.LinearFilter;
  mapTexture.minFilter = THREE.LinearFilter;
  mapTexture.needsUpdate = true;
  const material = new THREE.ShaderMaterial({
    uniforms: { exposure: { value: 1 }, mode: { value: 0 }, map: { value: mapTexture } },
    vertexShader: `
      attribute vec3 radiance; attribute float value;
      varying vec3 vRadiance; varying float vValue;
      void main() {
        vRadiance = radiance; vValue = value;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      uniform float exposure; uniform int mode; uniform sampler2D map;
      varying vec3 vRadiance; varying float vValue;
      vec3 srgb(vec3 v) {
        v = clamp(v, 0.0, 1.0);
        return mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
      }
      void main() {
        float t = clamp(exposure * vValue, 0.0, 1.0);
        if (!gl_FrontFacing) gl_FragColor = vec4(0.0, 0.0, 0.0, 1.0);
        else if (mode == 0) gl_FragColor = vec4(srgb(exposure * vRadiance), 1.0);
        else if (mode == 1) gl_FragColor = vec4(srgb(vec3(t)), 1.0);
        else gl_FragColor = vec4(texture2D(map, vec2((0.5 + 255.0 * t) / 256.0, 0.5)).rgb, 1.0);
      }`,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  });
  const scene = new THREE.Scene();
  const body = new THREE.Mesh(geometry, material);
  scene.add(body);
  const outlineGeometry = new THREE.BufferGeometry();
  outlineGeometry.setAttribute('position', geometry.attributes.position);
  outlineGeometry.setIndex(new THREE.BufferAttribute(words(solution.outlines), 1));
  const outlines = new THREE.LineSegments(outlineGeometry,
    new THREE.LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.35 }));
  outlines.visible = false;
  scene.add(outlines);

  const camera = new THREE.PerspectiveCamera(40, 1, size / 1000, size * 100);
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enableKeys = false;
  let mode = 'orbit', queued = false, tangent = { x: 0.36, y: 0.36 };

  function draw() {
    queued = false;
    renderer.render(scene, camera);
    document.documentElement.dataset.frames = 1 + Number(document.documentElement.dataset.frames || 0);
  }
  const redraw = () => { if (!queued) { queued = true; requestAnimationFrame(draw); } };
  orbit.addEventListener('change', redraw);

  // The camera's whole film is in the window, whatever the window's shape.
  function resize() {
    const width = window.innerWidth, height = window.innerHeight, aspect = width / height;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.aspect = aspect;
    camera.fov = 2 * Math.atan(Math.max(tangent.y, tangent.x / aspect)) * 180 / Math.PI;
    camera.updateProjectionMatrix();
    redraw();
  }

  function lookFrom(c) {
    camera.up.fromArray(c ? c.up : [0, 1, 0]);
    if (c) {
      const direction = new THREE.Vector3().fromArray(c.direction);
      camera.position.fromArray(c.position);
      const ahead = centre.clone().sub(camera.position).dot(direction);
      orbit.target.copy(camera.position).addScaledVector(direction, ahead > 0.05 * size ? ahead : size);
      tangent = { x: c.tangentX, y: c.tangentY };
    } else {
      camera.position.copy(centre).add(new THREE.Vector3(0, 0.3, 3).multiplyScalar(size));
      orbit.target.copy(centre);
    }
    camera.lookAt(orbit.target);
    resize();
    if (mode === 'orbit') orbit.update();
  }

  // What is shown, and on which scale.
  const chosenBand = () => Number(byId('band').value);
  const kind = () => byId('show').value;
  let scaleEnd = 1;
  function number(v) {
    if (v === 0) return '0';
    const power = Math.floor(Math.log10(Math.abs(v)));
    if (power >= -3 && power < 5) return Number(v.toPrecision(3)).toString();
    return `${(v / 10 ** power).toFixed(2)} × 10${String(power).replace('-', '⁻').replace(/\d/g, (d) => '⁰¹²³⁴⁵⁶⁷⁸⁹'[d])}`;
  }
  function show() {
    const band = chosenBand(), stops = Number(byId('exposure').value), what = kind();
    const values = (what === 'bound' ? planes.bound : planes.radiosity)[band];
    geometry.attributes.value.array.set(values);
    geometry.attributes.value.needsUpdate = true;
    const end = what === 'colour' ? scaleFor(colours, 3) : scaleFor(values, 1);
    scaleEnd = end / 2 ** stops;
    material.uniforms.exposure.value = 1 / scaleEnd;
    material.uniforms.mode.value = { colour: 0, grey: 1, false: 2, bound: 2 }[what];
    outlines.material.color.set(what === 'grey' ? 0xffb000 : 0xffffff);
    byId('band').disabled = what === 'colour';
    byId('band-value').textContent = `${number(solution.bands[band])} nm`;
    byId('band').setAttribute('aria-valuetext', byId('band-value').textContent);
    byId('exposure-value').textContent = `${stops > 0 ? '+' : ''}${stops} stops`;
    byId('exposure').setAttribute('aria-valuetext', byId('exposure-value').textContent);
    byId('scale').hidden = what === 'colour';
    if (what !== 'colour') {
      const stop = (k) => what === 'grey'
        ? `rgb(${[0, 0, 0].map(() => Math.round(255 * (k <= 0.0031308 ? 12.92 * k : 1.055 * k ** (1 / 2.4) - 0.055)))})`
        : `rgb(${Array.from(mapBytes.slice(3 * Math.round(255 * k), 3 * Math.round(255 * k) + 3))})`;
      byId('bar').style.background = `linear-gradient(to right, ${Array.from({ length: 33 }, (_, k) => stop(k / 32))})`;
      byId('ticks').replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((k) => {
        const tick = document.createElement('span');
        tick.style.left = `${100 * k}%`;
        tick.textContent = (k === 1 ? '≥ ' : '') + number(k * scaleEnd);
        return tick;
      }));
      byId('scale-title').textContent = `${what === 'bound' ? 'Error bound of the radiosity' : 'Radiosity'} at ` +
        `${number(solution.bands[band])} nm / ${solution.unit}`;
    }
    redraw();
  }

  // The reading: surface, value and bound under the pointer, between the vertices linear.
  const ray = new THREE.Raycaster(), weights = new THREE.Vector3();
  function read(x, y) {
    ray.setFromCamera({ x: 2 * x / window.innerWidth - 1, y: 1 - 2 * y / window.innerHeight }, camera);
    const hit = ray.intersectObject(body)[0];
    if (!hit) { byId('reading').textContent = ''; return; }
    const corners = [hit.face.a, hit.face.b, hit.face.c];
    const at = corners.map((v) => new THREE.Vector3().fromBufferAttribute(geometry.attributes.position, v));
    THREE.Triangle.getBarycoord(hit.point, at[0], at[1], at[2], weights);
    const mean = (plane) => corners.reduce((sum, v, k) => sum + plane[v] * weights.getComponent(k), 0);
    const band = kind() === 'colour' ? Math.floor(bandCount / 2) : chosenBand();
    const value = mean(planes.radiosity[band]), bound = mean(planes.bound[band]);
    const name = solution.surfaces[surfaceOf[hit.faceIndex]];
    const share = value > 0 ? ` (${number(100 * bound / value)} %)` : '';
    byId('reading').textContent = `${name}, ${number(solution.bands[band])} nm: ` +
      `${number(value)} ${solution.unit}, error bound ${number(bound)}${share}`;
  }

  // Walking: turn by dragging or with Shift and the arrows, step in the plane that `up` stands on.
  const axis = new THREE.Vector3();
  function turn(yaw, pitch) {
    const forward = camera.getWorldDirection(new THREE.Vector3());
    forward.applyAxisAngle(camera.up, yaw);
    axis.crossVectors(forward, camera.up).normalize();
    const tilted = forward.clone().applyAxisAngle(axis, pitch);
    if (tilted.angleTo(camera.up) > 0.1 && tilted.angleTo(camera.up) < Math.PI - 0.1) forward.copy(tilted);
    camera.lookAt(camera.position.clone().add(forward));
    redraw();
  }
  function step(ahead, right, up) {
    const forward = camera.getWorldDirection(new THREE.Vector3());
    forward.addScaledVector(camera.up, -forward.dot(camera.up)).normalize();
    axis.crossVectors(forward, camera.up);
    const length = 0.03 * size;
    camera.position.addScaledVector(forward, length * ahead).addScaledVector(axis, length * right)
      .addScaledVector(camera.up, length * up);
    redraw();
  }
  function orbitBy(yaw, pitch, zoom) {
    const offset = camera.position.clone().sub(orbit.target).applyAxisAngle(camera.up, yaw);
    axis.crossVectors(camera.up, offset).normalize();
    const tilted = offset.clone().applyAxisAngle(axis, pitch);
    if (tilted.angleTo(camera.up) > 0.05 && tilted.angleTo(camera.up) < Math.PI - 0.05) offset.copy(tilted);
    camera.position.copy(orbit.target).addScaledVector(offset, zoom);
    orbit.update();
    redraw();
  }
  function setMode(next) {
    mode = next;
    orbit.enabled = mode === 'orbit';
    byId('pad').hidden = mode !== 'walk';
    if (mode === 'orbit') {  // go on around what is ahead
      const ahead = Math.max(centre.distanceTo(camera.position), 0.2 * size);
      orbit.target.copy(camera.position).addScaledVector(camera.getWorldDirection(axis), ahead);
      orbit.update();
    }
    redraw();
  }

  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key, a = 0.06;
    const orbitKeys = {
      ArrowLeft: [-a, 0, 1], ArrowRight: [a, 0, 1], ArrowUp: [0, -a, 1], ArrowDown: [0, a, 1],
      '+': [0, 0, 0.9], '=': [0, 0, 0.9], '-': [0, 0, 1.1],
    };
    const steps = {
      w: [1, 0, 0], s: [-1, 0, 0], a: [0, -1, 0], d: [0, 1, 0], e: [0, 0, 1], q: [0, 0, -1],
      ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1],
    };
    const turns = { ArrowLeft: [a, 0], ArrowRight: [-a, 0] };
    if (event.shiftKey) Object.assign(turns, { ArrowUp: [0, a], ArrowDown: [0, -a] });
    if (mode === 'orbit' && orbitKeys[key]) orbitBy(...orbitKeys[key]);
    else if (mode === 'walk' && turns[key]) turn(...turns[key]);
    else if (mode === 'walk' && steps[key]) step(...steps[key]);
    else return;
    event.preventDefault();
  });
  let held = null;
  canvas.addEventListener('pointerdown', (event) => { held = { x: event.clientX, y: event.clientY }; canvas.focus(); });
  window.addEventListener('pointerup', () => { held = null; });
  canvas.addEventListener('pointermove', (event) => {
    if (held && mode === 'walk') {
      turn(0.004 * (event.clientX - held.x), 0.004 * (event.clientY - held.y));
      held = { x: event.clientX, y: event.clientY };
    }
    if (!held) read(event.clientX, event.clientY);
  });
  canvas.addEventListener('click', (event) => read(event.clientX, event.clientY));
  const moves = { forward: [1, 0, 0], back: [-1, 0, 0], left: [0, -1, 0], right: [0, 1, 0] };
  for (const button of byId('pad').children) {
    const go = () => step(...moves[button.dataset.move]);
    let timer = 0;
    const stop = () => { clearInterval(timer); timer = 0; };
    button.addEventListener('pointerdown', () => { stop(); go(); timer = setInterval(go, 60); });
    for (const end of ['pointerup', 'pointercancel', 'pointerleave']) button.addEventListener(end, stop);
    button.addEventListener('keydown', (event) => { if (event.key === 'Enter' || event.key === ' ') go(); });
  }

  byId('band').max = bandCount - 1;
  byId('band').value = Math.floor(bandCount / 2);
  for (const id of ['show', 'band', 'exposure']) byId(id).addEventListener('input', show);
  byId('mesh').addEventListener('input', () => { outlines.visible = byId('mesh').checked; redraw(); });
  byId('backs').addEventListener('input', () => {
    material.side = byId('backs').checked ? THREE.DoubleSide : THREE.FrontSide;
    redraw();
  });
  for (const input of document.querySelectorAll('input[name="mode"]'))
    input.addEventListener('input', () => setMode(input.value));
  solution.cameras.forEach((c, k) => byId('camera').add(new Option(c.name, k)));
  byId('camera-row').hidden = solution.cameras.length < 2;
  const home = () => lookFrom(solution.cameras[Number(byId('camera').value || 0)]);
  byId('camera').addEventListener('input', home);
  byId('reset').addEventListener('click', () => { byId('exposure').value = 0; show(); home(); });
  function fold(open) {
    byId('fold').setAttribute('aria-expanded', open);
    document.body.classList.toggle('folded-out', open);
  }
  byId('fold').addEventListener('click', () => fold(byId('fold').getAttribute('aria-expanded') !== 'true'));
  fold(window.innerWidth > 720);
  byId('controls').addEventListener('submit', (event) => event.preventDefault());
  window.addEventListener('resize', resize);
  const scheme = window.matchMedia('(prefers-color-scheme: dark)');
  const paper = () => {
    renderer.setClearColor(getComputedStyle(document.documentElement).getPropertyValue('--paper').trim());
    redraw();
  };
  scheme.addEventListener('change', paper);
  paper();
  home();
  show();
  document.documentElement.dataset.ready = 'true';
})();
