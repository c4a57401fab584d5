// The thing under a ray: primitives, proposals and live surfaces, as they are seen.
import * as THREE from "three";

const NEAR_M = 0.02;
const FAR_M = 30;

export class Picker {
  constructor(things, bodies, proposals, upright) {
    Object.assign(this, { things, bodies, proposals, upright });
    this.raycaster = new THREE.Raycaster();
    this.raycaster.near = NEAR_M;
    this.raycaster.far = FAR_M;
  }

  /** The nearest on a ray of the world, as { kind, key, metres }; null where none is. */
  hit(origin, direction) {
    this.raycaster.set(origin, direction);
    const found = [
      ...this.bodies.hits(this.raycaster).map(([key, metres]) => ({ kind: "primitive", key, metres })),
      ...this.proposals.hits(this.raycaster).map(([key, metres]) => ({ kind: "proposal", key, metres })),
      ...this.#surfaces(),
    ];
    return found.sort((a, b) => a.metres - b.metres)[0] ?? null;
  }

  /** The one nearest to a place (upright axes), within metres; null where none is. */
  near(place, metres) {
    const found = [
      ...this.things.of("primitive").map(([key]) => ["primitive", key, this.bodies.meshes.get(key)]),
      ...this.things.of("proposal").map(([key]) => ["proposal", key, this.proposals.copies.get(key)?.solid]),
    ].filter(([, , mesh]) => mesh !== undefined)
      .map(([kind, key, mesh]) => ({ kind, key, metres: this.#toBox(mesh, place) }));
    for (const [key, { corners, seen }] of this.things.of("surface")) {
      const [a, b, c, d] = (seen ?? corners).map((corner) => new THREE.Vector3(...corner));
      const ways = [new THREE.Triangle(a, b, c), new THREE.Triangle(a, c, d)].map((half) =>
        half.closestPointToPoint(place, new THREE.Vector3()).distanceTo(place));
      found.push({ kind: "surface", key, metres: Math.min(...ways) });
    }
    return found.filter((thing) => thing.metres <= metres).sort((a, b) => a.metres - b.metres)[0] ?? null;
  }

  /** Metres from a place, three numbers in upright axes, to a primitive; far where it is gone. */
  toShape(key, place) {
    const mesh = this.bodies.meshes.get(key);
    return mesh === undefined ? Infinity : this.#toBox(mesh, new THREE.Vector3(...place));
  }

  /** Metres from a place to a mesh's box. */
  #toBox(mesh, place) {
    if (mesh.geometry.boundingBox === null) mesh.geometry.computeBoundingBox();
    mesh.updateWorldMatrix(true, false);
    const world = this.upright.localToWorld(place.clone());
    const nearest = mesh.geometry.boundingBox.clampPoint(mesh.worldToLocal(world.clone()), new THREE.Vector3());
    return mesh.localToWorld(nearest).distanceTo(world);
  }

  #surfaces() {
    const { ray } = this.raycaster;
    return this.things.of("surface").flatMap(([key, { corners, seen }]) => {
      const [a, b, c, d] = (seen ?? corners).map((corner) =>
        this.upright.localToWorld(new THREE.Vector3(...corner)));
      const at = new THREE.Vector3();
      const isHit = ray.intersectTriangle(a, b, c, false, at) ?? ray.intersectTriangle(a, c, d, false, at);
      return isHit ? [{ kind: "surface", key, metres: at.distanceTo(ray.origin) }] : [];
    });
  }
}
