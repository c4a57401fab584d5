// What one does in the room with a mouse, a finger or a pen: look, point, draw, mark a surface whose
// live picture everybody sees, put shapes, carry things, propose where objects should go, take back.
import * as THREE from "three";
import { INKS } from "live/board.js";
import { MAKES } from "live/things/carry.js";
import { SHAPES } from "live/things/shapes.js";

const PICK_MS = 15; // between two looks for the surface under the pointer
const HAND_IN_CAMERA = [0.14, -0.2, -0.25]; // where one's ray begins: not in one's own eye
const HINTS = {
  look: { orbit: "drag: turn · right button: move · wheel: nearer",
    fly: "W A S D: move · Q E: down, up · shift: faster · drag: look around",
    walk: "W A S D: walk · shift: faster · drag: look around" },
  point: "hold the button on something: everybody sees where you point · right button: turn",
  draw: "drag over a surface: everybody sees the line · right button: turn",
  mark: "click the four corners of a board, a screen or a table: it shows what the camera sees there",
  shape: "click a surface, or drag: as large as you drag, an arrow to where you let go",
  carry: "drag what you have put, or a live picture · , . turn it · + − size it · Delete removes it",
  propose: "drag an object to where it should go: a copy of it shows everybody · , . turn it",
};
const TOOLS = ["look", "point", "draw", "mark", "shape", "propose", "carry"];
/** Operations that a tool asks the studio for; any of them will do. */
const RIGHTS = { draw: ["line"], mark: ["surface"], shape: ["primitive"], propose: ["propose"],
  carry: ["primitive", "surface", "propose"] };
const byId = (id) => document.getElementById(id);

export class Tools {
  /** `room` with camera and hit(origin, direction), `board`, `control` of the camera; `carry` is set
      by whoever makes it. */
  constructor(canvas, room, board, control, changed) {
    Object.assign(this, { canvas, room, board, control, changed });
    this.carry = null;
    this.shape = SHAPES[0];
    this.tool = "look";
    this.ink = INKS[0][2];
    this.ray = null; // six numbers in upright axes while one points
    this.pointer = null; // where the pointer is
    this.held = null; // id of the pointer that points or draws
    this.byKey = false;
    this.pickedAt = -Infinity;
    this.corners = []; // of a surface that is being marked: where in the picture, and in the room
    for (const name of TOOLS) {
      byId(`tool-${name}`).addEventListener("click", () => this.choose(name));
    }
    byId("undo").addEventListener("click", () => board.undo());
    for (const [name, hex, ink] of INKS) this.#addInk(name, hex, ink);
    for (const name of SHAPES) byId(`shape-${name}`).addEventListener("click", () => this.chooseShape(name));
    // Before the camera's own: what is taken hold of is not to turn the view.
    canvas.addEventListener("pointerdown", (event) => this.#down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    canvas.addEventListener("pointerup", (event) => this.#up(event));
    canvas.addEventListener("pointercancel", (event) => this.#up(event));
    window.addEventListener("blur", () => this.pointByKey(false));
    this.chooseShape(this.shape);
    this.choose("look");
  }

  choose(tool) {
    if (byId(`tool-${tool}`).hidden) return;
    this.tool = tool;
    this.corners = [];
    this.board.preview([]);
    for (const name of TOOLS) {
      byId(`tool-${name}`).setAttribute("aria-checked", String(name === tool));
      byId(`tool-${name}`).tabIndex = name === tool ? 0 : -1;
    }
    byId("inks").hidden = tool !== "draw" && tool !== "shape";
    byId("shapes").hidden = tool !== "shape";
    if (!(tool in MAKES)) this.carry?.select(null);
    this.control.setFree(tool === "look" || tool in MAKES);
    this.showHint();
  }

  /** Chooses what the tool for shapes puts. */
  chooseShape(shape) {
    this.shape = shape;
    for (const name of SHAPES) {
      byId(`shape-${name}`).setAttribute("aria-checked", String(name === shape));
      byId(`shape-${name}`).tabIndex = name === shape ? 0 : -1;
    }
  }

  /** Whether one's rights allow a tool. */
  allows(tool) {
    return !byId(`tool-${tool}`).hidden;
  }

  /** Hides what one's role does not allow. */
  allow(rights) {
    for (const [tool, ops] of Object.entries(RIGHTS)) {
      byId(`tool-${tool}`).hidden = !ops.some((op) => rights.includes(op));
    }
    byId("undo").hidden = !rights.includes("undo");
    if (byId(`tool-${this.tool}`).hidden) this.choose("look");
  }

  showHint() {
    const hint = HINTS[this.tool];
    byId("hint").textContent = typeof hint === "string" ? hint : hint[this.control.mode];
  }

  /** Points at what is under the pointer while a key is held. */
  pointByKey(on) {
    if (this.byKey === on) return;
    this.byKey = on;
    if (on && this.pointer !== null) this.#point();
    else if (this.held === null) this.#endRay();
  }

  /** The surface under a place of the page, in upright axes; null where none is. */
  pick(x, y) {
    const found = this.room.hit(...this.#rayAt(x, y));
    return found === null ? null : this.room.upright.worldToLocal(found).toArray();
  }

  /** Origin and direction in the world of what is under a place of the page. */
  #rayAt(x, y) {
    const { camera } = this.room;
    const place = new THREE.Vector2(
      (2 * x) / window.innerWidth - 1, 1 - (2 * y) / window.innerHeight);
    camera.updateMatrixWorld();
    const ray = new THREE.Raycaster();
    ray.setFromCamera(place, camera);
    return [ray.ray.origin, ray.ray.direction];
  }

  #down(event) {
    this.pointer = [event.clientX, event.clientY];
    if (this.tool === "look" || event.button !== 0 || !event.isPrimary) {
      // A second finger moves the view: what the first had just begun was not meant.
      if (this.held === null || event.isPrimary) return;
      this.board.drop();
      this.#end();
      return;
    }
    if (this.tool === "mark") {
      this.#mark();
      return;
    }
    if (this.tool in MAKES) {
      const isTaken = this.carry.begin(this.tool, this.pointer);
      this.control.setFree(!isTaken); // else it turns the view
      if (!isTaken) return;
    }
    this.held = event.pointerId;
    this.canvas.setPointerCapture(event.pointerId);
    if (this.tool === "draw") this.board.begin(this.ink, this.room.objectAt(...this.#rayAt(...this.pointer)));
    this.#go();
  }

  #move(event) {
    this.pointer = [event.clientX, event.clientY];
    if (performance.now() - this.pickedAt < PICK_MS) return;
    if (event.pointerId === this.held) this.#go();
    else if (this.byKey) this.#point();
  }

  #up(event) {
    if (event.pointerId !== this.held) return;
    this.pointer = [event.clientX, event.clientY];
    this.#go();
    this.#end();
  }

  #end() {
    this.held = null;
    this.board.end();
    this.#endRay();
    if (!(this.tool in MAKES)) return;
    this.carry.end();
    this.control.setFree(true);
  }

  #go() {
    if (this.tool in MAKES) this.carry.go(this.pointer);
    else if (this.tool === "point") this.#point();
    else this.#draw();
  }

  #point() {
    const place = this.#pickHere();
    if (place === null) return;
    const { camera, upright } = this.room;
    const hand = upright.worldToLocal(camera.localToWorld(new THREE.Vector3(...HAND_IN_CAMERA)));
    this.ray = [...hand.toArray(), ...place];
    this.changed();
  }

  #draw() {
    const place = this.#pickHere();
    if (place !== null) this.board.extend(place, performance.now());
  }

  #mark() {
    const place = this.#pickHere();
    if (place === null) return;
    this.corners.push({ at: this.pointer, place });
    this.board.preview(this.corners.map((corner) => corner.place));
    if (this.corners.length < 4) return;
    this.board.mark(clockwise(this.corners).map((corner) => corner.place));
    this.choose("look");
  }

  #pickHere() {
    this.pickedAt = performance.now();
    return this.pick(...this.pointer);
  }

  #endRay() {
    if (this.ray === null) return;
    this.ray = null;
    this.changed();
  }

  #addInk(name, hex, ink) {
    const button = document.createElement("button");
    button.setAttribute("role", "radio");
    button.setAttribute("aria-checked", "false");
    button.setAttribute("aria-label", `Draw in ${name}`);
    button.title = name;
    button.style.setProperty("--ink-colour", hex);
    const choose = () => {
      this.ink = ink;
      for (const other of byId("inks").children) {
        other.setAttribute("aria-checked", String(other === button));
      }
    };
    button.addEventListener("click", choose);
    byId("inks").append(button);
    if (ink === this.ink) choose();
  }
}

/** Corners in the order in which pictures lie: clockwise from the top left, as they are seen. */
function clockwise(corners) {
  const middle = [0, 1].map((axis) => corners.reduce((sum, { at }) => sum + at[axis], 0) / 4);
  const angle = ({ at: [x, y] }) => Math.atan2(y - middle[1], x - middle[0]);
  const turned = [...corners].sort((a, b) => angle(a) - angle(b));
  const sums = turned.map(({ at: [x, y] }) => x + y);
  const first = sums.indexOf(Math.min(...sums));
  return [...turned.slice(first), ...turned.slice(0, first)];
}
