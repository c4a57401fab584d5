// Arms: from shoulders and wrists to elbows and hands, within what joints can do:
// `scenes/bodies/arms.py`. A right arm is solved as the mirror image of a left one.
import * as K from "shared/bodies/constants.js";
import {
  about, across, back, clip, cross, dot, excess, length, less, mirrored, moved, scaled, turned,
  unit, whole, within, wrapped,
} from "shared/bodies/vectors.js";

const ROUND = 2 * Math.PI;
const STEP = ROUND / K.SWIVELS;
const DEGREE = Math.PI / 180;
const [ACROSS_CHEST, UP] = [[Math.SQRT1_2, -Math.SQRT1_2, 0], [0, 0, 1]];
const OUT = unit([0.5, 0.5, -0.7]); // where a hand is put that is in the shoulder
const NATURAL = Array.from({ length: K.SWIVELS }, (_, i) => Math.cos(i * STEP));
const CONE = K.SHOULDER_CONE_DEG.map(([around, limit]) => [around * DEGREE, limit * DEGREE]);

/** Angle of an upper arm from the middle of its reach, and direction around it. */
function coneAngles(upper) {
  const side = dot(upper, ACROSS_CHEST);
  const high = upper[2];
  return [Math.atan2(Math.sqrt(side * side + high * high), dot(upper, K.SHOULDER_AXIS)),
    whole(Math.atan2(high, side))];
}

function coneLimit(around) {
  let i = 1;
  while (i < CONE.length - 1 && CONE[i][0] < around) i += 1;
  const [[from, low], [to, high]] = [CONE[i - 1], CONE[i]];
  return low + (high - low) * clip((around - from) / (to - from), 0, 1);
}

/** The direction across the chest, carried along as an arm swings to `upper`. */
function swung(upper) {
  const turn = cross(K.SHOULDER_AXIS, upper);
  const sine = length(turn);
  const angle = Math.atan2(sine, dot(K.SHOULDER_AXIS, upper));
  return about(sine < 1e-6 ? UP : scaled(turn, 1 / sine), angle, ACROSS_CHEST);
}

function twistOf(upper, fore) {
  const zero = swung(upper);
  const lever = across(fore, upper);
  return Math.atan2(dot(cross(zero, lever), upper), dot(zero, lever));
}

/** One arm; `side` 0 is the left one, `palm` null where that is free, `previous` null at first. */
export function armOf(side, { shoulder, wrist, palm, chest, previous, maxTurn, depth }) {
  const own = side === 0 ? (v) => v : mirrored;
  const circle = circleOf(own(back(chest, less(wrist, shoulder))));
  const localPalm = palm && palm.map((axis) => own(back(chest, axis)));
  let swivel = lowest((i) => {
    const [upper, fore] = placed(circle, i * STEP);
    const inSolid = depth
      ? depth(moved(shoulder, K.UPPER_ARM_M, turned(chest, own(upper)))) : 0;
    return [1 - NATURAL[i] + K.IN_BODY * (Math.max(bodyDepth(upper), 0) + inSolid)
      + strain(upper, fore), upper, fore];
  }, localPalm);
  if (previous !== null) swivel = previous + clip(wrapped(swivel - previous), -maxTurn, maxTurn);
  return withinLimits(side, ...placed(circle, swivel), { palm: localPalm, chest, shoulder, swivel });
}

function circleOf(towards) {
  const distance = length(towards);
  const axis = distance > 1e-6 ? unit(towards) : OUT;
  const reach = clip(distance, K.MIN_REACH_M, K.MAX_REACH_M);
  const along = (K.UPPER_ARM_M ** 2 - K.FOREARM_M ** 2 + reach ** 2) / (2 * reach);
  const out = Math.sqrt(Math.max(K.UPPER_ARM_M ** 2 - along ** 2, 0));
  const first = across(pole(axis, reach), axis);
  return { axis, reach, along, out, first, second: cross(axis, first) };
}

/** Unit vectors of upper arm and forearm for a swivel. */
function placed({ axis, reach, along, out, first, second }, swivel) {
  const [c, s] = [out * Math.cos(swivel), out * Math.sin(swivel)];
  const elbow = [
    along * axis[0] + c * first[0] + s * second[0],
    along * axis[1] + c * first[1] + s * second[1],
    along * axis[2] + c * first[2] + s * second[2]];
  return [scaled(elbow, 1 / K.UPPER_ARM_M),
    scaled(less(scaled(axis, reach), elbow), 1 / K.FOREARM_M)];
}

/** Where elbows like to be. */
function pole(axis, reach) {
  const high = clip(axis[2] + 0.2, 0, 1);
  const inwards = clip(-axis[1], 0, 1);
  const near = 1 - reach / K.MAX_REACH_M;
  return [-0.40 + 0.30 * high + 0.35 * inwards, 0.32 + 0.55 * high + 0.35 * inwards + 0.25 * near,
    -1.0 + 0.55 * high];
}

/** How far the shoulder is beyond its limits, weighted. */
function strain(upper, fore) {
  const [angle, around] = coneAngles(upper);
  return K.OUT_OF_LIMITS * (Math.max(angle - coneLimit(around), 0)
    + excess(K.HUMERAL_TWIST, twistOf(upper, fore)));
}

/** How far the wrist is beyond its limits, weighted. */
function wristStrain(upper, fore, palm) {
  const [pronation, bend, deviation] = wristAngles(fore, unit(cross(upper, fore)), palm);
  return K.OUT_OF_WRIST * (0.7 * excess(K.PRONATION, pronation)
    + excess(K.WRIST_FLEXION, bend) + excess(K.WRIST_DEVIATION, deviation)
    + 0.05 * Math.abs(pronation));
}

function bodyDepth(upper) {
  const [x, y, z] = moved([0, 0.175, -0.045], K.UPPER_ARM_M, upper);
  return z < 0.02 && z > -0.6 ? K.NEAR_BODY_M - Math.hypot(1.3 * x, y) : 0;
}

/** The swivel of the lowest score; `place(i)` gives a score without the wrist, and both bones. */
function lowest(place, palm) {
  const places = Array.from({ length: K.SWIVELS }, (_, i) => place(i));
  const scores = new Array(K.SWIVELS).fill(null);
  const score = (i) => {
    const [free, upper, fore] = places[i];
    scores[i] ??= free + (palm === null ? 0 : wristStrain(upper, fore, palm));
    return scores[i];
  };
  // A wrist only adds to a score: places that are worse without it need no look at it.
  const order = [...places.keys()].sort((a, b) => places[a][0] - places[b][0] || a - b);
  let best = order[0];
  for (const i of order) {
    if (places[i][0] > score(best)) break;
    if (score(i) < score(best) || (score(i) === score(best) && i < best)) best = i;
  }
  const at = (k) => score((best + k + K.SWIVELS) % K.SWIVELS);
  const curve = Math.max(at(-1) - 2 * at(0) + at(1), 1e-9);
  return (best + clip(0.5 * (at(-1) - at(1)) / curve, -0.5, 0.5)) * STEP;
}

/** An arm of which every joint is within its limits, in the world's axes again. */
function withinLimits(side, towards, before, { palm, chest, shoulder, swivel }) {
  const [angle, around] = coneAngles(towards);
  const limit = coneLimit(around);
  const ring = moved(scaled(ACROSS_CHEST, Math.cos(around)), Math.sin(around), UP);
  const upper = angle > limit
    ? moved(scaled(K.SHOULDER_AXIS, Math.cos(limit)), Math.sin(limit), ring) : unit(towards);
  const bend = within(K.ELBOW, Math.atan2(length(cross(upper, before)), dot(upper, before)));
  const lever = about(upper, within(K.HUMERAL_TWIST, twistOf(upper, before)), swung(upper));
  const fore = moved(scaled(upper, Math.cos(bend)), Math.sin(bend), lever);
  const hinge = cross(upper, lever);
  let [pronation, flexion, deviation] = [
    DEGREE * (25 + 40 * clip(fore[2] + 0.75, 0, 1)), 0.06, 0];
  if (palm !== null) [pronation, flexion, deviation] = wristAngles(fore, hinge, palm);
  pronation = within(K.PRONATION, pronation);
  const [ahead, dorsal] = palmOf(fore, hinge, pronation,
    within(K.WRIST_FLEXION, flexion), within(K.WRIST_DEVIATION, deviation));
  const out = (v) => turned(chest, side === 0 ? v : mirrored(v));
  const elbow = moved(shoulder, K.UPPER_ARM_M, out(upper));
  const [along, handBack] = [out(ahead), out(dorsal)];
  return {
    elbow,
    wrist: moved(elbow, K.FOREARM_M, out(fore)),
    // A mirrored frame turns its y round so that it stays right-handed; so does the hinge, an axis.
    hinge: scaled(out(hinge), K.SIDES[side]),
    palm: [along, cross(handBack, along), handBack],
    pronation,
    swivel,
  };
}

/** A palm's direction and its back; the inverse of `wristAngles`. */
function palmOf(fore, hinge, pronation, flexion, deviation) {
  const dorsal = about(fore, pronation, scaled(hinge, -1));
  const side = about(dorsal, deviation, cross(dorsal, fore));
  const ahead = about(dorsal, deviation, fore);
  return [about(side, flexion, ahead), about(side, flexion, dorsal)];
}

function wristAngles(fore, hinge, palm) {
  const [ahead, , dorsal] = palm;
  const side = cross(dorsal, ahead);
  const deviation = -Math.asin(clip(dot(side, fore), -1, 1));
  const flat = unit(moved(side, Math.sin(deviation), fore));
  const foreBack = cross(fore, flat);
  const neutral = scaled(hinge, -1);
  const pronation = Math.atan2(dot(cross(neutral, foreBack), fore), dot(neutral, foreBack));
  const straight = about(foreBack, deviation, fore);
  const flexion = Math.atan2(dot(cross(straight, ahead), side), dot(straight, ahead));
  return [pronation, flexion, deviation];
}
