// How the room lies on the headset's space, kept while one wears it and, where the device can, for the
// next time: by an anchor, which stays in its place when the headset corrects its space.
import * as THREE from "three";

const STORED = "gaussiannexus.anchor"; // of this browser: of each room its anchor, and the room from there
const MAX_STORED = 20;

export class Kept {
  /** `roomId` names the room in the browser's memory. */
  constructor(roomId) {
    this.roomId = roomId;
    this.anchor = null;
    this.roomFromAnchor = null; // { yaw, place } of the anchor's upright frame
    this.count = 0; // layings so far: an anchor that comes late is of another one
    this.isStored = false;
  }

  /** Puts an anchor where the room was laid; `found`: { yaw, place } of the headset's space in the room. */
  async lay(frame, space, found, at) {
    this.drop();
    const { count } = this;
    if (!frame.createAnchor) return;
    const roomFromAnchor = composed(found, { yaw: 0, place: at });
    const [x, y, z] = at;
    const anchor = await frame.createAnchor(new XRRigidTransform({ x, y, z }), space).catch(() => null);
    if (anchor === null || count !== this.count) return;
    Object.assign(this, { anchor, roomFromAnchor });
    const uuid = await anchor.requestPersistentHandle?.().catch(() => null);
    if (uuid && count === this.count) this.#store(uuid);
  }

  /** Looks for the anchor of an earlier visit; whether there is one. */
  async restore(session) {
    const stored = read()[this.roomId];
    if (!isLaying(stored) || !session.restorePersistentAnchor) return false;
    const { count } = this;
    const anchor = await session.restorePersistentAnchor(stored.uuid).catch(() => null);
    if (anchor === null || count !== this.count) return false;
    Object.assign(this, { anchor, roomFromAnchor: { yaw: stored.yaw, place: stored.place }, isStored: true });
    return true;
  }

  /** Where the headset's space lies in the room now, by the anchor; null where it is not seen. */
  now(frame, space) {
    const pose = this.anchor && frame.getPose(this.anchor.anchorSpace, space);
    if (!pose) return null;
    const { position, orientation } = pose.transform;
    const turn = new THREE.Quaternion(orientation.x, orientation.y, orientation.z, orientation.w);
    const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(turn);
    // Upright, however the anchor has tilted.
    const spaceFromAnchor = { yaw: Math.atan2(-ahead.x, -ahead.z), place: [position.x, position.y, position.z] };
    return composed(this.roomFromAnchor, inverse(spaceFromAnchor));
  }

  /** Forgets the anchor of this visit. */
  drop() {
    this.count += 1;
    this.anchor = this.roomFromAnchor = null;
    this.isStored = false;
  }

  #store(uuid) {
    const all = Object.entries(read()).filter(([room]) => room !== this.roomId).slice(1 - MAX_STORED);
    const stored = { uuid, ...this.roomFromAnchor };
    localStorage.setItem(STORED, JSON.stringify(Object.fromEntries([...all, [this.roomId, stored]])));
    this.isStored = true;
  }
}

function read() {
  try {
    const stored = JSON.parse(localStorage.getItem(STORED) ?? "{}");
    return typeof stored === "object" && stored !== null ? stored : {};
  } catch {
    return {};
  }
}

function isLaying(stored) {
  return typeof stored?.uuid === "string" && Number.isFinite(stored.yaw)
    && Array.isArray(stored.place) && stored.place.length === 3 && stored.place.every(Number.isFinite);
}

function composed(a, b) {
  const [c, s] = [Math.cos(a.yaw), Math.sin(a.yaw)];
  const [x, y, z] = b.place;
  return { yaw: a.yaw + b.yaw,
    place: [a.place[0] + c * x + s * z, a.place[1] + y, a.place[2] + c * z - s * x] };
}

function inverse({ yaw, place }) {
  const { place: [x, y, z] } = composed({ yaw: -yaw, place: [0, 0, 0] }, { yaw: 0, place });
  return { yaw: -yaw, place: [-x, -y, -z] };
}
