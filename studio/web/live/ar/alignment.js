// The room on a headset's space: from marks of known places, by least squares, turned about up alone.
// Metres, Y up.

const MIN_APART_M = 1; // a centimetre beside two marks is 0.8° then, and 4 cm at 3 m
const MAX_RESIDUAL_M = 0.05; // a hand marks to a centimetre or two; the next code is farther away
const BESIDE_ROOM_M = 0.5; // so far outside of the room's sides somebody may stand who marks from a door

/** Where marks lie in the room: { yaw, place, residual_m, apart_m }. A mark is { seen, known }, three
    numbers each: in the headset's space and in the room. There are two or more. */
export function aligned(marks) {
  const [from, to] = ["seen", "known"].map((key) => mean(marks.map((mark) => mark[key])));
  let [along, across] = [0, 0];
  for (const { seen, known } of marks) {
    const [px, pz, qx, qz] = [seen[0] - from[0], seen[2] - from[2], known[0] - to[0], known[2] - to[2]];
    along += px * qx + pz * qz;
    across += pz * qx - px * qz;
  }
  const yaw = Math.atan2(across, along);
  const turnedFrom = turned(from, yaw);
  const place = to.map((value, i) => value - turnedFrom[i]);
  const squares = marks.map(({ seen, known }) => distance(laid(seen, { yaw, place }), known) ** 2);
  return { yaw, place, residual_m: Math.sqrt(mean(squares.map((square) => [square]))[0]),
    apart_m: Math.min(apart(marks, "seen"), apart(marks, "known")) };
}

/** A place of the headset's space in the room. */
export function laid(seen, { yaw, place }) {
  return turned(seen, yaw).map((value, i) => value + place[i]);
}

/** Words that say why marks are not good enough and what to do; null if they are.
    `head`: where one stands, in the headset's space; `footprint`: the room's, x and y of the world. */
export function flawOf(found, head, footprint) {
  if (found.apart_m < MIN_APART_M) {
    return `The marks are ${metres(found.apart_m)} apart, wanted ${metres(MIN_APART_M)} or more: `
      + "mark codes on different walls.";
  }
  if (found.residual_m > MAX_RESIDUAL_M) {
    return `The marks are ${centimetres(found.residual_m)} off, wanted ${centimetres(MAX_RESIDUAL_M)} or `
      + "less: mark each code in its middle, and the one that is named.";
  }
  const [x, , z] = laid(head, found);
  const [[lowX, lowY], [highX, highY]] = footprint;
  const outside = Math.max(lowX - x, x - highX, lowY + z, -z - highY);
  if (outside > BESIDE_ROOM_M) {
    return `You would stand ${metres(outside)} outside of the room: codes were taken for each other. `
      + "Mark the ones that are named.";
  }
  return null;
}

/** A length in words. */
export const centimetres = (length) => `${(100 * length).toFixed(1)} cm`;
const metres = (length) => `${length.toFixed(1)} m`;

function turned([x, y, z], yaw) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [c * x + s * z, y, c * z - s * x];
}

const mean = (rows) => rows[0].map((_, i) => rows.reduce((sum, row) => sum + row[i], 0) / rows.length);
const distance = (a, b) => Math.hypot(...a.map((value, i) => value - b[i]));

/** The longest way over the floor between two places. */
function apart(marks, key) {
  const places = marks.map((mark) => [mark[key][0], mark[key][2]]);
  return Math.max(...places.flatMap((a) => places.map((b) => distance(a, b))));
}
