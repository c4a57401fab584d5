"""The native crate; called through the modules that `pyproject.toml` names."""

from collections.abc import Mapping, Sequence
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

_Picture = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]

class Lens(TypedDict):
    """A camera; a fisheye of the first focal length if `max_angle` is given, else a pinhole.

    `distortion` makes the fisheye one of Kannala and Brandt.
    """

    size: tuple[int, int]
    focal: tuple[float, float]
    centre: tuple[float, float]
    max_angle: float | None
    distortion: tuple[float, float, float, float] | None

class Draw(TypedDict):
    """What to draw; `backdrop` and `tile_mask` are flat, and the former replaces `background`."""

    background: tuple[float, float, float]
    backdrop: NDArray[np.float32] | None
    region: tuple[int, int, int, int] | None
    tile_mask: NDArray[np.bool_] | None
    near: float
    antialias: bool
    sh_degree: int
    exact_above: float
    threads: int
    marked: int | None

class PreparedCloud:
    """A splat cloud prepared for drawing; all arrays flat and C-contiguous."""

    def __init__(
        self,
        means: NDArray[np.float32],
        scales: NDArray[np.float32],
        rotations: NDArray[np.float32],
        opacities: NDArray[np.float32],
        sh: NDArray[np.float32],
    ) -> None: ...
    @property
    def count(self) -> int:
        """Splats that can be drawn."""

    @property
    def dropped(self) -> int:
        """Splats dropped because they are damaged."""

class Engine:
    """Draws prepared clouds; keeps threads and buffers between pictures."""

    def __init__(self, *, portable: bool = False, instructions: str | None = None) -> None: ...
    @staticmethod
    def available() -> list[str]:
        """Instruction sets this machine has, the narrowest first."""

    @property
    def simd(self) -> str:
        """Instruction set in use."""

    def reach(
        self,
        clouds: Sequence[PreparedCloud],
        camera_from_object: NDArray[np.float64],
        *,
        lens: Lens,
        draw: Draw,
    ) -> tuple[int, int, int, int] | None:
        """Left, top, right and bottom of a part outside which nothing is drawn, in pixels."""

    def render(
        self,
        clouds: Sequence[PreparedCloud],
        camera_from_object: NDArray[np.float64],
        *,
        lens: Lens,
        draw: Draw,
        picture: _Picture,
    ) -> None:
        """Draw over flat rgb, alpha, depth, ids; `camera_from_object` (M, 12), row-major 3×4."""

class Alone:
    """A cloud drawn alone on black through one camera; `camera_from_world` is row-major 3×4."""

    def __init__(
        self,
        engine: Engine,
        cloud: PreparedCloud,
        camera_from_world: Sequence[float],
        *,
        lens: Lens,
        draw: Draw,
    ) -> None: ...

_ObjectGradients = tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    tuple[float, float, float, float, float, float],
]

class Tape:
    """A picture drawn by `Differentiator.record`, ready to be differentiated."""

    def gradients(
        self, d_rgb: NDArray[np.float32], d_alpha: NDArray[np.float32], d_depth: NDArray[np.float32]
    ) -> list[_ObjectGradients]:
        """Per object: flat gradients of means, scales, rotations, opacities, sh, and a twist."""

class Probe:
    """The stages of a recorded picture, each to be timed from outside; for benchmarks.

    Each stage needs those above it to have run. Threads are the recording's, but where it says so.
    """

    def __init__(self, tape: Tape) -> None: ...
    def project(self) -> None:
        """Cull and project."""

    def sort(self) -> None:
        """Sort what `project` found by depth; call it once after each `project`."""

    def bin(self) -> None:
        """List the splats of every tile."""

    def blend(self, instructions: str) -> None:
        """Blend every tile on one thread with a kernel of `Engine.available`; keeps nothing."""

    def count_lanes(self, instructions: str) -> tuple[int, int]:
        """Samples that `blend` changes a pixel with, and all lanes of its registers."""

    def draw(self) -> None:
        """Blend the picture with the recording's threads, into memory kept for it."""

    def blend_back(
        self, d_rgb: NDArray[np.float32], d_alpha: NDArray[np.float32], d_depth: NDArray[np.float32]
    ) -> None:
        """Blend backwards; flat arrays."""

    @staticmethod
    def blend_everywhere(instructions: str, times: int) -> int:
        """Run a kernel's inner loop alone, all lanes in use; how many, 0 for "scalar"."""

class Differentiator:
    """Draws pictures that can be differentiated; keeps threads between them."""

    def __init__(self, *, instructions: str | None = None) -> None: ...
    def record(
        self,
        clouds: Sequence[PreparedCloud],
        camera_from_object: NDArray[np.float64],
        *,
        lens: Lens,
        draw: Draw,
    ) -> tuple[_Picture, Tape]:
        """As `Engine.render`; remembers how."""

class StillPicture:
    """The picture of a camera that stands still, and what it was drawn from."""

    def __init__(self, *, lens: Lens, draw: Draw) -> None: ...
    @property
    def arrays(self) -> _Picture:
        """Flat rgb, alpha, depth and ids; each update writes into these same arrays."""

    def update(
        self,
        engine: Engine,
        clouds: Sequence[PreparedCloud],
        camera_from_object: NDArray[np.float64],
        *,
        threads: int,
    ) -> NDArray[np.bool_]:
        """Draw what changed since the last update; one flag per 16×16 tile, row by row."""

_Distance = tuple[
    float,
    float,
    tuple[float, float, float],
    tuple[float, float, float],
    tuple[float, float],
]

class TrainingTarget:
    """A photo to train on; `rgb` flat, row by row."""

    def __init__(
        self,
        rgb: NDArray[np.uint8],
        *,
        size: tuple[int, int],
        bounds: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
    ) -> None: ...
    @property
    def nbytes(self) -> int:
        """Bytes held."""

    def distance(
        self,
        rgb: NDArray[np.float32],
        *,
        ssim_share: float,
        gain: tuple[float, float, float],
        bias: tuple[float, float, float],
        falloff: tuple[float, float],
    ) -> tuple[_Distance, NDArray[np.float32]]:
        """L1, 1 - SSIM, gradients by gain, bias, falloff; the one by `rgb`, laid out alike."""

class Trainee:
    """Splats in training: rows of numbers, all arrays flat and C-contiguous."""

    def __init__(
        self,
        values: NDArray[np.float32],
        first: NDArray[np.float32],
        second: NDArray[np.float32],
        steps: NDArray[np.uint32],
        error: NDArray[np.float32],
        *,
        sh_count: int,
        portable: bool = False,
    ) -> None: ...
    def rows(
        self,
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.uint32],
        NDArray[np.float32],
    ]:
        """Copies of values, first and second moments, steps, error."""

    @property
    def spent_ns(self) -> tuple[int, int, int, int]:
        """Time spent drawing, comparing, going back through the tiles, and moving the splats."""

    def step(
        self,
        target: TrainingTarget,
        camera_from_world: Sequence[float],
        rates: NDArray[np.float32],
        *,
        lens: Lens,
        draw: Draw,
        ssim_share: float,
        gain: tuple[float, float, float],
        bias: tuple[float, float, float],
        falloff: tuple[float, float],
        depth_price: float,
    ) -> _Distance:
        """One step towards `target`; `camera_from_world` is a row-major 3×4 matrix."""

class TrackOutline(TypedDict):
    """Contour points of an object; see `tracking.contour.Contour`."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    inner_px: NDArray[np.float64]
    outer_px: NDArray[np.float64]
    colours: NDArray[np.float32]

class TrackTexture(TypedDict):
    """Texture points of an object; `correlation` of them count as one."""

    points: NDArray[np.float64]
    values: NDArray[np.float32]
    slopes: NDArray[np.float32]
    correlation: float

class TrackProblem(TypedDict):
    """What a pose is measured by; see `tracking.kernels.Measurement`. Poses are 3 × 4, flat."""

    lens: Lens
    focal: float
    camera_from_world: list[float]
    outline: TrackOutline
    texture: TrackTexture | None
    centre: NDArray[np.float64]
    prior_mean: list[float]
    prior_sigma: NDArray[np.float64]
    prior_halo: float
    low_pass_px: float
    is_round: bool

class TrackLayer(TypedDict):
    """An object drawn into a rectangle of a lens picture; see `tracking.window.Layer`."""

    corner: tuple[int, int]
    size: tuple[int, int]
    rgb: NDArray[np.float32]
    alpha: NDArray[np.float32]
    nearer: NDArray[np.float32]

class SeenWindow:
    """A window of a lens picture as the solver reads it; `size` is width and height."""

    def __init__(
        self,
        live: NDArray[np.float32],
        foreground: NDArray[np.float32],
        own: NDArray[np.float32],
        hidden: NDArray[np.float32],
        size: tuple[int, int],
    ) -> None: ...
    def sample(self, pixels: NDArray[np.float64]) -> NDArray[np.float32]:
        """Foreground, own, hidden and the smoothed live colours (3) at (N, 2) pixels, flat."""

class Setting:
    """A part of the live picture, and what it would show without the object.

    `size` is width and height; the twin is `tracking.resemblance`.
    """

    def __init__(
        self,
        live: NDArray[np.float32],
        empty: NDArray[np.float32],
        free: NDArray[np.float32],
        *,
        size: tuple[int, int],
        constants: Mapping[str, float | bool],
    ) -> None: ...
    def strange(self, rgb: NDArray[np.float32], alpha: NDArray[np.float32]) -> float:
        """In how many pixels the live picture is not what a drawn object would make it."""

    def resemblance(self, rgb: NDArray[np.float32], alpha: NDArray[np.float32]) -> float:
        """How much a drawn object resembles the picture, at most 1, 0 for by chance."""

    def strange_at(
        self, alone: Alone, upright: Sequence[tuple[float, float, float, float]]
    ) -> list[float]:
        """`strange` of a cloud at each of some poses, each x, y, z (m) and yaw in the world.

        It may be drawn with a whole number of pixels each way per pixel of this picture.
        """

    def resemblance_at(
        self, alone: Alone, upright: Sequence[tuple[float, float, float, float]]
    ) -> list[float]:
        """`resemblance` of a cloud, like `strange_at`."""

class Shell:
    """An object drawn as scanned and coloured by where it faces; `facing` (N, 3) of its splats."""

    def __init__(self, scanned: Alone, compass: Alone, facing: NDArray[np.float64]) -> None: ...

class Relighter:
    """Tells in what light an object is seen; `upright` is x, y, z (m) and yaw in the world.

    The twin is `tracking.relight.LitView`.
    """

    def __init__(self, constants: Mapping[str, float | tuple[float, float]]) -> None: ...
    def light(
        self, setting: Setting, shell: Shell, upright: tuple[float, float, float, float]
    ) -> tuple[list[float], list[float]]:
        """How much lighter it is seen: on all sides and along x, y and z, and what colours add."""

    def resemblance(
        self, setting: Setting, shell: Shell, upright: tuple[float, float, float, float]
    ) -> float:
        """How much it resembles the picture in that light."""

    def relit(
        self,
        setting: Setting,
        shell: Shell,
        fine: Alone,
        upright: tuple[float, float, float, float],
    ) -> Alone:
        """The object in that light, to be drawn like `fine`."""

class ObservedWindow(TypedDict):
    """A window's pictures, see `tracking.evidence.observation.Observation`; width and height."""

    size: tuple[int, int]
    live: NDArray[np.float32]
    empty: NDArray[np.float32]
    expected: NDArray[np.float32]
    changed: NDArray[np.float32]
    foreground: NDArray[np.float32]
    room_misfit: NDArray[np.float32]
    foreign_misfit: NDArray[np.float32]
    hidden: NDArray[np.float32]
    claimed: NDArray[np.float32]
    range_m: NDArray[np.float32]
    in_any_light: bool

class KernelDrawing(TypedDict):
    """Clouds that a kernel draws itself, by whom, through which lens and how."""

    engine: Engine
    clouds: list[PreparedCloud]
    lens: Lens
    draw: Draw

class ComparedBody(TypedDict):
    """An object: the corners of its box (m, its own frame), and by level what is drawn of it.

    A level is drawn as scanned, and coloured by where it faces.
    """

    corners: list[list[float]]
    radius_m: float
    levels: list[tuple[PreparedCloud, PreparedCloud]]

class ComparedPoses(TypedDict):
    """Poses: (N, 12) row-major 3×4, radii in px of the window, and levels; and how to compare.

    The constants are those of `tracking.likelihood.drawn_object` and `pose_likelihood`.
    """

    camera_from_object: NDArray[np.float64]
    radius_px: NDArray[np.float64]
    level: list[int]
    margin_px: float
    ring: float
    fine_px: int
    reach: float
    shared_px: float
    shared_m: float
    sigma: float
    most_misfit: float
    occluded: float

class PoseLikelihood:
    """How far a window speaks for poses; the twin is `tests.twins.likelihood`."""

    def __init__(self, constants: Mapping[str, object]) -> None: ...
    def supports(
        self,
        window: ObservedWindow,
        body: ComparedBody,
        poses: ComparedPoses,
        drawing: KernelDrawing,
    ) -> list[tuple[float, float, float, float, float, float]]:
        """At each pose: nats, samples, open, matched and unknown fractions, and area in px²."""

class DrawnArrays(TypedDict):
    """An object drawn alone."""

    rgb: NDArray[np.float32]
    alpha: NDArray[np.float32]
    depth: NDArray[np.float32]

def outlined(
    drawn: DrawnArrays, *, lens: Lens, kept: Mapping[str, float | tuple[int, int]]
) -> tuple[
    tuple[int, int, int, int],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
]:
    """The outline of a drawing, and its picture at the window's own pixels; all flat.

    Left, top, width and height in the window; pixels, points (camera axes), normals, widths inside
    and outside of the contour; colours, alpha and depth.
    """

def looks(
    drawn: DrawnArrays,
    line: Mapping[str, NDArray[np.float64]],
    *,
    lens: Lens,
    kept: Mapping[str, float],
) -> tuple[
    NDArray[np.float32],
    tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float32]],
    tuple[NDArray[np.float64], NDArray[np.float32]],
    int,
]:
    """Points on a drawn object in camera axes, and how it looks there; all flat.

    Colours inside the contour; points, values and slopes of the texture; points and colours of the
    surface; pixels of the silhouette.
    """

class TrackKernels:
    """The tracker's kernels with their constants; arrays are C-contiguous unless it is said."""

    def __init__(self, constants: Mapping[str, float | tuple[float, float]]) -> None: ...
    def change(
        self,
        live: NDArray[np.uint8],
        plate: Sequence[NDArray[np.float32]],
        noise: Sequence[NDArray[np.float32]],
        *,
        lens_size: tuple[int, int],
        window: tuple[int, int, int, int],
        shrink: int,
        exposure: list[list[float]],
        layers: list[TrackLayer],
        table: NDArray[np.float32],
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        SeenWindow,
    ]:
        """Live picture, foreground, own colours, what is hidden, flat, and all for the solver.

        Plate and noise come in parts, one below the other; rows may be apart, their values may not.
        """

    def refine(
        self,
        window: SeenWindow,
        problem: TrackProblem,
        start: list[float],
        halo: float,
        *,
        rounds: list[tuple[float, int]],
    ) -> tuple[list[float], float, list[float]]:
        """A pose after Gauss-Newton, its halo and the information (7 × 7, flat)."""

    def edges(
        self,
        window: SeenWindow,
        problem: TrackProblem,
        pose: list[float],
        halo: float,
        *,
        reach_px: float,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Distance, its standard deviation, found and hidden of the edge at every contour point."""

    def judge(
        self,
        window: SeenWindow,
        problem: TrackProblem,
        pose: list[float],
        halo: float,
        *,
        surface: NDArray[np.float64],
        colours: NDArray[np.float32],
        is_textured: bool,
    ) -> list[float]:
        """How well a window supports a pose: the eight of `tracking.judgement.Judgement`."""

class RoomLearner:
    """Learns the empty room from live pictures; see `tracking.learn`."""

    def __init__(self, constants: Mapping[str, float | tuple[float, float]]) -> None: ...
    def learn(
        self,
        live: NDArray[np.uint8],
        plate: NDArray[np.float32],
        learned: NDArray[np.bool_],
        usable: NDArray[np.bool_],
        *,
        lens_size: tuple[int, int],
        top: int,
        exposure: list[list[float]],
        sides: tuple[int, int, int],
        level: float,
        is_cautious: bool,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
        """New plate, noise and what was ever learned of whole rows, flat.

        The rows of `live` may be apart; `sides` are those of `tracking.learn.surroundings`; a mean
        difference above `level` is a thing.
        """

def swept_depth(
    grey: NDArray[np.uint8],
    others: Sequence[tuple[NDArray[np.uint8], Sequence[float], Sequence[float]]],
    *,
    inverse: tuple[float, float, int],
    prices: tuple[int, int, int],
    margin: float,
    noise: float,
) -> NDArray[np.float32]:
    """Inverse depth of a photo's pixels by others, flat, 0 where it is not known.

    Args:
        grey: (H, W).
        others: photos, the (3, 3) turn of (x, y, 1) into their pixels, row by row, and the shift to
            be added to it per unit of inverse depth; whole numbers are pixel centres.
        inverse: the first inverse depth that is tried, the step, and how many.
        prices: of a neighbour at the next depth, at any other, and the difference of grey levels
            that halves the latter.
        margin: share by which all other depths have to cost more than the best.
        noise: grey levels by which neighbours differ without being brighter or darker.
    """

def cut_out(
    picture: NDArray[np.float32],
    centres: NDArray[np.float64],
    *,
    lens: Lens,
    world_from_lens: list[float],
    side: int,
    half_m: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Colours, own foreground and what is free at some places, flat; see `tracking.templates`."""

def exposure(
    plate: NDArray[np.float64],
    radius2: NDArray[np.float64],
    seen: NDArray[np.float64],
    rounds: int,
) -> tuple[float, float, float]:
    """Gain, falloff and offset of one channel."""

def patch_means(
    live: NDArray[np.uint8], corners: NDArray[np.int64], side: int
) -> NDArray[np.float32]:
    """Mean RGB, 0..1, flat, of squares whose left and top are in `corners`."""

def contour(
    drawn: DrawnArrays,
    *,
    lens: Lens,
    limit: int,
    reach_px: float,
) -> tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float32],
]:
    """Points in camera axes, normals, widths inside and outside, colours, all flat."""

class PortraitArrays(TypedDict):
    """A live picture of an object, and how its camera sees what the drawing's camera sees."""

    shown: NDArray[np.float32]
    depth: NDArray[np.float32]
    lens: Lens
    there_from_here: list[float]
    slack_m: float
    worth: float

def laid_on(
    drawn: DrawnArrays, portrait: PortraitArrays, *, lens: Lens, least_alpha: float
) -> NDArray[np.float32]:
    """The colours of a drawing, flat, with those that a portrait knows better."""
