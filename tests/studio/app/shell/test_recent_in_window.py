"""What was opened is opened again from the File menu and the first page; files are browsed for."""

from dataclasses import replace

import pytest

from scenes.package import save_package
from studio.app.model.documents.recent import recent_choices
from studio.app.model.settings import Settings
from studio.console.display import why_no_window
from studio.session.plan import SessionPlan

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def opened_lately(desk, tiny, tmp_path):
    """A room, a session and a scenario on the disk, remembered as opened."""
    room, session = tmp_path / "other.gnx", tmp_path / "2026-01-02_tiny" / "recording.mcap"
    save_package(replace(tiny.scene, name="other"), room)
    session.parent.mkdir()
    tiny.session(SessionPlan(methods=("own",), record_to=session)).run(lambda _output: None)
    scenario = tmp_path / "push.toml"
    scenario.write_text("duration_s = 3\n")
    bench = desk.window.bench
    bench.remember(str(room))
    bench.remember(str(session), "recent_sessions")
    bench.remember(str(scenario), "recent_scenarios")
    return room, session, scenario


def entries(desk):
    """Of the menu *Open recent*, as it is when it is opened."""
    menu = desk.window.menus.menu("File").findChild(
        type(desk.window.menus.menu("File")), "file.open_recent choices"
    )
    menu.aboutToShow.emit()
    return {entry.text(): entry for entry in menu.actions()}


def test_the_menu_opens_rooms_sessions_and_scenarios(desk, opened_lately):
    room, session, scenario = opened_lately
    bench = desk.window.bench
    found = entries(desk)
    assert list(found) == [
        f"other.gnx ({room.parent.name})",
        "Session 2026-01-02_tiny",
        f"Scenario push.toml ({scenario.parent.name})",
    ]
    found["Session 2026-01-02_tiny"].trigger()
    desk.until(lambda: bench.recording == session)
    bench.do("timeline.close")
    next(iter(found.values())).trigger()
    desk.until(lambda: bench.scene.name == "other")
    assert bench.settings.recent[0] == str(room)


def test_the_first_page_has_them_too(desk, opened_lately):
    room, _, _ = opened_lately
    window = desk.window
    window.menus.qt_action("help.first_page").trigger()
    button = window.first_page.recent.buttons[0]
    assert button.text() == f"other.gnx ({room.parent.name})"
    desk.click(button)
    desk.until(lambda: window.bench.scene.name == "other")
    assert not window.first_page.isVisible()


def test_what_is_gone_is_not_offered(tmp_path):
    settings = Settings(recent=("lab", str(tmp_path / "gone.gnx")))
    assert [choice.title for choice in recent_choices(settings)] == ["lab"]


def test_a_package_a_video_and_photos_are_browsed_for(desk, opened_lately, tmp_path):
    room, _, _ = opened_lately
    window, bench = desk.window, desk.window.bench
    bench.do("dock.preparation")
    page = window.content("preparation").room
    video = tmp_path / "room.mp4"
    video.write_bytes(b"no film, but a file")
    desk.choose_file(video)
    desk.click(page.browse_video)
    assert page.source == video
    assert page.start_button.isEnabled()
    page.source = None
    desk.choose_file(video)
    desk.click(page.drop)
    assert page.source == video
    photos = tmp_path / "photos"
    photos.mkdir()
    desk.choose_file(photos)
    desk.click(page.browse_photos)
    assert page.source == photos
    desk.choose_file(room)
    desk.click(page.browse_package)
    desk.until(lambda: bench.scene.name == "other")


def test_a_package_is_opened_by_its_key(desk, opened_lately):
    desk.choose_file(opened_lately[0])
    desk.press("O", "Control", "Shift")
    desk.until(lambda: desk.window.bench.scene.name == "other")
