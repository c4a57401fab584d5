// In a headset: by grip or pinch one takes a thing of one's own and carries it, puts a shape where
// one's hand is, or takes a copy of an object to where it should go.
import * as THREE from "three";
import { composed, inverse, poseOf, scaledCorners, turned, turnOf } from "live/things/poses.js";
import { SIZES } from "live/things/shapes.js";
import { arrowFrom, sized } from "live/things/carry.js";

const REACH_M = 0.08; // from the hand to a thing that it takes
const TURN_RAD_S = 1.8; // of the thumbstick
const GROW_S = 1.6;
const LEAST_STICK = 0.3;
const LOOK_MS = 30; // between two looks for the surface that a hand points at
const STILL = [0, 0, 0, 0, 0, 0, 1];
const DRAWN_M = 0.06; // so far a hand has moved before what it puts grows

export class Grab {
  /** `tools` with tool, shape and ink; `picker` finds things near a hand; `handing` passes them on. */
  constructor(room, things, picker, { tools, handing }) {
    Object.assign(this, { room, things, picker, tools, handing });
    this.held = [null, null]; // by each hand
  }

  /** Begins a grip at a place, with a hand's pose and where it points; whether it took anything. */
  begin(side, { tip, pose, aim, points }) {
    if (this.held.some((held) => held !== null)) return false; // one thing at a time
    const own = this.#own(tip, points ? aim : null);
    if (own !== null) return this.#hold(side, own, pose);
    const near = this.picker.near(tip, REACH_M);
    if (near !== null && this.handing.takeFree(near)) return true; // carried by the next grip
    const { tool } = this.tools;
    if (tool === "shape" && this.things.can("primitive")) return this.#putShape(side, tip);
    if (tool === "propose" && this.things.can("proposal")) return this.#copyObject(side, tip, aim);
    return false;
  }

  /** Whether a hand carries something. */
  holds(side) {
    return this.held[side] !== null;
  }

  /** Follows a hand; `stick`: its thumbstick, sideways and forwards, -1..1. */
  move(side, { tip, pose, aim }, [sideways, forwards], seconds) {
    const held = this.held[side];
    if (held === null) return;
    if (Math.abs(sideways) > LEAST_STICK) held.turn -= sideways * TURN_RAD_S * seconds;
    if (Math.abs(forwards) > LEAST_STICK) held.grown *= GROW_S ** (-forwards * seconds);
    const fields = held.follow({ tip, pose, aim });
    if (fields !== null) this.things.put(held.kind, held.key, fields, held.drag);
  }

  end(side) {
    const held = this.held[side];
    if (held === null) return;
    this.held[side] = null;
    this.things.end();
    if (held.kind === "primitive") this.handing.letGo(held.key);
  }

  /** Takes what a hand carries away: a surface is back in its place, all else is removed. */
  drop(side) {
    const held = this.held[side];
    if (held === null) return;
    const fields = this.things.get(held.kind, held.key);
    this.end(side);
    if (held.kind === "surface" && fields?.seen) {
      this.things.change(held.kind, held.key, { ...fields, seen: null }, held.drag);
    } else this.things.erase(held.kind, held.key);
  }

  #own(tip, aim) {
    const near = this.picker.near(tip, REACH_M);
    if (near !== null && this.things.isOwn(near.kind, near.key) && this.things.can(near.kind)) return near;
    if (aim === null) return null;
    const found = this.picker.hit(...this.#worldRay(aim));
    const isOwn = found !== null && this.things.isOwn(found.kind, found.key);
    return isOwn && this.things.can(found.kind) ? found : null;
  }

  #hold(side, { kind, key }, pose) {
    const fields = this.things.get(kind, key);
    const held = { kind, key, drag: this.things.newDrag(), turn: 0, grown: 1 };
    const before = inverse(pose);
    if (kind === "surface") {
      const corners = fields.seen ?? fields.corners;
      const inHand = corners.map((corner) => composed(before, [...corner, 0, 0, 0, 1]).slice(0, 3));
      held.follow = (hand) => ({ ...fields, seen: scaledCorners(
        inHand.map((corner) => composed(hand.pose, [...corner, 0, 0, 0, 1]).slice(0, 3)), held.grown) });
    } else if (kind === "primitive") {
      const inHand = composed(before, fields.pose);
      held.follow = (hand) => ({ ...fields, size: sized(fields.size, held.grown),
        pose: composed(composed(hand.pose, inHand), turned(STILL, held.turn)) });
    } else held.follow = this.#sliding(held, fields);
    this.held[side] = held;
    return true;
  }

  /** A copy of an object stands on the surface that the hand points at. */
  #sliding(held, fields) {
    let lookedAt = -Infinity;
    return ({ aim }) => {
      const now = performance.now();
      if (now - lookedAt < LOOK_MS) return null;
      lookedAt = now;
      const found = this.room.hit(...this.#worldRay(aim), fields.object);
      if (found === null) return null;
      const place = this.room.standing(this.room.upright.worldToLocal(found), fields.object);
      return { ...fields, pose: turned(poseOf(place, turnOf(fields.pose)), held.turn) };
    };
  }

  #putShape(side, tip) {
    const { shape, ink } = this.tools;
    const [key, size, from] = [this.things.newKey(), SIZES[shape], tip.clone()];
    const standing = (sides) => [from.x, from.y - sides[1] / 2, from.z, 0, 0, 0, 1];
    const fields = { shape, size, colour: ink, pose: standing(size) };
    const follow = (hand) => {
      const way = hand.tip.distanceTo(from);
      if (way < DRAWN_M) return null;
      if (shape === "arrow") return { ...fields, ...arrowFrom(from, hand.tip, size) };
      const sides = sized(size, (2 * way) / size[0]);
      return { ...fields, size: sides, pose: standing(sides) };
    };
    const drag = this.things.newDrag();
    this.held[side] = { kind: "primitive", key, drag, turn: 0, grown: 1, follow };
    this.things.put("primitive", key, fields, drag);
    return true;
  }

  #copyObject(side, tip, aim) {
    const id = this.room.objectNear(tip) ?? this.room.objectAt(...this.#worldRay(aim));
    if (id === null) return false;
    const held = { kind: "proposal", key: this.things.newKey(), drag: this.things.newDrag(), turn: 0,
      grown: 1 };
    const fields = { object: id, pose: this.room.objects.get(id).pose };
    held.follow = this.#sliding(held, fields);
    this.held[side] = held;
    this.things.put("proposal", held.key, fields, held.drag);
    return true;
  }

  /** Origin and direction in the world of a pose that points along its -Z. */
  #worldRay(aim) {
    const { upright } = this.room;
    const direction = new THREE.Vector3(0, 0, -1).applyQuaternion(turnOf(aim));
    return [upright.localToWorld(new THREE.Vector3().fromArray(aim)),
      direction.applyQuaternion(upright.quaternion)];
  }
}
