// On the browser's thread of sound: a microphone's samples out, a decoded voice in. Imported by the
// page, it only says where it lies.

const MOMENT = 960; // samples: 20 ms of 48 kHz
const AHEAD = 2880; // that wait before a voice begins: 60 ms, of which a network may be late
const MOST = 9600; // that wait at most: 200 ms; of more, the oldest go

export const address = import.meta.url;

if (globalThis.registerProcessor) {
  class Capture extends AudioWorkletProcessor {
    constructor() {
      super();
      this.samples = new Float32Array(MOMENT);
      this.count = 0;
    }

    process([[input]]) {
      for (let at = 0; input && at < input.length;) {
        const part = input.subarray(at, at + MOMENT - this.count);
        this.samples.set(part, this.count);
        this.count += part.length;
        at += part.length;
        if (this.count === MOMENT) {
          this.port.postMessage(this.samples, [this.samples.buffer]);
          this.samples = new Float32Array(MOMENT);
          this.count = 0;
        }
      }
      return true;
    }
  }

  class Player extends AudioWorkletProcessor {
    constructor() {
      super();
      this.parts = [];
      this.count = 0;
      this.at = 0;
      this.isPlaying = false;
      this.port.onmessage = ({ data }) => {
        this.parts.push(data);
        this.count += data.length;
        while (this.count > MOST) this.#shift();
      };
    }

    #shift() {
      this.count -= this.parts.shift().length - this.at;
      this.at = 0;
    }

    process(_inputs, [[output]]) {
      if (!this.isPlaying && this.count >= AHEAD) this.isPlaying = true;
      if (!this.isPlaying) return true;
      let filled = 0;
      while (filled < output.length && this.parts.length) {
        const part = this.parts[0].subarray(this.at, this.at + output.length - filled);
        output.set(part, filled);
        filled += part.length;
        this.at += part.length;
        this.count -= part.length;
        if (this.at === this.parts[0].length) this.#shift();
      }
      if (filled < output.length) this.isPlaying = false; // it waits until there is enough again
      return true;
    }
  }

  registerProcessor("capture", Capture);
  registerProcessor("player", Player);
}
