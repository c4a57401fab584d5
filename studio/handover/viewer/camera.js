// Where one looks from: around the room (orbit), or through it (fly).
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const WALK_M_S = 1.6;
const RUN = 3;
const LONGEST_STEP_S = 0.5; // nobody is flung through the room after a page has stood still
const TURN_PER_PIXEL = 0.004;
const LOOK_AHEAD_M = 1.5;
const NEAR_M = 0.05;
const STEEPEST = Math.PI / 2 - 0.02;
const STEPS = {
  KeyW: [0, 1, 0], ArrowUp: [0, 1, 0], KeyS: [0, -1, 0], ArrowDown: [0, -1, 0],
  KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 0, -1], KeyE: [0, 0, 1],
};

export class CameraControl {
  constructor(camera, canvas, views, changed) {
    this.camera = camera;
    this.views = views;
    this.changed = changed;
    this.flying = false;
    this.held = new Map(); // of each key, since when its way is still to go, ms
    this.owed = new Map(); // of each key, for how long it was held before it was let go, s
    this.orbit = new OrbitControls(camera, canvas);
    this.orbit.zoomSpeed = 0.8;
    this.orbit.addEventListener("change", changed);
    canvas.addEventListener("pointermove", (event) => this.#turn(event));
    window.addEventListener("keyup", (event) => this.#release(event.code, event.timeStamp));
    window.addEventListener("blur", () => this.#stop());
    this.go("corner");
  }

  /** Looks from one of the page's views. */
  go(name) {
    const { eye, target, near } = this.views[name];
    this.camera.position.set(...eye);
    this.camera.near = near ?? NEAR_M;
    this.camera.updateProjectionMatrix();
    this.orbit.target.set(...target);
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
    this.flying = flying;
    this.orbit.enabled = !flying;
    this.#stop();
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    if (flying) this.#near(NEAR_M);
    else this.orbit.target.copy(this.camera.position).addScaledVector(ahead, LOOK_AHEAD_M);
    this.changed();
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
      this.camera.position.addScaledVector(ahead, forwards * way);
      this.camera.position.z += upwards * way;
    }
    this.owed.clear();
    return true;
  }

  #release(code, now) {
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

  #turn(event) {
    if (!this.flying || !event.buttons) return;
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    const yaw = Math.atan2(ahead.y, ahead.x) - event.movementX * TURN_PER_PIXEL;
    const pitch = THREE.MathUtils.clamp(
      Math.asin(ahead.z) - event.movementY * TURN_PER_PIXEL, -STEEPEST, STEEPEST);
    const to = new THREE.Vector3(
      Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch));
    this.camera.lookAt(to.add(this.camera.position));
    this.changed();
  }
}
