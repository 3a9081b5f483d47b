// Numbers as the rest of the report writes them (figures/text.cpp), and elements.

const superscript = (n) => String(n).replace(/./g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));

const numberText = (value, digits = 4) => {
  if (Number.isNaN(value)) return "NaN";
  if (!Number.isFinite(value)) return value > 0 ? "+∞" : "-∞";
  if (value === 0) return "0";
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  if (exponent < -4 || exponent >= Math.max(digits, 6))
    return (mantissa === "1" ? "" : `${mantissa} × `) + `10${superscript(exponent)}`;
  return value.toFixed(Math.max(0, digits - 1 - exponent));
};

const estimateText = (value, u, digits = 4) => {
  if (!Number.isFinite(value) || !Number.isFinite(u) || u <= 0) return numberText(value, digits);
  const decimals = 1 - Math.floor(Math.log10(u));
  if (decimals < 0 || decimals > 8) return `${numberText(value, digits)} ± ${numberText(u, 2)}`;
  return `${value.toFixed(decimals)} ± ${u.toFixed(decimals)}`;
};

const unitText = (unit) =>
  unit === "1" ? "" : unit.replace(/\^(-?\d+)/g, (_, power) => superscript(power));

const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);

// Names come from files: they only ever become text, never markup.
const element = (space) => (name, attributes = {}, ...children) => {
  const node = space ? document.createElementNS(space, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(key, value);
    else if (value !== null && value !== undefined) node.setAttribute(key, value);
  }
  node.append(...children);
  return node;
};
const html = element(null);
const svg = element("http://www.w3.org/2000/svg");
