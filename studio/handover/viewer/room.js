// The room in three dimensions: splats of the room and of every object, people, rays and lines.
// Everything stands in the world of the recording: metres, Z up.
import * as THREE from "three";
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import { around, latest, mixed, pose } from "viewer/moments.js";

const HEAD_RADIUS_M = 0.11;
const COLOURS = { local: 0xf28e2b, remote: 0x4e9de6 };
const RAY_WIDTH_M = 0.006;
const STEM_WIDTH_M = 0.012;
const LINE_WIDTH_M = 0.008;
const UPRIGHT = 0.96;
const ON_M = 0.03;

export class Room {
  /** `changed` is called whenever the picture is no longer what it should be. */
  constructor(canvas, data, changed) {
    THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
    this.data = data;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0x0e1014);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.5));
    this.camera = new THREE.PerspectiveCamera(62, 1, 0.05, 200);
    this.spark = new SparkRenderer({ renderer: this.renderer, onDirty: changed });
    this.scene.add(this.spark);
    this.objects = new Map();
    this.shadows = new Map();
    this.people = new Map();
    this.lines = new Map();
  }

  /** Unpacks all splats; `progress(done, all)` after each of them. */
  async load(parts, progress) {
    const { data } = this;
    const all = data.objects.length + 1;
    const room = await this.#splats(parts, data.room_part);
    this.scene.add(room);
    progress(1, all);
    for (const [index, item] of data.objects.entries()) {
      const group = new THREE.Group();
      group.add(await this.#splats(parts, item.part));
      this.objects.set(item.id, group);
      this.scene.add(group);
      if (parts.has(item.shadow_part)) {
        const shadow = new THREE.Group();
        shadow.add(await this.#splats(parts, item.shadow_part));
        this.shadows.set(item.id, shadow);
        this.scene.add(shadow);
      }
      progress(index + 2, all);
    }
    for (const person of data.people) {
      const head = headOf(COLOURS[person.role] ?? COLOURS.remote);
      const [ray, stem] = [RAY_WIDTH_M, STEM_WIDTH_M].map((width) =>
        rod(width, COLOURS[person.role] ?? COLOURS.remote));
      this.people.set(person.id, { head, ray, stem });
      this.scene.add(head, ray, stem);
    }
    for (const line of data.lines) {
      const group = new THREE.Group();
      this.lines.set(line.id, { group, shown: undefined });
      this.scene.add(group);
    }
  }

  /** Puts everything where it was at a time. */
  show(t) {
    for (const item of this.data.objects) {
      const body = this.objects.get(item.id);
      pose(body, item.poses, t);
      const shadow = this.shadows.get(item.id);
      if (shadow) lay(shadow, body, item.stands_m);
    }
    for (const person of this.data.people) {
      const { head, ray, stem } = this.people.get(person.id);
      head.visible = pose(head, person.heads, t);
      // Down to the floor: so one sees where on it a person is.
      const { x, y, z } = head.position;
      stretch(stem, [x, y, z - HEAD_RADIUS_M, x, y, 0]);
      stem.visible &&= head.visible;
      const ends = around(person.rays, t);
      if (ends === null) ray.visible = false;
      else stretch(ray, mixed(...ends));
    }
    for (const line of this.data.lines) this.#draw(line, latest(line.versions, t));
  }

  /** Ids of the people, rays and lines that are there. */
  shown() {
    const people = [...this.people].filter(([, person]) => person.head.visible);
    const rays = [...this.people].filter(([, person]) => person.ray.visible);
    const lines = [...this.lines].filter(([, line]) => line.group.children.length);
    const [heads, pointing, drawn] = [people, rays, lines].map((of) => of.map(([id]) => id));
    return { heads, rays: pointing, lines: drawn };
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

  async #splats(parts, name) {
    const mesh = new SplatMesh({ fileBytes: parts.bytes(name), fileName: `${name}.spz` });
    // The file's up is Y, as in any SPZ file.
    const [w, x, y, z] = this.data.world_from_file;
    mesh.quaternion.set(x, y, z, w);
    await mesh.initialized;
    return mesh;
  }

  #draw(line, points) {
    const kept = this.lines.get(line.id);
    if (kept.shown === points) return;
    kept.shown = points;
    kept.group.clear();
    const colour = new THREE.Color().setRGB(...line.colour, THREE.SRGBColorSpace);
    for (let i = 0; points !== null && i + 5 < points.length; i += 3) {
      const part = rod(LINE_WIDTH_M, colour);
      stretch(part, points.slice(i, i + 6));
      kept.group.add(part);
    }
  }
}

/** Lays an object's shadow below it; hides it where the object is in the air or lies on its side. */
function lay(shadow, body, stands) {
  const { x, y, z, w } = body.quaternion;
  const isUpright = 1 - 2 * (x * x + y * y) > UPRIGHT;
  shadow.visible = isUpright && stands.some((height) => Math.abs(body.position.z - height) < ON_M);
  shadow.position.copy(body.position);
  shadow.quaternion.set(0, 0, z, w).normalize();
}

/** A head, in its own axes: x right, y down, z where it looks. */
function headOf(colour) {
  const head = new THREE.Group();
  const skin = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.7 });
  const dark = new THREE.MeshStandardMaterial({ color: 0x15181e, roughness: 0.3 });
  const ball = new THREE.Mesh(new THREE.SphereGeometry(HEAD_RADIUS_M, 32, 24), skin);
  ball.scale.set(0.85, 1.1, 1);
  const visor = new THREE.Mesh(new THREE.BoxGeometry(0.15, 0.06, 0.05), dark);
  visor.position.set(0, -0.015, 0.095);
  head.add(ball, visor);
  return head;
}

/** A thin rod of one metre along Y, to be stretched between two points. */
function rod(width, colour) {
  const shape = new THREE.CylinderGeometry(width / 2, width / 2, 1, 6);
  return new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ color: colour }));
}

function stretch(mesh, [x, y, z, u, v, w]) {
  const from = new THREE.Vector3(x, y, z);
  const along = new THREE.Vector3(u, v, w).sub(from);
  const length = along.length();
  mesh.visible = length > 1e-6;
  if (!mesh.visible) return;
  mesh.position.copy(from).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.divideScalar(length));
  mesh.scale.set(1, length, 1);
}
