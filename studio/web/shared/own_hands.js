// One's own hands in a headset, and one's own ray: exactly where they are tracked, so that a finger
// touches what it seems to touch. In the axes of headsets: metres, Y up.
import * as THREE from "three";
import { rod, stretch } from "shared/shapes.js";

const SKIN = 0xece6dd;
const DARK = 0x23262d;
const DOT_RADIUS_M = 0.014;

/** Joints of a hand as WebXR orders them: the wrist, four of the thumb, five of each finger. */
export const JOINTS = 25;
const FINGERS = [[1, 2, 3, 4], [5, 6, 7, 8, 9], [10, 11, 12, 13, 14], [15, 16, 17, 18, 19],
  [20, 21, 22, 23, 24]];
const PALM = [[6, 11], [11, 16], [16, 21], [5, 10], [10, 15], [15, 20], [1, 5], [2, 6]];
const BONES = [
  ...FINGERS.flatMap((finger) => finger.slice(1).map((joint, i) => [finger[i], joint])),
  ...FINGERS.map(([first]) => [0, first]), ...PALM];
const THINNEST_M = 0.005;
const THICKEST_M = 0.016;

export class OwnHands {
  /** `colour` of the ray, `rayWidth` in metres. */
  constructor(colour, rayWidth) {
    this.group = new THREE.Group();
    this.skin = new THREE.MeshStandardMaterial({ color: SKIN, roughness: 0.75 });
    this.dark = new THREE.MeshStandardMaterial({ color: DARK, roughness: 0.35 });
    this.ray = rod(rayWidth, colour);
    this.dot = new THREE.Mesh(new THREE.SphereGeometry(DOT_RADIUS_M, 16, 12),
      new THREE.MeshBasicMaterial({ color: colour }));
    this.hands = [0, 1].map(() => new FingerHand(this.skin));
    this.grips = [0, 1].map(() => this.#grip());
    this.group.add(this.ray, this.dot, ...this.grips, ...this.hands.map((hand) => hand.group));
    this.show({});
  }

  /** Gives the ray another colour. */
  setColour(colour) {
    this.ray.material.color.set(colour);
    this.dot.material.color.set(colour);
  }

  /** Shows `hands` and `grips` left and right, `ray` as six numbers; what is missing or null is
      hidden. A hand is { joints, radii }, a grip [x y z qx qy qz qw]. */
  show({ hands = [null, null], grips = [null, null], ray = null }) {
    this.hands.forEach((hand, side) => hand.show(hands[side]));
    this.grips.forEach((grip, side) => {
      grip.visible = grips[side] !== null && hands[side] === null;
      if (grip.visible) place(grip, grips[side]);
    });
    this.ray.visible = this.dot.visible = ray !== null;
    if (ray === null) return;
    stretch(this.ray, ray);
    this.dot.position.fromArray(ray, 3);
  }

  /** A fist around a controller, along -Z as headsets say how it is held. */
  #grip() {
    const grip = new THREE.Group();
    const fist = new THREE.Mesh(new THREE.SphereGeometry(1, 40, 28), this.skin);
    fist.scale.set(0.042, 0.048, 0.046);
    const handle = new THREE.Mesh(new THREE.CapsuleGeometry(0.017, 0.11, 8, 20), this.dark);
    handle.rotation.x = Math.PI / 2;
    grip.add(fist, handle);
    return grip;
  }
}

/** A hand of smooth fingers, from its joints. */
class FingerHand {
  constructor(skin) {
    this.group = new THREE.Group();
    this.joints = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 14, 10), skin, JOINTS);
    this.bones = new THREE.InstancedMesh(
      new THREE.CylinderGeometry(1, 1, 1, 14, 1, true), skin, BONES.length);
    this.joints.frustumCulled = this.bones.frustumCulled = false;
    this.group.add(this.joints, this.bones);
    this.part = new THREE.Object3D();
  }

  show(hand) {
    this.group.visible = hand !== null;
    if (hand === null) return;
    const { joints, radii } = hand;
    const thick = (i) => THREE.MathUtils.clamp(radii[i], THINNEST_M, THICKEST_M);
    for (let i = 0; i < JOINTS; i++) {
      this.part.position.fromArray(joints, 3 * i);
      this.part.quaternion.identity();
      this.part.scale.setScalar(thick(i));
      this.part.updateMatrix();
      this.joints.setMatrixAt(i, this.part.matrix);
    }
    BONES.forEach(([a, b], i) => {
      const at = (j) => [joints[3 * j], joints[3 * j + 1], joints[3 * j + 2]];
      stretch(this.part, [...at(a), ...at(b)]);
      const width = Math.min(thick(a), thick(b));
      this.part.scale.x = this.part.scale.z = this.part.visible ? width : 0;
      this.part.updateMatrix();
      this.bones.setMatrixAt(i, this.part.matrix);
    });
    this.joints.instanceMatrix.needsUpdate = this.bones.instanceMatrix.needsUpdate = true;
  }
}

function place(target, [x, y, z, qx, qy, qz, qw]) {
  target.position.set(x, y, z);
  target.quaternion.set(qx, qy, qz, qw);
}
