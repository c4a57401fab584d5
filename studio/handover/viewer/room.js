// A recorded room: splats of the room and of every object, people, rays and lines at a time.
import * as THREE from "three";
import { COLOURS, Figure } from "shared/figure.js";
import { around, latest, mixed, pose } from "viewer/moments.js";
import { Line, rod, stretch } from "shared/shapes.js";
import { layShadow, Stage } from "shared/stage.js";

const STEM_WIDTH_M = 0.012;
const LINE_WIDTH_M = 0.008;
const BELOW_HEAD_M = 0.7;
const ON_M = 0.03;

export class Room extends Stage {
  constructor(canvas, data, changed) {
    super(canvas, data.world_from_file, changed);
    this.data = data;
    this.objects = new Map();
    this.shadows = new Map();
    this.people = new Map();
    this.lines = new Map();
    // People are drawn in a headset's axes, whose up is the files' up.
    this.upright = new THREE.Group();
    this.upright.quaternion.copy(this.worldFromFile);
    this.scene.add(this.upright);
  }

  /** Unpacks all splats; `progress(done, all)` after each of them. */
  async load(parts, progress) {
    const { data } = this;
    const all = data.objects.length + 1;
    this.empty = await this.#part(parts, data.room_part);
    this.scene.add(this.empty);
    progress(1, all);
    for (const [index, item] of data.objects.entries()) {
      const group = new THREE.Group();
      group.add(await this.#part(parts, item.part));
      this.objects.set(item.id, group);
      this.scene.add(group);
      if (parts.has(item.shadow_part)) {
        const shadow = new THREE.Group();
        shadow.add(await this.#part(parts, item.shadow_part));
        this.shadows.set(item.id, shadow);
        this.scene.add(shadow);
      }
      progress(index + 2, all);
    }
    data.people.forEach((person, index) => {
      const colour = COLOURS[index % COLOURS.length];
      const figure = new Figure(colour);
      const stem = rod(STEM_WIDTH_M, colour);
      this.people.set(person.id, { figure, stem, head: figure.head });
      this.upright.add(figure.group);
      this.scene.add(stem);
    });
    for (const line of data.lines) {
      const drawn = new Line(LINE_WIDTH_M);
      this.lines.set(line.id, { drawn, shown: undefined });
      this.scene.add(drawn.group);
    }
  }

  /** Puts everything where it was at a time. */
  show(t) {
    for (const item of this.data.objects) {
      const body = this.objects.get(item.id);
      pose(body, item.poses, t);
      const shadow = this.shadows.get(item.id);
      const stands = item.stands_m.some((height) => Math.abs(body.position.z - height) < ON_M);
      if (shadow) layShadow(shadow, body, stands);
    }
    for (const person of this.data.people) this.#showPerson(person, t);
    for (const line of this.data.lines) {
      const kept = this.lines.get(line.id);
      const points = latest(line.versions, t);
      if (kept.shown === points) continue;
      kept.shown = points;
      kept.drawn.show(points, line.colour);
    }
  }

  /** Ids of the people, rays and lines that are there. */
  shown() {
    const people = [...this.people].filter(([, { figure }]) => figure.head.visible);
    const rays = [...this.people].filter(([, { figure }]) => figure.ray.visible);
    const lines = [...this.lines].filter(([, line]) => line.drawn.isShown);
    const [heads, pointing, drawn] = [people, rays, lines].map((of) => of.map(([id]) => id));
    return { heads, rays: pointing, lines: drawn };
  }

  #showPerson(person, t) {
    const { figure, stem } = this.people.get(person.id);
    const keys = around(person.heads, t);
    const ends = around(person.rays, t);
    const inFile = this.worldFromFile.clone().invert();
    const turned = (numbers) => {
      const found = [];
      for (let i = 0; i < numbers.length; i += 3) {
        const place = new THREE.Vector3().fromArray(numbers, i).applyQuaternion(inFile);
        found.push(...place.toArray());
      }
      return found;
    };
    const ray = ends === null ? null : turned(mixed(...ends));
    let head = null;
    stem.visible = keys !== null;
    if (keys !== null) {
      const at = new THREE.Object3D();
      pose(at, person.heads, t);
      const { x, y, z } = at.position;
      // The recording's head has a camera's axes: y down, looking along z.
      const flip = new THREE.Quaternion(1, 0, 0, 0);
      at.quaternion.premultiply(inFile).multiply(flip);
      head = [...turned([x, y, z]), ...at.quaternion.toArray()];
      // Down to the floor: so one sees where on it a person is.
      stretch(stem, [x, y, z - BELOW_HEAD_M, x, y, 0]);
    }
    figure.show({ head, ray });
  }

  async #part(parts, name) {
    return this.splats(parts.bytes(name), name);
  }
}
