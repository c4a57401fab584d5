// Proposals: a translucent copy of an object's splats where it should go, with its owner's name. It
// turns green when the object itself stands there.
import * as THREE from "three";
import { dyno, SplatMesh } from "@sparkjsdev/spark";
import { Line } from "shared/shapes.js";
import { Behind } from "live/things/behind.js";
import { boxPath, standsThere } from "live/things/poses.js";

const OPACITY = 0.5;
const MET_OPACITY = 0.8; // before the object itself
const LARGER = 1.03; // than the object, which then stands in it
const [TINT, MET_TINT] = [0.6, 0.85]; // share of the colour that says whether it is met
const MET = [0.3, 0.86, 0.55];
const OPEN = [0.95, 0.75, 0.25];
const EDGE_M = 0.012;
const LABEL_OVER_M = 0.2;

export class Proposals {
  /** `room`: the live room, with its objects. */
  constructor(room, changed) {
    this.room = room;
    this.changed = changed;
    this.copies = new Map();
    this.isOutlined = false;
    this.behind = new Behind(room);
    room.beforeRender = () => this.#hide();
  }

  /** Shows the edges of a box in place of a copy's splats, and of its footprint. */
  outline(on) {
    this.isOutlined = on;
    for (const copy of this.copies.values()) copy.isMet = null;
    this.step();
  }

  /** Shows a proposal as it is; null takes it away. */
  show(key, fields) {
    const known = this.copies.get(key);
    const body = fields === null ? undefined : this.room.objects.get(fields.object);
    if (known !== undefined && known.fields.object !== fields?.object) this.#remove(key, known);
    if (body !== undefined) {
      const copy = this.copies.get(key) ?? this.#add(key, body);
      copy.fields = fields;
      copy.group.position.fromArray(fields.pose);
      copy.group.quaternion.fromArray(fields.pose, 3);
      this.#judge(copy);
    }
    this.changed();
  }

  /** Looks whether objects stand where they were proposed. */
  step() {
    for (const copy of this.copies.values()) {
      if (this.#judge(copy)) this.changed();
    }
  }

  /** Whether an object stands as proposed. */
  isMet(key) {
    return this.copies.get(key)?.isMet ?? false;
  }

  /** Words to write on the picture, as `Labels` takes them. */
  labels(you) {
    return [...this.copies].map(([key, { fields, item, group, isMet }]) => {
      const who = fields.by === you ? "you" : fields.name || fields.by;
      const words = isMet ? `✓ ${item.name} stands as proposed by ${who}` : `${who}: ${item.name} here`;
      const place = group.localToWorld(new THREE.Vector3(0, 2 * item.middle_m + LABEL_OVER_M, 0));
      return [`proposal:${key}`, words, isMet ? "var(--good)" : "var(--warn)", place];
    });
  }

  /** Those on a ray of the world: [key, metres]. */
  hits(raycaster) {
    return [...this.copies].flatMap(([key, { solid }]) => {
      solid.updateWorldMatrix(true, false);
      return raycaster.intersectObject(solid, false).slice(0, 1).map((hit) => [key, hit.distance]);
    });
  }

  #add(key, body) {
    const { item, mesh } = body;
    const group = new THREE.Group();
    // The very same splats: a copy costs a draw, no memory.
    const splats = new SplatMesh({ packedSplats: mesh.packedSplats });
    splats.raycastable = false;
    splats.scale.setScalar(LARGER);
    const tint = dyno.dynoVec3(new THREE.Vector3());
    const share = dyno.dynoFloat(TINT);
    splats.objectModifier = tinted(tint, share);
    splats.worldModifier = this.behind.modifier();
    splats.updateGenerator();
    const [x, y, z] = item.box_m ?? [item.radius_m, item.radius_m, 2 * item.middle_m];
    const solid = new THREE.Mesh(new THREE.BoxGeometry(x, z, y).translate(0, z / 2, 0));
    solid.visible = false;
    const edge = new Line(EDGE_M);
    group.add(splats, solid, edge.group);
    this.room.upright.add(group);
    const [a, b] = [x / 2, y / 2];
    const around = [[-a, -b], [a, -b], [a, b], [-a, b], [-a, -b]].flatMap(([u, v]) => [u, 0.01, v]);
    const copy = { item, body, group, splats, tint, share, solid, edge, around, edges: boxPath(x, y, z),
      fields: null, isMet: null };
    this.copies.set(key, copy);
    return copy;
  }

  /** Hides what of copies is behind a headset's surfaces, as they are seen now. */
  #hide() {
    if (!this.behind.step(this.copies.size > 0)) return;
    for (const { splats } of this.copies.values()) splats.updateVersion();
  }

  /** Colours a copy; whether that has changed. */
  #judge(copy) {
    const { body, fields, splats, tint, share, edge, around, edges } = copy;
    const isMet = body.pose !== undefined
      && standsThere(body.pose, fields.pose, body.item.symmetry ?? 1);
    if (isMet === copy.isMet) return false;
    copy.isMet = isMet;
    const colour = isMet ? MET : OPEN;
    tint.value.fromArray(colour);
    share.value = isMet ? MET_TINT : TINT;
    splats.opacity = isMet ? MET_OPACITY : OPACITY;
    splats.updateVersion();
    edge.show(this.isOutlined ? edges : around, colour);
    return true;
  }

  #remove(key, { group, splats, solid, edge }) {
    group.removeFromParent();
    edge.clear();
    solid.geometry.dispose();
    splats.packedSplats = undefined; // the object's own, which stays
    this.copies.delete(key);
  }
}

/** Splats of an object in one colour, of which the object's own shading stays to be seen. */
function tinted(colour, share) {
  return dyno.dynoBlock({ gsplat: dyno.Gsplat }, { gsplat: dyno.Gsplat }, ({ gsplat }) => {
    const { rgb } = dyno.splitGsplat(gsplat).outputs;
    const mixed = dyno.mix(rgb, colour, share);
    return { gsplat: dyno.combineGsplat({ gsplat, rgb: mixed }) };
  });
}
