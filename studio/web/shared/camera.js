// Where one looks from: around the room (orbit), through it (fly), or on its floor (walk).
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const WALK_M_S = 1.6;
const RUN = 3;
const LONGEST_STEP_S = 0.5; // nobody is flung through the room after a page has stood still
const TURN_PER_PIXEL = 0.004;
const LOOK_AHEAD_M = 1.5;
const NEAR_M = 0.05;
const EYE_HEIGHT_M = 1.6;
const ELBOW_ROOM_M = 0.25; // so far from the walls one walks
const PINCH_M_PER_PIXEL = 0.008;
const STEEPEST = Math.PI / 2 - 0.02;
const STEPS = {
  KeyW: [0, 1, 0], ArrowUp: [0, 1, 0], KeyS: [0, -1, 0], ArrowDown: [0, -1, 0],
  KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 0, -1], KeyE: [0, 0, 1],
};

export class CameraControl {
  /** `footprint`: lowest and highest corner (x, y) of the floor one walks on, metres; may be missing. */
  constructor(camera, canvas, views, changed, footprint = null) {
    this.camera = camera;
    this.views = views;
    this.changed = changed;
    this.footprint = footprint;
    this.mode = "orbit";
    this.isFree = true;
    this.held = new Map(); // of each key, since when its way is still to go, ms
    this.owed = new Map(); // of each key, for how long it was held before it was let go, s
    this.fingers = new Map(); // where each pointer that is down was last
    this.orbit = new OrbitControls(camera, canvas);
    this.orbit.zoomSpeed = 0.8;
    this.orbit.addEventListener("change", changed);
    canvas.addEventListener("pointerdown", (event) => this.#touch(event));
    canvas.addEventListener("pointermove", (event) => this.#turn(event));
    window.addEventListener("pointerup", (event) => this.fingers.delete(event.pointerId));
    window.addEventListener("pointercancel", (event) => this.fingers.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    window.addEventListener("keyup", (event) => this.release(event.code, event.timeStamp));
    window.addEventListener("blur", () => this.#stop());
    this.go("corner");
  }

  /** Whether one moves through the room, in the air or on the floor. */
  get flying() {
    return this.mode !== "orbit";
  }

  /** Looks from one of the page's views. */
  go(name) {
    const { eye, target, near } = this.views[name];
    this.camera.position.fromArray(eye);
    if (this.mode === "walk") this.#land();
    this.camera.near = near ?? NEAR_M;
    this.camera.updateProjectionMatrix();
    this.orbit.target.fromArray(target);
    this.orbit.enabled = !this.flying;
    this.camera.lookAt(this.orbit.target);
    this.orbit.update();
    this.changed();
  }

  /** Looks at a place, from where one is. */
  lookAt(place) {
    this.orbit.target.copy(place);
    this.camera.lookAt(place);
    this.orbit.update();
    this.changed();
  }

  setFlying(flying) {
    this.setMode(flying ? "fly" : "orbit");
  }

  /** `mode`: orbit, fly or walk. */
  setMode(mode) {
    this.mode = mode;
    this.orbit.enabled = !this.flying;
    this.#stop();
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    if (this.flying) this.#near(NEAR_M);
    else this.orbit.target.copy(this.camera.position).addScaledVector(ahead, LOOK_AHEAD_M);
    if (mode === "walk") this.#land();
    this.changed();
  }

  /** Whether the first button and one finger turn the view; else they are a tool's, and the right
      button and two fingers turn it. */
  setFree(free) {
    this.isFree = free;
    this.orbit.mouseButtons.LEFT = free ? THREE.MOUSE.ROTATE : null;
    this.orbit.mouseButtons.RIGHT = free ? THREE.MOUSE.PAN : THREE.MOUSE.ROTATE;
    this.orbit.touches.ONE = free ? THREE.TOUCH.ROTATE : null;
    this.orbit.touches.TWO = free ? THREE.TOUCH.DOLLY_PAN : THREE.TOUCH.DOLLY_ROTATE;
  }

  /** Takes a key that moves; true if it is one. */
  press(code, now) {
    if (!this.flying || !(code in STEPS)) return false;
    if (!this.held.has(code)) this.held.set(code, now);
    this.changed();
    return true;
  }

  /** Goes on to a time, ms, as far as keys were held: slow pictures lose none of it. True while it moves. */
  step(now, fast) {
    if (!this.held.size && !this.owed.size) return false;
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    const level = new THREE.Vector3(ahead.x, ahead.y, 0).normalize();
    const right = new THREE.Vector3(level.y, -level.x, 0);
    for (const code of this.held.keys()) this.#owe(code, now);
    for (const [code, seconds] of this.owed) {
      const [sideways, forwards, upwards] = STEPS[code];
      const way = Math.min(seconds, LONGEST_STEP_S) * WALK_M_S * (fast ? RUN : 1);
      this.camera.position.addScaledVector(right, sideways * way);
      this.camera.position.addScaledVector(this.mode === "walk" ? level : ahead, forwards * way);
      this.camera.position.z += upwards * way;
    }
    this.owed.clear();
    if (this.mode === "walk") this.#land();
    return true;
  }

  /** Lets go of a key that moves. */
  release(code, now) {
    if (!this.held.has(code)) return;
    this.#owe(code, now);
    this.held.delete(code);
    this.changed();
  }

  #owe(code, now) {
    const since = this.held.get(code);
    const until = Math.max(now, since);
    this.owed.set(code, (this.owed.get(code) ?? 0) + (until - since) / 1000);
    this.held.set(code, until);
  }

  #stop() {
    this.held.clear();
    this.owed.clear();
  }

  #near(near) {
    this.camera.near = near;
    this.camera.updateProjectionMatrix();
  }

  /** Puts the eye at a standing person's height over the floor, within the walls. */
  #land() {
    const { position } = this.camera;
    position.z = EYE_HEIGHT_M;
    if (this.footprint === null) return;
    for (const [axis, name] of ["x", "y"].entries()) {
      const [low, high] = this.footprint.map((corner) => corner[axis]);
      const room = Math.min(ELBOW_ROOM_M, (high - low) / 2);
      position[name] = THREE.MathUtils.clamp(position[name], low + room, high - room);
    }
  }

  #touch(event) {
    this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  #turn(event) {
    const last = this.fingers.get(event.pointerId);
    if (last === undefined || !event.buttons) return;
    const span = this.#span();
    this.#touch(event);
    if (!this.flying) return;
    if (this.fingers.size === 2) {
      const ahead = this.camera.getWorldDirection(new THREE.Vector3());
      const way = (this.#span() - span) * PINCH_M_PER_PIXEL;
      this.camera.position.addScaledVector(ahead, way);
      if (this.mode === "walk") this.#land();
      this.changed();
      return;
    }
    if (!this.isFree && event.buttons === 1) return;
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    const yaw = Math.atan2(ahead.y, ahead.x) - (event.clientX - last[0]) * TURN_PER_PIXEL;
    const pitch = THREE.MathUtils.clamp(
      Math.asin(ahead.z) - (event.clientY - last[1]) * TURN_PER_PIXEL, -STEEPEST, STEEPEST);
    const to = new THREE.Vector3(
      Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch));
    this.camera.lookAt(to.add(this.camera.position));
    this.changed();
  }

  /** Pixels between two fingers. */
  #span() {
    const [a, b] = [...this.fingers.values()];
    return b === undefined ? 0 : Math.hypot(a[0] - b[0], a[1] - b[1]);
  }
}
