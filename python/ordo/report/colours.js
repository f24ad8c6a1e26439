"use strict";
// Maps of colours by a few points of each, between which lines are drawn. Viridis: Smith & van der Walt (2015), matplotlib; cool-warm: Moreland (2009).

const MAPS = {
  viridis: "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c 1fa088 28ae80 3fbc73 5ec962 84d44b addc30 d8e219 fde725",
  plasma: "0d0887 310597 4c02a1 6600a7 7e03a8 9511a1 aa2395 bc3587 cc4778 da5a6a e66c5c f0804e f89540 fdac33 fdc527 f8df25 f0f921",
  "cool-warm": "3b4cc0 4f69d9 6485ec 7b9ff9 93b5fe aac7fd c0d4f5 d4dbe6 dddddd ead4c8 f2cab5 f7b89c f7a789 f08a6c e6735b d65244 b40426",
  grey: "202020 f0f0f0",
};
// Of whole numbers such as bodies: Okabe & Ito (2008), for all kinds of sight.
const KINDS = ["0072b2", "e69f00", "009e73", "d55e00", "cc79a7", "56b4e9", "f0e442", "8c8c8c"];
const NO_VALUE = [150, 150, 150];

function rgb(hex) {
  return [0, 2, 4].map((k) => parseInt(hex.slice(k, k + 2), 16));
}

/** Bytes r, g, b, a of a map at `count` places. */
function colourBytes(name, count) {
  const points = MAPS[name].split(" ").map(rgb);
  const bytes = new Uint8Array(4 * count);
  for (let k = 0; k < count; ++k) {
    const at = (k / (count - 1)) * (points.length - 1);
    const left = Math.min(Math.floor(at), points.length - 2);
    for (let c = 0; c < 3; ++c) bytes[4 * k + c] = Math.round(points[left][c] + (at - left) * (points[left + 1][c] - points[left][c]));
    bytes[4 * k + 3] = 255;
  }
  return bytes;
}

function kindBytes(count) {
  const bytes = new Uint8Array(4 * count);
  for (let k = 0; k < count; ++k) bytes.set([...rgb(KINDS[k % KINDS.length]), 255], 4 * k);
  return bytes;
}
