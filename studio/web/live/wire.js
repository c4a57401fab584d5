// A body in bytes, as `devices/hub/protocol/wire.py` has it: little endian, metres, Y up.
// A body is { seq, t_us, head, controllers, hands, ray }: head 7 numbers (place, quaternion x y z w),
// a controller { aim, grip, buttons, axes }, a hand { joints, radii } of 75 and 25 numbers, left one
// first, a ray 6 numbers; null for what there is not.

const VERSION = 1;
const BODY = 1;
const BODIES = 2;
const CELLS = 7;
const HEAD = 1;
const CONTROLLERS = [2, 4];
const HANDS = [8, 16];
const RAY = 32;
const JOINTS = 25;
const HEADER_BYTES = 16;
const POSE_BYTES = 28;
const CONTROLLER_BYTES = 66;
const HAND_BYTES = 12 + 7 * JOINTS;
const RAY_BYTES = 24;
const MAX_BYTES = HEADER_BYTES + POSE_BYTES + 2 * (CONTROLLER_BYTES + HAND_BYTES) + RAY_BYTES;
const AXIS_STEPS = 32767;
const MAX_ROOM_M = 100;

/** Bytes of a body; what is out of a room's range is left out. */
export function encodeBody(body) {
  const view = new DataView(new ArrayBuffer(MAX_BYTES));
  let at = HEADER_BYTES;
  let flags = 0;
  const floats = (numbers) => {
    for (const number of numbers) {
      view.setFloat32(at, number, true);
      at += 4;
    }
  };
  if (isInRoom(body.head)) {
    flags |= HEAD;
    floats(body.head);
  }
  body.controllers.forEach((controller, side) => {
    if (!controller || !isInRoom(controller.aim) || !isInRoom(controller.grip)) return;
    flags |= CONTROLLERS[side];
    floats(controller.aim);
    floats(controller.grip);
    view.setUint16(at, controller.buttons, true);
    controller.axes.forEach((axis, i) =>
      view.setInt16(at + 2 + 2 * i, clamp(Math.round(axis * AXIS_STEPS), AXIS_STEPS), true));
    at += 10;
  });
  body.hands.forEach((hand, side) => {
    if (!hand || !isInRoom(hand.joints)) return;
    flags |= HANDS[side];
    const wrist = Array.from(hand.joints.slice(0, 3), Math.fround);
    floats(wrist);
    for (let joint = 0; joint < JOINTS; joint++) {
      for (let i = 0; i < 3; i++) {
        const away = Math.round(1000 * (hand.joints[3 * joint + i] - wrist[i]));
        view.setInt16(at + 2 * i, clamp(away, AXIS_STEPS), true);
      }
      view.setUint8(at + 6, Math.min(Math.max(Math.round(1000 * hand.radii[joint]), 0), 255));
      at += 7;
    }
  });
  if (isInRoom(body.ray)) {
    flags |= RAY;
    floats(body.ray);
  }
  view.setUint8(0, VERSION);
  view.setUint8(1, BODY);
  view.setUint16(2, flags, true);
  view.setUint32(4, body.seq, true);
  view.setBigUint64(8, BigInt(Math.round(body.t_us)), true);
  return new Uint8Array(view.buffer, 0, at);
}

/** The body in bytes that a hub has checked; null if they are none. */
export function decodeBody(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < HEADER_BYTES || view.getUint8(0) !== VERSION || view.getUint8(1) !== BODY) {
    return null;
  }
  const flags = view.getUint16(2, true);
  if (bytes.length !== lengthOf(flags)) return null;
  let at = HEADER_BYTES;
  const floats = (count) => {
    const numbers = Array.from({ length: count }, (_, i) => view.getFloat32(at + 4 * i, true));
    at += 4 * count;
    return numbers;
  };
  const head = flags & HEAD ? floats(7) : null;
  const controllers = CONTROLLERS.map((bit) => {
    if (!(flags & bit)) return null;
    const [aim, grip] = [floats(7), floats(7)];
    const buttons = view.getUint16(at, true);
    const axes = [0, 1, 2, 3].map((i) => view.getInt16(at + 2 + 2 * i, true) / AXIS_STEPS);
    at += 10;
    return { aim, grip, buttons, axes };
  });
  const hands = HANDS.map((bit) => {
    if (!(flags & bit)) return null;
    const wrist = floats(3);
    const joints = [];
    const radii = [];
    for (let joint = 0; joint < JOINTS; joint++) {
      for (let i = 0; i < 3; i++) joints.push(wrist[i] + view.getInt16(at + 2 * i, true) / 1000);
      radii.push(view.getUint8(at + 6) / 1000);
      at += 7;
    }
    return { joints, radii };
  });
  const ray = flags & RAY ? floats(6) : null;
  const [seq, t_us] = [view.getUint32(4, true), Number(view.getBigUint64(8, true))];
  return { seq, t_us, head, controllers, hands, ray };
}

/** The newest bodies of others, as [index of the person, body, bytes of all but its number and
    time]; what cannot be read is left out. */
export function decodeBodies(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 4 || view.getUint8(0) !== VERSION || view.getUint8(1) !== BODIES) return [];
  const found = [];
  let at = 4;
  for (let left = view.getUint16(2, true); left > 0 && at + 4 <= buffer.byteLength; left--) {
    const [index, length] = [view.getUint16(at, true), view.getUint16(at + 2, true)];
    at += 4;
    if (at + length > buffer.byteLength) break;
    const bytes = new Uint8Array(buffer, at, length);
    const body = decodeBody(bytes);
    if (body !== null) found.push([index, body, bytes.subarray(HEADER_BYTES)]);
    at += length;
  }
  return found;
}

/** Whether a message has cells of surfaces that hide. */
export function isCells(buffer) {
  const view = new DataView(buffer);
  return view.byteLength >= 4 && view.getUint8(0) === VERSION && view.getUint8(1) === CELLS;
}

function lengthOf(flags) {
  const has = (bit) => (flags & bit ? 1 : 0);
  return HEADER_BYTES + POSE_BYTES * has(HEAD) + RAY_BYTES * has(RAY)
    + CONTROLLER_BYTES * (has(CONTROLLERS[0]) + has(CONTROLLERS[1]))
    + HAND_BYTES * (has(HANDS[0]) + has(HANDS[1]));
}

function isInRoom(numbers) {
  return Boolean(numbers) && numbers.every((n) => Number.isFinite(n) && Math.abs(n) <= MAX_ROOM_M);
}

function clamp(value, most) {
  return Math.min(Math.max(value, -most), most);
}
