"""The page in a real browser: what is seen, what moves, and that nothing is fetched."""

import base64
import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from scenes.bodies.goals import goals_of
from scenes.bodies.solve import solve_bodies
from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from tests.studio.browser import until

WIDTH, HEIGHT = 640, 400
FIELD_OF_VIEW_DEG = 62.0
BLANK = 12.0
READY = "document.documentElement?.dataset.state === 'ready'"
CHAIR_FROM, CHAIR_TO = (-0.4, 0.3, 0.0), (0.9, -0.6, 0.0)


def guest(step):
    """The person who goes away, as the fixtures beside this file have them."""
    spec = importlib.util.spec_from_file_location("fixtures", Path(__file__).parent / "conftest.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.guest(step)


@pytest.fixture
def shown(chromium, lab_page):
    """The lab's page, freshly opened."""
    chromium.requests.clear()
    chromium.messages.clear()
    chromium.open(lab_page, width=WIDTH, height=HEIGHT)
    chromium.wait_for(READY)
    return chromium


def settled(page):
    """The picture once splats are sorted and nothing is drawn any more."""
    page.rest()
    picture = page.picture()
    assert picture.std() > BLANK
    return picture.astype(np.float64) / 255.0


def bare(page):
    """Without what stands around the picture, with the picture's own middle, and without people."""
    page.evaluate("viewer.room.people.forEach(({figure}) => { figure.group.visible = false; })")
    page.evaluate(
        "document.getElementById('panel').hidden || document.getElementById('side').click()"
    )
    page.evaluate(
        "for (const e of document.querySelectorAll('header,footer,#hint,#labels'))"
        " e.style.display = 'none'"
    )


def test_words_are_in_the_face_that_the_page_brings_along(shown):
    shown.wait_for("[...document.fonts].every((face) => face.status === 'loaded')")
    faces = shown.evaluate("[...document.fonts].map((face) => `${face.family} ${face.weight}`)")
    assert {face.replace('"', "") for face in faces} == {
        "Atkinson Hyperlegible Next 400",
        "Atkinson Hyperlegible Next 700",
    }


def test_the_room_and_its_objects_look_as_the_renderer_draws_them(shown, lab):
    bare(shown)
    shown.evaluate("viewer.seek(2000)")
    picture = settled(shown)

    eye, target = shown.evaluate("viewer.eye()"), shown.evaluate("viewer.target()")
    wanted, elsewhere = (
        drawn_here(lab, eye, target, Pose.from_yaw(yaw, place))
        for yaw, place in ((1.0, CHAIR_TO), (0.0, CHAIR_FROM))
    )
    difference = np.abs(picture - wanted).mean(axis=2)
    # Colours are rounded, splats are cut off elsewhere, and a line is drawn.
    assert difference.mean() < 0.02
    assert np.quantile(difference, 0.9) < 0.04
    # Where the chair is and where it was, the page shows it where it is.
    matters = np.abs(wanted - elsewhere).mean(axis=2) > 0.15
    nearer = difference < np.abs(picture - elsewhere).mean(axis=2)
    assert matters.sum() > 900
    assert nearer[matters].mean() > 0.9


def test_a_chair_that_was_moved_darkens_the_floor_where_it_stands(shown, lab):
    bare(shown)
    shown.evaluate("viewer.seek(2000)")
    page = settled(shown)
    eye, target = (np.array(shown.evaluate(f"viewer.{end}()")) for end in ("eye", "target"))
    unshaded = drawn_here(lab, eye, target, Pose.from_yaw(1.0, CHAIR_TO))

    def darker(radius_m):
        angles = np.arange(0, 2 * np.pi, 0.2)
        ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]) * radius_m + CHAIR_TO
        focal = 0.5 * HEIGHT / np.tan(np.radians(FIELD_OF_VIEW_DEG) / 2)
        camera = Pinhole(WIDTH, HEIGHT, focal, focal, WIDTH / 2, HEIGHT / 2)
        pixels, seen = camera.project(look_at(eye, target).inverse() @ ring)
        columns, rows = np.round(pixels[seen]).astype(int).T
        return float(np.median((unshaded - page)[rows, columns].mean(axis=1)))

    assert darker(0.22) > darker(0.75) + 0.03


def drawn_here(lab, eye, target, world_from_chair):
    """The same view by the program's own renderer."""
    focal = 0.5 * HEIGHT / np.tan(np.radians(FIELD_OF_VIEW_DEG) / 2)
    camera = Pinhole(WIDTH, HEIGHT, focal, focal, WIDTH / 2, HEIGHT / 2)
    poses = {item.object_id: item.world_from_object for item in lab.objects}
    poses["chair-1"] = world_from_chair
    objects = [PosedSplats(item.splats, poses[item.object_id]) for item in lab.objects]
    drawn = NativeRenderer().render(
        [PosedSplats(lab.room, Pose.identity()), *objects],
        camera,
        look_at(np.array(eye), np.array(target)),
        RenderOptions(),
    )
    return np.clip(drawn.rgb, 0, 1)


def test_objects_move_when_somebody_scrubs(shown):
    shown.evaluate("viewer.seek(0)")
    before = settled(shown)
    assert shown.evaluate("viewer.place('chair-1')") == pytest.approx(CHAIR_FROM, abs=1e-3)
    assert state_of(shown, 0) == "at rest"

    box = shown.evaluate(
        "(({x, y, width, height}) => ({x, y, width, height}))"
        "(document.getElementById('scrub').getBoundingClientRect())"
    )
    shown.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    shown.wait_for("viewer.time() > 900")
    middle = shown.evaluate("viewer.place('chair-1')")
    share = (shown.evaluate("viewer.time()") - 500) / 1000
    assert middle == pytest.approx(
        [a + share * (b - a) for a, b in zip(CHAIR_FROM, CHAIR_TO, strict=True)], abs=2e-3
    )
    assert state_of(shown, 0) == "followed"

    shown.evaluate("viewer.seek(2000)")
    after = settled(shown)
    assert shown.evaluate("viewer.place('chair-1')") == pytest.approx(CHAIR_TO, abs=1e-3)
    assert 0.005 < (np.abs(after - before).max(axis=2) > 0.15).mean() < 0.3


def state_of(page, row):
    return page.evaluate(f"document.querySelectorAll('#objects .state')[{row}].textContent")


def test_it_plays_to_the_end_and_stops_there(shown):
    shown.evaluate(
        "document.getElementById('speed').value = '4';"
        "document.getElementById('speed').dispatchEvent(new Event('change'))"
    )
    shown.evaluate("document.activeElement.blur()")
    shown.press(" ", "Space")
    shown.wait_for("viewer.time() > 0")
    shown.wait_for("viewer.time() === 2000")
    shown.wait_for("document.querySelector('#play .word').textContent === 'Play'")

    shown.press("ArrowLeft", "ArrowLeft")
    assert shown.evaluate("viewer.time()") == pytest.approx(1900)


def test_one_walks_through_the_room(shown):
    start = shown.evaluate("viewer.eye()")
    shown.press("f", "KeyF")
    shown.hold("w", "KeyW", 0.6)
    # 0.96 m at 1.6 m/s, however few pictures were drawn meanwhile.
    shown.wait_for(f"Math.hypot(...viewer.eye().map((v, i) => v - {start}[i])) > 0.7")

    assert shown.evaluate("document.getElementById('fly').ariaPressed") == "true"


def test_the_list_can_be_hidden_and_every_event_leads_to_its_time(shown):
    shown.evaluate("document.querySelector('#events button').click()")
    assert shown.evaluate("viewer.time()") == 500
    # What the recording says is text, never a part of the page.
    assert shown.evaluate("document.querySelector('#events span').textContent") == (
        "pushes <b>chair-1</b>"
    )

    # A page as narrow as this one opens without the list.
    hidden = "document.getElementById('panel').hidden"
    assert shown.evaluate(hidden)
    for is_hidden in (False, True):
        shown.press("h", "KeyH")
        assert shown.evaluate(hidden) is is_hidden


def test_people_rays_and_lines_are_there_when_they_were(shown):
    def visible():
        return shown.evaluate("viewer.shown()")

    shown.evaluate("viewer.seek(0)")
    assert visible() == {"heads": ["remote-user", "grace"], "rays": [], "lines": []}
    assert shown.evaluate("viewer.head('remote-user')") == pytest.approx([-1.5, -1.0, 1.6])
    shown.evaluate("viewer.seek(1600)")
    assert visible() == {"heads": ["remote-user"], "rays": ["remote-user"], "lines": ["line-1"]}


def test_people_have_the_program_s_figure_with_their_hands_until_they_leave(shown):
    shown.evaluate("viewer.seek(900)")
    found = shown.evaluate("viewer.skeleton('grace')")
    goals = goals_of([guest(9)])
    _, skeleton = solve_bodies(None, goals)
    # Rounded to tenths of a millimetre, fingers to half a degree.
    assert np.abs(np.array(found) - skeleton.origins[0]).max() < 0.003
    wait_for_labels(shown, "remote-user,grace")

    shown.evaluate("viewer.seek(1200)")
    assert shown.evaluate("viewer.shown().heads") == ["remote-user"]
    wait_for_labels(shown, "remote-user")
    assert shown.evaluate("document.querySelectorAll('#people .state')[1].textContent") == "away"
    shown.evaluate("viewer.seek(0)")
    assert shown.evaluate("viewer.shown().heads") == ["remote-user", "grace"]


def wait_for_labels(page, wanted):
    """Labels are laid when a picture is drawn."""
    page.wait_for(
        "[...document.querySelectorAll('#labels span')].filter((l) => !l.hidden)"
        f".map((l) => l.textContent).join() === {wanted!r}"
    )


def test_nothing_is_fetched_and_nothing_could_be(shown, lab_page):
    settled(shown)

    outside = [u for u in shown.requests if not u.startswith(("blob:", "data:"))]
    assert outside == [lab_page.resolve().as_uri()]
    assert shown.messages == []
    refused = shown.evaluate("fetch('https://example.org/').then(() => 'fetched', () => 'refused')")
    assert refused == "refused"
    until(any, lambda: ["Content Security Policy" in said for said in said_by(shown)])


def said_by(page):
    """The messages of a page that have come by now."""
    page.evaluate("1")
    return page.messages


def test_a_damaged_page_says_so(chromium, lab_page, tmp_path):
    text = lab_page.read_text(encoding="utf-8")
    begin = re.search(r'id="part:room">', text).end()
    rubbish = base64.b64encode(b"no splats at all" * 64).decode()
    damaged = tmp_path / "damaged.html"
    damaged.write_text(text[:begin] + rubbish + text[text.index("</script>", begin) :])

    chromium.open(damaged)
    chromium.wait_for("/stop|could not/.test(document.getElementById('message')?.textContent)")

    assert not chromium.evaluate("document.getElementById('message').hidden")


def test_a_slow_computer_s_picture_is_coarse_while_it_moves_and_fine_at_rest(shown):
    settled(shown)
    assert shown.evaluate("viewer.sharpness()") == 0

    coarsest = shown.evaluate(
        "(async () => { let most = 0; for (let i = 0; i < 6; i++) { viewer.seek(300 * i);"
        " await new Promise(requestAnimationFrame);"
        " most = Math.max(most, viewer.sharpness()); } return most; })()"
    )
    if coarsest == 0:
        pytest.skip("this computer draws the lab quickly: it is never coarse")
    shown.wait_for("viewer.sharpness() === 0")
