// What is where at a time: looked up in the keys of a recording, between two of them interpolated.
// Times are milliseconds. A key's values are numbers or null; no drawing here.

/** Index of the last key at or before a time, -1 before the first. */
export function keyBefore(times, t) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Values at a time: [a, b, fraction] of the two keys around it; null where there is nothing. */
export function around(keys, t) {
  if (!keys.t_ms.length) return null;
  const at = Math.max(keyBefore(keys.t_ms, t), 0);
  const a = keys.values[at];
  const b = keys.values[at + 1];
  if (a === null) return null;
  if (b === undefined || b === null || t <= keys.t_ms[at]) return [a, a, 0];
  return [a, b, (t - keys.t_ms[at]) / (keys.t_ms[at + 1] - keys.t_ms[at])];
}

/** Puts a Group or Mesh where a body's keys have it at a time; false where there is nothing. */
export function pose(target, keys, t) {
  const found = around(keys, t);
  if (found === null) return false;
  const [a, b, fraction] = found;
  target.position.set(...mixed(a, b, fraction, 0, 3));
  target.quaternion.set(a[4], a[5], a[6], a[3]);
  if (fraction > 0) {
    const next = target.quaternion.clone().set(b[4], b[5], b[6], b[3]);
    target.quaternion.slerp(next, fraction);
  }
  return true;
}

/** Columns of the rotation whose quaternion w x y z is in a body's keys; null where there is nothing. */
export function turn(keys, t, from) {
  const found = around(keys, t);
  if (found === null) return null;
  const [w, x, y, z] = normed(mixed(...found, from, from + 4));
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
}

function normed(numbers) {
  const length = Math.hypot(...numbers);
  return numbers.map((value) => value / length);
}

/** Some of the numbers of two keys, mixed. */
export function mixed(a, b, fraction, from = 0, to = a.length) {
  const values = [];
  for (let i = from; i < to; i++) values.push(a[i] + fraction * (b[i] - a[i]));
  return values;
}

/** The newest of [[time, value], ...] at a time, null before the first. */
export function latest(versions, t) {
  let found = null;
  for (const [from, value] of versions) {
    if (from > t) break;
    found = value;
  }
  return found;
}
