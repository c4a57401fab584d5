// Head, neck, spine and pelvis, hung from the eyes: `scenes/bodies/torso.py`.
import * as K from "shared/bodies/constants.js";
import {
  added, back, clip, cross, dot, frame, mirrored, moved, scaled, smooth, times, turned, unit,
  less, within, wrapped, yawRotation,
} from "shared/bodies/vectors.js";

const DEGREE = Math.PI / 180;

/** Yaw, pitch and roll of a head, radians. */
export function headAngles([ahead, left, up]) {
  const yaw = Math.atan2(ahead[1] - ahead[2] * up[1], ahead[0] - ahead[2] * up[0]);
  const pitch = -Math.asin(clip(ahead[2], -1, 1));
  const level = [-Math.sin(yaw), Math.cos(yaw), 0];
  const roll = Math.atan2(dot(cross(level, left), ahead), dot(level, left));
  return [yaw, pitch, roll];
}

/** The rotation of the angles that `headAngles` gives. */
export function rotationOf(yaw, pitch, roll) {
  const [c, s, cr, sr] = [Math.cos(pitch), Math.sin(pitch), Math.cos(roll), Math.sin(roll)];
  const above = [s, 0, c];
  return times(yawRotation(yaw), [
    [c, 0, -s], moved([0, cr, 0], sr, above), moved(scaled(above, cr), -sr, [0, 1, 0])]);
}

/** Head to pelvis: joints and rotations; `feet` is [x, y] between both feet. */
export function torsoOf(eyes, head, facing, feet) {
  const [yaw, pitch, tilt] = headAngles(head);
  const turn = wrapped(yaw - facing);
  const chestTurn = within(K.CHEST_TURN, K.SHARE_OF_CHEST * turn);
  const roll = within(K.NECK_ROLL, tilt);
  const neckYaw = facing + 0.5 * (chestTurn + turn);
  const headYaw = facing + chestTurn + within(K.NECK_TURN, turn - chestTurn);
  const hung = (lean) => {
    const nod = clip(pitch, lean + K.NECK_PITCH[0], lean + K.NECK_PITCH[1]);
    const headTurn = rotationOf(headYaw, nod, roll);
    const neckTurn = rotationOf(neckYaw, 0.5 * (lean + nod), 0.5 * roll);
    const at = less(eyes, turned(headTurn, K.EYES_IN_HEAD));
    return [at, less(at, turned(neckTurn, K.NECK_UP)), headTurn, neckTurn];
  };
  const [headAt, neck, headTurn, neckTurn] = hung(leanOf(hung(0)[1][2], pitch));
  const lean = leanOf(neck[2], pitch);
  const spine = backOf(neck, lean, facing, feet);
  return {
    pelvis: moved(neck, -K.BACK_M, spine),
    waist: moved(neck, -K.THORAX_M, spine),
    neck,
    head: headAt,
    pelvisTurn: upright(unit(added(spine, [0, 0, 1])), facing),
    chestTurn: upright(spine, facing + chestTurn),
    neckTurn,
    headTurn,
    lean,
  };
}

/** [x, y] where the middle between both feet belongs. */
export function middleBelow({ neck, lean }, facing) {
  const off = K.FEET_BELOW * K.BACK_M * Math.sin(lean);
  return [neck[0] - off * Math.cos(facing), neck[1] - off * Math.sin(facing)];
}

function leanOf(neck_m, pitch) {
  const drop = K.STANDING_PELVIS_M + K.BACK_M - neck_m;
  const down = smooth(pitch / (60 * DEGREE));
  const lean = Math.max(drop, 0) * (K.LEAN_PER_DROP + K.LOOKING_LEAN * down);
  const steepest = Math.acos(clip((neck_m - K.STANDING_PELVIS_M) / K.BACK_M, -1, 1));
  const flattest = Math.acos(clip((neck_m - K.MIN_PELVIS_M) / K.BACK_M, -1, 1));
  return Math.min(Math.max(Math.min(lean, steepest), flattest), K.MAX_LEAN_RAD);
}

function backOf(neck, lean, facing, feet) {
  const s = Math.sin(lean);
  const way = [Math.cos(facing) * s, Math.sin(facing) * s];
  const off = [0, 1].map((i) =>
    K.BALANCE * (neck[i] - feet[i] - K.FEET_BELOW * K.BACK_M * way[i]) / K.BACK_M);
  const far = Math.hypot(...off);
  const share = K.MAX_BALANCE * Math.tanh(far / K.MAX_BALANCE) / Math.max(far, 1e-9)
    * Math.max(Math.cos(lean), 0);
  return unit([way[0] + share * off[0], way[1] + share * off[1], Math.cos(lean)]);
}

function upright(up, yaw) {
  const made = frame(up, [-Math.sin(yaw), Math.cos(yaw), 0]);
  return [scaled(made[2], -1), made[1], made[0]];
}

/** Inner ends of collarbones, shoulders and collarbones' rotations, left and right. */
export function shouldersOf(torso, wrists) {
  return K.SIDES.map((side, i) => {
    const own = side > 0 ? (v) => v : mirrored;
    const fixed = added(torso.neck, turned(torso.chestTurn, own(K.SHOULDER_IN_CHEST)));
    const root = added(torso.neck, turned(torso.chestTurn, own(K.STERNUM_IN_CHEST)));
    const towards = scaled(back(torso.chestTurn, less(wrists[i], fixed)), 1 / 0.55);
    const roll = side * K.MAX_SHRUG_RAD * smooth(towards[2] + 0.1);
    const yaw = -side * K.MAX_FORWARD_RAD * smooth(towards[0] - 0.35);
    const [c, s] = [Math.cos(roll), Math.sin(roll)];
    const turn = times(times(torso.chestTurn, yawRotation(yaw)), [[1, 0, 0], [0, c, s], [0, -s, c]]);
    const reach = own(less(K.SHOULDER_IN_CHEST, K.STERNUM_IN_CHEST));
    return { root, shoulder: added(root, turned(turn, reach)), turn };
  });
}
