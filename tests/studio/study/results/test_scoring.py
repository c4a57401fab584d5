"""Scores by their authors' rules."""

import pytest

from studio.study.questionnaires import ABOUT, KNOWN, PAPER_PRESENCE, PRESENCE, SUS, TLX_PAIRS
from studio.study.results.scoring import BETTER, scores

TLX = {
    "mental": "70", "physical": "10", "temporal": "40",
    "performance": "20", "effort": "60", "frustration": "0",
}  # fmt: skip


def sus(*values):
    return scores(SUS, {f"SQ{k}": str(v) for k, v in enumerate(values, start=1)})


def test_the_system_usability_scale():
    assert sus(5, 1, 5, 1, 5, 1, 5, 1, 5, 1) == {"sus": 100.0}
    assert sus(1, 5, 1, 5, 1, 5, 1, 5, 1, 5) == {"sus": 0.0}
    assert sus(3, 3, 3, 3, 3, 3, 3, 3, 3, 3) == {"sus": 50.0}
    assert sus(4, 2, 4, 1, 5, 2, 5, 1, 4, 2) == {"sus": 85.0}
    assert sus(*[""] * 10) == {}
    assert sus(5, 1, 5, 1, 5, 1, 5, 1, 5, "") == {"sus": 95.0}  # left out: the middle


def test_presence():
    answers = {f"P{k}": str(v) for k, v in enumerate((7, 6, 5, 6, 1, 2), start=1)}
    assert scores(PRESENCE, answers) == {"presence.mean": 4.5, "presence.high": 3.0}
    answers = {f"PQ{k}": str(v) for k, v in enumerate((5, 5, 5, 5, 4, 4), start=1)}
    assert scores(PAPER_PRESENCE, answers) == {"paper-presence.mean": pytest.approx(28 / 6)}


def test_nasa_tlx_raw_and_weighed():
    assert scores(KNOWN["tlx"], TLX)["tlx.raw"] == pytest.approx(200 / 6)
    titles = {"mental": "Mental demand", "physical": "Physical demand",
              "temporal": "Temporal demand", "performance": "Performance",
              "effort": "Effort", "frustration": "Frustration"}  # fmt: skip
    # The first of each pair: weights 5, 4, 3, 2, 1, 0.
    chosen = {f"{one}-{other}": titles[one] for one, other in TLX_PAIRS}
    found = scores(KNOWN["tlx-weighed"], {**TLX, **chosen})
    weighed = (5 * 70 + 4 * 10 + 3 * 40 + 2 * 20 + 1 * 60 + 0 * 0) / 15
    assert found["tlx-weighed.weighed"] == pytest.approx(weighed)
    assert found["tlx-weighed.raw"] == pytest.approx(200 / 6)
    assert scores(KNOWN["tlx"], {**TLX, "effort": ""}) == {}


def test_what_is_no_scale_has_no_score_but_its_numbers():
    assert scores(ABOUT, {"age": "25", "gender": "", "headsets": "often"}) == {"about.age": 25.0}
    assert BETTER["tlx.raw"] == "lower"
