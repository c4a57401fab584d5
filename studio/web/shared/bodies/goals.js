// What a body is solved for: { eyes, head, wrists, grips, palms, fingers, aim }, metres of the world,
// Z up; null where nobody knows. A head's columns are ahead, left and up: `scenes/bodies/goals.py`.
import * as K from "shared/bodies/constants.js";
import { added, length, less, moved, unit } from "shared/bodies/vectors.js";
import { fingerAngles } from "shared/bodies/hands.js";

/** A point of a headset's axes (Y up) in the world's (Z up). */
export const toWorld = (/** @type {number[]} */ [x, y, z]) => [x, -z, y];

/** A vector turned by a quaternion x y z w.
 * @param {number[]} quaternion @param {number[]} vector */
export function turnedBy(quaternion, vector) {
  const [[x, y, z, w], [a, b, c]] = [quaternion, vector];
  const [u, v, s] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * u + y * s - z * v, b + w * v + z * u - x * s, c + w * s + x * v - y * u];
}

/** Goals of a body as it comes by the wire (Y up); `hands` are { joints } of 75 numbers. */
export function goalOf({ head, hands = [null, null], grips = [null, null], ray = null }) {
  const turn = head.slice(3, 7);
  const axis = (v) => toWorld(turnedBy(turn, v));
  return goal({
    eyes: toWorld(head),
    head: [axis([0, 0, -1]), axis([-1, 0, 0]), axis([0, 1, 0])],
    hands: hands.map((hand, side) => {
      if (hand !== null) return pointsOf(hand.joints).map(toWorld);
      return grips[side] === null ? null : [toWorld(grips[side])];
    }),
    ray: ray && pointsOf(ray).map(toWorld),
  });
}

/** Goals of a head, of hands as lists of points (25 joints, or the middle of a palm) and of a ray. */
export function goal({ eyes, head, hands, ray }) {
  const found = { eyes, head, wrists: [null, null], grips: [0, 0], palms: [null, null],
    fingers: [null, null], aim: null };
  hands.forEach((hand, side) => {
    if (hand === null) return;
    const isTracked = hand.length === K.JOINTS;
    found.wrists[side] = isTracked ? hand[0] : middle(hand);
    if (!isTracked) {
      found.grips[side] = K.GRIP_M;
      return;
    }
    const seen = fingerAngles(side, hand);
    if (seen !== null) [found.palms[side], found.fingers[side]] = [seen.palm, seen.angles];
  });
  if (ray === null) return found;
  const known = hands.filter((hand) => hand !== null);
  if (!known.length) found.aim = ray[1];
  else if (known.every((hand) => hand.length !== K.JOINTS)) {
    const far = found.wrists.map((wrist) => (wrist === null ? Infinity : length(less(wrist, ray[0]))));
    found.fingers[far[1] < far[0] ? 1 : 0] = K.POINTING;
  }
  return found;
}

/** Where the wrist of a right arm is that points at something. */
export const pointingWrist = (aim, shoulder) =>
  moved(shoulder, K.POINTING_REACH_M, unit(less(aim, shoulder)));

function middle(points) {
  const sum = points.reduce(added);
  return sum.map((value) => value / points.length);
}

function pointsOf(numbers) {
  const found = [];
  for (let i = 0; i < numbers.length; i += 3) found.push([numbers[i], numbers[i + 1], numbers[i + 2]]);
  return found;
}
