// Live surfaces: what the studio's camera shows of a wall or a table, on a board at its place.
import * as THREE from "three";

const KIND = 4;
const IN_FRONT_M = 0.02; // of the surface
const NEARER_M = 0.08; // splats in front of it by less than this are the scan of the surface itself
const CORNERS = [[0, 1], [1, 1], [1, 0], [0, 0]]; // clockwise from the top left, as pictures lie

// Where it is drawn stays, how deep it lies in the picture becomes less.
const NEARER = `
  #include <project_vertex>
  vec4 nearer = vec4(mvPosition.xyz * (1.0 - ${NEARER_M} / length(mvPosition.xyz)), 1.0);
  vec4 nearerClip = projectionMatrix * nearer;
  gl_Position.z = nearerClip.z / nearerClip.w * gl_Position.w;
`;

export class Surfaces {
  /** `upright`: the group whose axes are a headset's; `changed`: the picture is no longer right. */
  constructor(upright, changed) {
    this.group = new THREE.Group();
    upright.add(this.group);
    this.changed = changed;
    this.boards = new Map();
    this.taken = 0;
  }

  /** Takes everything there is. */
  takeWhole(state) {
    for (const id of [...this.boards.keys()]) this.#place(id, []);
    for (const [id, { corners, seen }] of Object.entries(state.surfaces ?? {})) {
      this.#place(id, seen ?? corners);
    }
  }

  /** Shows a surface between four corners, where it is filmed or carried to; none takes it away. */
  show(id, corners) {
    this.#place(id, corners);
  }

  /** Takes a message with a picture. */
  async takePicture(buffer) {
    const end = 4 + new DataView(buffer).getUint16(2, true);
    const id = new TextDecoder().decode(new Uint8Array(buffer, 4, end - 4));
    const board = this.boards.get(id);
    if (board === undefined) return;
    this.taken += 1;
    board.number = this.taken;
    const { number } = board;
    const picture = await createImageBitmap(new Blob([new Uint8Array(buffer, end)], { type: "image/jpeg" }),
      { imageOrientation: "flipY" });
    // A newer picture was quicker, or the surface is gone.
    if (this.boards.get(id) !== board || board.number !== number) {
      picture.close();
      return;
    }
    board.picture?.close();
    board.texture?.dispose(); // a picture of another size needs another texture
    board.picture = picture;
    board.texture = new THREE.Texture(picture);
    board.texture.colorSpace = THREE.SRGBColorSpace;
    board.texture.flipY = false;
    board.texture.needsUpdate = true;
    board.mesh.material.map = board.texture;
    board.mesh.material.needsUpdate = true;
    board.mesh.visible = true;
    this.changed();
  }

  /** Sizes in pixels of the pictures that are shown, by surface. */
  shown() {
    return Object.fromEntries([...this.boards].filter(([, { mesh, picture }]) => mesh.visible && picture)
      .map(([id, { picture }]) => [id, [picture.width, picture.height]]));
  }

  #place(id, corners) {
    const known = this.boards.get(id);
    if (corners.length !== 4) {
      if (known === undefined) return;
      known.mesh.removeFromParent();
      known.mesh.geometry.dispose();
      known.mesh.material.dispose();
      known.texture?.dispose();
      known.picture?.close();
      this.boards.delete(id);
    } else {
      const board = known ?? { mesh: emptyBoard(), picture: null, texture: null, number: 0 };
      lay(board.mesh.geometry, corners);
      this.boards.set(id, board);
      this.group.add(board.mesh);
    }
    this.changed();
  }
}

/** Whether a message is a picture of a surface. */
export function isPicture(buffer) {
  const view = new DataView(buffer);
  return view.byteLength >= 4 && view.getUint8(0) === 1 && view.getUint8(1) === KIND;
}

/** A board that nothing is shown on yet. */
function emptyBoard() {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(12), 3));
  geometry.setAttribute("uv", new THREE.BufferAttribute(new Float32Array(CORNERS.flat()), 2));
  geometry.setIndex([0, 2, 1, 0, 3, 2]);
  const material = new THREE.MeshBasicMaterial({ toneMapped: false });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", NEARER);
  };
  const mesh = new THREE.Mesh(geometry, material);
  mesh.visible = false;
  return mesh;
}

/** Puts a board's corners just in front of a surface's. */
function lay(geometry, corners) {
  const [a, b, , d] = corners.map((corner) => new THREE.Vector3(...corner));
  // Seen from the front the corners are clockwise: down the left side, then along the top.
  const front = d.sub(a).cross(b.sub(a)).normalize().multiplyScalar(IN_FRONT_M);
  corners.forEach((corner, i) => {
    geometry.attributes.position.setXYZ(i, corner[0] + front.x, corner[1] + front.y, corner[2] + front.z);
  });
  geometry.attributes.position.needsUpdate = true;
  geometry.computeBoundingSphere();
}
