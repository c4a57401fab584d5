// What stands beside the picture: objects with their state, people, events, and the time.
import { around, latest } from "viewer/moments.js";
import { addRow, fillRow, STATES } from "shared/rows.js";

const byId = (id) => document.getElementById(id);

export class Panel {
  /** `actions`: seek(t), look(objectId), lookAtPerson(id). */
  constructor(data, actions) {
    this.data = data;
    this.end = data.end_ms;
    this.objects = data.objects.map((item) =>
      addRow(byId("objects"), item.name, () => actions.look(item.id)));
    this.people = data.people.map((person) =>
      addRow(byId("people"), person.id, () => actions.lookAtPerson(person.id)));
    this.events = data.events.map(([t, text]) => this.#event(t, text, actions.seek));
    this.scrub = /** @type {HTMLInputElement} */ (byId("scrub"));
    byId("people-title").hidden = !data.people.length;
    byId("events-title").hidden = !data.events.length;
    this.scrub.max = String(this.end);
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
      fillRow(this.objects[index], state, mark, word);
    });
    this.data.people.forEach((person, index) => {
      const here = around(person.heads, t) !== null;
      const points = around(person.rays, t) !== null;
      fillRow(this.people[index], "", points ? "↗" : "○",
        here ? (points ? "points" : person.role) : "away");
    });
    this.data.events.forEach(([from], index) => {
      this.events[index].className = from <= t ? "past" : "";
    });
    this.scrub.value = String(Math.round(t));
    byId("time").textContent = `${seconds(t)} of ${seconds(this.end)} s`;
  }

  showPlaying(playing) {
    byId("play").firstChild.textContent = playing ? "❚❚" : "▶";
    byId("play").lastChild.textContent = playing ? "Pause" : "Play";
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
