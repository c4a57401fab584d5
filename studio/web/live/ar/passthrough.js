// The live room over the real one: no splats; people, lines, shapes, proposals and outlines of tracked
// objects, where the wearer has laid the room.
import * as THREE from "three";
import { Line } from "shared/shapes.js";
import { Kept } from "live/ar/kept.js";
import { Marking, MIN_PLACES } from "live/ar/marking.js";
import { boxPath } from "live/things/poses.js";

const FEATURES = { requiredFeatures: ["local-floor"], optionalFeatures: ["hand-tracking", "anchors"] };
const AWAY_M = 10000; // from a room that is not laid yet nothing is to be seen
const OUTLINE_M = 0.006;
const [FOLLOWED, UNSURE] = [[0.34, 0.71, 0.91], [0.95, 0.75, 0.25]];

export class Passthrough {
  /** `rig`: the group of the headset's space in the room's axes; `shown` has proposals and surfaces. */
  constructor(room, rig, shown) {
    Object.assign(this, { room, rig, shown });
    this.marking = new Marking(rig, room.manifest.footprint);
    this.kept = new Kept(room.manifest.made_of);
    this.laying = null; // { yaw, place } of the headset's space in the room
    this.outlines = new Map();
    this.isReset = false;
  }

  /** Words that say why the room cannot be laid on the real one here; null if it can. */
  async obstacle() {
    if (!window.isSecureContext) return "AR needs a secure address (https). The self-test says what to do.";
    const works = await navigator.xr?.isSessionSupported("immersive-ar").catch(() => false);
    if (!works) return "This device has no AR (WebXR). In a Quest 3, open this page in its own browser.";
    const { length } = this.#places();
    if (length >= MIN_PLACES) return null;
    return `AR is laid on ${MIN_PLACES} known places, printed codes or the camera; here ${length} are known: `
      + "hang up codes and prepare the room with them.";
  }

  /** What can be marked: printed codes, and the 360° camera where it is known. */
  #places() {
    const codes = (this.room.manifest.codes ?? []).map(({ name, place }) =>
      ({ what: `the middle of the code “${name}”`, place }));
    const { cameraPlace } = this.room;
    if (cameraPlace === null) return codes;
    return [...codes, { what: "the 360° camera, between its lenses", place: cameraPlace }];
  }

  /** The session that is to be entered. */
  static request() {
    return navigator.xr.requestSession("immersive-ar", FEATURES);
  }

  /** Begins: what is not for passthrough is hidden, and the room is to be laid. */
  enter(session) {
    const { room, shown } = this;
    room.spark.visible = false;
    this.background = room.scene.background;
    room.scene.background = null;
    room.hidden.hideAll(true);
    shown.surfaces.group.visible = false;
    shown.proposals.outline(true);
    this.#putAway();
    this.marking.begin(this.#places());
    this.isReset = false;
    const space = room.renderer.xr.getReferenceSpace();
    space?.addEventListener?.("reset", () => { this.isReset = true; });
    this.kept.drop();
    this.kept.restore(session).then((isThere) => {
      if (isThere) this.marking.tell("The room lies as last time. ⌖ at your left hand lays it anew.");
    });
  }

  /** Ends: all is as before. */
  leave() {
    const { room, shown } = this;
    room.spark.visible = true;
    room.scene.background = this.background;
    room.hidden.hideAll(false);
    shown.surfaces.group.visible = true;
    shown.proposals.outline(false);
    this.marking.group.visible = false;
    for (const { line } of this.outlines.values()) {
      line.clear();
      line.group.removeFromParent();
    }
    this.outlines.clear();
    this.kept.drop();
    this.laying = null;
  }

  /** Marks the codes anew. */
  redo() {
    this.kept.drop();
    this.#putAway();
    this.marking.begin(this.#places());
  }

  /** Whether the room is laid. */
  get isLaid() {
    return this.laying !== null;
  }

  /** Whether hands mark codes now, and do nothing else. */
  get isMarking() {
    return !this.marking.isDone;
  }

  /** Follows a frame, before anything is placed by the rig: `viewer` is its transform, `hands` as
      `Marking.step` takes them. */
  step(frame, space, { viewer, hands, seconds }) {
    const { x, y, z } = viewer.position;
    const { orientation: turn } = viewer;
    const ahead = new THREE.Vector3(0, 0, -1)
      .applyQuaternion(new THREE.Quaternion(turn.x, turn.y, turn.z, turn.w));
    const found = this.marking.step([x, y, z], ahead, hands, seconds);
    if (found !== null) {
      this.laying = { yaw: found.yaw, place: found.place };
      this.kept.lay(frame, space, this.laying, found.at);
    }
    const anchored = this.kept.now(frame, space);
    if (anchored !== null) this.laying = anchored;
    else if (this.isReset && this.laying !== null && this.kept.anchor === null) {
      this.#putAway();
      this.marking.begin(this.#places(), "The headset has moved its space.");
    }
    this.isReset = false;
    if (this.laying !== null) {
      this.rig.position.fromArray(this.laying.place);
      this.rig.rotation.set(0, this.laying.yaw, 0);
    }
    this.rig.updateMatrix();
    this.#outline();
  }

  #putAway() {
    this.laying = null;
    this.rig.position.set(0, -AWAY_M, 0);
    this.rig.rotation.set(0, 0, 0);
  }

  #outline() {
    for (const [id, body] of this.room.objects) {
      const known = this.outlines.get(id) ?? this.#add(id, body);
      known.line.group.visible = body.state !== "lost";
      if (known.isFlagged === body.isFlagged) continue;
      known.isFlagged = body.isFlagged;
      const [x, y, z] = body.item.box_m;
      known.line.show(boxPath(x, y, z), body.isFlagged ? UNSURE : FOLLOWED);
    }
  }

  #add(id, body) {
    const known = { line: new Line(OUTLINE_M), isFlagged: null };
    known.line.group.quaternion.copy(this.room.worldFromFile); // the path's up is Y, the object's Z
    body.group.add(known.line.group);
    this.outlines.set(id, known);
    return known;
  }
}
