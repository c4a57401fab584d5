// What the studio's session panel shows of a headset: worn or not, pictures a second, battery. A browser
// without a headset says nothing.

const SAY_MS = 2000;
const SEEN_MS = 1000; // a headset that has not known for so long where it is, is not worn
const MODELS = /\b(Quest(?: (?:Pro|\d\w?))?|PICO \w+|Vision Pro)\b/i;

export class Device {
  /** `headset`: what one enters, with the time at which it knew last where it is. */
  constructor(link, headset) {
    Object.assign(this, { link, headset });
    this.model = navigator.userAgent.match(MODELS)?.[0] ?? "";
    this.isHeadset = false;
    this.battery = null; // the browser's, where it has one
    this.pictures = 0;
    this.saidAt = performance.now();
    this.said = null; // the last message
    this.#look();
  }

  /** Counts a picture, and says how the headset is from time to time. */
  step(now) {
    this.pictures += 1;
    const elapsed = now - this.saidAt;
    const immersion = this.#immersion();
    const hasTurned = this.said !== null && immersion !== this.said.immersion;
    if (!this.isHeadset || (elapsed < SAY_MS && !hasTurned)) return;
    const { session, steppedAt } = this.headset;
    const isSeen = session?.visibilityState === "visible" && now - steppedAt < SEEN_MS;
    // Of a rate that was counted over half a way of showing, nothing is said.
    const hz = immersion === "none" || hasTurned ? null : Math.round((10_000 * this.pictures) / elapsed) / 10;
    const level = this.battery?.level;
    this.said = { kind: "device", model: this.model, immersion, worn: isSeen, hz,
      battery: Number.isFinite(level) ? Math.round(100 * level) : null,
      charging: this.battery?.charging ?? false };
    Object.assign(this, { pictures: 0, saidAt: now });
    if (this.link.isOpen) this.link.say(this.said);
  }

  #immersion() {
    if (!this.headset.isOn) return "none";
    return this.headset.isAr ? "ar" : "vr";
  }

  async #look() {
    const modes = ["immersive-vr", "immersive-ar"];
    const found = await Promise.all(modes.map((mode) =>
      navigator.xr?.isSessionSupported(mode).catch(() => false)));
    this.isHeadset = found.some(Boolean);
    if (this.isHeadset) this.battery = await navigator.getBattery?.().catch(() => null) ?? null;
  }
}
