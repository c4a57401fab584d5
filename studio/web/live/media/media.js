// Voices and surfaces that move: by WebRTC where the network lets it through, else over the WebSocket.
// Nothing of it begins before somebody speaks or a surface is there.
import { Connection } from "live/media/connection.js";
import { Microphone } from "live/media/microphone.js";
import { Screens } from "live/media/screens.js";
import { canDecode, isVoices, SocketVoice } from "live/media/socket_voice.js";
import { Speakers } from "live/media/speakers.js";

const LOOK_MS = 250;
const LATE_MS = 8000; // without a connection for so long, WebRTC is taken for blocked
const BROKEN_MS = 1500; // a connection that stutters for longer is given up
const UNUSED_MS = 60000; // a connection that nobody needs for so long is closed
const WAITS_MS = [5000, 10000, 20000, 40000];
const byId = (id) => document.getElementById(id);

export class Media {
  /** `page`: link, people, surfaces, panel, room, changed, notice. */
  constructor(page) {
    Object.assign(this, page);
    this.speakers = new Speakers(page.people);
    this.screens = new Screens(page.surfaces, page.changed);
    this.microphone = new Microphone();
    this.socketVoice = new SocketVoice(page.link, this.speakers);
    this.connection = null;
    this.settings = { rtc: false, why: "", recorded: false, voices: 0, videos: 0 };
    this.list = [];
    this.you = null;
    this.maySpeak = false;
    this.told = "";
    this.tries = 0;
    this.notBefore = 0;
    this.lookedAt = -Infinity;
    this.neededAt = -Infinity;
    this.isBlocked = false;
    this.speaking = new Set();
    byId("microphone").addEventListener("click", () => this.toggleMicrophone());
  }

  /** A new connection to the studio: WebRTC begins anew, too. */
  welcome({ media, you }) {
    this.you = you;
    this.settings = media ?? this.settings;
    this.told = "";
    this.tries = 0;
    this.notBefore = 0;
    this.#drop();
    byId("recorded").hidden = !this.settings.recorded;
    this.#look(performance.now());
  }

  /** The studio says whether it records voices. */
  takeMedia({ recorded }) {
    this.settings = { ...this.settings, recorded };
    byId("recorded").hidden = !recorded;
    this.notice(recorded ? "The studio records voices from now on." : "Voices are no longer recorded.");
  }

  rights({ rights, muted }) {
    this.maySpeak = rights.includes("speak");
    const button = byId("microphone");
    button.hidden = !this.maySpeak && !muted;
    button.disabled = !this.maySpeak;
    button.title = muted ? "The operator has muted you" : "Speak, or be silent (N)";
    if (!this.maySpeak && this.microphone.isOn) this.#silence();
  }

  setList(list) {
    this.list = list;
    this.#mark();
  }

  /** Who speaks, as the studio hears it. */
  takeSpeaking({ people }) {
    this.speaking = new Set(people);
    this.#mark();
  }

  async takeAnswer(message) {
    const { connection } = this;
    if (connection === null) return;
    if (!message.sdp) return this.#failed();
    try {
      await connection.accept(message.sdp);
    } catch {
      if (connection === this.connection) this.#failed();
    }
  }

  takePlaces({ voices, videos }) {
    this.speakers.setOwners(voices);
    this.screens.setPlaces(videos);
  }

  /** Takes a binary message if it is voices; whether it was. */
  takeVoices(buffer) {
    if (!isVoices(buffer)) return false;
    if (!this.isConnected) this.socketVoice.take(buffer);
    return true;
  }

  get isConnected() {
    return this.connection?.state === "connected";
  }

  /** How voices come: "rtc", "socket" or "off". */
  get way() {
    if (this.isConnected) return "rtc";
    return this.#isNeeded() && canDecode() ? "socket" : "off";
  }

  async toggleMicrophone() {
    if (this.microphone.isOn) return this.#silence();
    if (!this.maySpeak) return;
    this.speakers.start();
    try {
      await this.microphone.start();
    } catch (error) {
      return this.notice(error.message);
    }
    byId("microphone").setAttribute("aria-pressed", "true");
    await this.#route();
    this.#look(performance.now());
  }

  /** Puts every voice at its speaker's head, heard from a camera. */
  step(now, camera) {
    this.speakers.step(camera);
    if (now - this.lookedAt > LOOK_MS) this.#look(now);
  }

  #silence() {
    this.microphone.stop();
    byId("microphone").setAttribute("aria-pressed", "false");
    this.#route();
    this.#look(performance.now());
  }

  /** The microphone goes over the one way that there is. */
  async #route() {
    const { track } = this.microphone;
    await this.connection?.speak(track).catch(() => {});
    if (track !== null && !this.isConnected) await this.socketVoice.speak(this.microphone.stream);
    else this.socketVoice.silence();
  }

  #isNeeded() {
    const isHeard = this.list.some((person) => person.id !== this.you && person.microphone);
    return this.microphone.isOn || isHeard || this.surfaces.boards.size > 0;
  }

  #look(now) {
    this.lookedAt = now;
    if (!this.link.isOpen) return;
    const { connection } = this;
    const isNeeded = this.#isNeeded();
    if (isNeeded) {
      this.neededAt = now;
      this.speakers.start();
    }
    if (connection !== null && now - this.neededAt > UNUSED_MS) {
      this.#drop();
      this.link.say({ kind: "offer", sdp: "" });
    } else if (connection === null) {
      if (isNeeded && this.settings.rtc && now >= this.notBefore) this.#connect();
    } else if (connection.state === "connected") {
      this.tries = 0;
    } else if (now - connection.changedAt > (connection.wasConnected ? BROKEN_MS : LATE_MS)) {
      this.#failed();
    }
    this.screens.step(now, this.isConnected);
    this.#tell();
    const isSlow = isNeeded && !this.isConnected && (this.isBlocked || !this.settings.rtc);
    byId("slow").hidden = !isSlow;
    byId("slow").title = this.settings.why || "This network lets no WebRTC through; it is tried again";
    byId("slow").textContent = canDecode() || !isSlow ? "voice and surfaces over the slower way"
      : "no voice: this browser and network let none through";
  }

  #connect() {
    if (!window.RTCPeerConnection) {
      this.isBlocked = true;
      this.notBefore = Infinity;
      return;
    }
    this.connection = new Connection(this.settings, {
      send: (sdp) => this.link.say({ kind: "offer", sdp }),
      track: (kind, place, track) => {
        if (kind === "audio") this.speakers.listenTo(place, track);
        else this.screens.show(place, track);
      },
      changed: () => this.#changed(),
    });
    this.connection.offer(this.microphone.track).catch(() => this.#failed());
  }

  #changed() {
    if (this.connection === null) return;
    if (this.connection.state === "failed" || this.connection.state === "closed") this.#failed();
    if (this.isConnected) this.isBlocked = false;
    this.#route();
    this.#look(performance.now());
  }

  #failed() {
    const wait = WAITS_MS[Math.min(this.tries, WAITS_MS.length - 1)];
    this.tries += 1;
    this.isBlocked = true;
    this.notBefore = performance.now() + wait;
    this.#drop();
    this.link.say({ kind: "offer", sdp: "" });
    this.#route();
  }

  #drop() {
    const { connection } = this;
    this.connection = null;
    connection?.close();
    this.screens.clear();
    this.speakers.forgetPlaces();
    this.#route();
  }

  #tell() {
    const said = { kind: "media", voice: this.way, microphone: this.microphone.isOn,
      videos: this.screens.shown() };
    const text = JSON.stringify(said);
    if (text === this.told) return;
    this.told = text;
    this.link.say(said);
  }

  #mark() {
    for (const person of this.list) {
      const isSpeaking = this.speaking.has(person.id);
      this.people.setSpeaking(person.id, isSpeaking);
      const row = this.panel.rows.get(person.id);
      if (row) row.dataset.voice = isSpeaking ? "speaks" : person.microphone ? "on" : "";
      if (person.id === this.you) byId("microphone").classList.toggle("speaks", isSpeaking);
    }
    this.changed();
  }
}
