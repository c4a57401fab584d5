// A person as others see them: head with a face, shoulders below it, hands, and a pointing ray.
// In the axes of headsets: metres, Y up; a head looks along -Z and its origin is between the eyes.
import * as THREE from "three";
import { rod, stretch } from "shared/shapes.js";

/** Colours that people with any colour vision tell apart (Okabe and Ito), one a person. */
export const COLOURS = [0x56b4e9, 0xe69f00, 0x3ed6a0, 0xcc79a7, 0xf0c733, 0xff9a62];
const SKIN = 0xece6dd;
const DARK = 0x23262d;
const RAY_WIDTH_M = 0.006;
const DOT_RADIUS_M = 0.014;
const NECK_BELOW_EYES_M = 0.185;
const NECK_BEHIND_EYES_M = 0.08;
const LARGER = 1.12; // of a head than in life: a face is read from further away
const NEAR_M = 0.35; // nearer than this one looks through somebody
const CLEAR_M = 0.9;
const FAINTEST = 0.15;

/** Half of a torso's outline, from the neck down: radius and height in metres. */
const TORSO = [[0.05, 0.045], [0.056, 0.02], [0.085, -0.004], [0.145, -0.032], [0.19, -0.078],
  [0.203, -0.15], [0.186, -0.28], [0.166, -0.4], [0.15, -0.48], [0.11, -0.535], [0, -0.55]];
const NECK = { radius: 0.043, length: 0.16, rise: 0.04, depth: 0.68 }; // a capsule that reaches into the head
const TORSO_DEPTH = 0.58; // of its width

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

export class Figure {
  constructor(colour) {
    this.group = new THREE.Group();
    this.skin = material(SKIN);
    this.cloth = material(colour);
    this.dark = material(DARK, 0.35);
    this.head = this.#head();
    this.torso = new THREE.Group();
    const neck = new THREE.Mesh(new THREE.CapsuleGeometry(NECK.radius, NECK.length, 8, 28), this.skin);
    neck.position.y = NECK.rise;
    neck.scale.z = NECK.depth;
    this.torso.add(new THREE.Mesh(torsoShape(), this.cloth), neck);
    this.ray = rod(RAY_WIDTH_M, colour);
    this.dot = new THREE.Mesh(new THREE.SphereGeometry(DOT_RADIUS_M, 16, 12),
      new THREE.MeshBasicMaterial({ color: colour }));
    this.hands = [0, 1].map(() => new FingerHand(this.skin));
    this.grips = [0, 1].map(() => this.#grip());
    this.group.add(this.head, this.torso, this.ray, this.dot, ...this.grips,
      ...this.hands.map((hand) => hand.group));
    this.show({});
  }

  /** Shows what is known: `head` [x y z qx qy qz qw], `hands` and `grips` left and right, `ray`
      six numbers; what is missing or null is hidden. A hand is { joints, radii }. */
  show({ head = null, hands = [null, null], grips = [null, null], ray = null }) {
    this.head.visible = this.torso.visible = head !== null;
    if (head !== null) this.#stand(head);
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

  /** Fades somebody who stands in the way: `metres` from their head to the eye. */
  fade(metres) {
    const share = THREE.MathUtils.clamp((metres - NEAR_M) / (CLEAR_M - NEAR_M), FAINTEST, 1);
    for (const one of [this.skin, this.cloth, this.dark]) {
      if (one.transparent !== share < 1) one.needsUpdate = true;
      one.transparent = share < 1;
      one.opacity = share;
    }
  }

  /** Frees what the graphics card holds of it. */
  dispose() {
    this.group.traverse((part) => {
      part.geometry?.dispose();
      part.material?.dispose();
    });
    this.group.removeFromParent();
  }

  #stand(head) {
    place(this.head, head);
    // Where the neck is; shoulders stay level and turn with the face.
    const neck = new THREE.Vector3(0, -NECK_BELOW_EYES_M * 0.45, NECK_BEHIND_EYES_M);
    this.torso.position.copy(neck.applyQuaternion(this.head.quaternion)).add(this.head.position);
    this.torso.position.y -= NECK_BELOW_EYES_M * 0.55;
    const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(this.head.quaternion);
    const up = new THREE.Vector3(0, 1, 0).applyQuaternion(this.head.quaternion);
    // Straight up or down, the face says nothing of the shoulders: the top of the head does.
    const level = ahead.addScaledVector(up, -ahead.y);
    this.torso.rotation.set(0, Math.atan2(-level.x, -level.z), 0);
  }

  #head() {
    const head = new THREE.Group();
    const middle = new THREE.Group();
    middle.position.set(0, 0.015, 0.085);
    middle.scale.setScalar(LARGER);
    const skull = ball(this.skin, [0.078, 0.112, 0.095]);
    const jaw = ball(this.skin, [0.062, 0.085, 0.074], [0, -0.048, -0.018]);
    const hair = new THREE.Mesh(
      new THREE.SphereGeometry(1, 48, 28, 0, 2 * Math.PI, 0, 0.5 * Math.PI).rotateX(0.55), this.cloth);
    hair.scale.set(0.083, 0.118, 0.101);
    const nose = ball(this.skin, [0.011, 0.02, 0.016], [0, -0.032, -0.094]);
    const eyes = [-1, 1].map((side) =>
      ball(this.dark, [0.0105, 0.0145, 0.007], [side * 0.031, -0.008, -0.0855]));
    const ears = [-1, 1].map((side) =>
      ball(this.skin, [0.012, 0.027, 0.017], [side * 0.078, -0.015, 0.008]));
    const smile = new THREE.Mesh(new THREE.TorusGeometry(0.026, 0.0032, 8, 24, 2), this.dark);
    smile.position.set(0, -0.049, -0.0885);
    smile.rotation.set(0.14, 0, -Math.PI / 2 - 1);
    middle.add(skull, jaw, hair, nose, ...eyes, ...ears, smile);
    head.add(middle);
    return head;
  }

  /** A fist around a controller, along -Z as headsets say how it is held. */
  #grip() {
    const grip = new THREE.Group();
    const fist = ball(this.skin, [0.042, 0.048, 0.046]);
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

function material(colour, roughness = 0.75) {
  return new THREE.MeshStandardMaterial({ color: colour, roughness });
}

function ball(skin, size, at = [0, 0, 0]) {
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(1, 40, 28), skin);
  mesh.scale.set(...size);
  mesh.position.set(...at);
  return mesh;
}

function torsoShape() {
  const outline = new THREE.SplineCurve(TORSO.map(([r, y]) => new THREE.Vector2(r, y)));
  const points = outline.getPoints(48).map((p) => new THREE.Vector2(Math.max(p.x, 0), p.y));
  const shape = new THREE.LatheGeometry(points.reverse(), 48);
  shape.scale(1, 1, TORSO_DEPTH);
  shape.computeVertexNormals();
  return shape;
}

function place(target, [x, y, z, qx, qy, qz, qw]) {
  target.position.set(x, y, z);
  target.quaternion.set(qx, qy, qz, qw);
}
