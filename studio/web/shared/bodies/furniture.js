// Solids of a room that hands stay out of: what stands fixed, and movable objects where they are:
// `scenes/bodies/furniture.py`. A box is given as centre, quaternion w x y z, half extents: 10 numbers.
import * as THREE from "three";
import { added, length, less, times, turned } from "shared/bodies/vectors.js";

const REACH_M = 1.3; // from eyes to what a hand reaches at most

export class Furniture {
  /** `solids`: { room, objects } with boxes, those of an object in its own frame; `groups`: the objects
      as they are drawn, { group } by id. */
  constructor({ room, objects }, groups) {
    this.fixed = room.map(boxOf);
    this.movable = Object.entries(objects).filter(([id]) => groups.has(id)).map(([id, boxes]) => ({
      group: groups.get(id).group, own: boxes.map(boxOf), boxes: [], place: new THREE.Vector3(NaN),
      turn: new THREE.Quaternion() }));
  }

  /** Boxes that somebody's hands may reach, by the place of their eyes. */
  near(eyes) {
    const isNear = ({ centre, radius }) => length(less(centre, eyes)) < REACH_M + radius;
    const found = this.fixed.filter(isNear);
    for (const movable of this.movable) {
      if (movable.group.position.distanceTo(new THREE.Vector3(...eyes)) > 2 * REACH_M) continue;
      found.push(...placed(movable).filter(isNear));
    }
    return found;
  }
}

function boxOf([x, y, z, qw, qx, qy, qz, a, b, c]) {
  return { centre: [x, y, z], turn: columns(qx, qy, qz, qw), half: [a, b, c], radius: Math.hypot(a, b, c) };
}

function placed(movable) {
  const { group: { position, quaternion }, own, place, turn } = movable;
  if (place.equals(position) && turn.equals(quaternion)) return movable.boxes;
  place.copy(position);
  turn.copy(quaternion);
  const world = columns(...quaternion.toArray());
  movable.boxes = own.map((box) => ({ ...box,
    centre: added(position.toArray(), turned(world, box.centre)), turn: times(world, box.turn) }));
  return movable.boxes;
}

function columns(x, y, z, w) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
}
