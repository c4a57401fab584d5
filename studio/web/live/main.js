// The live room on a page: what the studio sends is shown, what one does is sent.
import * as THREE from "three";
import { CameraControl } from "shared/camera.js";
import { Furniture } from "shared/bodies/furniture.js";
import { readShapes } from "shared/bodies/shapes.js";
import { COLOURS } from "shared/colours.js";
import { OwnHands } from "shared/own_hands.js";
import { Detail } from "shared/detail.js";
import { Sharpness } from "shared/sharpness.js";
import { Asked } from "live/asked.js";
import { Board } from "live/board.js";
import { Device } from "live/device.js";
import { Headset } from "live/headset.js";
import { LiveRoom } from "live/live_room.js";
import { Attention } from "live/things/attention.js";
import { Media } from "live/media/media.js";
import { Labels, Panel } from "live/panel.js";
import { People } from "live/people.js";
import { isPicture, Surfaces } from "live/surfaces.js";
import { Carry } from "live/things/carry.js";
import { Grab } from "live/things/grab.js";
import { Handing } from "live/things/handing.js";
import { Palette } from "live/things/palette.js";
import { Picker } from "live/things/pick.js";
import { Proposals } from "live/things/proposals.js";
import { Bodies } from "live/things/shapes.js";
import { Things } from "live/things/store.js";
import { Tools } from "live/tools.js";
import { encodeBody } from "live/wire.js";

const NARROW_PX = 760;
const BODY_MS = 33; // between two bodies without a headset
const HEADSET_MS = 9; // the hub takes a hundred bodies a second
const SMOOTH_MS = 50; // from one picture to the next on a screen, at the longest
const STILL_MS = 1000; // one who does not move is shown to be here all the same
const STILL = 5e-4;
const LABEL_OVER_M = 0.25;
const OWN_RAY_M = 0.002; // one's own ray begins before one's eyes
const FLAGS = { lost: ["✕ lost", "var(--bad)"], occluded: ["◐ hidden", "var(--warn)"] };
const UNSURE = ["◐ unsure", "var(--warn)"];
const WAYS = { vr: "Stand in the room with this headset",
  ar: "See people and what they show over the real room, with this headset in it" };
const byId = (id) => document.getElementById(id);

/** Opens the room after a welcome; `notice(words)` tells the user something. */
export async function openRoom(link, manifest, files, { progress, notice }) {
  const canvas = byId("room");
  let dirty = true;
  const changed = () => { dirty = true; };
  const room = new LiveRoom(canvas, manifest, files, changed);
  const control = new CameraControl(room.camera, canvas, manifest.views, changed, manifest.footprint);
  const people = new People(room.scene, readShapes(await files.figure()));
  const board = new Board(room.upright, link, changed, (id) => room.objects.get(id)?.pose);
  const surfaces = new Surfaces(room.upright, changed);
  const bodies = new Bodies(room.upright, changed);
  const proposals = new Proposals(room, changed);
  const attention = new Attention(room);
  const things = new Things(link, showThing);
  const tools = new Tools(canvas, room, board, control, changed);
  const picker = new Picker(things, bodies, proposals, room.upright);
  const handing = new Handing(room, things, people, picker, { notice, changed });
  tools.carry = new Carry(room, things, picker,
    { ask: () => ({ shape: tools.shape, colour: tools.ink }), handing, notice, changed });
  const self = new OwnHands(COLOURS[0], OWN_RAY_M);
  room.upright.add(self.group);
  const headset = new Headset(room, board, self, { tools, ended: leftHeadset, shown: { proposals, surfaces },
    grab: new Grab(room, things, picker, { tools, handing }), palette: new Palette(room.upright, tools) });
  const device = new Device(link, headset);
  const labels = new Labels(byId("labels"));
  const panel = new Panel(manifest.objects, {
    look: (id) => control.lookAt(room.objects.get(id).group.getWorldPosition(new THREE.Vector3())),
    lookAtPerson: (id) => {
      const known = people.byId.get(id);
      if (known?.figure.group.visible) control.lookAt(known.figure.head.getWorldPosition(new THREE.Vector3()));
      else notice("They show no body at the moment.");
    },
  });
  const asked = new Asked(link, byId("asked"), byId("asks").content);
  const media = new Media({ link, people, surfaces, panel, room, changed, notice });
  let you = null;
  let isLoaded = false;
  let moving = false;
  let fast = false;
  let drawn = 0;
  let seq = 0;
  let sent = { at: -Infinity, numbers: [] };
  const sharpness = new Sharpness(room.renderer);
  const detail = new Detail(room.spark, changed);

  const take = {
    welcome(message) {
      you = message.you;
      take.rights(message);
      room.takeWhole(message.state);
      board.takeWhole(you, message.state);
      surfaces.takeWhole(message.state);
      things.takeWhole(you, message.state);
      take.people(message);
      media.welcome(message);
      asked.begin(message.role);
      showObjects();
      showWays();
    },
    rights(message) {
      const { rights } = message;
      media.rights(message);
      tools.allow(rights);
      things.rights = rights;
      headset.canDraw = rights.includes("line");
      headset.canUndo = rights.includes("undo");
    },
    people({ people: list }) {
      people.setList(list, you);
      panel.showPeople(list, you);
      handing.setList(list, you);
      media.setList(list);
      const own = list.find((person) => person.id === you);
      if (own) self.setColour(COLOURS[own.index % COLOURS.length]);
      changed();
    },
    state(message) {
      room.take(message, performance.now());
      if (message.camera) showWays();
      link.seen(message.version);
      showObjects();
    },
    log: (entry) => {
      board.take(entry);
      things.take(entry);
    },
    done: ({ id }) => {
      board.answered(id, true);
      things.answered(id);
    },
    refused: ({ id, why }) => {
      board.answered(id, false);
      things.answered(id);
      notice(`Not done: ${why}.`);
    },
    cells: (buffer) => room.hidden.take(buffer),
    bodies: (buffer) => {
      if (isPicture(buffer)) surfaces.takePicture(buffer);
      else if (!media.takeVoices(buffer)) people.take(buffer, performance.now());
    },
    speaking: (message) => media.takeSpeaking(message),
    media: (message) => media.takeMedia(message),
    answer: (message) => media.takeAnswer(message),
    places: (message) => media.takePlaces(message),
    status: (status) => panel.showLink(status, link.latency),
  };

  function showThing(kind, key, fields) {
    if (kind === "primitive") bodies.show(key, fields);
    else if (kind === "proposal") proposals.show(key, fields);
    else {
      surfaces.show(key, fields === null ? [] : fields.seen ?? fields.corners);
      board.frame(key, fields?.corners ?? [], fields?.seen ?? null);
    }
    const { carry } = tools;
    if (carry?.selected?.key === key && carry.selected.kind === kind) carry.refresh();
  }

  function showObjects() {
    for (const [id, { state, isFlagged }] of room.objects) panel.showObject(id, state, isFlagged);
    changed();
  }

  function setMode(mode) {
    control.setMode(mode);
    for (const name of ["orbit", "walk", "fly"]) {
      byId(`mode-${name}`).setAttribute("aria-checked", String(name === mode));
      byId(`mode-${name}`).tabIndex = name === mode ? 0 : -1;
    }
    byId("pad").hidden = mode === "orbit";
    tools.showHint();
  }

  function toggleList() {
    const hidden = !byId("panel").hidden;
    byId("panel").hidden = hidden;
    byId("side").setAttribute("aria-expanded", String(!hidden));
    resize();
  }

  function resize() {
    if (headset.isOn) return;
    const list = byId("panel").getBoundingClientRect();
    const isBeside = list.width > 0 && list.width < window.innerWidth / 2;
    room.resize(window.innerWidth, window.innerHeight, isBeside ? window.innerWidth - list.left : 0);
    changed();
  }

  function leftHeadset() {
    for (const id of ["vr", "ar"]) byId(id).setAttribute("aria-pressed", "false");
    resize();
  }

  const obstacleTo = (id) => (id === "ar" ? headset.passthrough.obstacle() : Headset.obstacle());

  function showWays() {
    for (const [id, words] of Object.entries(WAYS)) {
      obstacleTo(id).then((obstacle) => {
        byId(id).setAttribute("aria-disabled", String(obstacle !== null));
        byId(id).title = obstacle ?? words;
      });
    }
  }

  async function toggleHeadset(id) {
    const obstacle = await obstacleTo(id);
    if (obstacle !== null) return notice(obstacle);
    if (headset.isOn) return headset.leave();
    try {
      await headset.enter(id === "ar");
      byId(id).setAttribute("aria-pressed", "true");
    } catch (error) {
      notice(`The headset did not start: ${error.message}`);
    }
  }

  const KEYS = {
    Digit1: () => control.go("corner"),
    Digit2: () => { setMode("orbit"); control.go("above"); },
    KeyO: () => setMode("orbit"),
    KeyF: () => setMode(control.mode === "fly" ? "orbit" : "fly"),
    KeyG: () => setMode(control.mode === "walk" ? "orbit" : "walk"),
    KeyH: toggleList,
    KeyL: () => tools.choose(tools.tool === "draw" ? "look" : "draw"),
    KeyM: () => tools.choose(tools.tool === "mark" ? "look" : "mark"),
    KeyX: () => tools.choose(tools.tool === "shape" ? "look" : "shape"),
    KeyV: () => tools.choose(tools.tool === "propose" ? "look" : "propose"),
    KeyC: () => tools.choose(tools.tool === "carry" ? "look" : "carry"),
    KeyN: () => media.toggleMicrophone(),
    KeyP: () => tools.pointByKey(true),
    Escape: () => tools.choose("look"),
  };

  function onKey(event) {
    if (event.target.closest?.("#asked, select")) return;
    fast = event.shiftKey;
    const isUndo = event.code === "KeyZ" && (event.ctrlKey || event.metaKey);
    if (isUndo && !byId("undo").hidden) board.undo();
    if (isUndo) event.preventDefault();
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.target.getAttribute?.("role") === "radio" && event.code.startsWith("Arrow")) return;
    if (tools.carry.press(event.code)) return event.preventDefault();
    const isKnown = control.press(event.code, event.timeStamp) || (KEYS[event.code] && !event.repeat);
    if (isKnown) event.preventDefault();
    if (isKnown && !control.held.has(event.code)) KEYS[event.code]?.();
  }

  function listen() {
    window.addEventListener("keydown", onKey);
    window.addEventListener("keyup", (event) => {
      fast = event.shiftKey;
      if (event.code === "KeyP") tools.pointByKey(false);
    });
    window.addEventListener("resize", resize);
    for (const name of ["orbit", "walk", "fly"]) {
      byId(`mode-${name}`).addEventListener("click", () => setMode(name));
    }
    byId("view-corner").addEventListener("click", () => control.go("corner"));
    byId("view-above").addEventListener("click", KEYS.Digit2);
    byId("side").addEventListener("click", toggleList);
    for (const id of ["vr", "ar"]) byId(id).addEventListener("click", () => toggleHeadset(id));
    showWays();
    for (const group of document.querySelectorAll("[role=radiogroup]")) stepByArrows(group);
    for (const button of byId("pad").children) holdAsKey(button, control, changed);
    canvas.addEventListener("webglcontextlost", () =>
      notice("The graphics stopped. Load this page again."));
  }

  function flags() {
    return [...room.objects.values()].filter((body) => body.isFlagged).map((body) => {
      const [text, colour] = FLAGS[body.state] ?? UNSURE;
      const place = body.group.localToWorld(
        new THREE.Vector3(0, 0, body.item.middle_m * 2 + LABEL_OVER_M));
      return [`object:${body.item.id}`, text, colour, place];
    });
  }

  /** One's own body without a headset: where one looks from, and what one points at. */
  function deskBody() {
    const { camera, upright } = room;
    const place = upright.worldToLocal(camera.position.clone());
    const turn = camera.quaternion.clone().premultiply(upright.quaternion.clone().invert());
    const head = [...place.toArray(), ...turn.toArray()];
    return { head, controllers: [null, null], hands: [null, null], ray: tools.ray };
  }

  function sendDesk(now) {
    if (now - sent.at < BODY_MS) return;
    const body = deskBody();
    const numbers = [...body.head, ...(body.ray ?? [])];
    const isSame = numbers.length === sent.numbers.length
      && numbers.every((value, i) => Math.abs(value - sent.numbers[i]) < STILL);
    if (isSame && now - sent.at < STILL_MS) return;
    if (send(body, now)) sent = { at: now, numbers };
  }

  function send(body, now) {
    seq = (seq + 1) >>> 0;
    return link.sendBody(encodeBody({ seq, t_us: now * 1000, ...body }));
  }

  // Draws only what changed: a page that rests costs nothing.
  function frame(_time, xrFrame) {
    const now = performance.now();
    device.step(now);
    const eye = room.camera.getWorldPosition(new THREE.Vector3());
    if (room.step(now)) changed();
    proposals.step();
    if (board.step()) changed();
    if (handing.step(now)) changed();
    if (attention.step(people, you)) changed();
    if (people.step(now, eye, headset.isOn)) changed();
    panel.showAge(now - link.heardAt);
    media.step(now, room.camera);
    if (xrFrame && headset.isOn) {
      const body = headset.step(xrFrame);
      if (body !== null && now - sent.at > HEADSET_MS && send(body, now)) sent = { at: now, numbers: [] };
      detail.before(now, { isMoving: true, wantedMs: headset.frameMs, isLast: true });
      room.render();
      drawn += 1;
      return;
    }
    if (control.step(now, fast)) changed();
    self.show({ ray: tools.ray });
    sendDesk(now);
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
    labels.show([...people.labels(), ...flags(), ...proposals.labels(you)], room.camera);
    drawn += 1;
  }

  await room.loadFirst(progress);
  people.furniture = new Furniture(manifest.solids, room.objects);
  listen();
  setMode("orbit");
  if (window.innerWidth < NARROW_PX) toggleList();
  resize();
  room.renderer.setAnimationLoop(frame);
  const rest = room.loadRest().then(() => {
    if (room.shownRoom !== room.solid) detail.watch(room.shownRoom);
    isLoaded = true;
    changed();
  });
  rest.catch((error) => notice(`The whole room could not be loaded: ${error.message}`));

  // For whoever drives this page: the browser's console, and the program's tests.
  window.live = {
    room, people, board, surfaces, tools, headset, control, link, media, setMode, detail, things,
    bodies, proposals, attention, handing, device,
    drawn: () => drawn,
    isWhole: () => isLoaded,
    sharpness: () => sharpness.shown,
    place: (id) => room.objects.get(id).group.position.toArray(),
    eye: () => room.camera.position.toArray(),
    you: () => you,
  };
  return take;
}

/** Arrows go from one choice of a group to the next, as everywhere. */
function stepByArrows(group) {
  group.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.code];
    if (step === undefined) return;
    const shown = [...group.children].filter((button) => !button.hidden);
    const next = shown[(shown.indexOf(document.activeElement) + step + shown.length) % shown.length];
    next.focus();
    next.click();
    event.preventDefault();
    event.stopPropagation();
  });
}

/** A button that moves as a key does, as long as it is held. */
function holdAsKey(button, control, changed) {
  const code = button.dataset.key;
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    control.press(code, event.timeStamp);
    changed();
  });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
    button.addEventListener(kind, (event) => control.release(code, event.timeStamp));
  }
}
