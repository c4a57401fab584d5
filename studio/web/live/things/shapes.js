// Primitives in the room: boxes and cylinders stand for furniture and free space, a sphere marks a
// place, an arrow says which way.
import * as THREE from "three";

export const SHAPES = ["box", "sphere", "cylinder", "arrow"];
/** Metres along x, y (up) and z of a new one. */
export const SIZES = { box: [0.3, 0.3, 0.3], sphere: [0.2, 0.2, 0.2], cylinder: [0.3, 0.4, 0.3],
  arrow: [0.5, 0.1, 0.1] };
export const MIN_SIDE_M = 0.02;
export const MAX_SIDE_M = 3;
const ROUND = 40;
const HEAD = 0.4; // of an arrow's length
const NEARER_M = 0.03; // splats before a shape by less than this are what it stands on

/** Forms of one metre whose base is at y = 0; an arrow points along +x. */
const FORMS = {
  box: () => new THREE.BoxGeometry(1, 1, 1).translate(0, 0.5, 0),
  sphere: () => new THREE.SphereGeometry(0.5, ROUND, ROUND / 2).translate(0, 0.5, 0),
  cylinder: () => new THREE.CylinderGeometry(0.5, 0.5, 1, ROUND).translate(0, 0.5, 0),
  arrow: () => new THREE.LatheGeometry([[0, -0.5], [0.22, -0.5], [0.22, 0.5 - HEAD], [0.5, 0.5 - HEAD],
    [0, 0.5]].map(([radius, y]) => new THREE.Vector2(radius, y)), ROUND)
    .rotateZ(-Math.PI / 2).translate(0, 0.5, 0),
};

export class Bodies {
  /** `upright`: the group whose axes are a headset's; `changed`: the picture is no longer right. */
  constructor(upright, changed) {
    this.upright = upright;
    this.changed = changed;
    this.meshes = new Map();
    this.forms = new Map();
  }

  /** Shows a primitive as it is; null takes it away. */
  show(key, fields) {
    let mesh = this.meshes.get(key);
    if (fields === null) {
      mesh?.removeFromParent();
      mesh?.material.dispose();
      this.meshes.delete(key);
    } else {
      if (mesh === undefined) {
        mesh = new THREE.Mesh(undefined, material());
        this.meshes.set(key, mesh);
        this.upright.add(mesh);
      }
      mesh.geometry = this.#form(fields.shape);
      mesh.position.fromArray(fields.pose);
      mesh.quaternion.fromArray(fields.pose, 3);
      mesh.scale.fromArray(fields.size);
      mesh.material.color.setRGB(...fields.colour, THREE.SRGBColorSpace);
    }
    this.changed();
  }

  /** Those on a ray of the world: [key, metres]. */
  hits(raycaster) {
    return [...this.meshes].flatMap(([key, mesh]) => {
      mesh.updateWorldMatrix(true, false);
      return raycaster.intersectObject(mesh, false).slice(0, 1).map((hit) => [key, hit.distance]);
    });
  }

  #form(shape) {
    if (!this.forms.has(shape)) this.forms.set(shape, FORMS[shape]());
    return this.forms.get(shape);
  }
}

/** Where it is drawn stays, how deep it lies in the picture becomes less. */
function material() {
  const made = new THREE.MeshLambertMaterial();
  made.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `
      #include <project_vertex>
      vec4 nearer = vec4(mvPosition.xyz * (1.0 - ${NEARER_M} / length(mvPosition.xyz)), 1.0);
      vec4 nearerClip = projectionMatrix * nearer;
      gl_Position.z = nearerClip.z / nearerClip.w * gl_Position.w;`);
  };
  return made;
}
