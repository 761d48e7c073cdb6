// Pixels of a picture of the page, for what only the eye sees: which colours there are, and where.

import { inflateSync } from "node:zlib";

import { call } from "./chromium.mjs";

const predictor = (a, b, c) => {
  const [pa, pb, pc] = [Math.abs(b - c), Math.abs(a - c), Math.abs(a + b - 2 * c)];
  return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
};

// Decodes a PNG with 8 bits for each of 3 or 4 channels and without interlacing, as a browser writes it.
function decode(png) {
  const width = png.readUInt32BE(16);
  const height = png.readUInt32BE(20);
  const channels = png[25] === 6 ? 4 : 3;
  const parts = [];
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    if (png.toString("latin1", at + 4, at + 8) === "IDAT") {
      parts.push(png.subarray(at + 8, at + 8 + length));
    }
    at += length + 12;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const line = width * channels;
  const pixels = Buffer.alloc(line * height);
  for (let y = 0; y < height; y += 1) {
    const filter = raw[y * (line + 1)];
    for (let x = 0; x < line; x += 1) {
      const place = y * line + x;
      const left = x >= channels ? pixels[place - channels] : 0;
      const up = y > 0 ? pixels[place - line] : 0;
      const corner = x >= channels && y > 0 ? pixels[place - line - channels] : 0;
      const added = [0, left, up, (left + up) >> 1, predictor(left, up, corner)][filter];
      pixels[place] = (raw[y * (line + 1) + 1 + x] + added) & 255;
    }
  }
  return { width, height, channels, pixels };
}

// The red pixels of the page, as places in it: red is far above green and blue.
export async function redPixels() {
  const { data } = await call("Page.captureScreenshot", { format: "png" });
  const { width, height, channels, pixels } = decode(Buffer.from(data, "base64"));
  const found = [];
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const at = (y * width + x) * channels;
      if (pixels[at] - Math.max(pixels[at + 1], pixels[at + 2]) > 90) {
        found.push([x, y]);
      }
    }
  }
  return found;
}
