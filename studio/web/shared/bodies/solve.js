// From a head and hands to a skeleton, a person at a time; a state and a time step carry on the rest:
// `scenes/bodies/solve.py`. Between, all is in the reference person's metres.
import * as K from "shared/bodies/constants.js";
import { armOf } from "shared/bodies/arms.js";
import { laidOut } from "shared/bodies/bones.js";
import { pointingWrist } from "shared/bodies/goals.js";
import { fingersOf, armPoints } from "shared/bodies/hands.js";
import { footAt, legsOf, standing, stepped, tilted } from "shared/bodies/legs.js";
import { depthIn, pushOut } from "shared/bodies/solids.js";
import { headAngles, middleBelow, shouldersOf, torsoOf } from "shared/bodies/torso.js";
import {
  added, back, clip, less, mirrored, moved, scaled, smooth, turned, unit, wrapped, yawRotation,
} from "shared/bodies/vectors.js";

const own = (side, v) => (side === 0 ? v : mirrored(v));

/** [state, skeleton] after `dt_s`; no state lays the body out anew. `solids`: boxes, or null. */
export function solveBody(before, goal, dt_s = 0, solids = null) {
  const isFresh = before === null || !(dt_s >= 0 && dt_s <= K.MAX_GAP_S);
  const state = isFresh ? freshBody(goal) : { ...before };
  const dt = isFresh ? 0 : dt_s;
  state.eyes_m = eyeHeight(state.eyes_m, goal.eyes[2], dt);
  const scale = state.eyes_m / K.EYE_M;
  const eyes = scaled(goal.eyes, 1 / scale);
  state.facing = facingOf(state.facing, goal, dt);
  const [left, right] = state.feet.map(footAt);
  const between = [(left[0] + right[0]) / 2, (left[1] + right[1]) / 2];
  const torso = torsoOf(eyes, goal.head, state.facing, between);
  const middle = middleBelow(torso, state.facing);
  if (dt > 0) {
    const share = 1 - Math.exp(-dt / K.SPEED_S);
    state.velocity = state.velocity.map((v, i) => v + share * ((middle[i] - state.middle[i]) / dt - v));
  }
  state.feet = stepped(state.feet, middle, state.facing, state.velocity, dt);
  state.middle = middle;
  torso.pelvisTurn = tilted(torso, state.feet);
  const { wrists, angles } = handGoals(state, goal, torso, scale, dt);
  const clavicles = shouldersOf(torso, wrists);
  const boxes = solids !== null && solids.length ? solids : null;
  const reach = (side, wrist, palm) => armOf(side, {
    shoulder: clavicles[side].shoulder, wrist, palm, chest: torso.chestTurn,
    previous: state.swivels[side], maxTurn: K.SWIVEL_RAD_S * dt,
    depth: boxes && ((point) => depthIn(boxes, scaled(point, scale))) });
  let arms = [0, 1].map((side) => reach(side, wrists[side], goal.palms[side]));
  const fingers = angles.map((each, side) => fingersOf(side, each));
  if (boxes !== null) arms = outOfSolids(arms, { reach, clavicles, torso, goal, fingers, boxes, scale });
  state.swivels = arms.map((arm) => arm.swivel);
  const legs = legsOf(torso, state.feet);
  return [state, { ...laidOut(torso, { clavicles, arms, legs, fingers, scale }), scale }];
}

/** The state of somebody of whom nothing is known yet: they stand below their head. */
function freshBody(goal) {
  const seen = goal.eyes[2];
  const eyes_m = seen >= K.MIN_EYE_M && seen <= K.MAX_EYE_M ? seen : K.EYE_M;
  const eyes = scaled(goal.eyes, K.EYE_M / eyes_m);
  const facing = wantedFacing(goal);
  const middle = middleBelow(torsoOf(eyes, goal.head, facing, eyes), facing);
  return {
    eyes_m,
    facing,
    feet: standing(middle, facing),
    middle,
    velocity: [0, 0],
    swivels: [null, null],
    reaches: goal.wrists.map((wrist, side) =>
      Number(wrist !== null || (side === 1 && goal.aim !== null))),
    wrists: [K.HANGING, K.HANGING],
    fingers: [K.RELAXED, K.RELAXED],
  };
}

/** Somebody who is seen higher up, and not flying, is taller. */
function eyeHeight(known_m, seen_m, dt) {
  const taller = seen_m <= K.MAX_EYE_M ? Math.max(seen_m, known_m) : known_m;
  return clip(Math.min(taller, known_m + K.GROWTH_M_S * dt), K.MIN_EYE_M, K.MAX_EYE_M);
}

/** The head's yaw, drawn towards two hands held ahead. */
function wantedFacing({ head, eyes, wrists: [left, right] }) {
  const [yaw] = headAngles(head);
  if (left === null || right === null) return yaw;
  const [x, y] = less(scaled(added(left, right), 0.5), eyes);
  const weight = 0.5 * smooth(Math.hypot(x, y) / 0.35);
  return yaw + weight * clip(wrapped(Math.atan2(y, x) - yaw), -1, 1);
}

function facingOf(facing, goal, dt) {
  const [yaw] = headAngles(goal.head);
  const off = wrapped(wantedFacing(goal) - facing);
  const free = Math.sign(off) * Math.max(Math.abs(off) - K.TURN_FREE_RAD, 0);
  const turnedTo = facing + (1 - Math.exp(-dt / K.TURN_S)) * free;
  return yaw + clip(wrapped(turnedTo - yaw), -K.MAX_TURN_RAD, K.MAX_TURN_RAD);
}

/** Where wrists go, and fingers' angles; takes note in the state of where hands were seen. */
function handGoals(state, goal, torso, scale, dt) {
  const body = yawRotation(state.facing);
  const low = moved(torso.neck, -1, [0, 0, 1]);
  const shoulders = shouldersOf(torso, [low, low]).map(({ shoulder }) => shoulder);
  const ahead = state.feet.map((foot) => {
    const [x, y] = footAt(foot);
    return x * body[0][0] + y * body[0][1];
  });
  const points = goal.aim !== null && goal.wrists[1] === null;
  const found = { wrists: [], angles: [] };
  const [reaches, last] = [[], []];
  for (const side of [0, 1]) {
    let seen = goal.wrists[side] && scaled(goal.wrists[side], 1 / scale);
    if (seen) seen = moved(seen, -goal.grips[side] / scale, unit(less(seen, shoulders[side])));
    if (side === 1 && points) seen = pointingWrist(scaled(goal.aim, 1 / scale), shoulders[1]);
    last[side] = seen ? back(body, less(seen, shoulders[side])) : state.wrists[side];
    let angles = goal.fingers[side] ?? state.fingers[side];
    if (side === 1 && points) angles = K.POINTING;
    reaches[side] = clip(state.reaches[side] + (seen ? 1 : -1) * dt / K.REACH_S, 0, 1);
    const swing = 0.35 * (ahead[0] - ahead[1]) * -K.SIDES[side];
    const hanging = added(own(side, K.HANGING), [swing, 0, 0.5 * swing * swing]);
    const share = smooth(reaches[side]);
    const local = moved(hanging, share, less(last[side], hanging));
    found.wrists.push(added(shoulders[side], turned(body, local)));
    found.angles.push(K.RELAXED.map((finger, f) =>
      finger.map((rest, k) => rest + share * (angles[f][k] - rest))));
  }
  [state.reaches, state.wrists] = [reaches, last];
  return found;
}

/** Arms of which no hand is in a solid by more than `MAX_DEPTH_M`. */
function outOfSolids(arms, { reach, clavicles, torso, goal, fingers, boxes, scale }) {
  const points = (arm, side) => armPoints(arm, fingers[side]).map((point) => scaled(point, scale));
  const deepest = (arm, side) => Math.max(...points(arm, side).map((point) => depthIn(boxes, point)));
  const half = 0.5 * K.MAX_DEPTH_M;
  let depths = arms.map(deepest);
  if (!(Math.max(...depths) > half)) return arms;
  let palms = goal.palms;
  const wrists = arms.map((arm) => arm.wrist);
  const again = () => { arms = wrists.map((wrist, side) => reach(side, wrist, palms[side])); };
  for (let round = 0; round < K.ROUNDS; round++) {
    depths = arms.map(deepest);
    if (Math.max(...depths) <= half) return arms;
    arms.forEach((arm, side) => {
      if (!(depths[side] > 0)) return;
      wrists[side] = moved(arm.wrist, 1 / scale, pushOut(boxes, points(arm, side)));
    });
    again();
  }
  for (const safe of K.SAFE_PLACES) {
    const end = clavicles.map(({ shoulder }, side) =>
      added(shoulder, turned(torso.chestTurn, own(side, safe))));
    const start = arms.map((arm) => arm.wrist);
    for (const share of K.RETREATS) {
      const deep = arms.map((arm, side) => deepest(arm, side) > K.MAX_DEPTH_M);
      if (!deep.includes(true)) return arms;
      deep.forEach((isDeep, side) => {
        if (isDeep) wrists[side] = moved(start[side], share, less(end[side], start[side]));
      });
      again();
    }
    // A hand that is in the way however near it is may be held in another way.
    palms = [null, null];
  }
  return arms;
}
