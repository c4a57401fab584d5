"""How exactly live surfaces lie on what they show: corners against the truth, two ways.

The true corners of boards and posters come from the room's meshes. Once the camera has found its
own pose, each corner's place in the lens picture is compared with the true one; and the surface's
picture, made from noisy compressed video, is registered to what is painted on the mesh, which
needs no pose at all. Corners clicked in the lens picture are compared in the room.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from scenes.splats import SplatCloud
from scenes.state import LiveSurface
from studio.evaluate.filming import FilmSet, Shot, standing
from studio.evaluate.findings import TITLES, Asked, Drawing, Findings, aligned, own_bar, row_name
from studio.evaluate.flat_faces import FlatFaces
from studio.evaluate.trial import Answer, Trial, film_messages
from studio.rows import Row, at_most
from tracking.surface_pick import corners_from_clicks
from tracking.surface_view import fineness, native_size_px, quad_of
from tracking.surfaces import SurfacesState, step

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
LEAST_CORRELATION = 0.8
"""A registration that fits worse has not found the picture."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One surface in one seed, by one method's camera pose.

    Attributes:
        corner_px: (4,) how far each corner is off in the lens picture.
        registered_px: (4,) the same by registration, in the surface's pixels; NaN if it failed.
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
    poses = standing({thing.object_id: thing.world_from_object for thing in room.objects})
    taken = [Shot(k * FRAME_NS, poses) for k in range(FRAMES)]
    shown: dict[str, dict[str, list[Shown]]] = {
        name: defaultdict(list[Shown]) for name in asked.methods
    }
    step_ms: list[float] = []
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            frame, answers = _located(film_set, trial, taken, asked, seed)
            for method, answer in answers.items():
                pose = answer.world_from_rig or answer.truth.world_from_rig
                surfaces = _surfaces(faces, frame, pose)
                clicks = np.random.default_rng([seed, 43])
                for surface, seen in _shown(surfaces, frame, pose, answer, faces):
                    clicked = _clicked(surface, frame, pose, answer, scene.room, clicks)
                    shown[method][surface.surface_id].append(
                        Shown(seen[0], seen[1], clicked, seen[2], seen[3])
                    )
                if method == asked.methods[0]:
                    step_ms.append(_step_ms(surfaces, frame, pose))
    return _report(shown, min(step_ms))


def _located(
    film_set: FilmSet, trial: Trial, taken: list[Shot], asked: Asked, seed: int
) -> tuple[Frame, Mapping[str, Answer]]:
    """The last frame of a take, and what the methods said of it."""
    states = trial.start()
    found: tuple[Frame, Mapping[str, Answer]] | None = None
    for message in film_messages(film_set, taken, asked, seed=seed, what=f"{SCENE}, boards"):
        states, answers = trial.step(states, message)
        found = message.frame, answers
    if found is None:
        raise ValueError("a take without a single frame cannot be judged")
    return found


def _surfaces(faces: FlatFaces, frame: Frame, world_from_rig: Pose) -> list[LiveSurface]:
    """The true boards, as fine as the lenses see them."""
    surfaces = []
    for name, place in TOWARDS.items():
        corners = faces.rectangle_towards(place)
        size = native_size_px(quad_of(corners), frame.rig, world_from_rig)
        surfaces.append(LiveSurface(name, corners, size, frame.stream_id))
    return surfaces


def _shown(
    surfaces: list[LiveSurface], frame: Frame, pose: Pose, answer: Answer, faces: FlatFaces
) -> Iterable[
    tuple[
        LiveSurface,
        tuple[
            NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8], NDArray[np.uint8]
        ],
    ]
]:
    """Each surface with its corners' errors, two ways, its picture and the painting."""
    _, pictures = step(SurfacesState(), frame, surfaces, pose)
    for surface, seen in zip(surfaces, pictures, strict=True):
        painting = faces.painting(quad_of(surface.corners_in_world), surface.size_px)
        lens = 0 if seen.lens is None else seen.lens
        apart = _in_lens(frame, pose, lens, surface.corners_in_world) - _in_lens(
            frame, answer.truth.world_from_rig, lens, surface.corners_in_world
        )
        registered = registered_corners_px(painting, seen.picture)
        yield surface, (np.linalg.norm(apart, axis=1), registered, seen.picture, painting)


def registered_corners_px(
    painting: NDArray[np.uint8], picture: NDArray[np.uint8]
) -> NDArray[np.float64]:
    """(4,) pixels between the corners of two pictures of one thing, by a homography (ECC).

    NaN where the two are not enough alike.
    """
    greys = [cv2.cvtColor(p, cv2.COLOR_RGB2GRAY) for p in (painting, picture)]
    start = np.eye(3, dtype=np.float32)
    try:
        alike, found = cv2.findTransformECC(  # pyright: ignore[reportCallIssue]
            *greys, start, cv2.MOTION_HOMOGRAPHY, REGISTERED, None, 5
        )  # pyright: ignore[reportArgumentType]
    except cv2.error:
        return np.full(4, np.nan)
    if alike < LEAST_CORRELATION:
        return np.full(4, np.nan)
    height, width = painting.shape[:2]
    corners = np.array([[[0, 0], [width, 0], [width, height], [0, height]]], np.float32) - 0.5
    moved = cv2.perspectiveTransform(corners, np.asarray(found, dtype=np.float32))
    return np.linalg.norm((moved - corners)[0].astype(np.float64), axis=1)


def _clicked(
    surface: LiveSurface,
    frame: Frame,
    pose: Pose,
    answer: Answer,
    room: SplatCloud,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """(4,) millimetres between true corners and those that somebody clicks in the live picture."""
    corners = surface.corners_in_world
    quad, rig = quad_of(corners), frame.rig
    lens = max(range(len(rig.lenses)), key=lambda i: fineness(quad, rig, pose, i))
    where = _in_lens(frame, answer.truth.world_from_rig, lens, corners)
    clicks = where + rng.normal(scale=CLICK_PX, size=where.shape)
    found = corners_from_clicks(clicks, lens, rig, pose, room, NativeRenderer())
    return 1000.0 * np.linalg.norm(found - corners, axis=1)


def _in_lens(
    frame: Frame, world_from_rig: Pose, lens: int, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    world_from_lens = world_from_rig @ frame.rig.rig_from_lens[lens]
    return frame.rig.lenses[lens].project(world_from_lens.inverse() @ points)[0]


def _step_ms(surfaces: list[LiveSurface], frame: Frame, pose: Pose) -> float:
    """Processor milliseconds a surface and frame: the quickest of many steps."""
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
        for name, values in (("corner_px", corner), ("registered_px", registered)):
            full = row_name(method, f"surface.{name}")
            findings.rows.append(at_most(full, float(np.nanmean(values)), "px", bar=bar))
            findings.rows.append(at_most(f"{full}.max", float(np.nanmax(values)), "px", bar=bar))
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
    """What is painted above what is shown."""
    surfaces = next(iter(results.values()))
    axes = figure.subplots(2, len(surfaces), squeeze=False)
    for column, (name, every) in enumerate(surfaces.items()):
        rows = ((every[0].painting, "as painted"), (every[0].picture, "live"))
        for row, (picture, title) in enumerate(rows):
            axes[row, column].imshow(picture, interpolation="nearest")
            axes[row, column].set_title(f"{name}, {title}", fontsize=7)
            axes[row, column].set_axis_off()
