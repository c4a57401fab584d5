"""The page that says how a room was prepared: pictures of every stage, figures and what to mind."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from scenes.cameras import Pinhole, pixel_centres
from scenes.frames import look_at
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.prepare.footage.contact_sheet import contact_sheet
from scenes.prepare.pipeline import Prepared
from scenes.prepare.room_splats import PREVIEWS
from scenes.prepare.stages import WorkFolder
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from studio.console.machine import describe_machine
from studio.console.rows import Row
from studio.evaluate.figures import INK, as_svg, figure_style
from studio.evaluate.verdict import verdict_of
from studio.reports.page import embedded_jpeg, page

Picture = NDArray[np.uint8]

TILE_WIDTH_PX, TILES_ACROSS = 160, 10
PREVIEWS_SHOWN = 4
ABOVE_PX = (980, 735)
DOLLHOUSE_CUT_M = 2.1
"""Height from which the view from above leaves everything out, the ceiling."""


def render_report(
    prepared: Prepared, work: WorkFolder, rows: list[Row], renderer: NativeRenderer
) -> str:
    """The page as HTML, complete in itself."""
    verdict = verdict_of(prepared)
    return page("preparation.html.j2").render(
        prepared=prepared,
        package=prepared.package,
        rows=rows,
        minutes=sum(stage.seconds or 0.0 for stage in prepared.package.stages) / 60,
        verdict=verdict,
        cards=_cards(rows),
        contact=embedded_jpeg(
            contact_sheet(
                prepared.capture,
                failed=prepared.sfm.failed,
                columns=TILES_ACROSS,
                width_px=TILE_WIDTH_PX,
            )
        ),
        plan=_plan(prepared),
        curve=_curve(prepared),
        previews=[embedded_jpeg(picture) for picture in _previews(work)],
        above=embedded_jpeg(_from_above(prepared, renderer)),
        hidden=embedded_jpeg(_mesh_from_above(prepared.package.collision, prepared))
        if prepared.package.collision is not None
        else "",
        errors=_errors(prepared),
        rejected=prepared.capture.counts(),
        machine=describe_machine(),
    )


def _cards(rows: list[Row]) -> list[dict[str, str]]:
    shown = (
        ("prepare.wall_min", "Time, all stages", "min", "{:.1f}"),
        ("prepare.preview_min", "To the first picture", "min", "{:.1f}"),
        ("prepare.placed", "Pictures placed", "", "{:.0%}"),
        ("prepare.psnr_db", "Views kept aside", "dB", "{:.1f}"),
        ("prepare.alignment_mm.predicted_95", "Position error, 95 % bound", "mm", "{:.1f}"),
    )
    values = {row.name: row.value for row in rows}
    return [
        {"title": title, "value": form.format(values[name]), "unit": unit}
        for name, title, unit, form in shown
        if values.get(name) is not None and values[name] == values[name]
    ]


def _plan(prepared: Prepared) -> str:
    """Sparse points from above, and from where the photos were taken."""
    metric = prepared.reconstruction
    low, high = prepared.package.footprint_m
    with figure_style():
        size = high - low
        figure = Figure(figsize=(7.2, max(2.5, 7.2 * float(size[1] / max(size[0], 1e-6)))))
        axes = figure.add_axes((0.08, 0.1, 0.9, 0.88))
        shade = metric.colours.astype(np.float64) / 255
        axes.scatter(
            metric.points[:, 0], metric.points[:, 1], s=1.5, c=shade, linewidths=0, rasterized=True
        )
        eyes = np.stack([view.world_from_camera.translation for view in metric.views])
        looks = np.stack([view.world_from_camera.rotation[:, 2] for view in metric.views])
        axes.quiver(
            eyes[:, 0], eyes[:, 1], looks[:, 0], looks[:, 1], color="#d9601f", width=0.004, scale=28
        )
        for anchor in prepared.alignment.anchors:
            x, y, _ = anchor.world_from_code.translation
            axes.plot(x, y, "s", color=INK, markersize=7)
            axes.annotate(anchor.payload, (x, y), (6, 6), textcoords="offset points", fontsize=8)
        axes.set_xlim(low[0] - 0.3, high[0] + 0.3)
        axes.set_ylim(low[1] - 0.3, high[1] + 0.3)
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        return as_svg(figure, "Sparse points and camera positions from above")


def _curve(prepared: Prepared) -> str:
    moments = [m for m in prepared.training.history if m.psnr_db is not None]
    if len(moments) < 2:
        return ""
    with figure_style():
        figure = Figure(figsize=(7.2, 2.6), layout="constrained")
        axes = figure.subplots()
        seconds = np.array([m.seconds for m in moments])
        psnr_db = np.array([m.psnr_db for m in moments], dtype=np.float64)
        lasts = mean_of_rounds(psnr_db, len(prepared.training.held_out))
        axes.plot(seconds, psnr_db, "o", color="#1f88d1", alpha=0.4, label="one view, in turn")
        axes.plot(seconds, lasts, "-", color="#1f88d1", label="mean of a round")
        axes.legend(loc="upper left")
        axes.set_xlabel("training time (s)")
        axes.set_ylabel("PSNR (dB)")
        axes.grid(visible=True)
        return as_svg(figure, "PSNR of held-out views over time")


def mean_of_rounds(values: NDArray[np.float64], views: int) -> NDArray[np.float64]:
    """(N,) mean of each value and those before it, as many as there are views that take turns."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    ends = np.arange(1, len(values) + 1)
    firsts = np.maximum(ends - max(views, 1), 0)
    return (sums[ends] - sums[firsts]) / (ends - firsts)


def _previews(work: WorkFolder) -> list[Picture]:
    files = sorted((work.path / "training" / PREVIEWS).glob("*.jpg"))
    if not files:
        return []
    places = np.unique(np.linspace(0, len(files) - 1, PREVIEWS_SHOWN).round().astype(int))
    return [np.asarray(Image.open(files[place]).convert("RGB")) for place in places]


def _camera_above(prepared: Prepared) -> tuple[Pinhole, Pose, float]:
    """A camera high over the room, and the distance from which on it sees the room."""
    low, high = prepared.package.footprint_m
    middle = 0.5 * (low + high)
    width, height = ABOVE_PX
    camera = Pinhole.from_fov(width, height, np.deg2rad(50.0))
    rise = 0.62 * max(float(high[0] - low[0]), float(high[1] - low[1]) * width / height)
    eye = np.array([middle[0], middle[1], DOLLHOUSE_CUT_M + rise / np.tan(np.deg2rad(25.0))])
    # A hair off straight down, or no direction in the picture would be up.
    world_from_camera = look_at(eye, eye + np.array([0.0, 1e-4, -1.0]))
    return camera, world_from_camera, float(eye[2]) - DOLLHOUSE_CUT_M


def _from_above(prepared: Prepared, renderer: NativeRenderer) -> Picture:
    camera, world_from_camera, near_m = _camera_above(prepared)
    drawn = renderer.render(
        [PosedSplats(prepared.package.room, Pose.identity())],
        camera,
        world_from_camera,
        RenderOptions(background=(0.06, 0.07, 0.09), near_m=near_m),
    )
    return (np.clip(drawn.rgb, 0, 1) * 255).astype(np.uint8)


def _mesh_from_above(mesh: CollisionMesh, prepared: Prepared) -> Picture:
    camera, world_from_camera, near_m = _camera_above(prepared)
    rays = camera.unproject(pixel_centres(camera)) @ world_from_camera.rotation.T
    start = near_m / -rays[:, 2:3]
    origins = world_from_camera.translation + rays * start
    hits = RayScene(mesh.vertices[mesh.faces]).cast(origins, rays)
    light = np.abs(hits.normals @ np.array([0.35, 0.25, 0.9]))
    shade = np.where(hits.triangle >= 0, 50 + 190 * light, 20)
    shape = (camera.height_px, camera.width_px, 1)
    return np.clip(shade, 0, 255).astype(np.uint8).reshape(shape).repeat(3, axis=2)


def _errors(prepared: Prepared) -> list[dict[str, Any]]:
    """Each code's residuals, and how far the room's corners may be off."""
    return [
        {
            "payload": anchor.payload,
            "side_mm": f"{1000 * anchor.side_m:.0f}",
            "photos": len(anchor.views),
            "px": f"{anchor.residual_px:.2f}",
            "mm": f"{anchor.residual_mm:.2f}",
            "corner_mm": f"{anchor.corner_mm:.2f}",
        }
        for anchor in prepared.alignment.anchors
    ]
