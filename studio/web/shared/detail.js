// How many splats of a room are drawn: all of them, or as many as keep the pictures coming while
// something moves. Where one looks they are finest: Spark chooses them from a tree of merged splats.

const LATE = 1.25; // pictures that take so much longer than wanted are too slow
const EARLY = 1.1;
const PICTURES_LATE = 12; // before fewer are drawn: a hiccup is none of the splats' doing
const PICTURES_EARLY = 90; // before more are: what was too much a second ago may be again
const [FEWER, MORE] = [0.75, 1.2];
const LEAST = 0.12; // share of the room by which it is still recognised

export class Detail {
  /** `spark` draws; `changed` is called when the picture is no longer what it should be. */
  constructor(spark, changed) {
    Object.assign(this, { spark, changed });
    this.mesh = null;
    this.share = 1;
    this.isMade = null; // a promise of the tree, once it was wanted
    this.at = -Infinity;
    this.late = 0;
    this.early = 0;
  }

  /** The room whose splats are chosen. */
  watch(mesh) {
    this.mesh = mesh;
    this.all = mesh.numSplats;
    this.isMade = null;
    this.share = 1;
    mesh.enableLod = false;
  }

  /** Before a picture at `now`; `isMoving` if the one before was drawn in the frame before,
      `wantedMs` from one to the next, `isLast` if nothing else makes them quicker. */
  before(now, { isMoving, wantedMs, isLast }) {
    const took = now - this.at;
    this.at = now;
    if (this.mesh === null) return;
    if (!isMoving) {
      this.#show(1);
      return;
    }
    this.late = took > LATE * wantedMs ? this.late + 1 : Math.max(this.late - 1, 0);
    this.early = took < EARLY * wantedMs ? this.early + 1 : 0;
    if (this.late >= PICTURES_LATE && isLast) this.#change(FEWER);
    else if (this.early >= PICTURES_EARLY) this.#change(MORE);
    this.#show(this.share);
  }

  #change(factor) {
    this.late = this.early = 0;
    this.share = Math.min(Math.max(this.share * factor, LEAST), 1);
  }

  #show(share) {
    const { mesh, spark } = this;
    if (share >= 1) {
      if (mesh.enableLod !== false) {
        mesh.enableLod = false;
        this.changed();
      }
      return;
    }
    if (this.isMade === null) this.isMade = this.#makeTree(mesh);
    if (!this.isReady) return;
    spark.lodSplatCount = Math.round(share * this.all);
    mesh.enableLod = true;
  }

  async #makeTree(mesh) {
    this.isReady = false;
    await mesh.createLodSplats();
    this.isReady = mesh === this.mesh;
  }
}
