// A recorded room: splats of the room and of every object, people, rays and lines at a time.
import * as THREE from "three";
import { Figure } from "shared/bodies/figure.js";
import { readShapes } from "shared/bodies/shapes.js";
import { COLOURS } from "shared/colours.js";
import { around, latest, mixed, pose, turn } from "viewer/moments.js";
import { Line } from "shared/shapes.js";
import { layShadow, Stage } from "shared/stage.js";

const LINE_WIDTH_M = 0.008;
const ON_M = 0.03;
const FINGERS = [0, 1, 2, 3, 4];

export class Room extends Stage {
  constructor(canvas, data, changed) {
    super(canvas, data.world_from_file, changed);
    this.data = data;
    this.objects = new Map();
    this.shadows = new Map();
    this.people = new Map();
    this.lines = new Map();
    this.shown_ms = -Infinity;
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
    const shapes = readShapes(await parts.buffer("figure"));
    data.people.forEach((person, index) => {
      const figure = new Figure(shapes, COLOURS[index % COLOURS.length], person.id);
      this.people.set(person.id, { figure, head: figure.head });
      this.scene.add(figure.group);
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
    // Backwards there are no steps: people are laid out anew.
    const dt_s = t >= this.shown_ms ? (t - this.shown_ms) / 1000 : null;
    this.shown_ms = t;
    for (const person of this.data.people) this.#showPerson(person, t, dt_s);
    for (const line of this.data.lines) {
      const kept = this.lines.get(line.id);
      const points = latest(line.versions, t);
      if (kept.shown === points) continue;
      kept.shown = points;
      kept.drawn.show(points, line.colour);
    }
  }

  /** Draws people as they are seen from where one looks. */
  render() {
    for (const { figure } of this.people.values()) figure.seenFrom(this.camera.position);
    super.render();
  }

  /** Ids of the people, rays and lines that are there. */
  shown() {
    const people = [...this.people].filter(([, { figure }]) => figure.head.visible);
    const rays = [...this.people].filter(([, { figure }]) => figure.ray.visible);
    const lines = [...this.lines].filter(([, line]) => line.drawn.isShown);
    const [heads, pointing, drawn] = [people, rays, lines].map((of) => of.map(([id]) => id));
    return { heads, rays: pointing, lines: drawn };
  }

  #showPerson(person, t, dt_s) {
    const { figure } = this.people.get(person.id);
    const known = (keys) => {
      const found = around(keys, t);
      return found === null ? null : mixed(...found);
    };
    const numbers = known(person.rays);
    const ray = numbers && [numbers.slice(0, 3), numbers.slice(3)];
    const eyes = known(person.heads)?.slice(0, 3);
    if (eyes === undefined) return figure.show(null, ray);
    // The recording's head has a camera's axes: x right, y down, z ahead.
    const [right, down, ahead] = turn(person.heads, t, 3);
    const goal = { eyes, head: [ahead, less(right), less(down)], wrists: [null, null], grips: [0, 0],
      palms: [null, null], fingers: [null, null], aim: null };
    person.hands.forEach(({ places, palms, fingers }, side) => {
      const place = known(places);
      if (place !== null) [goal.wrists[side], goal.grips[side]] = [place.slice(0, 3), place[3]];
      goal.palms[side] = turn(palms, t, 0);
      const angles = known(fingers);
      if (angles !== null) goal.fingers[side] = FINGERS.map((i) => angles.slice(4 * i, 4 * i + 4));
    });
    if (goal.wrists.every((wrist) => wrist === null)) goal.aim = ray && ray[1];
    figure.show(goal, ray, dt_s);
  }

  async #part(parts, name) {
    return this.splats(parts.bytes(name), name);
  }
}

const less = (v) => v.map((value) => -value);
