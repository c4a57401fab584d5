// Primitives, proposals and live surfaces of everybody, as the studio's log has them; one's own are
// shown at once as they are changed, and sent as often as the studio takes them.
import { rounded } from "live/things/poses.js";

const SEND_MS = 80;
/** Operation, field with the name, and list in a welcome, by kind of thing. */
const KINDS = {
  primitive: ["primitive", "primitive", "primitives"],
  surface: ["surface", "surface", "surfaces"],
  proposal: ["propose", "proposal", "proposals"],
};
const KIND_OF = { primitive: "primitive", surface: "surface", propose: "proposal" };

/** What an entry says of a thing; null of one that is gone. */
function fieldsOf(kind, entry) {
  if (kind === "surface") {
    const { by, corners, seen } = entry;
    return corners?.length === 4 ? { by, corners, seen: seen?.length === 4 ? seen : null } : null;
  }
  if (kind === "primitive") {
    const { by, shape, size, colour, pose } = entry;
    return shape ? { by, shape, size, colour, pose } : null;
  }
  const { by, name, object, pose } = entry;
  return object ? { by, name, object, pose } : null;
}

export class Things {
  /** `show(kind, key, fields)` is called whenever a thing is to be shown otherwise; null: not at all. */
  constructor(link, show) {
    this.link = link;
    this.show = show;
    this.known = new Map(); // by kind and key: { kind, key, fields, sure, waiting, unsent, sentAt }
    this.asked = new Map(); // by number of an operation, the thing
    this.held = null; // the thing that is being carried
    this.passed = (_key, _from, _to) => {}; // a primitive is somebody else's now
    this.rights = [];
    this.you = "";
    this.count = 0;
    this.visit = Date.now().toString(36);
  }

  /** Takes everything there is. */
  takeWhole(you, state) {
    this.you = you;
    this.asked.clear();
    this.held = null;
    for (const thing of this.known.values()) this.show(thing.kind, thing.key, null);
    this.known.clear();
    for (const [kind, [, , list]] of Object.entries(KINDS)) {
      for (const [key, entry] of Object.entries(state[list] ?? {})) {
        this.#learn(kind, key, fieldsOf(kind, entry));
      }
    }
  }

  /** Takes an entry of the log. */
  take(entry) {
    const kind = KIND_OF[entry.op];
    if (kind !== undefined) this.#learn(kind, entry[KINDS[kind][1]], fieldsOf(kind, entry));
  }

  /** The studio has done an operation, or refused it. */
  answered(id) {
    const thing = this.asked.get(id);
    this.asked.delete(id);
    if (thing === undefined) return;
    thing.waiting.delete(id);
    this.#settle(thing);
  }

  /** Whether one may make and change things of a kind. */
  can(kind) {
    return this.rights.includes(KINDS[kind][0]);
  }

  /** Whether something is one's own: a primitive may have been given away, or to one. */
  isOwn(kind, key) {
    const by = kind === "primitive" ? this.known.get(`${kind}:${key}`)?.sure?.by : undefined;
    return by === undefined ? key.startsWith(`${this.you}/`) : by === this.you;
  }

  get(kind, key) {
    return this.known.get(`${kind}:${key}`)?.fields ?? null;
  }

  /** All of a kind that are shown: [key, fields]. */
  of(kind) {
    return [...this.known.values()].filter((thing) => thing.kind === kind && thing.fields !== null)
      .map((thing) => [thing.key, thing.fields]);
  }

  /** A name for another thing of one's own. */
  newKey() {
    this.count += 1;
    return `${this.you}/${this.visit}-${this.count}`;
  }

  /** A name for what is to be taken back as one. */
  newDrag() {
    this.count += 1;
    return this.count;
  }

  /** Changes or makes a thing of one's own; `end` must follow once it is let go. */
  put(kind, key, fields, drag, now = performance.now()) {
    if (!this.isOwn(kind, key)) return; // it was given away meanwhile
    const thing = this.#thing(kind, key);
    this.held = thing;
    thing.fields = { by: this.you, ...fields };
    thing.unsent = drag;
    this.show(kind, key, thing.fields);
    if (now - thing.sentAt > SEND_MS) this.#send(thing, now);
  }

  /** Lets go of what is being carried. */
  end() {
    const thing = this.held;
    this.held = null;
    if (thing === null) return;
    if (thing.unsent !== null) this.#send(thing, performance.now());
    this.#settle(thing);
  }

  /** Changes a thing of one's own in one step. */
  change(kind, key, fields, drag) {
    this.put(kind, key, fields, drag, -Infinity);
    this.end();
  }

  /** Asks that somebody else has a primitive. */
  give(key, to) {
    this.link.do("give", { primitive: key, to });
  }

  erase(kind, key) {
    if (!this.isOwn(kind, key)) return;
    if (this.held?.key === key) this.held = null;
    const thing = this.#thing(kind, key);
    thing.fields = null;
    thing.unsent = this.newDrag();
    this.show(kind, key, null);
    this.#send(thing, performance.now());
  }

  #thing(kind, key) {
    const id = `${kind}:${key}`;
    if (!this.known.has(id)) {
      this.known.set(id, { kind, key, fields: null, sure: null, waiting: new Set(), unsent: null,
        sentAt: -Infinity });
    }
    return this.known.get(id);
  }

  #learn(kind, key, fields) {
    const thing = this.#thing(kind, key);
    const before = thing.sure?.by;
    thing.sure = fields;
    if (this.held === thing && !this.isOwn(kind, key)) this.held = null;
    this.#settle(thing);
    if (kind === "primitive" && before && fields && before !== fields.by) {
      this.passed(key, before, fields.by);
    }
  }

  /** Shows what the studio has, unless one's own hand is further. */
  #settle(thing) {
    if (thing === this.held || thing.waiting.size) return;
    thing.fields = thing.sure;
    this.show(thing.kind, thing.key, thing.fields);
    if (thing.fields === null) this.known.delete(`${thing.kind}:${thing.key}`);
  }

  #send(thing, now) {
    const [op, name] = KINDS[thing.kind];
    const { by, name: _owner, ...fields } = thing.fields ?? {};
    for (const [field, value] of Object.entries(fields)) {
      if (Array.isArray(value)) fields[field] = rounded(value);
    }
    thing.sentAt = now;
    const id = this.link.do(op, { [name]: thing.key, drag: thing.unsent, ...fields });
    thing.unsent = null;
    if (id === null) return;
    thing.waiting.add(id);
    this.asked.set(id, thing);
  }
}
