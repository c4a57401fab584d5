// Somebody in passthrough marks known places of the room: with the dot before a controller and the trigger, or
// with a pinch. Places are in the headset's space; words float before the wearer.
import * as THREE from "three";
import { aligned, centimetres, flawOf } from "live/ar/alignment.js";

const DOT_M = 0.012;
const [DOT_COLOUR, MARK_COLOUR] = [0xffffff, 0xf2bf40];
const WORDS_AHEAD_M = 1.1;
const WORDS_BELOW_M = 0.12;
const FOLLOW_S = 0.4; // in which the words come before one's eyes
const [WIDTH_PX, LINE_PX, TALL_M] = [900, 46, 0.045]; // of the words; a line is so tall
const MAX_MARKS = 3;
const SHOWN_MS = 6000; // of the last words
export const MIN_PLACES = 2;

export class Marking {
  /** `rig`: the group of the headset's space; `footprint` of the room. */
  constructor(rig, footprint) {
    this.footprint = footprint;
    this.places = [];
    this.group = new THREE.Group();
    this.group.visible = false;
    this.words = new Words();
    const dot = (colour) => new THREE.Mesh(new THREE.SphereGeometry(DOT_M, 16, 12),
      new THREE.MeshBasicMaterial({ color: colour }));
    this.tips = [0, 1].map(() => dot(DOT_COLOUR));
    this.dots = Array.from({ length: MAX_MARKS }, () => dot(MARK_COLOUR));
    this.group.add(this.words.sprite, ...this.tips, ...this.dots);
    rig.add(this.group);
    this.marks = [];
    this.isDone = true;
    this.doneAt = -Infinity;
  }

  /** Begins anew; `places` [{ what, place }]; `why`: words that are shown before what is to be done. */
  begin(places, why = "") {
    this.places = places;
    this.marks = [];
    this.at = 0; // of the places, the one that is to be marked
    this.skipped = 0;
    this.isDone = false;
    this.why = why;
    this.#show();
  }

  /** Shows words while nothing is to be marked. */
  tell(text) {
    this.isDone = true;
    this.doneAt = performance.now();
    this.words.write(text);
  }

  /** Follows a frame; the alignment once it is found, else null. `hands`, left and right: null or
      { tip, marks, skips }: three numbers, and whether it has just pressed for either. */
  step(head, ahead, hands, seconds) {
    this.group.visible = !this.isDone || performance.now() - this.doneAt < SHOWN_MS;
    if (!this.group.visible) return null;
    this.words.follow(head, ahead, seconds);
    hands.forEach((hand, side) => {
      this.tips[side].visible = hand !== null && !this.isDone;
      if (hand !== null) this.tips[side].position.fromArray(hand.tip);
    });
    this.dots.forEach((dot, i) => {
      dot.visible = !this.isDone && i < this.marks.length;
      if (dot.visible) dot.position.fromArray(this.marks[i].seen);
    });
    for (const hand of this.isDone ? [] : hands) {
      if (hand?.marks) return this.#mark(hand.tip, head);
      if (hand?.skips) return this.#skip(head);
    }
    return null;
  }

  #mark(seen, head) {
    this.marks.push({ seen: [...seen], known: this.places[this.at].place });
    this.why = "";
    return this.#next(head);
  }

  #skip(head) {
    this.skipped += 1;
    return this.#next(head);
  }

  #next(head) {
    this.at += 1;
    if (this.marks.length === MAX_MARKS || this.at === this.places.length) return this.#finish(head);
    this.#show();
    return null;
  }

  #finish(head) {
    if (this.marks.length < MIN_PLACES) {
      this.begin(this.places, `${this.marks.length} marked, wanted ${MIN_PLACES} or more.`);
      return null;
    }
    const found = aligned(this.marks);
    const flaw = flawOf(found, head, this.footprint);
    if (flaw !== null) {
      this.begin(this.places, flaw);
      return null;
    }
    const count = this.marks.length;
    this.tell(`The room is laid: ${count} marks, ${centimetres(found.residual_m)} off. `
      + "⌖ at your left hand lays it anew.");
    return { ...found, at: this.marks[0].seen };
  }

  #show() {
    const count = Math.min(this.places.length, MAX_MARKS + this.skipped);
    this.words.write(`${this.why} ${this.at + 1} of ${count}: touch ${this.places[this.at].what}, then trigger `
      + "or pinch. Grip, or thumb and middle finger: leave it out.");
  }
}

/** Words on a board that comes along before one's eyes. */
class Words {
  constructor() {
    this.text = "";
    this.canvas = document.createElement("canvas");
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.sprite = new THREE.Sprite(new THREE.SpriteMaterial({
      map: this.texture, depthTest: false, transparent: true }));
    this.sprite.renderOrder = 40;
    this.isPlaced = false;
  }

  write(text) {
    this.text = text.trim();
    const draw = this.canvas.getContext("2d");
    const font = `600 ${0.7 * LINE_PX}px "Atkinson Hyperlegible Next", sans-serif`;
    draw.font = font;
    const lines = wrapped(draw, this.text, WIDTH_PX - LINE_PX);
    [this.canvas.width, this.canvas.height] = [WIDTH_PX, (lines.length + 0.6) * LINE_PX];
    draw.font = font;
    draw.fillStyle = "rgba(18, 21, 27, .88)";
    draw.roundRect(0, 0, WIDTH_PX, this.canvas.height, 18);
    draw.fill();
    draw.fillStyle = "#f0f3f6";
    draw.textBaseline = "middle";
    lines.forEach((line, i) => draw.fillText(line, LINE_PX / 2, (i + 0.8) * LINE_PX));
    this.texture.dispose();
    this.texture.needsUpdate = true;
    this.sprite.scale.set(TALL_M * WIDTH_PX / LINE_PX, TALL_M * this.canvas.height / LINE_PX, 1);
  }

  follow(head, ahead, seconds) {
    const wanted = new THREE.Vector3().fromArray(head).addScaledVector(ahead, WORDS_AHEAD_M);
    wanted.y -= WORDS_BELOW_M;
    const share = this.isPlaced ? Math.min(1, seconds / FOLLOW_S) : 1;
    this.sprite.position.lerp(wanted, share);
    this.isPlaced = true;
  }
}

function wrapped(draw, text, width) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const longer = `${lines.at(-1)} ${word}`.trim();
    if (draw.measureText(longer).width <= width || !lines.at(-1)) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}
