// Light rings around objects that somebody points at, in their colour: what `studio/view/attention.py` says.
import * as THREE from "three";
import { COLOURS } from "shared/colours.js";
import { HIDDEN_LAST } from "live/hidden.js";

const SLACK_M = 0.05; // how far beside an object's sphere a ray may pass
const WIDTH_M = 0.03;
const APART_M = 0.045; // between the rings of two people
const OVER_M = 0.012; // what the object stands on
const OPACITY = 0.85;

export class Attention {
  /** `room`: the live room, with its objects. */
  constructor(room) {
    this.room = room;
    this.rings = new Map(); // by person
  }

  /** Shows what the others point at, as they are shown; whether anything has changed. */
  step(people, you) {
    let hasChanged = false;
    const count = new Map();
    for (const [id, { figure, shown, person }] of people.byId) {
      const ray = id !== you && figure.group.visible ? shown?.ray : null;
      const object = ray ? this.pointedAt(ray) : null;
      const place = count.get(object) ?? 0;
      count.set(object, place + 1);
      if (this.#show(id, object, place, COLOURS[person.index % COLOURS.length])) hasChanged = true;
    }
    for (const id of this.rings.keys()) {
      if (!people.byId.has(id) && this.#show(id, null, 0, "")) hasChanged = true;
    }
    return hasChanged;
  }

  /** The object that a ray, six numbers in upright axes, is meant for; null where it meets none. */
  pointedAt(ray) {
    const [start, end] = [new THREE.Vector3(...ray.slice(0, 3)), new THREE.Vector3(...ray.slice(3))];
    const line = new THREE.Line3(start, end);
    let [found, least] = [null, Infinity];
    for (const { item, group } of this.room.objects.values()) {
      const middle = this.room.upright.worldToLocal(
        group.localToWorld(new THREE.Vector3(0, 0, item.middle_m)));
      const beside = line.closestPointToPoint(middle, true, new THREE.Vector3()).distanceTo(middle);
      const off = beside + end.distanceTo(middle);
      if (beside <= item.radius_m + SLACK_M && off < least) [found, least] = [item.id, off];
    }
    return found;
  }

  /** Who points at what: [person, object]. */
  shown() {
    return [...this.rings].map(([id, { object }]) => [id, object]);
  }

  #show(id, object, place, colour) {
    const known = this.rings.get(id);
    if ((known?.object ?? null) === object && (known?.place ?? 0) === place) return false;
    if (known !== undefined) {
      known.ring.removeFromParent();
      known.ring.geometry.dispose();
      known.ring.material.dispose();
      this.rings.delete(id);
    }
    if (object === null) return known !== undefined;
    const { item, group } = this.room.objects.get(object);
    const inner = item.radius_m + place * APART_M;
    const ring = new THREE.Mesh(new THREE.RingGeometry(inner, inner + WIDTH_M, 48),
      new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: OPACITY,
        side: THREE.DoubleSide }));
    ring.position.z = OVER_M;
    ring.renderOrder = HIDDEN_LAST;
    group.add(ring);
    this.rings.set(id, { ring, object, place });
    return true;
  }
}
