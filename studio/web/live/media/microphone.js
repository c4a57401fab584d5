// One's own microphone: off until one switches it on, and asked for only then.

const WANTED = { audio: { echoCancellation: true, noiseSuppression: true, autoGainControl: true,
  channelCount: 1 } };
const WORDS = {
  NotAllowedError: "The browser does not let this page use the microphone. Allow it beside the address.",
  NotFoundError: "There is no microphone. Connect one, then try again.",
  NotReadableError: "Another program uses the microphone.",
};

export class Microphone {
  constructor() {
    this.stream = null;
  }

  get isOn() {
    return this.stream !== null;
  }

  get track() {
    return this.stream?.getAudioTracks()[0] ?? null;
  }

  /** Asks for it. Throws an Error whose message says what to do. */
  async start() {
    if (!navigator.mediaDevices) {
      throw new Error("The microphone needs a secure address (https). The self-test says what to do.");
    }
    try {
      this.stream = await navigator.mediaDevices.getUserMedia(WANTED);
    } catch (error) {
      throw new Error(WORDS[error.name] ?? `The microphone does not start: ${error.message}`);
    }
  }

  stop() {
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
  }
}
