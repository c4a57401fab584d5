// What stands beside the picture: who is here, the objects with their state, and the connection.
import { addRow, fillRow, STATES } from "shared/rows.js";
import { colourOf } from "shared/colours.js";

const AGE_FROM_MS = 2000;
const ROLES = { local: "in the room", remote: "elsewhere", operator: "operator",
  spectator: "watches" };
const byId = (id) => document.getElementById(id);

export class Panel {
  /** `actions`: look(objectId), lookAtPerson(id). */
  constructor(objects, actions) {
    this.actions = actions;
    this.objects = new Map(objects.map((item) =>
      [item.id, addRow(byId("objects"), item.name, () => actions.look(item.id))]));
    this.rows = new Map();
    this.age = null;
  }

  /** Shows an object's state; a pose that the tracker doubts says so. */
  showObject(id, state, isFlagged) {
    const [mark, word] = STATES[state] ?? STATES.static;
    const isUnsure = isFlagged && (state === "tracked" || state === "static");
    fillRow(this.objects.get(id), isUnsure ? "occluded" : state, isUnsure ? "◐" : mark,
      isUnsure ? "unsure" : word);
  }

  showPeople(list, ownId) {
    byId("people").replaceChildren();
    this.rows.clear();
    const own = list.find((person) => person.id === ownId);
    // While one has the pen, the others whose role lets them draw may not.
    const drawers = list.filter((person) => person.role !== "spectator" && !person.muted);
    const isGiven = drawers.some((person) => !person.pen);
    for (const person of own ? [own, ...list.filter((other) => other !== own)] : list) {
      const row = addRow(byId("people"), person.name, () => this.actions.lookAtPerson(person.id));
      row.firstChild.disabled = person === own;
      if (person === own) row.firstChild.title = "This is you";
      const words = [person === own ? "you" : null, ROLES[person.role] ?? person.role,
        person.muted ? "muted" : null, isGiven && person.pen ? "has the pen" : null];
      fillRow(row, "", "●", words.filter(Boolean).join(", "));
      row.firstChild.firstChild.style.color = colourOf(person.index);
      this.rows.set(person.id, row);
    }
    byId("people-title").textContent = `People (${list.length})`;
  }

  /** Shows the connection: a word, its delay, and what to do where it is broken. */
  showLink({ kind, words, remedy }, latency) {
    const line = byId("link");
    line.className = kind;
    const delay = kind === "here" && latency !== null ? ` · ${Math.max(1, Math.round(latency))} ms` : "";
    // Said anew only where it changes: some have this line read aloud.
    const write = (id, text) => { if (byId(id).textContent !== text) byId(id).textContent = text; };
    write("link-words", words + delay);
    write("link-remedy", remedy);
  }

  /** Shows how old the picture is, where nothing has come for a while. */
  showAge(age_ms) {
    const seconds = age_ms > AGE_FROM_MS ? Math.floor(age_ms / 1000) : null;
    if (seconds === this.age) return;
    this.age = seconds;
    byId("age").hidden = seconds === null;
    byId("age").textContent = seconds === null ? "" : `${seconds} s old`;
  }
}

/** Words on the picture at places of the room. */
export class Labels {
  constructor(parent) {
    this.parent = parent;
    this.known = new Map();
  }

  /** Shows exactly these: [id, text, colour, place in the world or null]. */
  show(labels, camera) {
    const here = new Set();
    for (const [id, text, colour, place] of labels) {
      here.add(id);
      const label = this.known.get(id) ?? this.#add(id);
      if (label.textContent !== text) label.textContent = text;
      label.style.setProperty("--mark", colour);
      const seen = place?.project(camera);
      label.hidden = !seen || seen.z > 1 || Math.abs(seen.x) > 1 || Math.abs(seen.y) > 1;
      if (label.hidden) continue;
      label.style.left = `${50 * (1 + seen.x)}%`;
      label.style.top = `${50 * (1 - seen.y)}%`;
    }
    for (const [id, label] of this.known) {
      if (here.has(id)) continue;
      label.remove();
      this.known.delete(id);
    }
  }

  #add(id) {
    const label = document.createElement("span");
    this.known.set(id, label);
    this.parent.append(label);
    return label;
  }
}
