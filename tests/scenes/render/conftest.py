"""Both renderers, cameras of both kinds, and clouds that are hard to draw."""

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.raster.reference.differences import drawable
from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

CAMERAS = {
    "pinhole": Pinhole.from_fov(97, 71, np.radians(70)),
    "pinhole off centre": Pinhole(90, 101, 50.0, 65.0, 20.5, 71.3),
    "telephoto": Pinhole.from_fov(64, 64, np.radians(8)),
    "fisheye 200°": Fisheye.from_fov(96, np.radians(200)),
    "fisheye 300°": Fisheye.from_fov(96, np.radians(300)),
    "fisheye cropped": Fisheye(80, 70, 45.0, 22.0, 51.0, np.radians(110)),
    "fisheye with coefficients": Fisheye(
        90, 84, 27.0, 44.0, 43.0, np.radians(105), (-0.05, 0.01, -0.004, 0.0006)
    ),
}


INSTRUCTIONS = ["scalar", "avx2", "avx512"]


def native_with(instructions: str) -> NativeRenderer:
    """The native renderer with these instructions; skips the test where there are none such."""
    available = NativeRenderer(portable=True).available_instructions()
    if instructions not in available:
        pytest.skip(f"this machine has {', '.join(available)} only")
    return NativeRenderer(instructions=instructions)


@pytest.fixture(scope="session", params=["reference", *INSTRUCTIONS])
def renderer(request):
    """Every renderer, for what they must all do."""
    if request.param == "reference":
        return ReferenceRenderer()
    return native_with(request.param)


@pytest.fixture(scope="session", params=INSTRUCTIONS)
def native(request):
    """The native renderer with each instruction set."""
    return native_with(request.param)


@pytest.fixture(scope="session")
def reference():
    """The oracle."""
    return ReferenceRenderer()


@pytest.fixture(scope="session", params=list(CAMERAS))
def camera(request):
    """Cameras of both kinds, none of them a whole number of tiles."""
    return CAMERAS[request.param]


@pytest.fixture(scope="session")
def wild_cloud() -> Callable[..., SplatCloud]:
    """make(count, degree, seed, spread_m) -> splats of 1 mm to 1 m about the origin."""

    def make(count: int, *, degree: int = 0, seed: int = 0, spread_m: float = 1.0) -> SplatCloud:
        rng = np.random.default_rng(seed)
        rotations = rng.normal(size=(count, 4))
        rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
        return SplatCloud(
            (rng.normal(size=(count, 3)) * spread_m).astype(np.float32),
            np.exp(rng.uniform(np.log(1e-3), 0.0, (count, 3))).astype(np.float32),
            rotations.astype(np.float32),
            rng.uniform(0.01, 1.0, count).astype(np.float32),
            (rng.normal(size=(count, (degree + 1) ** 2, 3)) * 0.25).astype(np.float32),
        )

    return make


@pytest.fixture(scope="session")
def ball() -> Callable[..., SplatCloud]:
    """make(mean, sigma_m, opacity, colour) -> one round splat of one colour."""

    def make(mean, *, sigma_m=0.02, opacity=0.8, colour=(1.0, 0.5, 0.25)) -> SplatCloud:
        sh = (np.array(colour) - 0.5) / SH_C0
        return SplatCloud(
            np.array([mean], dtype=np.float32),
            np.full((1, 3), sigma_m, dtype=np.float32),
            np.array([[1, 0, 0, 0]], dtype=np.float32),
            np.array([opacity], dtype=np.float32),
            sh.reshape(1, 1, 3).astype(np.float32),
        )

    return make


@pytest.fixture(scope="session")
def at_origin() -> Callable[..., tuple[PosedSplats, ...]]:
    """make(*clouds) -> the clouds, each posed at the identity."""

    def make(*clouds: SplatCloud) -> tuple[PosedSplats, ...]:
        return tuple(PosedSplats(cloud, Pose.identity()) for cloud in clouds)

    return make


@pytest.fixture(scope="session", params=["pinhole", "fisheye", "fisheye with coefficients"])
def small_lens(request):
    """Lenses for scenes small enough to be differentiated by differences."""
    if request.param == "pinhole":
        return Pinhole.from_fov(48, 40, np.radians(70))
    if request.param == "fisheye":
        return Fisheye.from_fov(48, np.radians(220))
    return Fisheye(48, 46, 13.0, 23.0, 24.0, np.radians(108), (0.04, -0.02, 0.005, -0.0004))


@pytest.fixture(scope="session")
def drawn_cloud(wild_cloud) -> Callable[..., PosedSplats]:
    """make(pose, camera, world_from_camera, options, seed) -> posed splats, all of them drawn.

    Sizes are 1 mm to 0.3 m, quaternions have any norm.
    """

    def make(
        pose: Pose,
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
        *,
        seed: int,
        count: int = 14,
    ) -> PosedSplats:
        cloud = wild_cloud(count, degree=3, seed=seed, spread_m=0.5)
        norms = np.random.default_rng(seed).uniform(0.5, 2.0, (count, 1)).astype(np.float32)
        cloud = SplatCloud(
            cloud.means,
            np.minimum(cloud.scales, 0.3),
            cloud.rotations * norms,
            cloud.opacities,
            cloud.sh,
        )
        return PosedSplats(
            cloud.select(drawable(cloud, pose, camera, world_from_camera, options)), pose
        )

    return make
