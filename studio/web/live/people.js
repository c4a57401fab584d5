// The other people: a figure each, moved between the bodies that come, and a name above it.
import * as THREE from "three";
import { COLOURS, Figure } from "shared/figure.js";
import { Pacer, Timeline } from "live/timeline.js";
import { decodeBodies } from "live/wire.js";

const HIDDEN_AFTER_MS = 2000;
const LABEL_RISE_M = 0.24;
const SIGN_PX = 48;

/** A person's colour, `#rrggbb`. */
export const colourOf = (index) =>
  `#${COLOURS[index % COLOURS.length].toString(16).padStart(6, "0")}`;

export class People {
  /** `upright`: the group whose axes are a headset's. */
  constructor(upright) {
    this.upright = upright;
    this.byId = new Map();
    this.byIndex = new Map();
  }

  /** Takes the list of who is here. */
  setList(list, ownId) {
    const here = new Set(list.map((person) => person.id));
    for (const [id, known] of this.byId) {
      if (here.has(id)) continue;
      known.figure.dispose();
      this.byId.delete(id);
      this.byIndex.delete(known.person.index);
    }
    for (const person of list) {
      if (person.id === ownId) continue;
      const known = this.byId.get(person.id) ?? this.#add(person);
      if (known.person.name !== person.name) known.sign.write(person.name);
      known.person = person;
    }
  }

  /** Takes bodies that came at a time. */
  take(buffer, now) {
    for (const [index, body, bytes] of decodeBodies(buffer)) {
      const known = this.byIndex.get(index);
      if (known === undefined) continue;
      const sent = body.t_us / 1000;
      // A device that started anew counts its time from elsewhere.
      if (sent < (known.newest ?? 0) - HIDDEN_AFTER_MS) {
        known.pacer = new Pacer();
        known.line = new Timeline(known.pacer);
      }
      // Somebody who keeps still is the same body: nothing has to be drawn again.
      if (!isSame(bytes, known.bytes)) known.body = body;
      known.bytes = bytes;
      known.newest = sent;
      known.cameAt = now;
      known.pacer.note(sent, now);
      known.line.push(sent, known.body);
    }
  }

  /** Shows everybody at a time; whether anybody has moved or still will. */
  step(now, eye, inHeadset) {
    let isMoving = false;
    for (const known of this.byId.values()) {
      const { figure, line, person, sign } = known;
      const found = now - known.cameAt < HIDDEN_AFTER_MS && !person.muted ? line.at(now) : null;
      const wasVisible = figure.group.visible;
      figure.group.visible = found !== null;
      const share = found === null || found[0] === found[1] ? 0 : found[2];
      if (found !== null && (found[0] !== known.shown || share !== known.share)) {
        [known.shown, known.share] = [found[0], share];
        figure.show(between(...found));
        sign.sprite.visible = false;
        isMoving = true;
      }
      isMoving ||= figure.group.visible !== wasVisible || (found !== null && line.isMoving(now));
      if (found === null) continue;
      const head = figure.head.getWorldPosition(new THREE.Vector3());
      figure.fade(head.distanceTo(eye));
      sign.sprite.position.copy(figure.head.position).setY(figure.head.position.y + LABEL_RISE_M);
      sign.sprite.visible = inHeadset && figure.head.visible;
    }
    return isMoving;
  }

  /** Names to write on the picture: [id, name, colour, place in the world or null if hidden]. */
  labels() {
    return [...this.byId].map(([id, { person, figure }]) => {
      const isHere = figure.group.visible && figure.head.visible;
      const place = isHere ? figure.head.getWorldPosition(new THREE.Vector3()) : null;
      place?.setZ(place.z + LABEL_RISE_M);
      return [id, person.name, colourOf(person.index), place];
    });
  }

  #add(person) {
    const figure = new Figure(COLOURS[person.index % COLOURS.length]);
    const sign = new Sign(person.name, colourOf(person.index));
    figure.group.add(sign.sprite);
    this.upright.add(figure.group);
    figure.group.visible = false;
    const pacer = new Pacer();
    const line = new Timeline(pacer);
    const known = { person, figure, sign, pacer, line, cameAt: -Infinity };
    this.byId.set(person.id, known);
    this.byIndex.set(person.index, known);
    return known;
  }
}

function isSame(bytes, other) {
  return bytes.length === other?.length && bytes.every((byte, i) => byte === other[i]);
}

/** What a figure shows between two bodies. */
function between(a, b, share) {
  const both = (mix, one, other) => (one && other ? mix(one, other, share) : one);
  const hand = (one, other) => both(
    () => ({ joints: lerped(one.joints, other.joints, share), radii: one.radii }), one, other);
  return {
    head: both(posed, a.head, b.head),
    grips: [0, 1].map((i) => both(posed, a.controllers[i]?.grip ?? null, b.controllers[i]?.grip)),
    hands: [0, 1].map((i) => hand(a.hands[i], b.hands[i])),
    ray: both(lerped, a.ray, b.ray),
  };
}

function lerped(a, b, share) {
  return a.map((value, i) => value + share * (b[i] - value));
}

function posed(a, b, share) {
  const turn = new THREE.Quaternion().fromArray(a, 3)
    .slerp(new THREE.Quaternion().fromArray(b, 3), share);
  return [...lerped(a.slice(0, 3), b.slice(0, 3), share), ...turn.toArray()];
}

/** A name that is part of the room: in a headset nothing else can be written. */
class Sign {
  constructor(text, colour) {
    this.colour = colour;
    this.canvas = document.createElement("canvas");
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.sprite = new THREE.Sprite(new THREE.SpriteMaterial({
      map: this.texture, depthTest: false, transparent: true }));
    this.sprite.renderOrder = 10;
    this.sprite.visible = false;
    this.write(text);
  }

  write(text) {
    const font = `600 ${SIGN_PX}px "Atkinson Hyperlegible Next", sans-serif`;
    const draw = this.canvas.getContext("2d");
    draw.font = font;
    const width = Math.ceil(draw.measureText(text).width) + SIGN_PX;
    [this.canvas.width, this.canvas.height] = [width, 1.5 * SIGN_PX];
    draw.font = font;
    draw.fillStyle = "rgba(18, 21, 27, .88)";
    draw.roundRect(0, 0, width, this.canvas.height, 18);
    draw.fill();
    draw.fillStyle = this.colour;
    draw.textBaseline = "middle";
    draw.fillText(text, SIGN_PX / 2, 0.78 * SIGN_PX);
    this.texture.dispose();
    this.sprite.scale.set(0.09 * width / this.canvas.height, 0.09, 1);
  }
}
