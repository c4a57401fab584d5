// Shapes pass from one person to another: by a button, in a headset by letting one go at somebody's
// hand. The studio decides; whose a shape is now is written over it for a while.
import { colourOf } from "shared/colours.js";
import { Sign } from "live/people.js";

const SHOWN_MS = 4000; // so long a name stands over what has passed: read twice
const OVER_M = 0.12; // above the shape
const REACH_M = 0.08; // from somebody's hand to what they are given, as for taking it
const byId = (id) => document.getElementById(id);

export class Handing {
  /** `picker` measures how far a place is from a shape; `notice(words)` tells the user something. */
  constructor(room, things, people, picker, { notice, changed }) {
    Object.assign(this, { room, things, people, picker, notice, changed });
    this.list = [];
    this.you = "";
    this.selected = null; // name of the shape that the button gives
    this.asked = null; // name of the shape that was asked for last
    this.signs = new Map(); // by name of a shape: { sign, until }
    things.passed = (key, from, to) => this.#passed(key, from, to);
    this.choice = /** @type {HTMLSelectElement} */ (byId("thing-taker"));
    byId("thing-give").addEventListener("click", () => {
      if (this.selected !== null) things.give(this.selected, this.choice.value);
    });
  }

  /** Takes the list of who is here. */
  setList(list, you) {
    Object.assign(this, { list, you });
    const named = this.takers().map(({ id, name }) => new Option(name, id));
    const said = (options) => [...options].map(({ value, text }) => `${value} ${text}`).join("\n");
    if (said(named) !== said(this.choice.options)) {
      const chosen = this.choice.value;
      this.choice.replaceChildren(...named);
      if (named.some(({ value }) => value === chosen)) this.choice.value = chosen;
    }
    byId("thing-give").textContent = named.length === 1 ? `Give to ${named[0].text}` : "Give";
    this.offer(this.selected);
  }

  /** Offers to give a shape; null: none. */
  offer(key) {
    const count = this.things.rights.includes("give") ? this.takers().length : 0;
    this.selected = key;
    byId("thing-give").hidden = key === null || count === 0;
    this.choice.hidden = key === null || count < 2;
  }

  /** People who can be given something. */
  takers() {
    return this.list.filter(({ id, takes }) => id !== this.you && takes);
  }

  /** Asks for a shape of somebody who has left, or has no page to hand it over; whether it is one. */
  takeFree({ kind, key }) {
    const by = this.things.get(kind, key)?.by;
    if (kind !== "primitive" || !this.things.rights.includes("give")) return false;
    if (this.list.some(({ id, yields }) => id === by && !yields)) return false;
    this.asked = key;
    this.things.give(key, this.you);
    return true;
  }

  /** Gives a shape that a hand lets go to whoever's hand is at it. */
  letGo(key) {
    const taker = this.takers().find(({ id }) => this.#handsOf(id).some((place) =>
      this.picker.toShape(key, place) <= REACH_M));
    if (taker !== undefined) this.things.give(key, taker.id);
  }

  /** A person's name; of nobody who is here, in other words. */
  nameOf(id) {
    return this.list.find((person) => person.id === id)?.name ?? "somebody else";
  }

  /** Lets what is written follow its shape, and end; whether anything has changed. */
  step(now) {
    for (const [key, { sign, until }] of this.signs) {
      const fields = this.things.get("primitive", key);
      if (fields === null || now > until) this.#end(key);
      else sign.sprite.position.fromArray(fields.pose).y += fields.size[1] + OVER_M;
    }
    return this.signs.size > 0;
  }

  /** What is written over which shape: [name of the shape, words]. */
  shown() {
    return [...this.signs].map(([key, { words }]) => [key, words]);
  }

  #passed(key, from, to) {
    this.#end(key);
    const isMine = to === this.you;
    const index = this.list.find(({ id }) => id === to)?.index ?? 0;
    const words = isMine ? "yours" : `${this.nameOf(to)} has it`;
    const sign = new Sign(words, colourOf(index));
    sign.sprite.visible = true;
    this.room.upright.add(sign.sprite);
    this.signs.set(key, { sign, words, until: performance.now() + SHOWN_MS });
    const isGiven = this.asked !== key && this.list.some(({ id }) => id === from);
    if (isMine) this.notice(isGiven ? `${this.nameOf(from)} gave you a shape.` : "The shape is yours now.");
    if (this.asked === key) this.asked = null;
    if (from === this.you) this.notice(`${this.nameOf(to)} has the shape now.`);
    this.changed();
  }

  #end(key) {
    const known = this.signs.get(key);
    if (known === undefined) return;
    known.sign.sprite.removeFromParent();
    known.sign.dispose();
    this.signs.delete(key);
    this.changed();
  }

  /** Places of somebody's hands, as they were sent last: joints, or a controller's grip. */
  #handsOf(id) {
    const known = this.people.byId.get(id);
    if (!known?.figure.group.visible || !known.shown) return [];
    const { hands, controllers } = known.shown;
    const joints = hands.flatMap((hand) => hand?.joints ?? []);
    const grips = controllers.flatMap((controller) => controller?.grip.slice(0, 3) ?? []);
    const numbers = [...joints, ...grips];
    return Array.from({ length: numbers.length / 3 }, (_, i) => numbers.slice(3 * i, 3 * i + 3));
  }
}
