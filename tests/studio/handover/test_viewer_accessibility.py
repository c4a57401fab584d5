"""The handed-over page by the rules of axe-core, with and without its list."""

import pytest

READY = "document.documentElement?.dataset.state === 'ready'"


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)], ids=["desk", "phone"])
def test_it_has_no_obstacles(chromium, lab_page, audited, size):
    width, height = size
    chromium.open(lab_page, width=width, height=height)
    chromium.wait_for(READY)
    for _ in range(2):
        found = audited(chromium)
        assert found.violations == ()
        assert found.score == 100
        chromium.evaluate("document.getElementById('side').click()")
