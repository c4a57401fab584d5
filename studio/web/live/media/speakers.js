// Voices in the room: each comes from its speaker's head, as two ears would hear it.
import * as THREE from "three";
import { address } from "live/media/worklet.js";

const RATE_HZ = 48000;
const NEAR_M = 1.2; // up to here a voice is as loud as it was spoken
const FADE = 0.7; // of its loudness with distance: a room's walls carry it further than open air

export class Speakers {
  /** `people`: whose heads. */
  constructor(people) {
    this.people = people;
    this.context = null;
    this.ready = null; // a promise: the worklets are there
    this.voices = new Map(); // by a name: { panner, index }
    this.elements = [];
  }

  /** Begins, if the browser lets it: some want a click or a key first. */
  start() {
    if (this.context !== null || !window.AudioContext) return;
    this.context = new AudioContext({ sampleRate: RATE_HZ, latencyHint: "interactive" });
    this.ready = this.context.audioWorklet?.addModule(address) ?? Promise.reject(new Error("no worklets"));
    this.ready.catch(() => {});
    const wake = () => {
      if (this.context.state !== "running") this.context.resume();
    };
    for (const kind of ["pointerdown", "keydown"]) window.addEventListener(kind, wake);
    wake();
  }

  /** Listens to a track of WebRTC, which carries the voice of whoever has that place. */
  listenTo(place, track) {
    this.start();
    if (this.context === null) return;
    const stream = new MediaStream([track]);
    // Chromium plays a remote track nowhere unless an element has it.
    const element = new Audio();
    element.muted = true;
    element.srcObject = stream;
    element.play().catch(() => {});
    this.elements.push(element);
    this.context.createMediaStreamSource(stream).connect(this.#voice(`place ${place}`, null).panner);
  }

  /** Whose voice each place carries. */
  setOwners(indices) {
    indices.forEach((index, place) => {
      const voice = this.voices.get(`place ${place}`);
      if (voice) voice.index = index;
    });
  }

  /** Forgets all tracks of WebRTC. */
  forgetPlaces() {
    for (const element of this.elements) element.srcObject = null;
    this.elements = [];
    for (const name of [...this.voices.keys()]) {
      if (name.startsWith("place ")) this.forget(name);
    }
  }

  /** The node that plays a person's voice at their head. */
  inputOf(index) {
    return this.#voice(`person ${index}`, index).panner;
  }

  forget(name) {
    this.voices.get(name)?.panner.disconnect();
    this.voices.delete(name);
  }

  /** Puts voices and ears where heads and the camera are, in the world's axes. */
  step(camera) {
    if (this.context === null || this.voices.size === 0) return;
    const { listener } = this.context;
    const ear = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
    const ahead = new THREE.Vector3(0, 0, -1).transformDirection(camera.matrixWorld);
    const up = new THREE.Vector3(0, 1, 0).transformDirection(camera.matrixWorld);
    put(listener, "position", ear);
    if (listener.forwardX) {
      put(listener, "forward", ahead);
      put(listener, "up", up);
    } else {
      listener.setOrientation(...ahead.toArray(), ...up.toArray());
    }
    for (const { panner, index } of this.voices.values()) {
      const figure = this.people.byIndex.get(index)?.figure;
      // Somebody without a body is heard right before one.
      const place = figure?.group.visible ? figure.head.getWorldPosition(new THREE.Vector3())
        : ear.clone().add(ahead);
      put(panner, "position", place);
    }
  }

  #voice(name, index) {
    let voice = this.voices.get(name);
    if (voice === undefined) {
      const panner = new PannerNode(this.context, { panningModel: "HRTF", distanceModel: "inverse",
        refDistance: NEAR_M, rolloffFactor: FADE });
      panner.connect(this.context.destination);
      voice = { panner, index };
      this.voices.set(name, voice);
    }
    return voice;
  }
}

function put(node, name, { x, y, z }) {
  if (node[`${name}X`]) {
    [node[`${name}X`].value, node[`${name}Y`].value, node[`${name}Z`].value] = [x, y, z];
  } else {
    node.setPosition(x, y, z); // browsers of before 2024 have no parameters of a listener
  }
}
