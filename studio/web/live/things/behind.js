// Splats that are hidden behind a headset's surfaces: of copies, not of the room. All splats of a page
// are drawn at once, over a picture whose depth the surfaces have left; so each splat of a copy is looked
// up in a depth map of the surfaces from the eye as Spark works the splats out, at each new view.
import * as THREE from "three";
import { dyno } from "@sparkjsdev/spark";

const MAP_PX = 512; // 2.5 mm a metre away over 62°: finer than a headset's mesh
const SLACK_M = 0.02; // what stands on a surface is not in it: about the mesh's own error

export class Behind {
  /** `room`: the live room, with `hidden`, camera and renderer. */
  constructor(room) {
    this.room = room;
    this.target = new THREE.WebGLRenderTarget(MAP_PX, MAP_PX, {
      depthTexture: new THREE.DepthTexture(MAP_PX, MAP_PX, THREE.UnsignedIntType) });
    this.mesh = new THREE.Mesh(room.hidden.geometry, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
    this.mesh.frustumCulled = this.mesh.matrixAutoUpdate = this.mesh.matrixWorldAutoUpdate = false;
    this.scene = new THREE.Scene().add(this.mesh);
    this.map = dyno.dynoSampler2D(this.target.depthTexture);
    this.clipFromWorld = dyno.dynoMat4(new THREE.Matrix4());
    this.depths = dyno.dynoVec3(new THREE.Vector3()); // of the projection, and 1 where there is a map
    this.version = -1; // of the surfaces in the map
  }

  /** Makes splats of a copy, in the world's axes, unseen where they are behind. */
  modifier() {
    return dyno.dynoBlock({ gsplat: dyno.Gsplat }, { gsplat: dyno.Gsplat }, ({ gsplat }) => {
      const { center, opacity } = dyno.splitGsplat(gsplat).outputs;
      const { seen } = new dyno.Dyno({
        inTypes: { center: "vec3", map: "sampler2D", clip: "mat4", depths: "vec3" },
        outTypes: { seen: "float" },
        inputs: { center, map: this.map, clip: this.clipFromWorld, depths: this.depths },
        statements: ({ inputs, outputs }) => dyno.unindentLines(`
          ${outputs.seen} = 1.0;
          vec4 placeInClip = ${inputs.clip} * vec4(${inputs.center}, 1.0);
          vec2 placeInMap = 0.5 + 0.5 * placeInClip.xy / placeInClip.w;
          bool isInMap = placeInClip.w > 0.0 && all(equal(placeInMap, clamp(placeInMap, 0.0, 1.0)));
          if (${inputs.depths}.z > 0.5 && isInMap) {
            float deep = 2.0 * texture(${inputs.map}, placeInMap).r - 1.0;
            float surfaceMetres = ${inputs.depths}.y / (deep + ${inputs.depths}.x);
            if (deep < 1.0 && placeInClip.w > surfaceMetres + ${SLACK_M}) ${outputs.seen} = 0.0;
          }`),
      }).outputs;
      return { gsplat: dyno.combineGsplat({ gsplat, opacity: dyno.mul(opacity, seen) }) };
    });
  }

  /** Draws the map from the eye where there are surfaces and copies; whether splats must be worked out
      anew although neither the view nor they have moved. */
  step(hasCopies) {
    const { room, depths } = this;
    const { hidden, renderer, camera } = room;
    const isOn = hasCopies && hidden.cells.size > 0;
    const wasOn = depths.value.z > 0.5;
    const isNew = isOn !== wasOn || (isOn && this.version !== hidden.version);
    depths.value.setZ(isOn ? 1 : 0);
    if (!isOn) return isNew;
    this.version = hidden.version;
    camera.updateWorldMatrix(true, false);
    const { elements } = camera.projectionMatrix;
    depths.value.setX(elements[10]).setY(elements[14]);
    this.clipFromWorld.value.copy(camera.matrixWorld).invert().premultiply(camera.projectionMatrix);
    this.mesh.matrixWorld.copy(room.upright.matrixWorld);
    const [before, isXr] = [renderer.getRenderTarget(), renderer.xr.enabled];
    renderer.xr.enabled = false;
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.render(this.scene, camera);
    renderer.setRenderTarget(before);
    renderer.xr.enabled = isXr;
    return isNew;
  }
}
