// The viewer: a room of splats in which a recorded session is played again.
import * as THREE from "three";
import { CameraControl } from "shared/camera.js";
import { Panel } from "viewer/panel.js";
import { Room } from "viewer/room.js";
import { Detail } from "shared/detail.js";
import { Sharpness } from "shared/sharpness.js";

const LABEL_RISE_M = 0.2;
const LONGEST_STEP_S = 0.1;
const NARROW_PX = 760;
const SMOOTH_MS = 50; // from one picture to the next, at the longest
const byId = (id) => document.getElementById(id);
const started = performance.now();
const canvas = byId("room");
const message = byId("message");
const data = JSON.parse(await window.viewerParts.text("data"));

let dirty = true;
const changed = () => { dirty = true; };
const room = new Room(canvas, data, changed);
const camera = new CameraControl(room.camera, canvas, data.views, changed);
await room.load(window.viewerParts, (done, all) => {
  message.textContent = `Opening the room … ${done} of ${all}`;
});

let t = 0;
let playing = false;
let speed = 1;
let last = performance.now();
let fast = false;

function seek(to) {
  t = Math.min(Math.max(to, 0), data.end_ms);
  room.show(t);
  panel.show(t);
  changed();
}

function play(on) {
  if (on && t >= data.end_ms) seek(0);
  playing = on;
  last = performance.now();
  panel.showPlaying(playing);
  changed();
}

const placeOf = (object) => object.getWorldPosition(new THREE.Vector3());
const panel = new Panel(data, {
  seek,
  look: (id) => camera.lookAt(placeOf(room.objects.get(id))),
  lookAtPerson: (id) => camera.lookAt(placeOf(room.people.get(id).head)),
});

function fly(on) {
  camera.setFlying(on);
  byId("fly").setAttribute("aria-pressed", String(on));
  byId("hint").textContent = on
    ? "W A S D: walk · Q E: down, up · shift: faster · drag: look around"
    : "drag: turn · right button: move · wheel: nearer";
}

function toggleList() {
  const hidden = !byId("panel").hidden;
  byId("panel").hidden = hidden;
  byId("side").setAttribute("aria-expanded", String(!hidden));
  resize();
}

const KEYS = {
  Space: () => play(!playing),
  KeyF: () => fly(!camera.flying),
  KeyH: toggleList,
  Digit1: () => camera.go("corner"),
  Digit2: () => camera.go("above"),
  ArrowLeft: () => { play(false); seek(t - data.frame_ms); },
  ArrowRight: () => { play(false); seek(t + data.frame_ms); },
  Home: () => seek(0),
  End: () => seek(data.end_ms),
};

window.addEventListener("keydown", (event) => {
  fast = event.shiftKey;
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.target instanceof HTMLSelectElement) return;
  const onButton = event.target instanceof HTMLButtonElement && event.code === "Space";
  if (onButton) return;
  if (camera.press(event.code, event.timeStamp) || (KEYS[event.code] && !event.repeat)
    || event.code.startsWith("Arrow")) event.preventDefault();
  if (!camera.held.has(event.code)) KEYS[event.code]?.();
});
window.addEventListener("keyup", (event) => { fast = event.shiftKey; });
byId("play").addEventListener("click", () => play(!playing));
byId("scrub").addEventListener("input", (event) => { play(false); seek(Number(event.target.value)); });
byId("speed").addEventListener("change", (event) => { speed = Number(event.target.value); });
byId("view-corner").addEventListener("click", () => camera.go("corner"));
byId("view-above").addEventListener("click", () => { fly(false); camera.go("above"); });
byId("fly").addEventListener("click", () => fly(!camera.flying));
byId("side").addEventListener("click", toggleList);
window.addEventListener("resize", resize);
canvas.addEventListener("webglcontextlost", () => {
  message.hidden = false;
  message.textContent = "The graphics stopped. Load this page again.";
});

function resize() {
  const list = byId("panel").getBoundingClientRect();
  const isBeside = list.width > 0 && list.width < window.innerWidth / 2;
  room.resize(window.innerWidth, window.innerHeight, isBeside ? window.innerWidth - list.left : 0);
  changed();
}

const labels = new Map(data.people.map((person) => {
  const label = document.createElement("span");
  label.textContent = person.id;
  byId("labels").append(label);
  return [person.id, label];
}));

function placeLabels() {
  for (const [id, label] of labels) {
    const { head } = room.people.get(id);
    const place = placeOf(head);
    place.z += LABEL_RISE_M;
    place.project(room.camera);
    label.hidden = !head.visible || place.z > 1 || Math.abs(place.x) > 1 || Math.abs(place.y) > 1;
    label.style.left = `${50 * (1 + place.x)}%`;
    label.style.top = `${50 * (1 - place.y)}%`;
  }
}

// Draws only what changed: a page that rests costs nothing.
function frame(now) {
  const passed = Math.min((now - last) / 1000, LONGEST_STEP_S * Math.max(1, speed));
  last = now;
  if (playing) {
    seek(t + 1000 * speed * passed);
    if (t >= data.end_ms) play(false);
  }
  if (camera.step(now, fast)) changed();
  const rested = sharpness.isDue(now);
  if (!dirty && !rested) {
    moving = false;
    return;
  }
  const isMoving = moving && !rested;
  sharpness.before(now, isMoving);
  detail.before(now, { isMoving, wantedMs: SMOOTH_MS, isLast: sharpness.isCoarsest });
  moving = dirty;
  dirty = false;
  room.render();
  placeLabels();
  drawn += 1;
}

let drawn = 0;
let moving = false;
const sharpness = new Sharpness(room.renderer);
const detail = new Detail(room.spark, changed);
detail.watch(room.empty);
if (window.innerWidth < NARROW_PX) toggleList();
resize();
seek(0);
room.renderer.setAnimationLoop(frame);
message.hidden = true;
document.documentElement.dataset.state = "ready";

// For whoever drives this page: the browser's console, and the program's tests.
window.viewer = {
  seek,
  play,
  fly,
  view: (name) => camera.go(name),
  time: () => t,
  drawn: () => drawn,
  sharpness: () => sharpness.shown,
  place: (id) => placeOf(room.objects.get(id)).toArray(),
  head: (id) => placeOf(room.people.get(id).head).toArray(),
  nudge: () => { room.camera.position.x += 0.002; changed(); },
  eye: () => room.camera.position.toArray(),
  target: () => camera.orbit.target.toArray(),
  shown: () => room.shown(),
  opened_ms: performance.now() - started,
};
