// A person as others see them: the figure of `scenes/bodies`, solved from head and hands, and the ray
// that they point with. In the world's axes: metres, Z up.
import * as THREE from "three";
import * as K from "shared/bodies/constants.js";
import { coloured } from "shared/bodies/shapes.js";
import { solveBody } from "shared/bodies/solve.js";
import { rod, stretch } from "shared/shapes.js";

const RAY_WIDTH_M = 0.006;
const DOT_RADIUS_M = 0.014;
const NEAR_M = 0.35; // nearer than this one looks through somebody
const CLEAR_M = 0.9;
const FAINTEST = 0.15;
const COARSE_FROM_M = 3.5; // from there the coarse figure does: a finger is two pixels wide
const FINE_TO_M = 3.1;
const AROUND_M = 1.5; // of the waist, where all of somebody is
const OVER_SPLATS = [20, 21]; // drawn after splats, which do not hide anything: depth, then colour

export class Figure {
  /** `shapes` of `readShapes`; `colour` of clothes and ray; `id` chooses skin and hair. */
  constructor(shapes, colour, id) {
    this.group = new THREE.Group();
    this.bones = new Bones();
    this.skin = new THREE.MeshLambertMaterial({ vertexColors: true });
    this.depth = new THREE.MeshBasicMaterial({ colorWrite: false, transparent: true });
    this.bodies = shapes.map((shape) => this.#body(coloured(shape, colour, id), this.skin));
    // Of somebody one looks through only the nearest surface is seen: its depth is laid first.
    this.veil = this.#body(this.bodies[0].geometry, this.depth);
    this.bodies[1].visible = this.veil.visible = false;
    this.veil.renderOrder = OVER_SPLATS[0];
    this.ray = rod(RAY_WIDTH_M, colour);
    this.dot = new THREE.Mesh(new THREE.SphereGeometry(DOT_RADIUS_M, 16, 12),
      new THREE.MeshBasicMaterial({ color: colour }));
    this.head = new THREE.Object3D(); // between the eyes
    this.group.add(...this.bodies, this.veil, this.ray, this.dot, this.head);
    this.state = null;
    this.show(null, null);
  }

  /** Shows somebody: `goal` of `shared/bodies/goals.js`, null where no head is known; `ray` as two
      points; `dt_s` since the last time, null lays the body out anew; boxes that hands stay out of. */
  show(goal, ray, dt_s = null, solids = null) {
    this.head.visible = goal !== null;
    if (goal === null) this.state = null;
    else {
      let skeleton;
      [this.state, skeleton] = solveBody(dt_s === null ? null : this.state, goal, dt_s ?? 0, solids);
      this.skeleton = skeleton;
      this.bones.lay(skeleton);
      this.head.position.fromArray(goal.eyes);
      for (const body of [...this.bodies, this.veil]) {
        body.boundingSphere.center.fromArray(skeleton.origins[K.BONE.SPINE]);
      }
    }
    this.#choose();
    this.ray.visible = this.dot.visible = ray !== null;
    if (ray === null) return;
    stretch(this.ray, ray.flat());
    this.dot.position.fromArray(ray[1]);
  }

  /** Takes note of where one looks from: who stands in the way fades, who is far is drawn coarsely. */
  seenFrom(eye) {
    const metres = eye.distanceTo(this.head.position);
    this.isCoarse = metres > (this.isCoarse ? FINE_TO_M : COARSE_FROM_M);
    this.share = THREE.MathUtils.clamp(
      (this.#gap(eye) - NEAR_M) / (CLEAR_M - NEAR_M), FAINTEST, 1);
    const isFaint = this.share < 1;
    if (this.skin.transparent !== isFaint) this.skin.needsUpdate = true;
    this.skin.transparent = isFaint;
    this.skin.opacity = this.share;
    for (const body of this.bodies) body.renderOrder = isFaint ? OVER_SPLATS[1] : 0;
    this.#choose();
  }

  /** Frees what the graphics card holds of it alone. */
  dispose() {
    for (const { geometry } of this.bodies) geometry.deleteAttribute("position");
    for (const part of [...this.bodies, this.ray, this.dot]) part.geometry.dispose();
    for (const part of [this.skin, this.depth, this.ray.material, this.dot.material, this.bones]) {
      part.dispose();
    }
    this.group.removeFromParent();
  }

  #choose() {
    const isHere = this.head.visible;
    this.bodies[0].visible = isHere && !this.isCoarse;
    this.bodies[1].visible = isHere && Boolean(this.isCoarse);
    this.veil.visible = isHere && this.skin.transparent && !this.isCoarse;
  }

  /** Metres from an eye to the line from the head down to the feet. */
  #gap({ x, y, z }) {
    const at = this.head.position;
    return Math.hypot(x - at.x, y - at.y, Math.max(z - at.z, 0, -z));
  }

  #body(geometry, material) {
    const body = new THREE.SkinnedMesh(geometry, material);
    body.bindMode = THREE.DetachedBindMode;
    body.bind(this.bones, new THREE.Matrix4());
    body.boundingSphere = new THREE.Sphere(new THREE.Vector3(), AROUND_M);
    return body;
  }
}

/** Matrices of bones as they are solved: no tree of objects that is walked for every picture. */
class Bones extends THREE.Skeleton {
  constructor() {
    super(Array.from({ length: K.BONES }, () => new THREE.Bone()));
  }

  update() {
    // They are laid, not worked out by the picture.
  }

  lay({ origins, turns, scale }) {
    const matrices = this.boneMatrices;
    for (let i = 0; i < K.BONES; i++) {
      const [x, y, z] = K.REST_ORIGINS[i];
      const turn = turns[i];
      for (let k = 0; k < 3; k++) {
        const at = 16 * i + k;
        matrices[at] = scale * turn[0][k];
        matrices[at + 4] = scale * turn[1][k];
        matrices[at + 8] = scale * turn[2][k];
        matrices[at + 12] = origins[i][k] - matrices[at] * x - matrices[at + 4] * y - matrices[at + 8] * z;
      }
      matrices[16 * i + 15] = 1;
    }
    if (this.boneTexture !== null) this.boneTexture.needsUpdate = true;
  }
}
