// A room of splats in three dimensions: the picture, its camera and light, and files of splats.
// Everything stands in the world of the program: metres, Z up.
import * as THREE from "three";
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";

const UPRIGHT = 0.96;

export class Stage {
  /** `worldFromFile`: quaternion w x y z that turns what is Y up; `changed` is called whenever the
      picture is no longer what it should be. */
  constructor(canvas, worldFromFile, changed) {
    THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
    const [w, x, y, z] = worldFromFile;
    this.worldFromFile = new THREE.Quaternion(x, y, z, w);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, stencil: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0x0e1014);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.5));
    this.camera = new THREE.PerspectiveCamera(62, 1, 0.05, 200);
    this.spark = new SparkRenderer({ renderer: this.renderer, onDirty: changed });
    this.scene.add(this.spark);
  }

  /** `covered`: pixels at the right that the list hides; the middle is that of the rest. */
  resize(width, height, covered) {
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, covered / 2, 0, width, height);
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }

  /** The splats of a file, up as they are in the world. */
  async splats(fileBytes, name) {
    const mesh = new SplatMesh({ fileBytes, fileName: `${name}.spz` });
    // The file's up is Y, as in any SPZ file.
    mesh.quaternion.copy(this.worldFromFile);
    await mesh.initialized;
    return mesh;
  }
}

/** Lays an object's shadow below it; hides it where the object is in the air or lies on its side. */
export function layShadow(shadow, body, stands) {
  const { x, y, z, w } = body.quaternion;
  const isUpright = 1 - 2 * (x * x + y * y) > UPRIGHT;
  shadow.visible = isUpright && stands;
  shadow.position.copy(body.position);
  shadow.quaternion.set(0, 0, z, w).normalize();
}
