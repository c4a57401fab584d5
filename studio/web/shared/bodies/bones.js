// Joints of torso, arms, legs and hands laid out as bones: `scenes/bodies/bones.py`.
import * as K from "shared/bodies/constants.js";
import {
  about, added, clip, frame, less, scaled, times, timesBack, turned, unit,
} from "shared/bodies/vectors.js";
import { rotationOf } from "shared/bodies/torso.js";

const [ALONG, HINGE, REST_PALM] = [K.REST_ALONG, K.REST_HINGE, K.REST_PALM];
const ARM_REST = [0, 1].map((side) => frame(ALONG[side], HINGE[side]));
const LEG_REST = frame([0, 0, -1], [1, 0, 0]);

/** { origins, turns }: where each bone begins in the world, metres, and its rotation. */
export function laidOut(torso, { clavicles, arms, legs, fingers, scale }) {
  const [origins, turns] = [[], []];
  const put = (bone, place, turn) => {
    origins[bone] = scaled(place, scale);
    turns[bone] = turn;
  };
  const B = K.BONE;
  put(B.PELVIS, torso.pelvis, torso.pelvisTurn);
  put(B.SPINE, torso.pelvis, torso.chestTurn);
  put(B.CHEST, torso.waist, torso.chestTurn);
  put(B.NECK, torso.neck, torso.neckTurn);
  put(B.HEAD, torso.head, torso.headTurn);
  for (const side of [0, 1]) {
    const [arm, { root, shoulder, turn }] = [arms[side], clavicles[side]];
    const [upper, fore] = [unit(less(arm.elbow, shoulder)), unit(less(arm.wrist, arm.elbow))];
    // A forearm's skin turns half as far as the hand.
    const half = about(fore, 0.5 * arm.pronation * K.SIDES[side], arm.hinge);
    const off = side * K.ARM_BONES;
    put(B.CLAVICLE + off, root, turn);
    put(B.UPPER_ARM + off, shoulder, timesBack(frame(upper, arm.hinge), ARM_REST[side]));
    put(B.FOREARM + off, arm.elbow, timesBack(frame(fore, half), ARM_REST[side]));
    put(B.HAND + off, arm.wrist, timesBack(arm.palm, REST_PALM[side]));
    fingers[side].forEach(({ places, turns: bends }, finger) => bends.forEach((bend, k) =>
      put(B.FINGERS + side * K.FINGER_BONES + 3 * finger + k,
        added(arm.wrist, turned(arm.palm, places[k])),
        timesBack(times(arm.palm, bend), REST_PALM[side]))));
    layLeg(put, side, legs[side]);
  }
  return { origins, turns };
}

function layLeg(put, side, { hip, knee, ankle, yaw }) {
  const ahead = [Math.cos(yaw), Math.sin(yaw), -1e-3];
  const lifted = clip((ankle[2] - K.ANKLE_M) * K.TOES_DOWN_PER_M, 0, K.MAX_TOES_DOWN_RAD);
  const off = side * K.LEG_BONES;
  put(K.BONE.THIGH + off, hip, timesBack(frame(unit(less(knee, hip)), ahead), LEG_REST));
  put(K.BONE.SHIN + off, knee, timesBack(frame(unit(less(ankle, knee)), ahead), LEG_REST));
  put(K.BONE.FOOT + off, ankle, rotationOf(yaw, lifted, 0));
}
