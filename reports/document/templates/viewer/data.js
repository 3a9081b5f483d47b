// From the bytes in the page to planes of numbers; document/image_set.h says how they are packed.

// RFC 1951 for browsers without DecompressionStream, after the order of its section 3.2.
const inflateHere = (input, size) => {
  const output = new Uint8Array(size);
  const order = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
  let at = 2, bit = 0, held = 0, out = 0;  // 2: the zlib header
  const take = (count) => {
    while (bit < count) {
      if (at >= input.length) throw new Error("the data end too early");
      held |= input[at++] << bit;
      bit += 8;
    }
    const value = held & ((1 << count) - 1);
    held >>>= count;
    bit -= count;
    return value;
  };
  const code = (lengths) => {
    const counts = new Uint16Array(16), offsets = new Uint16Array(16), symbols = [];
    for (const length of lengths) counts[length]++;
    counts[0] = 0;
    for (let n = 1; n < 15; n++) offsets[n + 1] = offsets[n] + counts[n];
    lengths.forEach((length, symbol) => { if (length) symbols[offsets[length]++] = symbol; });
    return { counts, symbols };
  };
  const next = ({ counts, symbols }) => {
    let value = 0, first = 0, index = 0;
    for (let n = 1; n < 16; n++) {
      value |= take(1);
      if (value - first < counts[n]) return symbols[index + value - first];
      index += counts[n];
      first = (first + counts[n]) << 1;
      value <<= 1;
    }
    throw new Error("a code that is not there");
  };
  const extra = (symbol, per) => (symbol < 2 * per ? 0 : Math.floor(symbol / per) - 1);
  const lengthOf = (s) => {
    if (s === 28) return 258;
    const e = extra(s, 4);
    return 3 + (s < 8 ? s : ((4 + (s & 3)) << e) + take(e));
  };
  const distanceOf = (s) => {
    const e = extra(s, 2);
    return 1 + (s < 4 ? s : ((2 + (s & 1)) << e) + take(e));
  };
  for (let last = 0; !last;) {
    last = take(1);
    const type = take(2);
    if (type === 0) {
      held = bit = 0;
      const count = input[at] | (input[at + 1] << 8);
      output.set(input.subarray(at + 4, at + 4 + count), out);
      at += 4 + count;
      out += count;
      continue;
    }
    let literals, distances;
    if (type === 1) {
      literals = code(Array.from({ length: 288 }, (_, i) => (i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8)));
      distances = code(Array(30).fill(5));
    } else {
      const counts = [take(5) + 257, take(5) + 1], first = Array(19).fill(0), lengths = [];
      const named = take(4) + 4;
      for (let i = 0; i < named; i++) first[order[i]] = take(3);
      const table = code(first);
      while (lengths.length < counts[0] + counts[1]) {
        const s = next(table);
        if (s < 16) lengths.push(s);
        else if (s === 16) lengths.push(...Array(3 + take(2)).fill(lengths.at(-1)));
        else lengths.push(...Array(s === 17 ? 3 + take(3) : 11 + take(7)).fill(0));
      }
      literals = code(lengths.slice(0, counts[0]));
      distances = code(lengths.slice(counts[0]));
    }
    for (let s = next(literals); s !== 256; s = next(literals)) {
      if (s < 256) {
        output[out++] = s;
        continue;
      }
      const length = lengthOf(s - 257), from = out - distanceOf(next(distances));
      if (from < 0 || out + length > size) throw new Error("a distance beyond the data");
      for (let i = 0; i < length; i++) output[out++] = output[from + i];
    }
  }
  if (out !== size) throw new Error("other data than announced");
  return output;
};

const inflate = async (bytes, size) => {
  if (typeof DecompressionStream === "undefined") return inflateHere(bytes, size);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const result = new Uint8Array(await new Response(stream).arrayBuffer());
  if (result.length !== size) throw new Error("other data than announced");
  return result;
};

let halves = null;  // the value of each of the 65536 bit patterns
const halfTable = () => {
  if (halves) return halves;
  halves = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const exponent = (bits >> 10) & 31, mantissa = bits & 1023, sign = bits & 0x8000 ? -1 : 1;
    halves[bits] = sign * (exponent === 31 ? (mantissa ? NaN : Infinity)
      : exponent ? 2 ** (exponent - 25) * (1024 + mantissa) : 2 ** -24 * mantissa);
  }
  return halves;
};

// { bands: [{ test, reference, testU, referenceU }], surfaceOf }: a Float32Array each.
const decodeSet = async (set) => {
  const kinds = ["test", "reference"];
  if (set.test_uncertainty !== "none") kinds.push("testU");
  if (set.reference_uncertainty !== "none") kinds.push("referenceU");
  const pixels = set.width_px * set.height_px, period = kinds.length;
  const count = set.bands.length * period + (set.surfaces.length ? 1 : 0);
  const packed = Uint8Array.from(atob(set.packed_base64), (c) => c.charCodeAt(0));
  const bytes = await inflate(packed, 2 * pixels * count);
  const table = halfTable(), before = [], bands = set.bands.map(() => ({}));
  let surfaceOf = null;
  for (let p = 0; p < count; p++) {
    const bits = new Uint16Array(pixels), low = 2 * p * pixels, high = low + pixels;
    const is_surface = p >= set.bands.length * period;
    const last = p >= period && !is_surface ? before[p % period] : null;
    for (let i = 0; i < pixels; i++)
      bits[i] = bytes[low + i] + (bytes[high + i] << 8) + (last ? last[i] : 0);
    if (is_surface) {
      surfaceOf = bits;
      break;
    }
    before[p % period] = bits;
    const scale = 2 ** set.scale_exponents[p], plane = new Float32Array(pixels);
    for (let i = 0; i < pixels; i++) plane[i] = table[bits[i]] * scale;
    bands[Math.floor(p / period)][kinds[p % period]] = plane;
  }
  return { bands, surfaceOf };
};
