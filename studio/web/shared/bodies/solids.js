// Solid boxes that hands stay out of, { centre, turn, half }: `scenes/bodies/solids.py`.
import * as K from "shared/bodies/constants.js";
import { added, back, less, moved } from "shared/bodies/vectors.js";

/** How deep a point is in the deepest solid, metres; 0 outside. */
export function depthIn(solids, point) {
  let deepest = 0;
  for (const { centre, turn, half } of solids) {
    const local = back(turn, less(point, centre));
    const depth = K.SKIN_M + Math.min(half[0] - Math.abs(local[0]), half[1] - Math.abs(local[1]),
      half[2] - Math.abs(local[2]));
    if (depth > deepest) deepest = depth;
  }
  return deepest;
}

/** The shift that takes a group of points out of the solids, one after the other. */
export function pushOut(solids, points) {
  let shift = [0, 0, 0];
  for (const { centre, turn, half: bare } of solids) {
    const half = bare.map((value) => value + K.SKIN_M);
    const local = points.map((point) => back(turn, less(added(point, shift), centre)));
    const inside = local.filter((p) => p.every((value, i) => Math.abs(value) < half[i]));
    if (!inside.length) continue;
    // To leave by +axis the lowest point that is inside decides, by -axis the highest.
    const low = [0, 1, 2].map((i) => half[i] - Math.min(...inside.map((p) => p[i])));
    const high = [0, 1, 2].map((i) => half[i] + Math.max(...inside.map((p) => p[i])));
    const ways = [...low, ...high];
    const best = ways.indexOf(Math.min(...ways));
    shift = moved(shift, (best < 3 ? 1 : -1) * (ways[best] + K.GAP_M), turn[best % 3]);
  }
  return shift;
}
