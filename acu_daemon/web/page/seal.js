"use strict";
// HMAC-SHA256 (FIPS 180-4, RFC 2104).  The browser's own is only there on https and localhost.
const ROUND = new Uint32Array(64), START = new Uint32Array(8);
(() => {
  const fraction = (x) => ((x - Math.floor(x)) * 4294967296) >>> 0;
  for (let n = 2, i = 0; i < 64; n++) {
    let prime = true;
    for (let k = 2; k * k <= n; k++) prime &&= n % k !== 0;
    if (prime) {
      if (i < 8) START[i] = fraction(Math.sqrt(n));
      ROUND[i++] = fraction(Math.cbrt(n));
    }
  }
})();

function sha256(bytes) {
  const length = bytes.length, size = ((length + 72) >> 6) << 6, padded = new Uint8Array(size), view = new DataView(padded.buffer);
  padded.set(bytes);
  padded[length] = 0x80;
  view.setUint32(size - 4, length * 8);
  view.setUint32(size - 8, Math.floor(length / 536870912));
  const h = START.slice(), w = new Uint32Array(64), turn = (x, n) => (x >>> n) | (x << (32 - n));
  for (let at = 0; at < size; at += 64) {
    for (let i = 0; i < 16; i++) w[i] = view.getUint32(at + 4 * i);
    for (let i = 16; i < 64; i++) {
      const a = w[i - 15], b = w[i - 2];
      w[i] = w[i - 16] + (turn(a, 7) ^ turn(a, 18) ^ (a >>> 3)) + w[i - 7] + (turn(b, 17) ^ turn(b, 19) ^ (b >>> 10));
    }
    let [a, b, c, d, e, f, g, k] = h;
    for (let i = 0; i < 64; i++) {
      const one = (k + (turn(e, 6) ^ turn(e, 11) ^ turn(e, 25)) + ((e & f) ^ (~e & g)) + ROUND[i] + w[i]) | 0;
      const two = ((turn(a, 2) ^ turn(a, 13) ^ turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      k = g; g = f; f = e; e = (d + one) | 0; d = c; c = b; b = a; a = (one + two) | 0;
    }
    [a, b, c, d, e, f, g, k].forEach((x, i) => { h[i] += x; });
  }
  const out = new Uint8Array(32), result = new DataView(out.buffer);
  h.forEach((x, i) => result.setUint32(4 * i, x));
  return out;
}

function hmac(token, text) {
  const code = new TextEncoder(), given = code.encode(token), key = new Uint8Array(64), said = code.encode(text);
  key.set(given.length > 64 ? sha256(given) : given);
  const joined = (mask, rest) => { const all = new Uint8Array(64 + rest.length); all.set(key.map((x) => x ^ mask)); all.set(rest, 64); return all; };
  return Array.from(sha256(joined(0x5c, sha256(joined(0x36, said)))), (x) => x.toString(16).padStart(2, "0")).join("");
}
