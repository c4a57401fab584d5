// Tools at one's left hand in a headset: shown while one looks at the hand, chosen by touching one
// with the right.
import * as THREE from "three";
import { placeOf, turnOf } from "live/things/poses.js";
import { SHAPES } from "live/things/shapes.js";

const TILE_M = 0.032;
const STEP_M = 0.04;
const OVER_M = 0.09; // above the hand
const TOUCH_M = 0.026;
const LOOK = Math.cos(THREE.MathUtils.degToRad(32)); // so near to the hand one looks
const SIGNS = { draw: "✎", box: "■", sphere: "●", cylinder: "▮", arrow: "→", propose: "◫", lay: "⌖" };
const PX = 64;

export class Palette {
  /** `tools` with choose(tool), tool, shape and allows(tool). */
  constructor(upright, tools) {
    this.tools = tools;
    this.group = new THREE.Group();
    this.group.visible = false;
    upright.add(this.group);
    this.tiles = Object.entries(SIGNS).map(([name, sign], i) => {
      const tile = new THREE.Mesh(new THREE.PlaneGeometry(TILE_M, TILE_M),
        new THREE.MeshBasicMaterial({ map: drawn(sign), side: THREE.DoubleSide, depthTest: false,
          transparent: true }));
      tile.position.set((i - 3) * STEP_M, 0, 0);
      tile.renderOrder = 9;
      tile.name = name;
      this.group.add(tile);
      return tile;
    });
    this.touched = null;
    this.redo = null; // lays the room anew, where it is laid on the real one
  }

  /** Follows head, left hand and the tip of the right one; null where one is not known. */
  step(head, hand, tip) {
    this.group.visible = head !== null && hand !== null && looksAt(head, hand);
    if (!this.group.visible) return;
    this.group.position.copy(placeOf(hand)).y += OVER_M;
    const away = this.group.position.clone().sub(placeOf(head)).setY(0);
    this.group.rotation.set(0, Math.atan2(-away.x, -away.z), 0);
    this.group.updateMatrix();
    const chosen = this.tools.tool === "shape" ? this.tools.shape : this.tools.tool;
    let touched = null;
    for (const tile of this.tiles) {
      const place = tile.position.clone().applyMatrix4(this.group.matrix);
      tile.visible = tile.name === "lay" ? this.redo !== null
        : this.tools.allows(SHAPES.includes(tile.name) ? "shape" : tile.name);
      if (tile.visible && tip !== null && place.distanceTo(tip) < TOUCH_M) touched = tile.name;
      tile.scale.setScalar(tile.name === chosen ? 1.3 : 1);
      tile.material.opacity = tile.name === chosen ? 1 : 0.75;
    }
    if (touched !== null && touched !== this.touched) this.#choose(touched);
    this.touched = touched;
  }

  hide() {
    this.group.visible = false;
    this.touched = null;
  }

  #choose(name) {
    if (name === "lay") return this.redo();
    if (SHAPES.includes(name)) this.tools.chooseShape(name);
    this.tools.choose(SHAPES.includes(name) ? "shape" : name);
  }
}

function looksAt(head, hand) {
  const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(turnOf(head));
  const way = placeOf(hand).setY(hand[1] + OVER_M).sub(placeOf(head));
  return way.length() < 0.8 && ahead.dot(way.normalize()) > LOOK;
}

function drawn(sign) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [PX, PX];
  const draw = canvas.getContext("2d");
  draw.fillStyle = "rgba(18, 21, 27, .92)";
  draw.roundRect(0, 0, PX, PX, 14);
  draw.fill();
  draw.fillStyle = "#f0f3f6";
  draw.font = `${0.62 * PX}px sans-serif`;
  draw.textAlign = "center";
  draw.textBaseline = "middle";
  draw.fillText(sign, PX / 2, PX / 2);
  return new THREE.CanvasTexture(canvas);
}
