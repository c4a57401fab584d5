// Vectors as [x, y, z]; rotations as their three columns. As `scenes/bodies/vectors.py`, one at a
// time in place of many. No drawing and no clock in this folder but for `figure.js`.

const TINY = 1e-9; // metres: below it a vector has no direction

export const added = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, s) => [s * a[0], s * a[1], s * a[2]];
/** a + s b. */
export const moved = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.sqrt(dot(a, a));
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const mirrored = (a) => [a[0], -a[1], a[2]];

/** a / |a|; what has no length stays about zero. */
export const unit = (a) => scaled(a, 1 / Math.max(length(a), TINY));

/** The unit vector of the part of a that is perpendicular to the unit axis. */
export const across = (a, axis) => unit(moved(a, -dot(a, axis), axis));

/** The rotation with columns `along`, `towards` made perpendicular, and their cross. */
export function frame(along, towards) {
  const second = across(towards, along);
  return [along, second, cross(along, second)];
}

export function turned(r, v) {
  return [
    r[0][0] * v[0] + r[1][0] * v[1] + r[2][0] * v[2],
    r[0][1] * v[0] + r[1][1] * v[1] + r[2][1] * v[2],
    r[0][2] * v[0] + r[1][2] * v[1] + r[2][2] * v[2]];
}

/** The transpose of r times v. */
export const back = (r, v) => [dot(r[0], v), dot(r[1], v), dot(r[2], v)];
/** a times b. */
export const times = (a, b) => [turned(a, b[0]), turned(a, b[1]), turned(a, b[2])];
/** a times the transpose of b. */
export const timesBack = (a, b) => [
  turned(a, [b[0][0], b[1][0], b[2][0]]), turned(a, [b[0][1], b[1][1], b[2][1]]),
  turned(a, [b[0][2], b[1][2], b[2][2]])];

/** A vector turned about a unit axis by an angle (Rodrigues). */
export function about(axis, angle, v) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [x, y, z] = cross(axis, v);
  const k = dot(axis, v) * (1 - c);
  return [v[0] * c + x * s + axis[0] * k, v[1] * c + y * s + axis[1] * k, v[2] * c + z * s + axis[2] * k];
}

export function yawRotation(yaw) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [[c, s, 0], [-s, c, 0], [0, 0, 1]];
}

const modulo = (a, n) => ((a % n) + n) % n;
/** An angle in radians as -pi..pi. */
export const wrapped = (angle) => modulo(angle + Math.PI, 2 * Math.PI) - Math.PI;
/** An angle in radians as 0..2 pi. */
export const whole = (angle) => modulo(angle, 2 * Math.PI);
export const clip = (x, low, high) => Math.min(Math.max(x, low), high);
/** An angle within a range of a joint, [low, high]. */
export const within = (range, x) => clip(x, range[0], range[1]);
/** How far an angle is outside a range. */
export const excess = (range, x) => Math.max(range[0] - x, 0) + Math.max(x - range[1], 0);
/** A step from 0 at 0 to 1 at 1 that is level at both ends. */
export function smooth(x) {
  const t = clip(x, 0, 1);
  return t * t * (3 - 2 * t);
}
