// In a headset, in VR or over the real room: one's own head, controllers and hands at display rate,
// teleport, pointing, drawing.
// Poses are in upright axes: metres, Y up, as headsets and the studio's wire have them.
import * as THREE from "three";
import { Line } from "shared/shapes.js";
import { Passthrough } from "live/ar/passthrough.js";

const FEATURES = { requiredFeatures: ["local-floor"], optionalFeatures: ["hand-tracking"] };
const MAX_STD_DEV = Math.sqrt(5); // of splats, which a headset's graphics are too slow to draw wider
const USUAL_HZ = 72; // of a headset that does not say: a Quest 3 begins so
const PUSHED = 0.7;
const LET_GO = 0.3;
const TURN = Math.PI / 6;
const HOLD_MS = 400; // a pinch of the left hand that lasts longer aims a jump
const THROW_M_S = 6;
const FALL_M_S2 = 9.8;
const ARC_STEP_S = 0.05;
const ARC_STEPS = 40;
const TIP_M = 0.06; // before a controller, where it draws
const PINCH_M = 0.015;
const ARC_COLOUR = [0.34, 0.71, 0.91];
const ELBOW_ROOM_M = 0.25; // so far from the walls one stands
const [THUMB_TIP, INDEX_TIP, MIDDLE_TIP] = [4, 9, 14];
const UPPER_BUTTON = 5; // B and Y: takes back what one did last, or removes what the hand carries

export class Headset {
  /** `figure` shows one's own hands; `tools` has the colour to draw with; `grab` carries things and
      `palette` shows tools; `shown` has what passthrough shows otherwise. */
  constructor(room, board, figure, { tools, grab, palette, shown, ended }) {
    Object.assign(this, { room, board, figure, tools, grab, palette, ended });
    this.rig = new THREE.Group();
    this.rig.visible = true;
    room.upright.add(this.rig);
    this.passthrough = new Passthrough(room, this.rig, shown);
    this.isAr = false;
    this.arc = new Line(0.012);
    room.upright.add(this.arc.group);
    this.session = null;
    this.sides = [freshSide(), freshSide()];
    this.drawing = null; // the side that draws
    this.landing = null;
    this.turned = false;
    this.steppedAt = performance.now();
  }

  /** Words that say why no headset can be entered; null if one can. */
  static async obstacle() {
    if (!window.isSecureContext) return "VR needs a secure address (https). The self-test says what to do.";
    if (!navigator.xr) return "This browser has no VR (WebXR). In a Quest, open this page in its own browser.";
    const works = await navigator.xr.isSessionSupported("immersive-vr").catch(() => false);
    return works ? null : "This browser finds no headset. In a Quest, open this page in its own browser.";
  }

  get isOn() {
    return this.session !== null;
  }

  /** Milliseconds from one of its pictures to the next. */
  get frameMs() {
    return 1000 / (this.session?.frameRate ?? USUAL_HZ);
  }

  /** Enters VR, or the real room with `isAr`. */
  async enter(isAr = false) {
    const { renderer, camera, spark } = this.room;
    const session = await (isAr ? Passthrough.request()
      : navigator.xr.requestSession("immersive-vr", FEATURES));
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local-floor");
    await renderer.xr.setSession(session);
    this.before = { position: camera.position.clone(), quaternion: camera.quaternion.clone(),
      maxStdDev: spark.maxStdDev };
    spark.maxStdDev = MAX_STD_DEV;
    this.isAr = isAr;
    if (isAr) this.passthrough.enter(session);
    else this.#standAtView();
    this.palette.redo = isAr ? () => this.passthrough.redo() : null;
    this.rig.add(camera);
    this.session = session;
    for (const [name, kind, on] of [["selectstart", "select", true], ["selectend", "select", false],
      ["squeezestart", "squeeze", true], ["squeezeend", "squeeze", false]]) {
      session.addEventListener(name, ({ inputSource }) => {
        const side = this.sides[sideOf(inputSource)];
        side[kind] = on;
        if (on) side.since = performance.now();
      });
    }
    session.addEventListener("end", () => this.#end());
  }

  leave() {
    this.session?.end();
  }

  /** Puts the rig where one looked from, on the floor. */
  #standAtView() {
    const { camera, upright } = this.room;
    const ahead = camera.getWorldDirection(new THREE.Vector3());
    const place = upright.worldToLocal(camera.position.clone());
    upright.worldToLocal(ahead.add(upright.position));
    this.rig.position.copy(this.#within(place.setY(0)));
    this.rig.rotation.set(0, Math.atan2(-ahead.x, -ahead.z), 0);
  }

  /** Reads head, controllers and hands of a frame; a body without number and time, or null. */
  step(frame) {
    const space = this.room.renderer.xr.getReferenceSpace();
    const viewer = frame.getViewerPose(space);
    if (!viewer) return null;
    const now = performance.now();
    this.seconds = Math.min(0.1, (now - this.steppedAt) / 1000);
    this.steppedAt = now;
    this.rig.updateMatrix();
    if (this.isAr && !this.#lay(frame, space, viewer)) return null;
    const head = this.#placed(viewer.transform);
    const body = { head, controllers: [null, null], hands: [null, null], ray: null };
    let aiming = null;
    let tip = null; // of the right hand, which touches the palette
    for (const source of this.session.inputSources) {
      if (source.handedness === "none") continue;
      const side = sideOf(source);
      const aim = this.#poseOf(frame, source.targetRaySpace, space);
      if (source.hand) body.hands[side] = this.#hand(frame, source.hand, space);
      else body.controllers[side] = this.#controller(frame, source, aim, space);
      if (aim === null) continue;
      const jumps = !this.isAr && (source.hand
        ? side === 0 && this.sides[side].select && performance.now() - this.sides[side].since > HOLD_MS
        : !this.grab.holds(side) && this.#stick(source, side, viewer));
      if (jumps) aiming = aim;
      else if (this.sides[side].select && !(source.hand && side === 0)) body.ray = this.#rayFrom(aim);
      const hand = { aim, pose: body.controllers[side]?.grip ?? this.#wrist(frame, source, space) ?? aim,
        joints: body.hands[side]?.joints ?? null };
      this.#work(side, source, hand);
      this.#undo(side, source);
      if (side === 1) tip = hand.joints === null ? before(aim) : joint(hand.joints, INDEX_TIP);
    }
    const left = body.controllers[0]?.grip ?? body.hands[0]?.joints.slice(0, 3) ?? null;
    this.palette.step(head, left, tip);
    this.#aim(aiming, viewer);
    const grips = body.controllers.map((controller) => controller?.grip ?? null);
    // Over the real room one's own hands are there.
    this.figure.show(this.isAr ? { ray: body.ray } : { hands: body.hands, grips, ray: body.ray });
    return body;
  }

  /** Lays the room on the real one, by marks or as it was laid; whether it lies. */
  #lay(frame, space, viewer) {
    const hands = [null, null];
    const { isMarking } = this.passthrough;
    for (const source of this.session.inputSources) {
      if (source.handedness === "none") continue;
      const side = sideOf(source);
      const state = this.sides[side];
      const { tip, grips } = this.#tipOf(frame, source, space);
      if (tip !== null) {
        hands[side] = { tip, marks: state.select && !state.marked, skips: grips && !state.grips };
      }
      state.marked = state.select;
      if (isMarking) state.grips = grips; // what it grips when it has marked is not for drawing
    }
    this.passthrough.step(frame, space, { viewer: viewer.transform, hands, seconds: this.seconds });
    if (this.passthrough.isLaid && !isMarking) return true;
    this.palette.hide();
    this.figure.show({});
    return false;
  }

  /** Where a hand marks, in the headset's space, three numbers or null; and whether it grips. */
  #tipOf(frame, source, space) {
    const placed = (pose) => pose && new THREE.Vector3().copy(pose.transform.position);
    if (!source.hand) {
      const pose = frame.getPose(source.targetRaySpace, space);
      if (!pose) return { tip: null, grips: false };
      const { x, y, z, w } = pose.transform.orientation;
      const tip = before([...placed(pose).toArray(), x, y, z, w]).toArray();
      return { tip, grips: this.sides[sideOf(source)].squeeze };
    }
    const [thumb, index, middle] = ["thumb-tip", "index-finger-tip", "middle-finger-tip"]
      .map((name) => placed(frame.getJointPose(source.hand.get(name), space)));
    if (!thumb || !index || !middle) return { tip: null, grips: false };
    return { tip: thumb.clone().lerp(index, 0.5).toArray(), grips: thumb.distanceTo(middle) < PINCH_M };
  }

  /** Whether the thumbstick aims a jump; sideways it turns by a step. */
  #stick(source, side, viewer) {
    const [sideways, forwards] = (source.gamepad?.axes ?? []).slice(2);
    if (Math.abs(sideways ?? 0) < LET_GO) this.sides[side].turned = false;
    else if (Math.abs(sideways) > PUSHED && !this.sides[side].turned) {
      this.sides[side].turned = true;
      const { x, z } = viewer.transform.position;
      const before = new THREE.Vector3(x, 0, z).applyMatrix4(this.rig.matrix);
      this.rig.rotation.y -= Math.sign(sideways) * TURN;
      this.#stand(before, viewer);
    }
    const state = this.sides[side];
    state.aims = state.aims ? (forwards ?? 0) < -LET_GO : (forwards ?? 0) < -PUSHED;
    return state.aims;
  }

  /** Shows where a jump would lead; jumps when one no longer aims. */
  #aim(pose, viewer) {
    if (pose === null) {
      if (this.landing !== null) this.#stand(this.landing, viewer);
      this.landing = null;
      if (this.arc.isShown) this.arc.clear();
      return;
    }
    const place = new THREE.Vector3().fromArray(pose);
    const speed = new THREE.Vector3(0, 0, -THROW_M_S)
      .applyQuaternion(new THREE.Quaternion().fromArray(pose, 3));
    const points = [...place.toArray()];
    for (let i = 0; i < ARC_STEPS && place.y > 0; i++) {
      speed.y -= FALL_M_S2 * ARC_STEP_S;
      // At a wall it falls straight down: one lands before it.
      this.#within(place.addScaledVector(speed, ARC_STEP_S));
      points.push(place.x, Math.max(place.y, 0.01), place.z);
    }
    this.landing = place.setY(0);
    this.arc.show(points, ARC_COLOUR);
  }

  /** Moves the rig so that the head is over a place of the floor. */
  #stand(place, viewer) {
    const { x, z } = viewer.transform.position;
    this.rig.position.set(0, 0, 0);
    this.rig.updateMatrix();
    const head = new THREE.Vector3(x, 0, z).applyMatrix4(this.rig.matrix);
    this.rig.position.set(place.x - head.x, 0, place.z - head.z);
    this.rig.updateMatrix();
  }

  /** A place of the floor, moved to within the room. */
  #within(place) {
    const [[lowX, lowY], [highX, highY]] = this.room.manifest.footprint;
    const clamp = (value, low, high) => {
      const room = Math.min(ELBOW_ROOM_M, (high - low) / 2);
      return THREE.MathUtils.clamp(value, low + room, high - room);
    };
    place.x = clamp(place.x, lowX, highX);
    place.z = clamp(place.z, -highY, -lowY);
    return place;
  }

  /** Carries or draws in the air: by the grip of a controller, by thumb and middle finger of a hand. */
  #work(side, source, { aim, pose, joints }) {
    const state = this.sides[side];
    let tip = null;
    if (source.hand) {
      const pinches = joints !== null
        && joint(joints, THUMB_TIP).distanceTo(joint(joints, MIDDLE_TIP)) < PINCH_M;
      if (pinches) tip = joint(joints, MIDDLE_TIP);
    } else if (state.squeeze) tip = before(aim);
    const begins = tip !== null && !state.grips;
    state.grips = tip !== null;
    if (begins && !this.grab.begin(side, { tip, pose, aim, points: state.select })
      && this.drawing === null && this.canDraw) {
      this.drawing = side;
      this.board.begin(this.tools.ink, this.room.objectNear(tip));
    }
    if (this.grab.holds(side)) {
      const [sideways, forwards] = (source.gamepad?.axes ?? []).slice(2);
      if (tip === null) this.grab.end(side);
      else this.grab.move(side, { tip, pose, aim }, [sideways ?? 0, forwards ?? 0], this.seconds);
      return;
    }
    if (this.drawing !== side) return;
    if (tip !== null) this.board.extend(tip.toArray(), performance.now());
    else {
      this.drawing = null;
      this.board.end();
    }
  }

  #undo(side, source) {
    const state = this.sides[side];
    const isDown = source.gamepad?.buttons[UPPER_BUTTON]?.pressed ?? false;
    if (isDown && !state.undoes) {
      if (this.grab.holds(side)) this.grab.drop(side);
      else if (this.canUndo) this.board.undo();
    }
    state.undoes = isDown;
  }

  #rayFrom(aim) {
    const { upright } = this.room;
    const origin = new THREE.Vector3().fromArray(aim);
    const along = new THREE.Vector3(0, 0, -1).applyQuaternion(new THREE.Quaternion().fromArray(aim, 3));
    const found = this.room.hit(upright.localToWorld(origin.clone()),
      along.clone().applyQuaternion(upright.quaternion));
    const end = found === null ? origin.clone().addScaledVector(along, 5) : upright.worldToLocal(found);
    return [...origin.toArray(), ...end.toArray()];
  }

  #controller(frame, source, aim, space) {
    const grip = source.gripSpace ? this.#poseOf(frame, source.gripSpace, space) : null;
    if (aim === null && grip === null) return null;
    const { buttons = [], axes = [] } = source.gamepad ?? {};
    let pressed = 0;
    buttons.slice(0, 16).forEach((button, i) => { if (button.pressed) pressed |= 1 << i; });
    return { aim: aim ?? grip, grip: grip ?? aim, buttons: pressed,
      axes: [0, 1, 2, 3].map((i) => axes[i] ?? 0) };
  }

  #hand(frame, hand, space) {
    const joints = [];
    const radii = [];
    for (const joint of hand.values()) {
      const pose = frame.getJointPose(joint, space);
      if (!pose) return null;
      joints.push(...this.#placed(pose.transform).slice(0, 3));
      radii.push(pose.radius ?? 0.008);
    }
    return { joints, radii };
  }

  #wrist(frame, source, space) {
    const pose = source.hand ? frame.getJointPose(source.hand.get("wrist"), space) : null;
    return pose ? this.#placed(pose.transform) : null;
  }

  #poseOf(frame, what, space) {
    const pose = frame.getPose(what, space);
    return pose ? this.#placed(pose.transform) : null;
  }

  /** A transform of the headset's floor in the room. */
  #placed({ position, orientation }) {
    const place = new THREE.Vector3(position.x, position.y, position.z).applyMatrix4(this.rig.matrix);
    const turn = new THREE.Quaternion(orientation.x, orientation.y, orientation.z, orientation.w);
    turn.premultiply(this.rig.quaternion).normalize();
    return [...place.toArray(), ...turn.toArray()];
  }

  #end() {
    const { camera, scene, spark, renderer } = this.room;
    this.session = null;
    if (this.isAr) this.passthrough.leave();
    this.board.end();
    this.drawing = null;
    for (const side of [0, 1]) this.grab.end(side);
    this.palette.hide();
    this.sides = [freshSide(), freshSide()];
    this.arc.clear();
    this.figure.show({});
    renderer.xr.enabled = false;
    scene.add(camera);
    camera.position.copy(this.before.position);
    camera.quaternion.copy(this.before.quaternion);
    camera.scale.set(1, 1, 1);
    spark.maxStdDev = this.before.maxStdDev;
    this.ended();
  }
}

function freshSide() {
  return { select: false, squeeze: false, since: 0, turned: false, aims: false, undoes: false,
    grips: false, marked: false };
}

const joint = (joints, i) => new THREE.Vector3().fromArray(joints, 3 * i);

/** A place before a controller, where it draws. */
function before(aim) {
  return new THREE.Vector3(0, 0, -TIP_M).applyQuaternion(new THREE.Quaternion().fromArray(aim, 3))
    .add(new THREE.Vector3().fromArray(aim));
}

function sideOf(source) {
  return source.handedness === "right" ? 1 : 0;
}
