// What moves elsewhere is shown a little later than it comes, so that there is always a next moment
// to move towards. No drawing and no clock here: times are milliseconds that the caller gives.

const USUAL_MS = 33;
const MIN_SPACING_MS = 8;
const MAX_SPACING_MS = 120;
const LEARN = 0.1;
const FORGET = 0.02; // of how much later a message came than the quickest: a route may get longer
const BEHIND = 2; // moments; one is lost or late now and then
const MOST = 16;

/** When what was sent is shown: learns how far two clocks are apart, and how often messages come. */
export class Pacer {
  constructor() {
    this.apart = null; // of the sender's clock and ours, by the quickest message
    this.spacing = USUAL_MS;
    this.lastSent = null;
  }

  /** Takes note of a message that was sent and came at these times. */
  note(sent, came) {
    const apart = came - sent;
    this.apart = this.apart === null || apart < this.apart
      ? apart : this.apart + FORGET * (apart - this.apart);
    const since = this.lastSent === null ? USUAL_MS : sent - this.lastSent;
    this.lastSent = sent;
    if (since <= 0 || since > 2 * MAX_SPACING_MS) return; // after a rest
    const bounded = Math.min(Math.max(since, MIN_SPACING_MS), MAX_SPACING_MS);
    this.spacing += LEARN * (bounded - this.spacing);
  }

  /** The sender's time that is shown at a time of ours. */
  shown(now) {
    return this.apart === null ? -Infinity : now - this.apart - BEHIND * this.spacing;
  }
}

/** The last moments of one object or person. */
export class Timeline {
  constructor(pacer) {
    this.pacer = pacer;
    this.moments = []; // [sent, value], oldest first
  }

  /** Takes what was so at a time of the sender; what is older than the newest is left out. */
  push(sent, value) {
    const last = this.moments.at(-1);
    if (last !== undefined && sent <= last[0]) return;
    const { spacing } = this.pacer;
    // Nothing is sent of what rests: it rested until just before this.
    if (last !== undefined && sent - last[0] > 3 * spacing) {
      this.moments.push([sent - spacing, last[1]]);
    }
    this.moments.push([sent, value]);
    if (this.moments.length > MOST) this.moments.splice(0, this.moments.length - MOST);
  }

  /** [a, b, share]: the moments around what is shown at a time of ours; null before the first. */
  at(now) {
    const shown = this.pacer.shown(now);
    const { moments } = this;
    if (!moments.length) return null;
    let i = moments.length - 1;
    while (i > 0 && moments[i][0] > shown) i -= 1;
    const [from, a] = moments[i];
    const next = moments[i + 1];
    if (next === undefined || shown <= from) return [a, a, 0];
    return [a, next[1], (shown - from) / (next[0] - from)];
  }

  /** Whether what is shown will still change without anything coming. */
  isMoving(now) {
    const found = this.at(now);
    return found !== null && this.moments.at(-1)[1] !== found[0];
  }

  clear() {
    this.moments = [];
  }
}
