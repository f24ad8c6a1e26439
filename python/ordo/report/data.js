"use strict";
// What the page holds: the object of its JSON, and compressed arrays of whole numbers (see _particles.py).

const DATA = JSON.parse(document.getElementById("data").textContent);

/** Codes of all frames, one after another, of the array of this name. */
async function unpacked(name) {
  const text = document.getElementById(name).textContent;
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < bytes.length; ++k) bytes[k] = binary.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  return restored(planes, DATA.particles.count, DATA.particles.times.length, DATA.particles.orders[name]);
}

/** Undoes the differences along particles in the first frame and in time in the others. */
function restored(planes, count, frames, order) {
  const all = count * frames;
  const found = new Uint16Array(all);
  for (let k = 0; k < all; ++k) {
    const zigzag = planes[k] | (planes[all + k] << 8);
    let value = (zigzag >>> 1) ^ -(zigzag & 1);
    if (k < count) value += k > 0 ? found[k - 1] : 0;
    else if (order === 1 || k < 2 * count) value += found[k - count];
    else value += 2 * found[k - count] - found[k - 2 * count];
    found[k] = value;  // modulo 2^16
  }
  return found;
}

/** A number as people read it. */
function readable(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 10 ** Math.max(5, digits) || size < 1e-3) return value.toExponential(digits - 1).replace("e+", "e").replace(/(\.\d*?)0+e/, "$1e").replace(".e", "e");
  return String(Number(value.toPrecision(digits)));
}

/** Digits that tell apart numbers between two ends. */
function digitsOf(low, high, more = 3) {
  const size = Math.max(Math.abs(low), Math.abs(high)), width = Math.abs(high - low);
  return size > 0 && width > 0 ? Math.min(15, Math.max(more, Math.ceil(Math.log10(size / width) - 0.3) + more)) : 6;
}

/** An element with attributes, properties that begin with "on", and children. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== false && value !== null) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}
