"""Join page, room and self-test by the rules of axe-core, on a desk and on a phone."""

import pytest

from tests.studio.web.conftest import JOINING, READY

MIN_SCORE = 90
SIZES = {"desk": (1280, 800, False), "phone": (390, 844, True)}


def assert_good(audit):
    assert audit.serious == []
    assert audit.score >= MIN_SCORE, audit.violations
    assert [rule for rule, _, _ in audit.violations] == []


@pytest.fixture(params=SIZES.values(), ids=SIZES)
def opened(request, page):
    """A function that opens an address at a size."""
    width, height, is_phone = request.param

    def visit(url, state):
        page.visit(url, width=width, height=height, is_phone=is_phone)
        page.wait_for(state)
        return page

    return visit


def test_the_self_test_and_the_join_page_have_no_obstacles(opened, hub, audited):
    assert_good(audited(opened(f"{hub.url}check", READY)))
    page = opened(hub.url, JOINING)
    assert_good(audited(page))
    # Refused: the words that say why are announced, too.
    page.evaluate(
        "document.getElementById('name').value = 'Eve';"
        "document.getElementById('code').value = '000 000';"
        "document.getElementById('join-button').click()"
    )
    page.wait_for("document.getElementById('join-state').className === 'refused'")
    assert_good(audited(page))


def test_the_room_has_no_obstacles_with_everything_open(opened, hub, invite_guest, audited):
    page = opened(hub.invite().url, JOINING)
    page.evaluate(
        "document.getElementById('name').value = 'Ada';"
        "document.getElementById('join-button').click()"
    )
    page.wait_for(READY)
    invite_guest("Grace")
    page.wait_for("live.people.byId.size === 1")
    assert_good(audited(page))
    page.evaluate(
        "document.getElementById('tool-draw').click();"
        "document.getElementById('mode-walk').click();"
        "if (document.getElementById('panel').hidden) document.getElementById('side').click()"
    )
    assert_good(audited(page))
    # The measure itself: a button that has lost its name is found.
    page.evaluate("document.getElementById('side').replaceChildren()")
    page.evaluate("document.getElementById('side').removeAttribute('title')")
    found = audited(page)
    assert [rule for rule, _, _ in found.serious] == ["button-name"]
    assert found.score < 100
