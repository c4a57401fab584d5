"""A room with one crate in it, and marks on the crate."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.splats import SplatCloud
from studio.app.preparation.cut_job import Mark

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
LOW, HIGH = np.array([-0.15, -0.1, 0.0]), np.array([0.15, 0.1, 0.25])


def splats_on(points, colour):
    n = len(points)
    sh = np.full((n, 1, 3), (np.asarray(colour) - 0.5) / 0.2820948)
    scales = np.full((n, 3), 0.012)
    scales[:, 2] = 0.002
    return SplatCloud(points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9), sh)


def joined(*clouds):
    fields = ("means", "scales", "rotations", "opacities", "sh")
    return SplatCloud(*(np.concatenate([getattr(c, f) for c in clouds]) for f in fields))


@pytest.fixture
def scene(tmp_path):
    """The folder of a scene with one crate and three views of it."""
    rng = np.random.default_rng(1)
    floor = rng.uniform((-0.8, -0.8, 0), (0.8, 0.8, 0.001), (9000, 3))
    under = ((floor[:, :2] > LOW[:2]) & (floor[:, :2] < HIGH[:2])).all(axis=1)
    crate = rng.uniform(LOW, HIGH, (1800, 3))
    side = rng.integers(0, 3, len(crate))
    end = np.where(rng.random(len(crate)) < 0.5, LOW[side], HIGH[side])
    crate[np.arange(len(crate)), side] = end
    room = joined(splats_on(floor[~under], (0.75, 0.7, 0.6)), splats_on(crate, (0.2, 0.3, 0.5)))
    centre = 0.5 * (LOW + HIGH)
    views = tuple(
        ViewPoint(f"{k}.png", CAMERA, look_at(centre + eye, centre))
        for k, eye in enumerate([(0.9, 0.2, 0.6), (-0.5, 0.8, 0.6), (-0.4, -0.8, 0.7)])
    )
    package = ScenePackage(
        "crate", room, (), (), Pose.identity(), np.array([[-1.0, -1], [1, 1]]), None, (), views
    )
    save_package(package, tmp_path / "crate.gnx")
    return tmp_path / "crate.gnx"


@pytest.fixture
def marks(scene):
    """A box around the crate in every view."""
    corners = np.array(np.meshgrid(*np.stack([LOW, HIGH], axis=1))).reshape(3, -1).T
    found = []
    for view in load_package(scene).views:
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ corners)
        low, high = pixels.min(axis=0) - 5, pixels.max(axis=0) + 5
        found.append(Mark(view.name, (*low.tolist(), *high.tolist())))
    return found


@pytest.fixture
def objects_page(tmp_path, qapp, until):
    """Opens the window on a scene, and the page on which its objects are cut out; gives both."""
    from studio.app.model.documents.document import Document
    from studio.app.window import dispose, make_window

    opened = []

    def show(scene):
        out, home = tmp_path / "out", tmp_path / "home"
        window = make_window(Document(str(scene)), rehearse_to=out, home=home)
        opened.append(window)
        window.bench.set(has_started=True)
        window.run.open_scene(str(scene))
        window.show()
        until(lambda: window.is_filled and window.bench.scene is not None)
        window.bench.do("dock.preparation")
        dock = window.content("preparation")
        dock.tabs.setCurrentWidget(dock.cut)
        return window, dock.cut

    yield show
    for window in opened:
        window.close()
        dispose(window)
