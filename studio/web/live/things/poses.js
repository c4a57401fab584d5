// Poses as the studio's wire has them: [x y z qx qy qz qw], metres, up is Y.
import * as THREE from "three";

const UP = new THREE.Vector3(0, 1, 0);
const ALONG = new THREE.Vector3(1, 0, 0);

export const placeOf = (pose) => new THREE.Vector3().fromArray(pose);
export const turnOf = (pose) => new THREE.Quaternion().fromArray(pose, 3);
export const poseOf = (place, turn) => [...place.toArray(), ...turn.toArray()];

/** Numbers with as many places as anybody needs. */
export const rounded = (numbers) => numbers.map((value) =>
  (Array.isArray(value) ? rounded(value) : Math.round(value * 1e5) / 1e5));

/** `a` then `b`, as matrices multiply. */
export function composed(a, b) {
  const turn = turnOf(a);
  return poseOf(placeOf(b).applyQuaternion(turn).add(placeOf(a)), turn.multiply(turnOf(b)));
}

export function inverse(pose) {
  const turn = turnOf(pose).invert();
  return poseOf(placeOf(pose).negate().applyQuaternion(turn), turn);
}

/** A place in a pose's own axes, in the room's. */
export const at = (pose, place) => new THREE.Vector3(...place).applyQuaternion(turnOf(pose)).add(placeOf(pose));

/** A pose turned to the left about the vertical through its place. */
export function turned(pose, radians) {
  const turn = new THREE.Quaternion().setFromAxisAngle(UP, radians).multiply(turnOf(pose));
  return poseOf(placeOf(pose), turn.normalize());
}

/** A pose at a place whose +X points along a direction. */
export const along = (place, direction) => poseOf(place,
  new THREE.Quaternion().setFromUnitVectors(ALONG, direction.clone().normalize()));

export const middleOf = (corners) => corners.reduce(
  (sum, corner) => sum.add(new THREE.Vector3(...corner).multiplyScalar(0.25)), new THREE.Vector3());

/** Corners turned to the left about the vertical through their middle. */
export function turnedCorners(corners, radians) {
  const middle = middleOf(corners);
  return corners.map((corner) => new THREE.Vector3(...corner).sub(middle)
    .applyAxisAngle(UP, radians).add(middle).toArray());
}

export function scaledCorners(corners, factor) {
  const middle = middleOf(corners);
  return corners.map((corner) => new THREE.Vector3(...corner).sub(middle)
    .multiplyScalar(factor).add(middle).toArray());
}

/** Whether something that stands at a pose stands at the other: within 5 cm and 10 degrees; of what
    looks the same `symmetry` times in a turn (0: always) the nearest counts. */
export function standsThere(pose, wanted, symmetry) {
  if (placeOf(pose).distanceTo(placeOf(wanted)) > 0.05) return false;
  const most = THREE.MathUtils.degToRad(10);
  const turn = turnOf(wanted).invert().multiply(turnOf(pose));
  if (symmetry === 1) return 2 * Math.acos(Math.min(1, Math.abs(turn.w))) <= most;
  const lean = UP.clone().applyQuaternion(turn).angleTo(UP);
  if (lean > most || symmetry === 0) return lean <= most;
  const step = (2 * Math.PI) / symmetry;
  const yaw = 2 * Math.atan2(turn.y, turn.w);
  return Math.abs(yaw - step * Math.round(yaw / step)) <= most;
}

// Along the edges of a box from corner to corner, some twice.
const WAY = [0, 1, 2, 3, 0, 4, 5, 1, 5, 6, 2, 6, 7, 3, 7, 4];

/** A way along all edges of a box of x and y on its frame's origin, z high: numbers, Y up. */
export function boxPath(x, y, z) {
  const [a, b] = [x / 2, y / 2];
  const corners = [0, z].flatMap((height) =>
    [[-a, height, -b], [a, height, -b], [a, height, b], [-a, height, b]]);
  return WAY.flatMap((corner) => corners[corner]);
}
