// What stands beside the picture: objects with their state, people, events, and the time.
import { around, latest } from "viewer/moments.js";

// Shape and word, not colour alone.
const STATES = {
  static: ["●", "at rest"],
  tracked: ["▲", "followed"],
  occluded: ["◐", "hidden"],
  lost: ["✕", "lost"],
};

const byId = (id) => document.getElementById(id);

export class Panel {
  /** `actions`: seek(t), look(objectId), lookAtPerson(id). */
  constructor(data, actions) {
    this.data = data;
    this.end = data.end_ms;
    this.objects = data.objects.map((item) =>
      this.#row(byId("objects"), item.name, () => actions.look(item.id)));
    this.people = data.people.map((person) =>
      this.#row(byId("people"), person.id, () => actions.lookAtPerson(person.id)));
    this.events = data.events.map(([t, text]) => this.#event(t, text, actions.seek));
    byId("people-title").hidden = !data.people.length;
    byId("events-title").hidden = !data.events.length;
    byId("scrub").max = String(this.end);
    for (const [t] of data.events) {
      const tick = document.createElement("i");
      tick.style.left = `${(100 * t) / Math.max(this.end, 1)}%`;
      byId("ticks").append(tick);
    }
  }

  show(t) {
    this.data.objects.forEach((item, index) => {
      const state = latest(item.states, t) ?? "static";
      const [mark, word] = STATES[state];
      this.#fill(this.objects[index], state, mark, word);
    });
    this.data.people.forEach((person, index) => {
      const here = around(person.heads, t) !== null;
      const points = around(person.rays, t) !== null;
      this.#fill(this.people[index], "", points ? "↗" : "○",
        here ? (points ? "points" : person.role) : "away");
    });
    this.data.events.forEach(([from], index) => {
      this.events[index].className = from <= t ? "past" : "";
    });
    byId("scrub").value = String(Math.round(t));
    byId("time").textContent = `${seconds(t)} of ${seconds(this.end)} s`;
  }

  showPlaying(playing) {
    byId("play").firstChild.textContent = playing ? "❚❚" : "▶";
    byId("play").lastChild.textContent = playing ? "Pause" : "Play";
  }

  #row(list, name, pressed) {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.title = `Look at ${name}`;
    button.append(...["mark", "name", "state"].map((kind) => {
      const part = document.createElement("span");
      part.className = kind;
      return part;
    }));
    button.children[1].textContent = name;
    button.addEventListener("click", pressed);
    item.append(button);
    list.append(item);
    return item;
  }

  #fill(item, kind, mark, word) {
    const button = item.firstChild;
    if (button.children[2].textContent === word && item.className === kind) return;
    item.className = kind;
    button.children[0].textContent = mark;
    button.children[2].textContent = word;
  }

  #event(t, text, seek) {
    const item = document.createElement("li");
    const button = document.createElement("button");
    const time = document.createElement("time");
    const words = document.createElement("span");
    time.textContent = `${seconds(t)} s`;
    words.textContent = text;
    button.append(time, words);
    button.addEventListener("click", () => seek(t));
    item.append(button);
    byId("events").append(item);
    return item;
  }
}

function seconds(t) {
  return (t / 1000).toFixed(1);
}
