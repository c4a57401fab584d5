// Hands: joints of a tracked one to a palm and fingers' angles, and those to bones:
// `scenes/bodies/hands.py`. Fingers are numbered from the thumb; angles are spread and three bends.
import * as K from "shared/bodies/constants.js";
import {
  across, added, back, clip, cross, dot, frame, less, mirrored, moved, scaled, timesBack, turned, unit,
  within,
} from "shared/bodies/vectors.js";

const FIRST = [2, 6, 11, 16, 21]; // joint of a tracked hand at which each drawn finger begins
const BASES = K.FAN_RAD.map((fan, finger) => {
  const along = finger === 0 ? unit([0.72, 0.62, -0.32]) : [Math.cos(fan), Math.sin(fan), 0];
  const dorsal = finger === 0 ? across([-0.30, 0.62, 0.72], along) : [0, 0, 1];
  return [along, cross(dorsal, along), dorsal];
});
const own = (side, v) => (side === 0 ? mirrored(v) : v);

/** { palm, angles } of a tracked hand, 25 joints of the world; null where they say nothing. */
export function fingerAngles(side, joints) {
  const wrist = joints[0];
  const width = scaled(less(joints[6], joints[21]), -K.SIDES[side]);
  const palm = frame(unit(less(joints[11], wrist)), width);
  const angles = FIRST.map((first, finger) => {
    const local = [0, 1, 2].map((k) => {
      // The first joint of a finger other than the thumb is its metacarpal, in the palm.
      const at = first + k - (finger === 0 ? 1 : 0);
      const bone = unit(less(joints[at + 1], joints[at]));
      return back(BASES[finger], own(side, back(palm, bone)));
    });
    const hinge = across([0, 1, 0], local[0]);
    const bend = (a, b) => Math.atan2(dot(cross(a, b), hinge), dot(a, b));
    return [
      within(K.FINGER_SPREAD, Math.asin(clip(local[0][1], -1, 1))),
      within(K.FINGER_FLEXION[0], Math.atan2(-local[0][2], local[0][0])),
      within(K.FINGER_FLEXION[1], bend(local[0], local[1])),
      within(K.FINGER_FLEXION[2], bend(local[1], local[2])),
    ];
  });
  const isKnown = [palm, angles].flat(2).every(Number.isFinite);
  return isKnown ? { palm, angles } : null;
}

/** Per finger { places, turns }: where its bones begin in the palm and its tip, and rotations. */
export function fingersOf(side, angles) {
  return bones(side, angles).map(({ places, turns }, finger) => ({
    places, turns: turns.map((turn, k) => timesBack(turn, REST[side][finger][k])) }));
}

function bones(side, angles) {
  return angles.map(([spread, ...bends], finger) => {
    const [c, s] = [Math.cos(spread), Math.sin(spread)];
    let bend = 0;
    let at = own(side, K.KNUCKLES[finger]);
    const places = [at];
    const turns = bends.map((more, k) => {
      bend += more;
      const along = own(side, turned(BASES[finger], [c * Math.cos(bend), s, -c * Math.sin(bend)]));
      const dorsal = own(side, turned(BASES[finger], [Math.sin(bend), 0, Math.cos(bend)]));
      at = moved(at, K.PHALANGES_M[finger][k], along);
      places.push(at);
      return frame(along, dorsal);
    });
    return { places, turns };
  });
}

const FLAT = K.FAN_RAD.map(() => [0, 0, 0, 0]);
const REST = [0, 1].map((side) => bones(side, FLAT).map(({ turns }) => turns));

/** Points of an arm below the elbow that solids may stop, in the world. */
export function armPoints(arm, fingers) {
  const palm = K.PALM.flatMap((share) => fingers.slice(1).map(({ places }) => scaled(places[0], share)));
  const middles = fingers.flatMap(({ places }) =>
    places.slice(1).map((place, k) => scaled(added(place, places[k]), 0.5)));
  const hand = [...palm, ...fingers.flatMap(({ places }) => places), ...middles]
    .map((place) => added(arm.wrist, turned(arm.palm, place)));
  const along = less(arm.elbow, arm.wrist);
  return [arm.wrist, ...hand, ...K.FOREARM.map((share) => moved(arm.wrist, share, along))];
}
