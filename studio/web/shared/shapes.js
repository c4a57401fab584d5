// Thin rods between two points: pointing rays and drawn lines.
import * as THREE from "three";

const SIDES = 6;
const UP = new THREE.Vector3(0, 1, 0);

/** A thin rod of one metre along Y, to be stretched between two points. */
export function rod(width, colour) {
  const shape = new THREE.CylinderGeometry(width / 2, width / 2, 1, SIDES);
  return new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ color: colour }));
}

/** Puts a rod between two points, given as six numbers; it is hidden where they are one.
 * @param {THREE.Object3D} mesh @param {ArrayLike<number>} ends */
export function stretch(mesh, ends) {
  const [x, y, z, u, v, w] = Array.from(ends);
  const from = new THREE.Vector3(x, y, z);
  const along = new THREE.Vector3(u, v, w).sub(from);
  const length = along.length();
  mesh.visible = length > 1e-6;
  if (!mesh.visible) return;
  mesh.position.copy(from).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
  mesh.scale.set(1, length, 1);
}

/** A line through points, numbers x y z x y z …: rods with round joints, in two draws however long. */
export class Line {
  constructor(width) {
    this.width = width;
    this.group = new THREE.Group();
  }

  /** Shows other points; null or none of them hides the line. */
  show(points, colour) {
    this.clear();
    const count = points === null ? 0 : points.length / 3;
    if (count < 2) return;
    const material = new THREE.MeshBasicMaterial({
      color: new THREE.Color().setRGB(colour[0], colour[1], colour[2], THREE.SRGBColorSpace) });
    const radius = this.width / 2;
    const rods = new THREE.InstancedMesh(
      new THREE.CylinderGeometry(radius, radius, 1, SIDES), material, count - 1);
    const joints = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, 8, 6), material, count);
    const part = new THREE.Object3D();
    for (let i = 0; i < count; i++) {
      part.position.fromArray(points, 3 * i);
      part.quaternion.identity();
      part.scale.set(1, 1, 1);
      part.updateMatrix();
      joints.setMatrixAt(i, part.matrix);
      if (i + 1 === count) break;
      stretch(part, points.slice(3 * i, 3 * i + 6));
      if (!part.visible) part.scale.setScalar(0);
      part.updateMatrix();
      rods.setMatrixAt(i, part.matrix);
    }
    rods.frustumCulled = joints.frustumCulled = false;
    this.group.add(rods, joints);
  }

  get isShown() {
    return this.group.children.length > 0;
  }

  /** Frees what the graphics card holds of it. */
  clear() {
    for (const part of /** @type {THREE.InstancedMesh[]} */ (this.group.children)) {
      part.geometry.dispose();
      /** @type {THREE.Material} */ (part.material).dispose();
      part.dispose();
    }
    this.group.clear();
  }
}
