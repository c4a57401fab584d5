// The other people: a figure each, moved between the bodies that come, and a name above it.
import * as THREE from "three";
import { Figure } from "shared/bodies/figure.js";
import { goalOf, toWorld } from "shared/bodies/goals.js";
import { COLOURS, colourOf } from "shared/colours.js";
import { Pacer, Timeline } from "live/timeline.js";
import { decodeBodies } from "live/wire.js";

const HIDDEN_AFTER_MS = 2000;
const SETTLES_MS = 900; // feet step and arms sink for so long after a body that stands still
const LONGEST_S = 0.1; // between two pictures of a body, which may have rested long before
const BUDGET_MS = 4; // for bodies in one picture; who is left out comes first in the next one
const LABEL_RISE_M = 0.24;
const SIGN_PX = 48;

export class People {
  /** `world`: what is metres and Z up; `shapes`: the figure's, of `readShapes`. */
  constructor(world, shapes) {
    this.world = world;
    this.shapes = shapes;
    this.byId = new Map();
    this.byIndex = new Map();
    this.furniture = null; // what hands stay out of
    this.spent_ms = 0; // for bodies in the last picture
  }

  /** Takes the list of who is here. */
  setList(list, ownId) {
    const here = new Set(list.map((person) => person.id));
    for (const [id, known] of this.byId) {
      if (here.has(id)) continue;
      known.figure.dispose();
      known.sign.dispose();
      this.byId.delete(id);
      this.byIndex.delete(known.person.index);
    }
    for (const person of list) {
      if (person.id === ownId) continue;
      const known = this.byId.get(person.id) ?? this.#add(person);
      if (known.person.name !== person.name) known.sign.write(person.name, known.isSpeaking);
      known.person = person;
    }
  }

  /** Takes note that somebody has begun or ceased to speak; true if that is news. */
  setSpeaking(id, isSpeaking) {
    const known = this.byId.get(id);
    if (known === undefined || known.isSpeaking === isSpeaking) return false;
    known.isSpeaking = isSpeaking;
    known.sign.write(known.person.name, isSpeaking);
    return true;
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
    const waiting = [];
    for (const known of this.byId.values()) {
      const { figure, line, person } = known;
      const found = now - known.cameAt < HIDDEN_AFTER_MS && !person.muted ? line.at(now) : null;
      const wasVisible = figure.group.visible;
      figure.group.visible = found !== null;
      isMoving ||= figure.group.visible !== wasVisible;
      if (found === null) continue;
      const share = found[0] === found[1] ? 0 : found[2];
      const isNew = found[0] !== known.shown || share !== known.share || !wasVisible;
      if (isNew) known.movedAt = now;
      if (!wasVisible) known.solvedAt = null;
      if (isNew || now - known.movedAt < SETTLES_MS) waiting.push([known, found]);
      [known.shown, known.share] = [found[0], share];
      isMoving ||= line.isMoving(now);
    }
    if (this.#solve(waiting, now)) isMoving = true;
    for (const { figure, sign } of this.byId.values()) {
      if (!figure.group.visible) continue;
      figure.seenFrom(eye);
      sign.sprite.position.copy(figure.head.position).setZ(figure.head.position.z + LABEL_RISE_M);
      sign.sprite.visible = inHeadset && figure.head.visible;
    }
    return isMoving;
  }

  /** Solves bodies, whoever waits longest first, as long as a picture may take; whether any was. */
  #solve(waiting, now) {
    waiting.sort(([a], [b]) => (a.solvedAt ?? -Infinity) - (b.solvedAt ?? -Infinity));
    const began = performance.now();
    this.spent_ms = 0;
    for (const [known, found] of waiting) {
      if (this.spent_ms > BUDGET_MS) break;
      const body = between(...found);
      const ray = body.ray && [toWorld(body.ray), toWorld(body.ray.slice(3))];
      const dt_s = known.solvedAt === null ? null : Math.min((now - known.solvedAt) / 1000, LONGEST_S);
      const goal = body.head && goalOf(body);
      known.figure.show(goal, ray, dt_s, goal && (this.furniture?.near(goal.eyes) ?? null));
      known.solvedAt = now;
      this.spent_ms = performance.now() - began;
    }
    return waiting.length > 0;
  }

  /** Names to write on the picture: [id, name, colour, place in the world or null if hidden]. */
  labels() {
    return [...this.byId].map(([id, { person, figure, isSpeaking }]) => {
      const isHere = figure.group.visible && figure.head.visible;
      const place = isHere ? figure.head.position.clone() : null;
      place?.setZ(place.z + LABEL_RISE_M);
      return [id, spoken(person.name, isSpeaking), colourOf(person.index), place];
    });
  }

  #add(person) {
    const figure = new Figure(this.shapes, COLOURS[person.index % COLOURS.length], person.id);
    const sign = new Sign(person.name, colourOf(person.index));
    figure.group.add(sign.sprite);
    this.world.add(figure.group);
    figure.group.visible = false;
    const pacer = new Pacer();
    const line = new Timeline(pacer);
    const known = { person, figure, sign, pacer, line, cameAt: -Infinity, movedAt: -Infinity,
      solvedAt: null, isSpeaking: false };
    this.byId.set(person.id, known);
    this.byIndex.set(person.index, known);
    return known;
  }
}

function isSame(bytes, other) {
  return bytes.length === other?.length && bytes.every((byte, i) => byte === other[i]);
}

/** A name, with waves before it while its owner speaks: seen without colours, too. */
const spoken = (name, isSpeaking) => (isSpeaking ? `))) ${name}` : name);

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
export class Sign {
  constructor(text, colour) {
    this.colour = colour;
    this.canvas = document.createElement("canvas");
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.sprite = new THREE.Sprite(new THREE.SpriteMaterial({
      map: this.texture, depthTest: false, transparent: true }));
    this.sprite.renderOrder = 30;
    this.sprite.visible = false;
    this.write(text, false);
  }

  write(name, isSpeaking) {
    const text = spoken(name, isSpeaking);
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
    this.texture.needsUpdate = true;
    this.sprite.scale.set(0.09 * width / this.canvas.height, 0.09, 1);
  }

  dispose() {
    this.texture.dispose();
    this.sprite.material.dispose();
  }
}
