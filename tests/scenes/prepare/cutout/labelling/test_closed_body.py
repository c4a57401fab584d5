"""One click: what ends is found whole, what goes on is refused."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.labelling.closed_body import closed_body
from scenes.prepare.cutout.labelling.surface_cells import (
    links_between,
    splats_of_cells,
    surface_cells,
)
from scenes.prepare.cutout.marks.masks import Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
SIZES_M = ((0.2, 0.16, 0.24), (0.4, 0.3, 0.5))
STEP_M = 0.02
FLOOR_M = 2.2


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.fixture(scope="module", params=SIZES_M, ids=["small", "large"])
def room(request, box_on_floor):
    """Splats of a floor and a box, which of them are the box's, and its size."""
    size = np.array(request.param)
    floor, box = box_on_floor(size, floor_m=FLOOR_M, step_m=STEP_M)
    own = np.arange(len(floor) + len(box)) >= len(floor)
    return concatenate([floor, box]), own, size


def viewpoints(size):
    """Photos from all around, high and low."""
    away_m = 0.5 + 2.5 * size.max()
    found = []
    for turn in np.arange(0.0, 2 * np.pi, np.pi / 6):
        for height in (0.7, 1.4):
            eye = np.array([away_m * np.cos(turn), away_m * np.sin(turn), height])
            name = f"{turn:.1f}-{height}"
            found.append(ViewPoint(name, CAMERA, look_at(eye, np.array([0, 0, size[2] / 2]))))
    return found


def clicked(view, *points):
    """A view with clicks where world points are drawn."""
    pixels, _ = view.camera.project(view.world_from_camera.inverse() @ np.array(points))
    prompt = Prompt(inside_px=pixels)
    return PromptedView(view.name, view.camera, view.world_from_camera, prompt)


def test_one_click_finds_the_whole_box_and_nothing_of_its_floor(room, renderer):
    cloud, own, size = room
    views = viewpoints(size)
    on_side = (0.5 * size[0], 0.0, 0.6 * size[2])
    found = closed_body(cloud, [clicked(views[0], on_side)], viewpoints=views, renderer=renderer)
    seen = own & (cloud.means[:, 2] > 0.01)  # nobody saw what it stands on
    assert found.labels[seen].mean() > 0.97
    assert (found.labels & ~own).sum() < 0.03 * own.sum()


def test_the_floor_does_not_end(room, renderer):
    cloud, _, size = room
    views = viewpoints(size)
    beside = (0.5 * size[0] + 0.4, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"does not end within 1.4 m.* draw a box"):
        closed_body(cloud, [clicked(views[0], beside)], viewpoints=views, renderer=renderer)


def test_a_click_on_nothing_names_the_view(room, renderer):
    cloud, _, size = room
    views = viewpoints(size)
    sky = (-2.0, 0.0, 1.4)
    with pytest.raises(ValueError, match=f"{views[0].name}; click on"):
        closed_body(cloud, [clicked(views[0], sky)], viewpoints=views, renderer=renderer)


def test_links_hold_on_faces_and_hardly_where_the_box_stands(room, renderer):
    cloud, own, size = room
    reach = 1.5 * size.max()
    cells = surface_cells(
        cloud, viewpoints(size), around=cloud.means[own].astype(np.float64),
        corners=(np.full(3, -reach), np.full(3, reach)), side_m=STEP_M, renderer=renderer,
    )  # fmt: skip
    assert np.abs(np.linalg.norm(cells.normals, axis=1) - 1.0).max() < 1e-6
    first, second, strength = links_between(cells)

    def hold_at(height_m: float) -> float:
        """How fast what lies above a height holds to what lies below."""
        below, above = (cells.places[end, 2] < height_m for end in (first, second))
        on_side = np.abs(cells.places[first, :2]) < 0.5 * size[:2] + 2 * cells.side_m
        return float(strength[(below != above) & on_side.all(axis=1)].sum())

    feet = min(hold_at(side * cells.side_m) for side in (0.5, 1.0, 1.5, 2.0))
    assert feet < 0.7 * hold_at(0.5 * size[2])
    on_box = cells.places[:, 2] > 1.5 * cells.side_m
    # The cells say whose each splat is.
    labels = splats_of_cells(cloud, cells, labels=on_box)
    assert (labels == own)[cloud.means[:, 2] > 2 * cells.side_m].all()
    assert not splats_of_cells(cloud, cells, labels=np.zeros(len(cells), dtype=bool)).any()


def test_no_view_sees_the_place(room, renderer):
    corners = (np.full(3, -1.0), np.full(3, 1.0))
    cells = surface_cells(
        room[0], [], around=np.zeros((1, 3)), corners=corners, side_m=0.02, renderer=renderer
    )
    assert len(cells) == 0
