// The live room: splats of the room and of every object, which stand where the studio has them.
import * as THREE from "three";
import { layShadow, Stage } from "shared/stage.js";
import { HiddenMesh } from "live/hidden.js";
import { Pacer, Timeline } from "live/timeline.js";

const REST_MS = 400; // an object that has not moved for so long stands on something
const SURE = 0.5;
const FAINT = 0.45; // of an object that is lost
const RAY_M = 30;
const MIN_HIT_OPACITY = 0.35;
const SAME_SURFACE_M = 0.15; // three splats within this are a surface, fewer a stray one
const OVER_M = 0.06; // so far over a surface one looks for it from above
const ON_FLOOR_M = 0.08;

export class LiveRoom extends Stage {
  /** `files`: bytes(part), a promise of a file's bytes. */
  constructor(canvas, manifest, files, changed) {
    super(canvas, manifest.world_from_file, changed);
    this.manifest = manifest;
    this.files = files;
    this.objects = new Map();
    this.cameraPlace = null; // of the 360° camera's middle, Y up
    this.pacer = new Pacer();
    this.raycaster = new THREE.Raycaster();
    // Whatever comes from the studio has a headset's axes, whose up is the files' up.
    this.upright = new THREE.Group();
    this.upright.quaternion.copy(this.worldFromFile);
    this.upright.updateMatrixWorld();
    this.scene.add(this.upright);
    this.hidden = new HiddenMesh(this.upright, changed);
    this.beforeRender = () => {};
  }

  render() {
    this.beforeRender();
    super.render();
  }

  /** Loads what the room is recognised by: a thinned room, and the objects. */
  async loadFirst(progress) {
    const { objects, first_part } = this.manifest;
    progress(0, objects.length + 1);
    this.solid = await this.#part(first_part);
    this.solid.minRaycastOpacity = MIN_HIT_OPACITY;
    this.shownRoom = this.solid;
    this.scene.add(this.solid);
    let done = 1;
    progress(done, objects.length + 1);
    await Promise.all(objects.map(async (item) => {
      const group = new THREE.Group();
      const mesh = await this.#part(item.part);
      mesh.minRaycastOpacity = MIN_HIT_OPACITY;
      group.add(mesh);
      this.scene.add(group);
      const body = { item, group, mesh, line: new Timeline(this.pacer), shadow: null,
        state: "static", isFlagged: false, movedAt: -Infinity };
      this.objects.set(item.id, body);
      this.#place(body, item.pose);
      progress(++done, objects.length + 1);
    }));
  }

  /** Loads the rest: the whole room in place of the thinned one, and shadows. */
  async loadRest() {
    const { room_part } = this.manifest;
    if (room_part !== null) {
      const whole = await this.#part(room_part);
      whole.raycastable = false;
      this.scene.add(whole);
      this.scene.remove(this.shownRoom);
      this.shownRoom = whole;
    }
    await Promise.all([...this.objects.values()].map(async (body) => {
      if (body.item.shadow_part === null) return;
      const shadow = new THREE.Group();
      shadow.add(await this.#part(body.item.shadow_part));
      body.shadow = shadow;
      this.scene.add(shadow);
    }));
  }

  /** Takes a state of the studio that came at a time. */
  take(message, now) {
    const sent = message.t_us / 1000;
    this.cameraPlace = message.camera ?? this.cameraPlace;
    this.pacer.note(sent, now);
    this.#takeObjects(message.objects, sent);
  }

  /** Takes everything there is, after a connection was made. */
  takeWhole({ objects, t_us, camera = null }) {
    this.cameraPlace = camera;
    // When it was so is older than when it was sent: nothing is learnt of the clocks.
    for (const body of this.objects.values()) body.line.clear();
    this.hidden.clear();
    this.#takeObjects(objects, t_us / 1000);
  }

  /** Puts objects where they are shown at a time; whether any has moved or still will. */
  step(now) {
    let isMoving = this.hidden.step();
    for (const body of this.objects.values()) {
      const found = body.line.at(now);
      if (found !== null) {
        const [a, b, share] = found;
        if (body.shown !== a || body.share !== share) {
          this.#place(body, a, b, share);
          [body.shown, body.share] = [a, share];
          isMoving = true;
        }
        isMoving ||= body.line.isMoving(now);
      }
      if (body.shadow !== null) {
        const stands = now - body.movedAt > REST_MS;
        if (stands !== body.shadow.visible) isMoving = true;
        layShadow(body.shadow, body.group, stands);
      }
    }
    return isMoving;
  }

  /** The nearest surface on a ray of the world, as a place just before it; null where none is.
      `but`: id of an object that does not count. */
  hit(origin, direction, but = null) {
    const splats = Math.min(this.#metresTo(this.solid, origin, direction),
      ...this.#aimed(origin, direction).filter(({ item }) => item.id !== but)
        .map(({ mesh }) => this.#metresTo(mesh, origin, direction)));
    const flat = this.#wall(origin, direction);
    const metres = Math.min(splats === Infinity ? flat : splats, this.hidden.metresTo(origin, direction));
    if (metres === Infinity) return null;
    const place = origin.clone().addScaledVector(direction, metres);
    // The floor is a plane: what is drawn on it lies flat.
    if (Math.abs(place.z) < ON_FLOOR_M && direction.z < -0.05) {
      return origin.clone().addScaledVector(direction, (0.01 - origin.z) / direction.z);
    }
    return place.addScaledVector(direction, -0.01);
  }

  /** Where something stands that is put at a place (upright axes): on what is below it, of a wall on
      the floor before it. `but`: id of an object that does not count. */
  standing(place, but = null) {
    const from = this.upright.localToWorld(place.clone());
    from.z += OVER_M;
    const found = this.hit(from, new THREE.Vector3(0, 0, -1), but);
    return found === null ? place : this.upright.worldToLocal(found);
  }

  /** The object that a ray of the world meets first, by id; null where the room is before it. */
  objectAt(origin, direction) {
    const found = this.#aimed(origin, direction)
      .map(({ item, mesh }) => [item.id, this.#metresTo(mesh, origin, direction)])
      .sort((a, b) => a[1] - b[1])[0];
    if (found === undefined || found[1] === Infinity) return null;
    const before = Math.min(this.#metresTo(this.solid, origin, direction),
      this.hidden.metresTo(origin, direction));
    return found[1] < before + SAME_SURFACE_M ? found[0] : null;
  }

  /** The object in whose sphere a place (upright axes) is, by id; null where none is. */
  objectNear(place) {
    const world = this.upright.localToWorld(place.clone());
    const found = [...this.objects.values()].map(({ item, group }) => [item,
      group.localToWorld(new THREE.Vector3(0, 0, item.middle_m)).distanceTo(world)])
      .filter(([item, metres]) => metres < item.radius_m).sort((a, b) => a[1] - b[1])[0];
    return found?.[0].id ?? null;
  }

  #aimed(origin, direction) {
    const ray = new THREE.Ray(origin, direction);
    return [...this.objects.values()].filter(({ item, group }) => ray.distanceToPoint(
      group.localToWorld(new THREE.Vector3(0, 0, item.middle_m))) < item.radius_m);
  }

  #metresTo(mesh, origin, direction) {
    mesh.updateWorldMatrix(true, false); // also where it has moved since the last picture
    this.raycaster.set(origin, direction);
    this.raycaster.near = 0.05;
    this.raycaster.far = RAY_M;
    return nearest(this.raycaster.intersectObject(mesh, false));
  }

  /** Metres along a ray to floor, ceiling or a side of the room, from within. */
  #wall(origin, direction) {
    const { footprint, height_m } = this.manifest;
    const box = new THREE.Box3(
      new THREE.Vector3(...footprint[0], 0), new THREE.Vector3(...footprint[1], height_m));
    const ways = ["x", "y", "z"].map((axis) => {
      const end = direction[axis] > 0 ? box.max[axis] : box.min[axis];
      const way = (end - origin[axis]) / direction[axis];
      return way > 0 && Number.isFinite(way) ? way : Infinity;
    });
    return Math.min(...ways);
  }

  #takeObjects(objects, sent) {
    for (const [id, values] of Object.entries(objects)) {
      const body = this.objects.get(id);
      if (body === undefined || values === null) continue;
      const [state, confidence] = values.slice(7);
      body.line.push(sent, values.slice(0, 7));
      body.state = state;
      body.isFlagged = state === "lost" || state === "occluded" || confidence < SURE;
      body.mesh.opacity = state === "lost" ? FAINT : 1;
    }
  }

  #place(body, a, b = a, share = 0) {
    const place = new THREE.Vector3().fromArray(a).lerp(new THREE.Vector3().fromArray(b), share);
    const turn = new THREE.Quaternion().fromArray(a, 3)
      .slerp(new THREE.Quaternion().fromArray(b, 3), share);
    body.pose = [...place.toArray(), ...turn.toArray()];
    // From a headset's axes to the world's, both of the room and of the object.
    const world = this.worldFromFile;
    place.applyQuaternion(world);
    turn.premultiply(world).multiply(world.clone().invert());
    const { group } = body;
    if (group.position.distanceTo(place) > 1e-3 || group.quaternion.angleTo(turn) > 1e-3) {
      body.movedAt = body.placed ? performance.now() : -Infinity;
    }
    body.placed = true;
    group.position.copy(place);
    group.quaternion.copy(turn);
  }

  async #part(name) {
    return this.splats(await this.files.bytes(name), name);
  }
}

/** Metres to where splats begin to be a surface. */
function nearest(hits) {
  const found = hits.map((hit) => hit.distance).sort((a, b) => a - b);
  for (let i = 0; i + 2 < found.length; i++) {
    if (found[i + 2] - found[i] < SAME_SURFACE_M) return found[i];
  }
  return found[0] ?? Infinity;
}
