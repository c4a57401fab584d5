// One connection by WebRTC: the microphone to the studio, voices and surfaces from it.

const GATHER_MS = 600; // addresses of this device alone: no server is asked for others

export class Connection {
  /** `settings`: how many voices and videos; `on`: send(sdp), track(kind, place, track), changed(). */
  constructor({ voices, videos }, on) {
    this.on = on;
    this.changedAt = performance.now();
    this.wasConnected = false;
    this.pc = new RTCPeerConnection({ iceServers: [], bundlePolicy: "max-bundle" });
    this.line = this.pc.addTransceiver("audio", { direction: "sendonly" });
    prefer(this.line, RTCRtpSender, "audio", /opus/i);
    const add = (kind, place, wanted) => {
      const line = this.pc.addTransceiver(kind, { direction: "recvonly" });
      prefer(line, RTCRtpReceiver, kind, wanted);
      on.track(kind, place, line.receiver.track);
    };
    for (let place = 0; place < voices; place++) add("audio", place, /opus/i);
    for (let place = 0; place < videos; place++) add("video", place, /vp8|rtx/i);
    this.pc.addEventListener("connectionstatechange", () => {
      this.changedAt = performance.now();
      this.wasConnected ||= this.state === "connected";
      on.changed();
    });
  }

  get state() {
    return this.pc.connectionState;
  }

  async offer(track) {
    await this.line.sender.replaceTrack(track);
    await this.pc.setLocalDescription();
    await gathered(this.pc);
    this.on.send(this.pc.localDescription.sdp);
  }

  async accept(sdp) {
    await this.pc.setRemoteDescription({ type: "answer", sdp });
  }

  /** Sends a track of the microphone, or none. */
  async speak(track) {
    if (this.state !== "closed") await this.line.sender.replaceTrack(track);
  }

  close() {
    this.on = { send() {}, track() {}, changed() {} };
    this.pc.close();
  }
}

/** Offers one codec only: the studio takes no other, and a short offer is quicker. */
function prefer(line, side, kind, wanted) {
  const codecs = side.getCapabilities?.(kind)?.codecs.filter(({ mimeType }) => wanted.test(mimeType));
  try {
    if (codecs?.length) line.setCodecPreferences?.(codecs);
  } catch {
    // The browser offers all that it has, then.
  }
}

function gathered(pc) {
  return new Promise((done) => {
    const look = () => { if (pc.iceGatheringState === "complete") done(); };
    pc.addEventListener("icegatheringstatechange", look);
    setTimeout(done, GATHER_MS);
    look();
  });
}
