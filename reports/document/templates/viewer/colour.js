// From numbers to pixels: sRGB without a tone curve, and the report's two false-colour maps.

const kNotFinite = [255, 0, 255];

// 256 steps of each map as hexadecimal text, written by the program (figures/colour_map.cpp).
const colourMaps = () => {
  const read = (hex) => Uint8Array.from({ length: hex.length / 2 }, (_, i) => parseInt(hex.substr(2 * i, 2), 16));
  const node = document.getElementById("colour-maps");
  const maps = JSON.parse(node.textContent);
  return { sequential: read(maps.sequential), diverging: read(maps.diverging) };
};

const kSrgbSteps = 4096;
const srgbTable = Uint8Array.from({ length: kSrgbSteps + 1 }, (_, i) => {
  const v = i / kSrgbSteps;
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});
const srgb = (v) => srgbTable[v <= 0 ? 0 : v >= 1 ? kSrgbSteps : Math.round(v * kSrgbSteps)];

// Linear RGB planes (or one grey plane three times) times a gain. The counts are never hidden.
const paintDisplay = (rgba, planes, gain, mark) => {
  const counts = { clipped: 0, gamut: 0, notFinite: 0 };
  for (let i = 0; i < planes[0].length; i++) {
    const r = planes[0][i] * gain, g = planes[1][i] * gain, b = planes[2][i] * gain;
    let shown;
    if (!Number.isFinite(r + g + b)) {
      counts.notFinite++;
      shown = kNotFinite;
    } else {
      const clipped = r > 1 || g > 1 || b > 1, outside = r < 0 || g < 0 || b < 0;
      counts.clipped += clipped;
      counts.gamut += outside;
      shown = mark && (clipped || outside) ? (clipped ? [255, 60, 0] : [0, 120, 255]) : [srgb(r), srgb(g), srgb(b)];
    }
    rgba.set(shown, 4 * i);
    rgba[4 * i + 3] = 255;
  }
  return counts;
};

// A scalar plane through a map; `low` to `high` are its ends.
const paintMap = (rgba, plane, map, low, high) => {
  const counts = { below: 0, above: 0, notFinite: 0 };
  for (let i = 0; i < plane.length; i++) {
    const t = (plane[i] - low) / (high - low);
    rgba[4 * i + 3] = 255;
    if (Number.isNaN(t)) {
      counts.notFinite++;
      rgba.set(kNotFinite, 4 * i);
      continue;
    }
    counts.below += t < 0;
    counts.above += t > 1;
    const step = 3 * Math.round(255 * Math.min(1, Math.max(0, t)));
    rgba[4 * i] = map[step];
    rgba[4 * i + 1] = map[step + 1];
    rgba[4 * i + 2] = map[step + 2];
  }
  return counts;
};

// The q-quantile of the finite values; `least` where there are none or all are smaller.
const quantile = (values, q, least = 1e-30) => {
  const finite = values.filter((v) => Number.isFinite(v)).sort();
  return finite.length ? Math.max(least, finite[Math.min(finite.length - 1, Math.floor(q * finite.length))]) : 1;
};
