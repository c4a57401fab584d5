// The file with the figure's mesh, fine and coarse, read into geometries that all people share, and
// the colours of one person: `studio/web/figure_file.py`, `scenes/bodies/figure.py`.
import * as THREE from "three";
import * as K from "shared/bodies/constants.js";

const TYPES = { u1: Uint8Array, i1: Int8Array, u2: Uint16Array };
const END_OF_LINE = 10;

/** [{ geometry, dyes, dyeNames }] fine and coarse, of the file's bytes. */
export function readShapes(buffer) {
  const bytes = new Uint8Array(buffer);
  const from = bytes.indexOf(END_OF_LINE) + 1;
  const { figures } = JSON.parse(new TextDecoder().decode(bytes.subarray(0, from)));
  return figures.map(({ low, high, steps, dyes: dyeNames, arrays }) => {
    const array = (name) => {
      const [at, type, size] = arrays[name];
      return new TYPES[type](buffer, bytes.byteOffset + from + at, size);
    };
    const at = summed(array("places"), 3);
    const places = new Float32Array(at.length);
    for (let i = 0; i < at.length; i++) {
      places[i] = low[i % 3] + (high[i % 3] - low[i % 3]) * at[i] / steps;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
    geometry.setAttribute("normal",
      new THREE.BufferAttribute(Float32Array.from(array("normals"), (n) => n / 127), 3));
    geometry.setAttribute("skinIndex", new THREE.BufferAttribute(array("bones"), 4));
    geometry.setAttribute("skinWeight", new THREE.BufferAttribute(array("shares"), 4, true));
    geometry.setIndex(new THREE.BufferAttribute(summed(array("faces"), 1), 1));
    return { geometry, dyes: array("dyes"), dyeNames };
  });
}

/** Rows that say how much more they are than the one before, as what they are. */
function summed(rows, width) {
  const found = new Uint16Array(rows.length);
  for (let i = 0; i < rows.length; i++) found[i] = rows[i] + (i < width ? 0 : found[i - width]);
  return found;
}

/** A person's own geometry: the shared one in colours by their clothes and their id. */
export function coloured({ geometry, dyes, dyeNames }, top, id) {
  const palette = paletteOf(top, id);
  const table = dyeNames.map((name) => palette[name].toArray().map((n) => Math.round(65535 * n)));
  const colours = new Uint16Array(4 * dyes.length).fill(65535);
  for (let i = 0; i < dyes.length; i++) colours.set(table[dyes[i]], 4 * i);
  const own = new THREE.BufferGeometry();
  for (const [name, attribute] of Object.entries(geometry.attributes)) own.setAttribute(name, attribute);
  own.setIndex(geometry.index);
  own.setAttribute("color", new THREE.BufferAttribute(colours, 4, true));
  return own;
}

/** Colours by the names of dyes; skin, hair and trousers as the program gives them. */
export function paletteOf(top, id) {
  const seed = numberOf(id);
  const skin = K.SKINS[seed % K.SKINS.length];
  const hair = K.HAIRS[(seed + 1) * 3 % K.HAIRS.length];
  const shaded = (colour, by) => colour.map((value, i) => value * by[i]);
  const rgb = { skin, hair, trousers: K.TROUSERS[seed % K.TROUSERS.length], ...K.WORN,
    brows: shaded(hair, K.BROWS), lips: shaded(skin, K.LIPS) };
  const found = { top: new THREE.Color(top) };
  for (const [name, colour] of Object.entries(rgb)) {
    found[name] = new THREE.Color().setRGB(colour[0], colour[1], colour[2], THREE.SRGBColorSpace);
  }
  return found;
}

/** A number that is the name's own; names that are numbered differ by one. */
export function numberOf(name) {
  const base = name.replace(/[0-9]+$/, "");
  const tail = name.slice(base.length).slice(-6);
  return crc32(new TextEncoder().encode(base)) % 10_000 + Number(tail || 0);
}

function crc32(bytes) {
  let crc = -1;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}
