// Lines that people draw, and frames of surfaces that they mark: shown as the studio's log says, one's own at
// once. A line is sent whole again as it grows.
import * as THREE from "three";
import { Line } from "shared/shapes.js";
import { at, composed, inverse, rounded } from "live/things/poses.js";

const LINE_WIDTH_M = 0.009;
const WIDTHS_M = { line: LINE_WIDTH_M, surface: 0.012, preview: 0.012, filmed: 0.004 };
const FRAME_COLOUR = [0.94, 0.78, 0.2];
const STEP_M = 0.015; // between two points
const MAX_POINTS = 600; // of a line; a longer one goes on as another
const FEW_POINTS = 4;
const SEND_MS = 80;

export class Board {
  /** `upright`: the group whose axes are a headset's; `changed`: the picture is no longer right;
      `poseOf`: where an object is, by its id. */
  constructor(upright, link, changed, poseOf = () => undefined) {
    Object.assign(this, { upright, link, changed, poseOf });
    this.drawn = new Map();
    this.own = null; // the line that is being drawn
    this.waiting = new Map(); // of each operation that is not answered, the key of its line
    this.count = 0;
    // Lines of an earlier visit keep their names.
    this.visit = Date.now().toString(36);
    this.you = "";
  }

  /** Takes everything there is. */
  takeWhole(you, state) {
    this.you = you;
    for (const key of [...this.drawn.keys()]) this.#show(key, [], []);
    for (const [id, line] of Object.entries(state.lines ?? {})) {
      this.#show(`line:${id}`, line.points, line.colour, line);
    }
  }

  /** Takes an entry of the log. */
  take(entry) {
    if (entry.op === "line") {
      // What one draws oneself is further than what comes back of it.
      if (this.own !== null && entry.line.endsWith(this.own.name)) return;
      this.#show(`line:${entry.line}`, entry.points ?? [], entry.colour ?? [1, 1, 1], entry);
    }
  }

  /** Shows the frame of a surface, where it is seen and, thinner, where it is filmed. */
  frame(id, corners, seen) {
    this.#show(`surface:${id}`, framed(seen ?? corners), FRAME_COLOUR);
    this.#show(`filmed:${id}`, seen === null ? [] : framed(corners), FRAME_COLOUR);
  }

  /** Begins a line; on an object, by its id, it goes along with that. */
  begin(colour, on = null) {
    this.count += 1;
    const at = on === null ? undefined : this.poseOf(on);
    const held = at === undefined ? {} : { on, at: rounded(at) };
    this.own = { name: `${this.visit}-${this.count}`, colour, points: [], sentAt: -Infinity, held };
  }

  /** Lets lines go along with the objects on which they were drawn; whether any has moved. */
  step() {
    let hasMoved = false;
    for (const line of this.drawn.values()) {
      const now = line.on === undefined ? undefined : this.poseOf(line.on);
      if (now === undefined || now === line.shownAt) continue;
      line.shownAt = now;
      const moved = composed(now, inverse(line.at));
      line.group.position.fromArray(moved);
      line.group.quaternion.fromArray(moved, 3);
      hasMoved = true;
    }
    return hasMoved;
  }

  /** Goes on to a place (upright axes), if it is far enough from the last. */
  extend(seen, now) {
    if (this.own === null) return;
    const { points, colour, held } = this.own;
    const here = held.on === undefined ? undefined : this.poseOf(held.on);
    const place = here === undefined ? seen : at(held.at, at(inverse(here), seen).toArray()).toArray();
    const last = points.at(-1);
    if (last !== undefined && Math.hypot(...last.map((v, i) => v - place[i])) < STEP_M) return;
    points.push(place.map((v) => Math.round(v * 1e4) / 1e4));
    this.#showOwn();
    if (now - this.own.sentAt > SEND_MS && points.length > 1) this.#send(now);
    if (points.length < MAX_POINTS) return;
    this.end();
    this.begin(colour, held.on ?? null);
    this.extend(seen, now);
  }

  end() {
    if (this.own === null) return;
    const { points } = this.own;
    if (points.length === 1) points.push(points[0].map((v, i) => (i === 1 ? v + 0.004 : v)));
    if (points.length) {
      this.#showOwn();
      this.#send(performance.now());
    }
    this.own = null;
  }

  /** Forgets the line that is being drawn where it has hardly begun. */
  drop() {
    if (this.own === null || this.own.points.length >= FEW_POINTS) return;
    this.#show(this.ownKey, [], []);
    if (this.own.sentAt > -Infinity) this.link.do("line", { line: this.own.name, points: [] });
    this.own = null;
  }

  /** Shows corners that one has picked. */
  preview(corners) {
    this.#show("preview", corners.length > 1 ? corners : [], FRAME_COLOUR);
  }

  /** Makes a surface live. */
  mark(corners) {
    this.count += 1;
    this.link.do("surface", { surface: `${this.visit}-${this.count}`, corners });
  }

  undo() {
    this.link.do("undo");
  }

  /** The studio has done an operation, or refused it: then its line goes. */
  answered(id, isDone) {
    const key = this.waiting.get(id);
    this.waiting.delete(id);
    if (isDone || key === undefined) return;
    if (this.own !== null && key.endsWith(this.own.name)) this.own = null;
    this.#show(key, [], []);
  }

  /** Names of the lines that are there. */
  lines() {
    return [...this.drawn.keys()].filter((key) => key.startsWith("line:")).map((key) => key.slice(5));
  }

  get ownKey() {
    return `line:${this.you}/${this.own.name}`;
  }

  #showOwn() {
    this.#show(this.ownKey, this.own.points, this.own.colour, this.own.held);
  }

  #send(now) {
    const { name, points, colour, held } = this.own;
    this.own.sentAt = now;
    const id = this.link.do("line", { line: name, points, colour, ...held });
    if (id === null) return;
    this.waiting.set(id, this.ownKey);
    if (this.waiting.size > 200) this.waiting.delete(this.waiting.keys().next().value);
  }

  #show(key, points, colour, { on, at: begun } = {}) {
    let line = this.drawn.get(key);
    if (!points.length) {
      if (line === undefined) return;
      line.clear();
      line.group.removeFromParent();
      this.drawn.delete(key);
    } else {
      if (line === undefined) {
        line = new Line(WIDTHS_M[key.split(":")[0]] ?? LINE_WIDTH_M);
        this.drawn.set(key, line);
        this.upright.add(line.group);
      }
      line.show(points.flat(), colour);
      Object.assign(line, { on, at: begun, shownAt: undefined });
    }
    this.changed();
  }
}

/** The outline of a surface from its corners. */
function framed(corners) {
  return corners.length ? [...corners, corners[0]] : [];
}

/** Colours to draw with: name and red, green, blue of 0..1. */
export const INKS = [["red", "#ff5c5c"], ["yellow", "#ffd84d"], ["green", "#4dd08a"],
  ["blue", "#5cb8ff"], ["white", "#ffffff"]].map(([name, hex]) =>
  [name, hex, new THREE.Color(hex).convertLinearToSRGB().toArray()]);
