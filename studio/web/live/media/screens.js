// Surfaces whose picture comes as video: each place of the connection shows one of them.
import * as THREE from "three";

const OLD_MS = 3000; // a video without a picture for so long has ended: the studio repeats each second

export class Screens {
  constructor(surfaces, changed) {
    this.surfaces = surfaces;
    this.changed = changed;
    this.places = [];
    this.ids = [];
    this.cameAt = new Map(); // of each surface that is shown, its newest picture
    this.pictures = 0;
  }

  /** Shows a track of WebRTC at its place. */
  show(number, track) {
    const video = document.createElement("video");
    Object.assign(video, { muted: true, autoplay: true, playsInline: true });
    video.srcObject = new MediaStream([track]);
    video.play().catch(() => {});
    const texture = new THREE.VideoTexture(video);
    texture.colorSpace = THREE.SRGBColorSpace;
    const place = { video, texture, isOver: false };
    this.places[number] = place;
    const next = () => {
      if (place.isOver) return;
      this.#lay(number, place);
      video.requestVideoFrameCallback(next);
    };
    video.requestVideoFrameCallback?.(next);
  }

  /** Which surface each place shows. */
  setPlaces(ids) {
    for (const [number, id] of this.ids.entries()) {
      if (id !== ids[number]) this.cameAt.delete(id);
    }
    this.ids = ids;
  }

  /** Forgets surfaces whose video has ended. */
  step(now, isConnected) {
    for (const [id, cameAt] of this.cameAt) {
      if (!isConnected || now - cameAt > OLD_MS || !this.surfaces.boards.has(id)) this.cameAt.delete(id);
    }
  }

  /** Surfaces that are shown as video, in order of their names. */
  shown() {
    return [...this.cameAt.keys()].sort();
  }

  clear() {
    // A board keeps the last picture until the next comes over the WebSocket.
    for (const place of this.places) {
      place.isOver = true;
      place.video.srcObject = null;
    }
    this.places = [];
    this.ids = [];
    this.cameAt.clear();
  }

  #lay(number, { texture, video }) {
    const id = this.ids[number];
    const board = id ? this.surfaces.boards.get(id) : undefined;
    if (board === undefined || video.videoWidth === 0) return;
    const { material } = board.mesh;
    if (material.map !== texture) {
      material.map = texture;
      material.needsUpdate = true;
      board.mesh.visible = true;
    }
    this.pictures += 1;
    this.cameAt.set(id, performance.now());
    this.changed();
  }
}
