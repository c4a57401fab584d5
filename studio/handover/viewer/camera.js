// Where one looks from: around the room (orbit), or through it (fly).
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const WALK_M_S = 1.6;
const RUN = 3;
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
    this.held = new Set();
    this.orbit = new OrbitControls(camera, canvas);
    this.orbit.zoomSpeed = 0.8;
    this.orbit.addEventListener("change", changed);
    canvas.addEventListener("pointermove", (event) => this.#turn(event));
    window.addEventListener("keyup", (event) => this.held.delete(event.code));
    window.addEventListener("blur", () => this.held.clear());
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
    this.held.clear();
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    if (flying) this.#near(NEAR_M);
    else this.orbit.target.copy(this.camera.position).addScaledVector(ahead, LOOK_AHEAD_M);
    this.changed();
  }

  /** Takes a key that moves; true if it is one. */
  press(code) {
    if (!this.flying || !(code in STEPS)) return false;
    this.held.add(code);
    this.changed();
    return true;
  }

  /** Goes on by some seconds; true while it moves. */
  step(seconds, fast) {
    if (!this.flying || !this.held.size) return false;
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    const level = new THREE.Vector3(ahead.x, ahead.y, 0).normalize();
    const right = new THREE.Vector3(level.y, -level.x, 0);
    const way = seconds * WALK_M_S * (fast ? RUN : 1);
    for (const code of this.held) {
      const [sideways, forwards, upwards] = STEPS[code];
      this.camera.position.addScaledVector(right, sideways * way);
      this.camera.position.addScaledVector(ahead, forwards * way);
      this.camera.position.z += upwards * way;
    }
    return true;
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
