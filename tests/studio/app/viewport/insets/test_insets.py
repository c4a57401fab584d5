"""Small pictures as their user has them: opened from the menu, closed one by one."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.frames import look_at
from scenes.opening import open_scene
from scenes.state import Avatar, SceneState
from studio.app.model.documents.document import Document
from studio.app.model.runs.live_run import HeadsetView, LiveRun
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


class NoHistory:
    """Nothing is undone here."""

    def push(self, change):
        pass

    def clear(self):
        pass


@pytest.fixture(scope="module")
def desk():
    return open_scene("desk")


@pytest.fixture
def bench(desk):
    made = Workbench(Document("desk"), Settings(), NoHistory())
    made.show_scene(desk)
    made.show_state(with_people("ana", "ben"))
    return made


def with_people(*names):
    heads = {
        name: look_at(np.array([x, -1.2, 1.5]), np.array([0.0, 0.0, 0.7]))
        for name, x in zip(names, (0.5, -0.5), strict=False)
    }
    return SceneState(avatars={name: Avatar(name, "remote", head) for name, head in heads.items()})


@pytest.fixture
def grid(bench, qapp):
    from studio.app.viewport.view_grid import ViewGrid

    made = ViewGrid(bench)
    made.resize(622, 430)
    made.show()
    yield made
    made.close()
    made.deleteLater()


def inset(grid, source):
    return dict(zip(grid.insets.sources, grid.insets.pictures, strict=True))[source]


def test_both_points_of_view_are_beside_each_other_and_closed_one_by_one(grid, bench, until):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    assert bench.do("view.inset", source="ana")
    assert bench.do("view.inset", source="ben")
    ana, ben = grid.insets.pictures
    until(lambda: not ana.words and not ben.words)
    assert (ana.title, ben.title) == ("what ana sees", "what ben sees")
    assert not ana.geometry().intersects(ben.geometry())
    assert grid.rect().contains(ana.geometry().united(ben.geometry()))
    assert ana.grab().toImage() != ben.grab().toImage()
    QTest.mouseClick(ana.button, Qt.MouseButton.LeftButton)
    assert grid.insets.sources == ("ben",)
    assert ben.isVisible()
    bench.do("view.no_insets")
    assert grid.insets.sources == ()


def test_the_menu_offers_whoever_is_there(grid, bench, qapp):
    from PySide6.QtWidgets import QMainWindow, QMenu

    from studio.app.shell.menus import Menus

    window = QMainWindow()
    menus = Menus(bench, window)
    menus.build()
    menu = menus.menu("View").findChild(QMenu, "view.inset choices")
    menu.aboutToShow.emit()
    titles = {made.text(): made for made in menu.actions()}
    assert {"360° camera", "ana", "ben"} <= set(titles)
    assert all(item.name in titles for item in bench.scene.objects)
    titles["ana"].trigger()
    menu.aboutToShow.emit()
    assert [made.text() for made in menu.actions() if made.isChecked()] == ["ana"]
    assert grid.insets.sources == ("ana",)


def test_there_is_a_limit_and_it_says_what_to_do(grid, bench):
    for source in ("ana", "ben", "camera"):
        assert bench.do("view.inset", source=source)
    assert not bench.do("view.inset", source=bench.scene.objects[0].object_id)
    assert "3 at most: close one" in bench.log.lines()[-1].text
    assert not bench.do("view.inset", source="nobody")
    assert "wanted one of camera, ana, ben" in bench.log.lines()[-1].text


def test_who_has_left_is_said_to_be_away_and_comes_back(grid, bench, until):
    bench.do("view.inset", source="ana")
    until(lambda: not inset(grid, "ana").words)
    bench.show_state(with_people("ben"))
    assert inset(grid, "ana").words == "ana is not here now"
    bench.show_state(with_people("ana", "ben"))
    until(lambda: not inset(grid, "ana").words)


def test_another_scene_closes_them(grid, bench, desk):
    bench.do("view.inset", source="ana")
    bench.show_scene(desk)
    assert grid.insets.sources == ()


class Worn:
    """A headset of `hololens` in the live session of a bench."""

    def __init__(self, bench):
        self.t_ns, self.age_s, self.drawn = None, 0.0, 0
        live = LiveRun(bench, SimpleNamespace(job=None))
        live.headset_view = lambda: HeadsetView("hololens", self.t_ns, self.age_s, self.draw)
        bench.share(live)

    def draw(self):
        self.drawn += 1
        return np.full((428, 760, 3), 90, np.uint8)


def test_of_the_local_user_is_shown_what_their_headset_sees(grid, bench, until):
    worn = Worn(bench)
    assert bench.do("view.inset", source="hololens"), "also before it is known where they are"
    shown = inset(grid, "hololens")
    until(lambda: shown.words == "no picture of the headset yet")
    worn.t_ns = 0
    until(lambda: not shown.words)
    assert shown.title == "what hololens sees"
    worn.t_ns, drawn = 99_000_000, worn.drawn
    worn.age_s = 3.2
    until(lambda: shown.title == "what hololens sees, 3 s old")
    assert worn.drawn == drawn, "ten a second"
    worn.t_ns = 100_000_000
    until(lambda: worn.drawn == drawn + 1)
    bench.do("view.no_insets")
    worn.t_ns = None
    bench.do("view.inset", source="hololens")
    until(lambda: inset(grid, "hololens").words == "no picture of the headset yet")


def test_both_peoples_views_are_opened_and_closed_at_once(grid, bench, until):
    assert not bench.do("view.people")
    assert "no local person is here" in bench.log.lines()[-1].text
    people = dict(with_people("ana", "ben").avatars)
    people["hololens"] = Avatar("hololens", "local", people["ben"].world_from_head, name="Cleo")
    bench.show_state(SceneState(avatars=people))
    Worn(bench).t_ns = 0
    assert bench.do("view.people")
    assert grid.insets.sources == ("hololens", "ana")
    until(lambda: not inset(grid, "hololens").words and not inset(grid, "ana").words)
    assert inset(grid, "hololens").title == "what Cleo sees"
    bench.do("view.inset", source="ana")
    assert bench.do("view.people"), "the one that was closed is opened again"
    assert set(grid.insets.sources) == {"hololens", "ana"}
    assert bench.do("view.people")
    assert grid.insets.sources == ()
