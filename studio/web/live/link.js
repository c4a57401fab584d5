// The connection to the studio: pairing by code, then a WebSocket that comes back by itself.

import { isCells } from "live/wire.js";

const PING_MS = 1000;
const SILENT_MS = 3000; // without any message a connection is given up: pongs come every second
const CONNECT_WITHIN_MS = 3000;
const SECOND_LOOK_MS = 400; // a page that draws for long reads what has come after its timers
const WAITS_MS = [200, 500, 1000];
const FULL_BYTES = 65536; // waiting to be sent: bodies are left out then
const TOKEN = "gaussiannexus.token"; // of this tab only: a reload comes back without a code

const REMEDIES = {
  403: "The code is wrong, was used already, or is older than two minutes. Ask for a new one.",
  409: "The room is full. Ask the operator to make place.",
  429: "Too many wrong codes. Wait a minute, then try again.",
  503: "The room is full. Ask the operator to make place.",
};

export class Link {
  /** `handlers`, all optional: status({ kind, words, remedy }), and by kind of message: welcome,
      people, rights, state, log, done, refused, speaking, answer, places, media, bodies(buffer),
      cells(buffer). */
  constructor(handlers) {
    this.handlers = handlers;
    this.token = sessionStorage.getItem(TOKEN);
    this.name = "";
    this.socket = null;
    this.isWanted = false;
    this.tries = 0;
    this.logSeq = null;
    this.heardAt = -Infinity;
    this.latency = null;
    this.counter = 0;
    this.timers = [];
    window.addEventListener("online", () => this.#hurry());
    document.addEventListener("visibilitychange", () => { if (!document.hidden) this.#hurry(); });
  }

  /** Trades a code for a token. Throws an Error whose message says what to do. */
  async pair(code, name) {
    let answer;
    try {
      answer = await fetch("/pair", {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ code, name }),
      });
    } catch {
      throw new Error("The studio does not answer. Is it running, and is this device in the same network?");
    }
    const said = await answer.json().catch(() => ({}));
    if (!answer.ok) {
      const why = typeof said.why === "string" ? said.why : null;
      throw new Error(why ?? REMEDIES[answer.status] ?? `The studio refused (${answer.status}).`);
    }
    this.#keep(said.token);
  }

  /** Connects, and again whenever the connection breaks, until `leave` or the studio's goodbye. */
  connect(name) {
    this.name = name;
    this.isWanted = true;
    this.tries = 0;
    this.#open();
  }

  /** Ends it for good. */
  leave(words = "You left the room.", remedy = "To come back, ask for a new code.") {
    this.isWanted = false;
    this.#keep(null);
    this.#close();
    this.#status("left", words, remedy);
  }

  get isOpen() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Asks for an operation; its number, or null without a connection. */
  do(op, fields = {}) {
    if (!this.isOpen) return null;
    this.counter += 1;
    this.#send({ kind: "do", id: this.counter, op, ...fields });
    return this.counter;
  }

  seen(version) {
    this.#send({ kind: "seen", version });
  }

  /** Sends a message of another kind. */
  say(message) {
    this.#send(message);
  }

  /** Sends a body unless older bytes still wait; whether it did. */
  sendBody(bytes) {
    if (!this.isOpen || this.socket.bufferedAmount > FULL_BYTES) return false;
    this.socket.send(bytes);
    return true;
  }

  #open() {
    this.#close();
    if (this.tries === 0) this.#status("connecting", "Connecting …", "");
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/people`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    let late = setTimeout(() => {
      late = setTimeout(() => this.#lost(socket), SECOND_LOOK_MS);
      this.timers.push(late);
    }, CONNECT_WITHIN_MS);
    this.timers.push(late);
    socket.addEventListener("open", () => {
      const known = this.logSeq === null ? {} : { log_seq: this.logSeq };
      this.#send({ kind: "hello", token: this.token, name: this.name, ...known });
    });
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.socket) return;
      clearTimeout(late);
      this.heardAt = performance.now();
      if (typeof data === "string") this.#take(JSON.parse(data));
      else if (isCells(data)) this.handlers.cells?.(data);
      else this.handlers.bodies?.(data);
    });
    socket.addEventListener("close", () => this.#lost(socket));
    socket.addEventListener("error", () => this.#lost(socket));
  }

  #take(message) {
    const { kind } = message;
    if (kind === "welcome") {
      this.#keep(message.token);
      this.logSeq = message.log_seq;
      this.tries = 0;
      this.#beat();
      this.#status("here", "Connected", "");
    } else if (kind === "pong") {
      this.latency = performance.now() - message.t_us / 1000;
      this.#status("here", "Connected", "");
      return;
    } else if (kind === "log") {
      this.logSeq = message.seq;
    } else if (kind === "token") {
      this.#keep(message.token);
      return;
    } else if (kind === "bye") {
      this.leave(`The studio said goodbye: ${message.why}.`, "To come back, ask for a new code.");
      return;
    }
    this.handlers[kind]?.(message);
  }

  #beat() {
    const { socket } = this;
    const isSilent = () => performance.now() - this.heardAt > SILENT_MS;
    const giveUp = () => { if (isSilent()) this.#lost(socket); };
    const beat = () => {
      if (isSilent()) this.timers.push(setTimeout(giveUp, SECOND_LOOK_MS));
      else this.#send({ kind: "ping", t_us: Math.round(performance.now() * 1000) });
    };
    this.timers.push(setInterval(beat, PING_MS));
    beat();
  }

  #lost(socket) {
    if (socket !== this.socket || socket === null) return;
    this.#close();
    if (!this.isWanted) return;
    const wait = WAITS_MS[Math.min(this.tries, WAITS_MS.length - 1)];
    this.tries += 1;
    this.#status("again", "Connection lost, trying again …",
      "This goes on by itself. Is the network there, is the studio running?");
    this.timers.push(setTimeout(() => this.#open(), wait));
  }

  #hurry() {
    if (this.isWanted && this.socket === null) this.#open();
  }

  #close() {
    for (const timer of this.timers) {
      clearTimeout(timer);
      clearInterval(timer);
    }
    this.timers = [];
    const { socket } = this;
    this.socket = null;
    socket?.close();
  }

  #send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  #keep(token) {
    this.token = token;
    if (token) sessionStorage.setItem(TOKEN, token);
    else sessionStorage.removeItem(TOKEN);
  }

  #status(kind, words, remedy) {
    this.handlers.status?.({ kind, words, remedy });
  }
}
