// How fine the picture is: coarser while something moves on a slow computer, full at rest.

const STEPS = [1, 0.7, 0.5, 0.35];
const SLOW_MS = 70;
const QUICK_MS = 22;
const REST_MS = 300;

export class Sharpness {
  constructor(renderer) {
    this.renderer = renderer;
    this.full = Math.min(window.devicePixelRatio, 2);
    this.step = 0;
    this.shown = 0;
    this.drawnAt = -Infinity;
  }

  /** Before a picture at `now`; `moving` if the one before was drawn in the frame before. */
  before(now, moving) {
    const took = now - this.drawnAt;
    if (moving && took > SLOW_MS) this.step = Math.min(this.step + 1, STEPS.length - 1);
    if (moving && took < QUICK_MS) this.step = Math.max(this.step - 1, 0);
    this.#show(moving ? this.step : 0);
    this.drawnAt = now;
  }

  /** Whether pictures are as coarse as they get. */
  get isCoarsest() {
    return this.step === STEPS.length - 1;
  }

  /** Whether nothing has moved for long enough to draw the last picture again, in full. */
  isDue(now) {
    return this.shown > 0 && now - this.drawnAt > REST_MS;
  }

  #show(step) {
    if (step === this.shown) return;
    this.shown = step;
    this.renderer.setPixelRatio(this.full * STEPS[step]);
  }
}
