// Surfaces that the local user's headset sees and the scan has not: they are not drawn, but people, rays,
// lines, shapes and rings of light are hidden behind them, and pointing ends on them (copies of objects:
// things/behind.js). Metres, Y up.
import * as THREE from "three";

const HEADER_BYTES = 4; // as `devices/hub/protocol/mesh.py` has a message
const CELL_BYTES = 22;
const STEP_M = 1e-4;
const MAX_CELLS = 10000;
const MAX_ROOM_M = 104; // the farthest corner that a cell within a room's range may have
const FIRST = -1000; // before all that can be hidden
const LAST = 1000; // after it, before the splats
const AGAIN = 10; // after the splats, before what is drawn over them and can be hidden
export const HIDDEN_LAST = AGAIN + 1; // such as rings of light
const FAR = 0.9999999; // as deep in the picture as nothing is

/** The cells of a message, as [key, { corners, triangles }]; null if it is not whole. */
export function decodeCells(buffer) {
  const view = new DataView(buffer);
  const cells = [];
  let at = HEADER_BYTES;
  for (let left = view.getUint16(2, true); left > 0; left--) {
    if (at + CELL_BYTES > view.byteLength) return null;
    const key = [0, 2, 4].map((i) => view.getInt16(at + i, true)).join(" ");
    const [count, faces] = [view.getUint16(at + 6, true), view.getUint16(at + 8, true)];
    const first = [10, 14, 18].map((i) => view.getFloat32(at + i, true));
    at += CELL_BYTES;
    if (at + 6 * (count + faces) > view.byteLength) return null;
    const corners = new Float32Array(3 * count);
    for (let i = 0; i < corners.length; i++) {
      corners[i] = first[i % 3] + STEP_M * view.getInt16(at + 2 * i, true);
    }
    at += 6 * count;
    const triangles = new Uint16Array(3 * faces);
    for (let i = 0; i < triangles.length; i++) triangles[i] = view.getUint16(at + 2 * i, true);
    at += 6 * faces;
    if (!corners.every((n) => Math.abs(n) <= MAX_ROOM_M)) return null;
    if (!triangles.every((corner) => corner < count)) return null;
    cells.push([key, { corners, triangles }]);
  }
  return at === view.byteLength ? cells : null;
}

export class HiddenMesh {
  /** `upright`: the group whose axes are a headset's; `changed`: the picture is no longer right. */
  constructor(upright, changed) {
    Object.assign(this, { upright, changed });
    this.cells = new Map();
    this.isOld = false;
    this.version = 0; // counts changes of what is drawn
    this.damaged = 0; // messages that could not be read
    this.geometry = new THREE.BufferGeometry();
    // Its depth is in the picture while all that can be hidden is drawn, and taken out again before the
    // splats where nothing is before it: there is no hole in the room behind it. After the splats it is
    // there again, for what lets the room shine through.
    const unseen = { colorWrite: false, side: THREE.DoubleSide };
    const marked = { ...unseen, depthWrite: false, depthFunc: THREE.EqualDepth, stencilWrite: true,
      stencilRef: 1, stencilZPass: THREE.ReplaceStencilOp };
    const freed = { ...unseen, depthFunc: THREE.AlwaysDepth, stencilWrite: true, stencilRef: 1,
      stencilFunc: THREE.EqualStencilFunc, stencilZPass: THREE.ZeroStencilOp };
    const again = { ...unseen, transparent: true };
    this.parts = [[unseen, FIRST], [marked, LAST], [freed, LAST + 1], [again, AGAIN]].map(([settings, order]) => {
      const part = new THREE.Mesh(this.geometry, new THREE.MeshBasicMaterial(settings));
      part.renderOrder = order;
      part.frustumCulled = part.visible = false;
      upright.add(part);
      return part;
    });
    this.parts[2].material.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>",
        `#include <project_vertex>\ngl_Position.z = ${FAR} * gl_Position.w;`);
    };
    this.hidesAll = false;
  }

  /** Forgets everything: whoever connects gets all there is. */
  clear() {
    if (this.cells.size) this.isOld = true;
    this.cells.clear();
  }

  /** Takes a message of cells; one that is not whole is left out. */
  take(buffer) {
    const cells = decodeCells(buffer);
    if (cells === null) this.damaged += 1;
    for (const [key, { corners, triangles }] of cells ?? []) {
      this.cells.delete(key);
      if (triangles.length && this.cells.size < MAX_CELLS) {
        this.cells.set(key, { corners, triangles, box: new THREE.Box3().setFromArray(corners) });
      }
      this.isOld = true;
    }
    if (this.isOld) this.changed();
  }

  /** Lets it hide whatever is drawn after it, too: where no splats are drawn. */
  hideAll(on) {
    this.hidesAll = on;
    this.isOld = true;
  }

  /** Brings what is drawn up to date; whether anything is new. */
  step() {
    if (!this.isOld) return false;
    this.isOld = false;
    this.version += 1;
    const all = [...this.cells.values()];
    const corners = new Float32Array(all.reduce((sum, cell) => sum + cell.corners.length, 0));
    const index = new Uint32Array(all.reduce((sum, cell) => sum + cell.triangles.length, 0));
    let [at, to] = [0, 0];
    for (const cell of all) {
      corners.set(cell.corners, at);
      for (const corner of cell.triangles) index[to++] = at / 3 + corner;
      at += cell.corners.length;
    }
    this.geometry.dispose();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    this.geometry.setIndex(new THREE.BufferAttribute(index, 1));
    this.parts.forEach((part, i) => { part.visible = index.length > 0 && (i === 0 || !this.hidesAll); });
    return true;
  }

  /** Metres along a ray of the world to the nearest of them; Infinity where none is. */
  metresTo(origin, direction) {
    if (!this.cells.size) return Infinity;
    const turn = this.upright.quaternion.clone().invert();
    const ray = new THREE.Ray(this.upright.worldToLocal(origin.clone()),
      direction.clone().applyQuaternion(turn));
    const [place, a, b, c] = Array.from({ length: 4 }, () => new THREE.Vector3());
    let nearest = Infinity;
    for (const { corners, triangles, box } of this.cells.values()) {
      if (ray.intersectBox(box, place) === null && !box.containsPoint(ray.origin)) continue;
      for (let i = 0; i < triangles.length; i += 3) {
        [a, b, c].forEach((corner, k) => corner.fromArray(corners, 3 * triangles[i + k]));
        if (ray.intersectTriangle(a, b, c, false, place) === null) continue;
        nearest = Math.min(nearest, place.distanceTo(ray.origin));
      }
    }
    return nearest;
  }
}
