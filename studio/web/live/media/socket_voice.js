// Voices over the WebSocket, where WebRTC does not get through: Opus by the browser's own codecs.
// Layouts as in `devices/hub/media/voice_wire.py`.

const VERSION = 1;
const VOICE = 5;
const VOICES = 6;
const RATE_HZ = 48000;
const MOMENT = 960; // samples: 20 ms
const HEAD_BYTES = 9;
const BIT_RATE = 32000;
const SILENT_DB = 127;
const SPEECH_DB = 60;
const HOLD_MS = 400; // what follows speech is sent for so long, then nothing until the next word
const MAX_WAITING = 8; // moments that wait for a codec; of more, the newest are left out

/** Whether this browser decodes voices by itself. */
export const canDecode = () => Boolean(window.AudioDecoder && window.AudioWorkletNode);

/** Whether a message is voices. */
export function isVoices(buffer) {
  const view = new DataView(buffer);
  return view.byteLength >= 4 && view.getUint8(0) === VERSION && view.getUint8(1) === VOICES;
}

export class SocketVoice {
  constructor(link, speakers) {
    this.link = link;
    this.speakers = speakers;
    this.players = new Map();
    this.speaking = null;
    this.seq = 0;
    this.time = 0;
    this.sent = 0;
    this.taken = 0;
  }

  /** Sends a microphone's stream from now on. */
  async speak(stream) {
    if (this.speaking?.stream === stream || !window.AudioEncoder) return;
    this.silence();
    const speaking = { stream, loudAt: -Infinity, levels: [] };
    this.speaking = speaking;
    await this.speakers.ready;
    if (this.speaking !== speaking) return;
    const { context } = this.speakers;
    speaking.encoder = new AudioEncoder({ output: (chunk) => this.#send(speaking, chunk), error() {} });
    speaking.encoder.configure({ codec: "opus", sampleRate: RATE_HZ, numberOfChannels: 1,
      bitrate: BIT_RATE, opus: { frameDuration: 20000 } });
    speaking.source = context.createMediaStreamSource(stream);
    speaking.node = new AudioWorkletNode(context, "capture", { channelCount: 1,
      channelCountMode: "explicit", outputChannelCount: [1] });
    speaking.node.port.onmessage = ({ data }) => this.#encode(speaking, data);
    // It gives silence, and is run only if somebody listens.
    speaking.source.connect(speaking.node).connect(context.destination);
  }

  silence() {
    const { speaking } = this;
    this.speaking = null;
    speaking?.source?.disconnect();
    speaking?.node?.disconnect();
    if (speaking?.encoder?.state === "configured") speaking.encoder.close();
  }

  /** Plays what has come. */
  take(buffer) {
    if (!canDecode() || this.speakers.context === null) return;
    const view = new DataView(buffer);
    let at = 4;
    for (let left = view.getUint16(2, true); left > 0 && at + 11 <= view.byteLength; left--) {
      const [index, length] = [view.getUint16(at, true), view.getUint16(at + 2, true)];
      const time = view.getUint32(at + 6, true);
      const end = at + 4 + length;
      if (end > view.byteLength || length < 8) return;
      this.#play(index, time, new Uint8Array(buffer, at + 11, end - at - 11));
      at = end;
    }
  }

  #encode(speaking, samples) {
    const { encoder } = speaking;
    const time = this.time;
    this.time = (this.time + MOMENT) >>> 0;
    if (encoder.state !== "configured" || encoder.encodeQueueSize > MAX_WAITING) return;
    const level = levelOf(samples);
    const now = performance.now();
    if (level < SPEECH_DB) speaking.loudAt = now;
    if (now - speaking.loudAt > HOLD_MS) return;
    speaking.levels.push([time, level]);
    const data = new AudioData({ format: "f32", sampleRate: RATE_HZ, numberOfFrames: MOMENT,
      numberOfChannels: 1, timestamp: Math.round(1e6 * time / RATE_HZ), data: samples });
    encoder.encode(data);
    data.close();
  }

  #send(speaking, chunk) {
    const [time, level] = speaking.levels.shift() ?? [this.time, SILENT_DB];
    const bytes = new Uint8Array(HEAD_BYTES + chunk.byteLength);
    const view = new DataView(bytes.buffer);
    this.seq = (this.seq + 1) & 0xffff;
    view.setUint8(0, VERSION);
    view.setUint8(1, VOICE);
    view.setUint16(2, this.seq, true);
    view.setUint32(4, time, true);
    view.setUint8(8, level);
    chunk.copyTo(bytes.subarray(HEAD_BYTES));
    if (this.link.sendBody(bytes)) this.sent += 1;
  }

  #play(index, time, opus) {
    const player = this.players.get(index) ?? this.#add(index);
    if (player === null || player.decoder.state !== "configured") return;
    if (player.decoder.decodeQueueSize > MAX_WAITING) return;
    this.taken += 1;
    player.decoder.decode(new EncodedAudioChunk({ type: "key", data: opus,
      timestamp: Math.round(1e6 * time / RATE_HZ) }));
  }

  #add(index) {
    this.players.set(index, null); // until the worklets are there
    this.speakers.ready.then(() => {
      const node = new AudioWorkletNode(this.speakers.context, "player", { numberOfInputs: 0,
        outputChannelCount: [1] });
      node.connect(this.speakers.inputOf(index));
      const decoder = new AudioDecoder({
        output: (data) => {
          const samples = new Float32Array(data.numberOfFrames);
          data.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
          data.close();
          node.port.postMessage(samples, [samples.buffer]);
        },
        error: () => this.players.delete(index),
      });
      decoder.configure({ codec: "opus", sampleRate: RATE_HZ, numberOfChannels: 1 });
      this.players.set(index, { node, decoder });
    }).catch(() => {});
    return null;
  }
}

/** How far below full scale samples are, dB. */
function levelOf(samples) {
  let sum = 0;
  for (const sample of samples) sum += sample * sample;
  const level = -10 * Math.log10(sum / samples.length + 1e-13);
  return Math.min(Math.max(Math.round(level), 0), SILENT_DB);
}
