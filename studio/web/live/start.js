// The page's start: what blocks it, the join form, and the room as soon as one is in.
import { Link } from "live/link.js";
import { graphics } from "live/blocks.js";

const NAME = "gaussiannexus.name";
const NOTICE_MS = 6000;
const byId = (id) => document.getElementById(id);
const FIGURE = byId("figure").content;

window.addEventListener("error", (event) => stop(event.message));
window.addEventListener("unhandledrejection", (event) => stop(event.reason?.message ?? event.reason));

function stop(words) {
  byId("message").hidden = false;
  byId("message-words").textContent = `The page stopped: ${words}\nLoad it again.`;
}

let noticed = 0;
function notice(words) {
  byId("notice").textContent = words;
  byId("notice").hidden = false;
  clearTimeout(noticed);
  noticed = setTimeout(() => { byId("notice").hidden = true; }, NOTICE_MS);
}

/** The code of an invitation's address; it leaves the address bar, where others might read it. */
function invitedCode() {
  const found = /^#code=(\d{6})$/.exec(location.hash);
  if (location.hash) history.replaceState(null, "", location.pathname);
  return found?.[1] ?? "";
}

let take = null; // what the room does with messages; until it is open they wait
let waiting = [];
const hand = (kind) => (message) => {
  if (take !== null) take[kind](message);
  else if (kind === "welcome") waiting = [[kind, message]];
  else if (waiting.length) waiting = keepNewest([...waiting, [kind, message]]);
};

/** Whatever a room that is being loaded must know: log and cells in order, the newest of the rest. */
function keepNewest(messages) {
  const last = new Map(messages.map(([kind], i) => [kind, i]));
  return messages.filter(([kind], i) =>
    ["welcome", "log", "state", "done", "refused", "cells"].includes(kind) || last.get(kind) === i);
}

const kinds = ["people", "rights", "state", "log", "done", "refused", "bodies", "cells",
  "speaking", "answer", "places", "media"];
const link = new Link({
  ...Object.fromEntries(kinds.map((kind) => [kind, hand(kind)])),
  welcome(message) {
    hand("welcome")(message);
    if (message.name) localStorage.setItem(NAME, byId("name").value);
    byId("join").hidden = true;
    if (opening === null) opening = open();
  },
  status(status) {
    document.documentElement.dataset.link = status.kind;
    take?.status(status);
    if (status.kind === "left") showJoin(`${status.words} ${status.remedy}`);
    else if (opening === null) {
      byId("join-state").textContent = `${status.words} ${status.remedy}`;
      byId("join-state").className = "";
    }
  },
});
let opening = null;
let figure = null; // an answer that is on its way, read once

async function open() {
  const began = performance.now();
  const files = {
    bytes: async (part) => (await authorised(`/assets/room/${part}.spz`)).arrayBuffer(),
    figure: async () => (await figure ?? await fetched(FIGURE)).arrayBuffer(),
  };
  byId("message").hidden = false;
  const manifest = await (await authorised("/assets/room/manifest.json")).json();
  byId("room-name").textContent = manifest.name;
  document.title = `${manifest.name} · live`;
  const { openRoom } = await import("live/main.js");
  const opened = await openRoom(link, manifest, files, {
    notice,
    progress: (done, all) => {
      byId("message-words").textContent = `Opening the room … ${done} of ${all}`;
    },
  });
  take = opened;
  for (const [kind, message] of waiting) take[kind](message);
  waiting = [];
  take.status({ kind: document.documentElement.dataset.link, words: "Connected", remedy: "" });
  byId("message").hidden = true;
  for (const id of ["head", "panel-frame", "tools"]) byId(id).hidden = false;
  window.dispatchEvent(new Event("resize"));
  byId("room").focus({ preventScroll: true });
  window.live.opened_ms = performance.now() - began;
  document.documentElement.dataset.state = "ready";
}

const authorised = (path) => fetched(path, { headers: { Authorization: `Bearer ${link.token}` } });

async function fetched(path, options) {
  const answer = await fetch(path, options);
  if (!answer.ok) throw new Error(`${path}: the studio answered ${answer.status}`);
  return answer;
}

function showJoin(words) {
  const form = byId("join");
  form.hidden = false;
  byId("join-state").textContent = words;
  byId("join-state").className = words ? "refused" : "";
  byId("join-button").disabled = false;
  const missing = ["name", "code"].find((id) => !byId(id).value);
  byId(missing ?? "join-button").focus();
}

async function join(event) {
  event.preventDefault();
  const [code, name] = [byId("code").value.replace(/\s/g, ""), byId("name").value.trim()];
  if (!/^\d{6}$/.test(code)) return showJoin("A code has six digits. The operator reads it to you.");
  byId("join-button").disabled = true;
  byId("join-state").textContent = "Joining …";
  byId("join-state").className = "";
  try {
    await link.pair(code, name);
  } catch (error) {
    byId("code").value = "";
    return showJoin(error.message);
  }
  byId("code").value = "";
  link.connect(name);
}

byId("name").value = localStorage.getItem(NAME) ?? "";
byId("code").value = invitedCode();
window.addEventListener("hashchange", () => {
  const code = invitedCode();
  if (code) byId("code").value = code;
});
byId("join").addEventListener("submit", join);
byId("leave").addEventListener("click", () => {
  link.leave();
  location.reload();
});
byId("message").hidden = true;
const drawing = graphics();
if (!drawing.isFine) {
  byId("join").hidden = false;
  showJoin(`${drawing.words} ${drawing.remedy}`);
  byId("join-button").disabled = true;
} else if (link.token && !byId("code").value) {
  byId("message").hidden = false;
  byId("message-words").textContent = "Coming back into the room …";
  link.connect(byId("name").value);
} else {
  showJoin("");
}
document.documentElement.dataset.state = "join";
// Fetched while somebody types a name; a figure that fails is asked for again by the room.
figure = fetched(FIGURE).catch(() => null);
import("live/main.js").catch((error) => stop(error.message));
