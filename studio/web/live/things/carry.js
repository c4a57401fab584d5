// Shapes are put, things carried and objects proposed with a mouse, a finger or a pen. What was
// touched last is selected: a bar of buttons, and keys, turn it, size it, put it back, remove it.
import * as THREE from "three";
import { Line } from "shared/shapes.js";
import { along, at, middleOf, placeOf, poseOf, scaledCorners, turned, turnedCorners, turnOf }
  from "live/things/poses.js";
import { MAX_SIDE_M, MIN_SIDE_M, SIZES } from "live/things/shapes.js";

const CLICK_PX = 6; // a drag that is shorter was a click
const TURN = Math.PI / 12;
const LARGER = 1.15;
const BURST_MS = 800; // steps that follow each other sooner are taken back as one
const OUTLINE_M = 0.008;
const WHITE = [1, 1, 1];
const byId = (id) => document.getElementById(id);

/** The tools of this module, and the kind of thing that each makes. */
export const MAKES = { shape: "primitive", propose: "proposal", carry: null };

export class Carry {
  /** `room` with camera, hit and objectAt; `picker` finds things; `ask()` gives shape and colour,
      `handing` passes shapes on. */
  constructor(room, things, picker, { ask, handing, notice, changed }) {
    Object.assign(this, { room, things, picker, ask, handing, notice, changed });
    this.drag = null; // what the pointer holds
    this.selected = null; // { kind, key }
    this.burst = { at: -Infinity, drag: 0, what: "" };
    this.outline = new Line(OUTLINE_M);
    room.upright.add(this.outline.group);
    const steps = { left: () => this.turn(1), right: () => this.turn(-1), larger: () => this.scale(1),
      smaller: () => this.scale(-1), back: () => this.putBack(), remove: () => this.remove() };
    for (const [name, step] of Object.entries(steps)) byId(`thing-${name}`).addEventListener("click", step);
  }

  /** Takes what is under the pointer; whether there was anything for the tool. */
  begin(tool, [x, y]) {
    const start = { x, y, drag: this.things.newDrag(), moved: false };
    if (tool === "shape") return this.#putShape(start);
    if (tool === "propose") return this.#copyObject(start);
    const ray = this.#ray(x, y);
    const found = this.picker.hit(ray.origin, ray.direction);
    if (found === null || found.metres > this.#wayToRoom(ray) + 0.1) {
      this.select(null);
      return false;
    }
    if (!this.things.isOwn(found.kind, found.key)) {
      if (this.handing.takeFree(found)) return false;
      const { name, by } = this.things.get(found.kind, found.key);
      const who = name ?? this.handing.nameOf(by);
      const ask = found.kind === "primitive" ? " Ask them to give it to you." : "";
      this.notice(`That is ${who}’s: only they can move it.${ask}`);
      return false;
    }
    this.select(found);
    this.#hold(start, found);
    return true;
  }

  /** Follows the pointer. */
  go([x, y]) {
    const { drag } = this;
    if (drag === null) return;
    drag.moved ||= Math.hypot(x - drag.x, y - drag.y) > CLICK_PX;
    if (!drag.moved) return;
    const fields = drag.follow(x, y);
    if (fields === null) return;
    this.things.put(drag.kind, drag.key, fields, drag.drag);
    this.#outlineAnew();
  }

  end() {
    if (this.drag !== null) this.things.end();
    this.drag = null;
  }

  select(found) {
    this.selected = found === null ? null : { kind: found.kind, key: found.key };
    this.#outlineAnew();
  }

  /** Turns what is selected, to the left where `sign` is 1. */
  turn(sign) {
    this.#step("turn", (fields) => (fields.pose
      ? { ...fields, pose: turned(fields.pose, sign * TURN) }
      : { ...fields, seen: turnedCorners(fields.seen ?? fields.corners, sign * TURN) }));
  }

  /** Makes what is selected larger, or smaller where `sign` is -1. */
  scale(sign) {
    const factor = LARGER ** sign;
    this.#step("scale", (fields) => {
      if (fields.object) return null; // an object is as large as it is
      if (fields.corners) return { ...fields, seen: scaledCorners(fields.seen ?? fields.corners, factor) };
      return { ...fields, size: sized(fields.size, factor) };
    });
  }

  /** Shows a carried surface in its own place again. */
  putBack() {
    this.#step("back", (fields) => (fields.seen ? { ...fields, seen: null } : null));
  }

  remove() {
    if (this.selected === null) return;
    this.things.erase(this.selected.kind, this.selected.key);
    this.select(null);
  }

  /** Takes a key; whether it is one for what is selected. */
  press(code) {
    const keys = { Comma: () => this.turn(1), Period: () => this.turn(-1), Equal: () => this.scale(1),
      NumpadAdd: () => this.scale(1), Minus: () => this.scale(-1), NumpadSubtract: () => this.scale(-1),
      Delete: () => this.remove(), Backspace: () => this.remove(), KeyB: () => this.putBack() };
    if (this.selected === null || !(code in keys)) return false;
    keys[code]();
    return true;
  }

  /** Shows the outline and the buttons of what is selected as it is. */
  refresh() {
    this.#outlineAnew();
  }

  #putShape(start) {
    const place = this.#surface(start.x, start.y);
    if (place === null) return false;
    const { shape, colour } = this.ask();
    const key = this.things.newKey();
    const size = SIZES[shape];
    const toViewer = this.#heading();
    const fields = { shape, size, colour, pose: poseOf(place, toViewer) };
    this.things.put("primitive", key, fields, start.drag);
    this.select({ kind: "primitive", key });
    const follow = (x, y) => {
      const end = this.#surface(x, y);
      const way = end === null ? 0 : end.distanceTo(place);
      if (way < 0.05) return null;
      if (shape === "arrow") return { ...fields, ...arrowFrom(place, end, size) };
      return { ...fields, size: sized(size, (2 * way) / size[0]) };
    };
    this.drag = { ...start, kind: "primitive", key, follow };
    return true;
  }

  #copyObject(start) {
    const ray = this.#ray(start.x, start.y);
    const id = this.room.objectAt(ray.origin, ray.direction);
    if (id === null) {
      this.notice("Begin on an object that is followed: a copy of it comes with the pointer.");
      return false;
    }
    const key = this.things.newKey();
    const pose = this.room.objects.get(id).pose;
    this.things.put("proposal", key, { object: id, pose }, start.drag);
    this.select({ kind: "proposal", key });
    this.#hold(start, { kind: "proposal", key });
    return true;
  }

  #hold(start, { kind, key }) {
    const fields = this.things.get(kind, key);
    const follow = kind === "surface" ? this.#onPlane(start, fields) : this.#onSurface(start, fields);
    this.drag = { ...start, kind, key, follow };
  }

  /** What stands slides on the surface under the pointer, its base as far from it as it was. */
  #onSurface(start, fields) {
    const base = this.#pixel(placeOf(fields.pose));
    const [dx, dy] = [base[0] - start.x, base[1] - start.y];
    return (x, y) => {
      const place = this.#surface(x + dx, y + dy, fields.object ?? null);
      if (place === null) return null;
      // Furniture does not hang on walls.
      const there = fields.object ? this.room.standing(place, fields.object) : place;
      return { ...fields, pose: poseOf(there, turnOf(fields.pose)) };
    };
  }

  /** A picture moves in the plane across the view in which its middle is. */
  #onPlane(start, fields) {
    const corners = fields.seen ?? fields.corners;
    const { camera, upright } = this.room;
    const across = new THREE.Plane().setFromNormalAndCoplanarPoint(
      camera.getWorldDirection(new THREE.Vector3()), upright.localToWorld(middleOf(corners)));
    const met = (x, y) => {
      const at = this.#ray(x, y).intersectPlane(across, new THREE.Vector3());
      return at === null ? null : upright.worldToLocal(at);
    };
    const from = met(start.x, start.y);
    return (x, y) => {
      const to = met(x, y);
      if (to === null || from === null) return null;
      const way = to.sub(from);
      return { ...fields, seen: corners.map((corner) => new THREE.Vector3(...corner).add(way).toArray()) };
    };
  }

  #step(what, changed) {
    const { selected, burst } = this;
    const before = selected === null ? null : this.things.get(selected.kind, selected.key);
    const fields = before === null ? null : changed(before);
    if (fields === null) return;
    const now = performance.now();
    const name = `${what} ${selected.key}`;
    if (burst.what !== name || now - burst.at > BURST_MS) burst.drag = this.things.newDrag();
    Object.assign(burst, { at: now, what: name });
    this.things.change(selected.kind, selected.key, fields, burst.drag);
    this.#outlineAnew();
  }

  #outlineAnew() {
    const { selected } = this;
    const isOwn = selected !== null && this.things.isOwn(selected.kind, selected.key);
    const fields = isOwn ? this.things.get(selected.kind, selected.key) : null;
    if (fields === null) this.selected = null;
    this.handing.offer(fields !== null && selected.kind === "primitive" ? selected.key : null);
    byId("thing-bar").hidden = fields === null;
    if (fields !== null) {
      byId("thing-back").hidden = !fields.corners;
      byId("thing-back").disabled = !fields.seen;
      for (const id of ["thing-smaller", "thing-larger"]) byId(id).hidden = Boolean(fields.object);
    }
    this.outline.show(fields === null ? null : this.#outline(fields).flatMap((place) => [...place]), WHITE);
    this.changed();
  }

  /** Places around the base of a thing, or around a picture. */
  #outline(fields) {
    if (fields.corners) {
      const corners = fields.seen ?? fields.corners;
      return [...corners, corners[0]];
    }
    const item = fields.object ? this.room.objects.get(fields.object)?.item : null;
    const [x, , z] = fields.size ?? [item?.box_m?.[0] ?? 0.4, 0, item?.box_m?.[1] ?? 0.4];
    const [a, b] = [x / 2 + 0.02, z / 2 + 0.02];
    return [[-a, -b], [a, -b], [a, b], [-a, b], [-a, -b]]
      .map(([u, v]) => at(fields.pose, [u, 0.012, v]).toArray());
  }

  /** The turn of what looks at one: its x axis to the right. */
  #heading() {
    const { camera, upright } = this.room;
    const ahead = upright.worldToLocal(camera.getWorldDirection(new THREE.Vector3()).add(upright.position));
    return new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), Math.atan2(-ahead.x, -ahead.z));
  }

  #ray(x, y) {
    const { camera } = this.room;
    camera.updateMatrixWorld();
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2((2 * x) / window.innerWidth - 1, 1 - (2 * y) / window.innerHeight), camera);
    return caster.ray;
  }

  #surface(x, y, but = null) {
    const ray = this.#ray(x, y);
    const found = this.room.hit(ray.origin, ray.direction, but);
    return found === null ? null : this.room.upright.worldToLocal(found);
  }

  #wayToRoom(ray) {
    const found = this.room.hit(ray.origin, ray.direction);
    return found === null ? Infinity : found.distanceTo(ray.origin);
  }

  #pixel(place) {
    const seen = this.room.upright.localToWorld(place.clone()).project(this.room.camera);
    return [((1 + seen.x) * window.innerWidth) / 2, ((1 - seen.y) * window.innerHeight) / 2];
  }
}

/** A size times a factor, each side within what the studio takes. */
export function sized(size, factor) {
  const low = MIN_SIDE_M / Math.min(...size);
  const high = MAX_SIDE_M / Math.max(...size);
  const fits = THREE.MathUtils.clamp(factor, low, high);
  return size.map((side) => THREE.MathUtils.clamp(side * fits, MIN_SIDE_M, MAX_SIDE_M));
}

/** Pose and size of an arrow that goes from a place to another one. */
export function arrowFrom(from, to, [, high, wide]) {
  const way = to.clone().sub(from);
  const length = THREE.MathUtils.clamp(way.length(), MIN_SIDE_M, MAX_SIDE_M);
  const middle = from.clone().addScaledVector(way.normalize(), length / 2);
  return { size: [length, high, wide], pose: along(middle, way) };
}
