// Legs: feet that stay where they stand, and step when the body has moved on: `scenes/bodies/legs.py`.
import * as K from "shared/bodies/constants.js";
import {
  about, across, added, back, clip, cross, dot, excess, length, less, mirrored, moved, scaled, smooth,
  turned, unit, within, wrapped,
} from "shared/bodies/vectors.js";

/** Feet, left and right: { place, goal } as [x, y, yaw], and the share of a step; 1 stands. */
export function standing(middle, facing) {
  return feetBelow(middle, facing).map((place) => ({ place, goal: place, step: 1 }));
}

function feetBelow(middle, facing) {
  const [c, s] = [Math.cos(facing), Math.sin(facing)];
  return K.SIDES.map((side) => {
    const out = K.HALF_STANCE_M * side;
    return [middle[0] - s * out, middle[1] + c * out, facing + K.TOES_OUT_RAD * side];
  });
}

/** [x, y, height over the floor, yaw] of a foot. */
export function footAt({ place, goal, step }) {
  const change = [goal[0] - place[0], goal[1] - place[1], wrapped(goal[2] - place[2])];
  const share = smooth(step);
  const lift = K.STEP_HEIGHT_M * Math.sin(Math.PI * clip(step, 0, 1));
  const far = Math.min(Math.hypot(change[0], change[1]) / 0.2 + Math.abs(change[2]), 1);
  return [place[0] + share * change[0], place[1] + share * change[1], lift * far,
    place[2] + share * change[2]];
}

/** Feet a moment later; of two at most one is in the air unless both are far away. */
export function stepped(feet, middle, facing, velocity, dt_s) {
  const home = feetBelow(middle, facing);
  const speed = Math.hypot(...velocity);
  const pace = K.STEP_S / (1 + 0.6 * Math.min(speed, 2.5));
  const lead = Math.min(0.9 * pace, K.STRIDE_M / Math.max(speed, 1e-6));
  const far = (i, place) => Math.hypot(home[i][0] - place[0], home[i][1] - place[1]);
  const later = feet.map(({ place, goal, step }, i) => {
    const next = Math.min(step + dt_s / pace, 1);
    const stands = next >= 1 && step < 1 ? goal : place;
    const aim = [home[i][0] + velocity[0] * lead, home[i][1] + velocity[1] * lead, home[i][2]];
    const isMoving = next < 1;
    const error = isMoving ? 0 : Math.max(far(i, stands) / K.STEP_FROM_M,
      Math.abs(wrapped(home[i][2] - stands[2])) / K.STEP_FROM_RAD);
    return { place: stands, goal: isMoving && next < 0.7 ? aim : goal, step: next, aim, error, isMoving };
  });
  const isMoving = later.some((foot) => foot.isMoving);
  const first = later[0].error >= later[1].error - K.EVEN ? 0 : 1;
  if (later[first].error > 1 && !isMoving) {
    later[first].step = 0;
    later[first].goal = later[first].aim;
  }
  if (Math.max(...later.map(({ place }, i) => far(i, place))) > K.JUMP_M) return standing(middle, facing);
  return later.map(({ place, goal, step }) => ({ place, goal, step }));
}

/** The rotation of a pelvis that is tilted back where a thigh would be bent further than it goes. */
export function tilted(torso, feet) {
  let pelvisTurn = torso.pelvisTurn;
  for (let i = 0; i < K.TILTS; i++) {
    const own = { ...torso, pelvisTurn };
    const most = Math.max(...freeLegs(own, feet).map(({ hip, knee }, side) =>
      hipAngles(pelvisTurn, side, unit(less(knee, hip)))[0] - K.HIP_FLEXION[1]));
    if (!(most > 0)) break;
    const level = pelvisTurn[1];
    pelvisTurn = pelvisTurn.map((axis) => about(level, -most, axis));
  }
  return pelvisTurn;
}

function hipAngles(pelvisTurn, i, thigh) {
  const local = back(pelvisTurn, thigh);
  return [Math.atan2(local[0], -local[2]), Math.asin(clip(local[1] * K.SIDES[i], -1, 1))];
}

/** Hip, knee, ankle and yaw of the foot, left and right. */
export function legsOf(torso, feet) {
  return freeLegs(torso, feet).map((leg, i) => {
    const angles = hipAngles(torso.pelvisTurn, i, unit(less(leg.knee, leg.hip)));
    if (!(excess(K.HIP_FLEXION, angles[0]) + excess(K.HIP_ABDUCTION, angles[1]) > 0)) return leg;
    const [flexion, abduction] = [within(K.HIP_FLEXION, angles[0]), within(K.HIP_ABDUCTION, angles[1])];
    const level = Math.cos(abduction);
    const thigh = turned(torso.pelvisTurn, [
      level * Math.sin(flexion), K.SIDES[i] * Math.sin(abduction), -level * Math.cos(flexion)]);
    const knee = moved(leg.hip, K.THIGH_M, thigh);
    return { ...leg, knee, ankle: moved(knee, K.SHIN_M, shin(knee, thigh, leg.ankle)) };
  });
}

function shin(knee, thigh, ankle) {
  let way = unit(less(ankle, knee));
  const down = clip((K.ANKLE_M - knee[2]) / K.SHIN_M, -1, 1);
  if (way[2] < down) {
    const level = Math.sqrt(1 - down * down) / Math.max(Math.hypot(way[0], way[1]), 1e-9);
    way = unit([level * way[0], level * way[1], down]);
  }
  const bend = Math.atan2(length(cross(thigh, way)), dot(thigh, way));
  if (bend <= K.KNEE[1]) return way;
  return moved(scaled(thigh, Math.cos(K.KNEE[1])), Math.sin(K.KNEE[1]), across(way, thigh));
}

function freeLegs({ pelvis, pelvisTurn }, feet) {
  return feet.map((foot, i) => {
    const side = K.SIDES[i];
    const inPelvis = side > 0 ? K.HIP_IN_PELVIS : mirrored(K.HIP_IN_PELVIS);
    const hip = added(pelvis, turned(pelvisTurn, inPelvis));
    const [x, y, height, yaw] = footAt(foot);
    const below = [hip[0], hip[1], hip[2] - K.LEG_M];
    const hovers = smooth((below[2] - K.ANKLE_M) / 0.25);
    let ankle = [x, y, K.ANKLE_M + height];
    ankle = moved(ankle, hovers, less([below[0], below[1], below[2] - 0.004], ankle));
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    const pole = [c - 0.08 * side * s, s + 0.08 * side * c, 0];
    return { hip, ...bent(hip, ankle, pole), yaw };
  });
}

/** Knee and reached ankle of a leg that bends towards a pole. */
function bent(hip, end, pole) {
  const towards = less(end, hip);
  const axis = unit(towards);
  const reach = clip(length(towards), K.MIN_LEG_M, K.LEG_M);
  const along = (K.THIGH_M ** 2 - K.SHIN_M ** 2 + reach ** 2) / (2 * reach);
  const out = Math.sqrt(Math.max(K.THIGH_M ** 2 - along ** 2, 0));
  const off = dot(pole, axis) > 0.999 ? 1e-6 : 0;
  const side = across([pole[0] + off, pole[1] + off, pole[2] + off], axis);
  return {
    knee: moved(moved(hip, along, axis), out, side),
    ankle: moved(hip, reach, axis),
  };
}
