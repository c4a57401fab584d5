"""How exactly live surfaces lie on what they show: corners against the truth, two ways.

The true corners of boards and posters come from the room's meshes. Once the camera has found its
own pose, each corner's place in the lens picture is compared with the true one. The surface's
picture, made from noisy compressed video, is also registered to what is painted on the mesh: that
needs no pose at all, adds a tenth of a pixel of its own and has no bar: it confirms the first
figure. Corners clicked in the lens picture are compared in the room.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, film_messages
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.flat_faces import FlatFaces
from devices.messages import Frame
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from scenes.splats import SplatCloud
from scenes.state import LiveSurface
from studio.console.rows import Row, at_most
from tracking.surfaces.corners import corners_from_clicks
from tracking.surfaces.live import SurfacePicture, SurfacesState, step
from tracking.surfaces.view import native_size_px

SCENE = "lab"
TOWARDS: Mapping[str, tuple[float, float, float]] = {
    "whiteboard": (-1.05, 2.5, 1.5),
    "screen": (1.1, 2.46, 1.22),
    "landscape": (3.0, 0.62, 1.62),
    "shapes": (3.0, -0.12, 1.62),
    "title": (1.0, -2.5, 1.62),
    "tall shapes": (1.85, -2.5, 1.62),
}
"""Places on the boards and posters, world metres; their corners are found in the meshes."""

FRAMES, FRAME_NS = 2, 100_000_000
TIMED_STEPS = 30
CLICK_PX = 0.5
"""Standard deviation of a click, in lens pixels."""

BAR_PX = 2.0

REGISTERED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-7)
ECC_BLUR_PX = 5
ECC_ROUNDS = 3
"""What one registration leaves of a shift, for the pictures' borders, the next one finds."""

MIN_CORRELATION = 0.8
"""A registration that fits worse has not found the picture."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A frame, with the camera where a method says it is and where it truly is."""

    frame: Frame
    world_from_rig: Pose
    true_world_from_rig: Pose

    def lens_px(self, points: NDArray[np.float64], lens: int) -> NDArray[np.float64]:
        """(N, 2) where the method takes world points to be in a lens picture."""
        return _in_lens(self.frame, self.world_from_rig, lens, points)

    def true_lens_px(self, points: NDArray[np.float64], lens: int) -> NDArray[np.float64]:
        """(N, 2) where they are."""
        return _in_lens(self.frame, self.true_world_from_rig, lens, points)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One surface in one seed, by one method's camera pose.

    Attributes:
        corner_px: (4,) how far each corner is off in the lens picture.
        registered_px: (4,) the same by registration; NaN if it failed.
        clicked_mm: (4,) how far clicked corners are off in the room.
        picture: what is shown.
        painting: what should be.
    """

    corner_px: NDArray[np.float64]
    registered_px: NDArray[np.float64]
    clicked_mm: NDArray[np.float64]
    picture: NDArray[np.uint8]
    painting: NDArray[np.uint8]


Results = Mapping[str, Mapping[str, list[Shown]]]
"""By method, by surface, one a seed."""


def evaluate(asked: Asked) -> Findings:
    """Start a session, once a seed, with a wrong camera pose, and make every board a surface."""
    room = sample_room(SCENE)
    scene = open_scene(SCENE)
    faces = FlatFaces(room)
    trial = Trial(scene, asked.methods)
    poses = standing({item.object_id: item.world_from_object for item in room.objects})
    taken = [Shot(k * FRAME_NS, poses) for k in range(FRAMES)]
    shown: dict[str, dict[str, list[Shown]]] = {
        name: defaultdict(list[Shown]) for name in asked.methods
    }
    step_ms = float("inf")
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            for method, look in _looks(film_set, trial, taken, asked, seed).items():
                surfaces = _surfaces(faces, look)
                _, pictures = step(SurfacesState(), look.frame, surfaces, look.world_from_rig)
                hand = np.random.default_rng([seed, 43])
                for surface, seen in zip(surfaces, pictures, strict=True):
                    judged = _judged(look, surface, seen, faces, _clicker(look, scene.room, hand))
                    shown[method][surface.surface_id].append(judged)
                step_ms = min(step_ms, _step_ms(surfaces, look))
    return _report(shown, step_ms)


def _looks(
    film_set: FilmSet, trial: Trial, taken: list[Shot], asked: Asked, seed: int
) -> Mapping[str, Look]:
    """The last frame of a take, as each method has it."""
    states = trial.start()
    looks: Mapping[str, Look] = {}
    for message in film_messages(film_set, taken, asked, seed=seed, what=f"{SCENE}, boards"):
        states, answers = trial.step(states, message)
        looks = {name: _look(message.frame, answer) for name, answer in answers.items()}
    return looks


def _look(frame: Frame, answer: Answer) -> Look:
    known = answer.world_from_rig or frame.world_from_rig
    assert known is not None  # a take is played with a known pose
    return Look(frame, known, answer.truth.world_from_rig)


def _surfaces(faces: FlatFaces, look: Look) -> list[LiveSurface]:
    """The true boards, as fine as the lenses see them."""
    surfaces = []
    for name, place in TOWARDS.items():
        corners = faces.rectangle_towards(place)
        size = native_size_px(quad_of(corners), look.frame.rig, look.world_from_rig)
        surfaces.append(LiveSurface(name, corners, size, look.frame.stream_id))
    return surfaces


def _judged(
    look: Look, surface: LiveSurface, seen: SurfacePicture, faces: FlatFaces, click: Clicker
) -> Shown:
    """One surface against the truth.

    Raises:
        ValueError: no lens sees it.
    """
    if seen.lens is None:
        raise ValueError(f"surface {surface.surface_id!r}: no lens sees it, so it is no test")
    corners, quad = surface.corners_in_world, quad_of(surface.corners_in_world)
    apart = look.lens_px(corners, seen.lens) - look.true_lens_px(corners, seen.lens)
    painting = faces.painting(quad, surface.size_px)
    places, _ = quad.points(registered_corners(painting, seen.picture))
    moved = look.lens_px(places, seen.lens) - look.lens_px(corners, seen.lens)
    clicked = click(corners, seen.lens)
    return Shown(
        np.linalg.norm(apart, axis=1),
        np.linalg.norm(moved, axis=1),
        1000.0 * np.linalg.norm(clicked - corners, axis=1),
        seen.picture,
        painting,
    )


def registered_corners(
    painting: NDArray[np.uint8], picture: NDArray[np.uint8]
) -> NDArray[np.float64]:
    """(4, 2) where a painting's corners are in a picture of it, 0..1 across the picture.

    By the affine map under which the two correlate best (ECC): a camera pose that is a little off
    does no more, and a homography's corners would swing where a painting is plain. NaN where the
    correlation of the two is below `MIN_CORRELATION`.
    """
    greys = [cv2.cvtColor(p, cv2.COLOR_RGB2GRAY) for p in (painting, picture)]
    height, width = painting.shape[:2]
    everywhere = np.full((height, width), 255, np.uint8)
    total, correlation = np.eye(3), 0.0
    for _ in range(ECC_ROUNDS):
        aligned_so_far = cv2.warpAffine(
            greys[1], total[:2], (width, height),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        still = np.eye(2, 3, dtype=np.float32)
        try:
            correlation, still = cv2.findTransformECC(
                greys[0], aligned_so_far, still, cv2.MOTION_AFFINE, REGISTERED, everywhere,
                ECC_BLUR_PX,
            )  # fmt: skip
        except cv2.error:
            return np.full((4, 2), np.nan)
        total = total @ np.vstack([np.asarray(still, dtype=np.float64), [0.0, 0.0, 1.0]])
    if correlation < MIN_CORRELATION:
        return np.full((4, 2), np.nan)
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float64)
    # OpenCV counts from the middle of the first pixel.
    moved = (corners - 0.5) @ total[:2, :2].T + total[:2, 2] + 0.5
    return moved / (width, height)


Clicker = Callable[[NDArray[np.float64], int], NDArray[np.float64]]
"""True corners and a lens in; the corners that somebody gets by clicking them in its picture."""


def _clicker(look: Look, room: SplatCloud, rng: np.random.Generator) -> Clicker:
    def click(corners: NDArray[np.float64], lens: int) -> NDArray[np.float64]:
        clicks = look.true_lens_px(corners, lens) + rng.normal(scale=CLICK_PX, size=(4, 2))
        rig = look.frame.rig
        return corners_from_clicks(clicks, lens, rig, look.world_from_rig, room, NativeRenderer())

    return click


def _in_lens(
    frame: Frame, world_from_rig: Pose, lens: int, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    world_from_lens = world_from_rig @ frame.rig.rig_from_lens[lens]
    return frame.rig.lenses[lens].project(world_from_lens.inverse() @ points)[0]


def _step_ms(surfaces: list[LiveSurface], look: Look) -> float:
    """Processor milliseconds a surface and frame: the quickest of many steps."""
    frame, pose = look.frame, look.world_from_rig
    state, _ = step(SurfacesState(), frame, surfaces, pose)
    quickest = float("inf")
    for _ in range(TIMED_STEPS):
        began = time.process_time_ns()
        state, _ = step(state, frame, surfaces, pose)
        quickest = min(quickest, (time.process_time_ns() - began) / 1e6)
    return quickest / len(surfaces)


def _report(results: Results, step_ms: float) -> Findings:
    findings = Findings()
    for method, surfaces in results.items():
        seen = [shown for every in surfaces.values() for shown in every]
        corner = np.concatenate([shown.corner_px for shown in seen])
        registered = np.concatenate([shown.registered_px for shown in seen])
        clicked = np.concatenate([shown.clicked_mm for shown in seen])
        bar = own_bar(method, BAR_PX)
        for name, values, limit in (
            ("corner_px", corner, bar),
            ("registered_px", registered, None),
        ):
            full = row_name(method, f"surface.{name}")
            findings.rows.append(at_most(full, float(np.nanmean(values)), "px", bar=limit))
            findings.rows.append(at_most(f"{full}.max", float(np.nanmax(values)), "px", bar=limit))
        unregistered = float(np.isnan(registered).mean())
        findings.rows.append(Row(row_name(method, "surface.unregistered"), unregistered, ""))
        findings.rows.append(
            Row(row_name(method, "surface.clicked_mm"), float(clicked.mean()), "mm")
        )
        lines = [["surface", "px", "corner px", "max", "registered px", "max", "clicked mm", "max"]]
        for name, every in surfaces.items():
            height, width = every[0].picture.shape[:2]
            columns = [
                np.concatenate([getattr(shown, column) for shown in every])
                for column in ("corner_px", "registered_px", "clicked_mm")
            ]
            cells = [f"{f(values):.2f}" for values in columns for f in (np.nanmean, np.nanmax)]
            lines.append([name, f"{width}×{height}", *cells])
        findings.text.append(f"surfaces: {TITLES[method]}\n{aligned(lines)}")
    findings.rows.append(Row("surface.step_ms", step_ms, "ms"))
    findings.drawings.append(Drawing("surface", lambda figure: _draw(figure, results)))
    return findings


def _draw(figure: Figure, results: Results) -> None:
    """Draw the painted surface above the shown one."""
    surfaces = next(iter(results.values()))
    axes = figure.subplots(2, len(surfaces), squeeze=False)
    for column, (name, every) in enumerate(surfaces.items()):
        rows = ((every[0].painting, "as painted"), (every[0].picture, "live"))
        for row, (picture, title) in enumerate(rows):
            axes[row, column].imshow(picture, interpolation="nearest")
            axes[row, column].set_title(f"{name}, {title}", fontsize=7)
            axes[row, column].set_axis_off()
