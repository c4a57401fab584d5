"""What the slow tables found broken, in small: hidden objects, and ten objects moved overnight.

Same rooms, pictures and scores as `nexus evaluate occlusion` and `recover`, one seed of each. The
quick part hides the chair for a shorter time, and leaves objects moved overnight to the random
room.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.evaluate.tables import occlusion, recover
from studio.console.progress import Progress

CEILINGS = tomllib.loads((Path(__file__).parent / "ceilings.toml").read_text(encoding="utf-8"))
HIDDEN, MOVED = CEILINGS["occlusion"], CEILINGS["recover"]
QUICK_FRAMES = {"HIDDEN_FRAMES": 8, "AFTER_FRAMES": 5}
"""Pictures of the quick part while the chair is hidden altogether, and afterwards: more than the
third of a second within which it must be found."""

pytestmark = [pytest.mark.golden, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """Our tracker, one seed, the tables' own conditions."""
    return Asked(
        methods=("own",),
        seeds=(0,),
        conditions=Conditions(),
        cache=TakeCache(tmp_path_factory.mktemp("takes")),
        progress=Progress(lambda _text, _final: None),
    )


def values(findings):
    """Figures by the rows' names."""
    return {row.name: row.value for row in findings.rows}


@pytest.fixture(
    scope="module",
    params=[QUICK_FRAMES, pytest.param({}, marks=pytest.mark.slow)],
    ids=["quick", "whole"],
)
def hidden(request, asked):
    """The chair pushed with 80 % of it hidden, and hidden altogether, at rest and in motion."""
    with pytest.MonkeyPatch.context() as patch:
        for name, frames in request.param.items():
            patch.setattr(occlusion, name, frames)
        return values(occlusion.evaluate(asked, shares=(0.8,)))


def test_a_pushed_chair_of_which_a_fifth_shows_is_followed(hidden):
    assert hidden["occlusion.80.world_cm.mean"] <= HIDDEN["hidden_80_cm"]["ceiling"]


def test_a_chair_hidden_altogether_is_found_again(hidden):
    assert hidden["occlusion.refound_still_s"] <= HIDDEN["refound_s"]["ceiling"]
    assert hidden["occlusion.refound_moved_s"] <= HIDDEN["refound_s"]["ceiling"]
    assert hidden["occlusion.switches"] == 0


@pytest.mark.slow
def test_most_of_ten_objects_moved_overnight_are_found(asked):
    found = values(recover.evaluate(asked, seconds=MOVED["seconds"]))
    print(found)
    assert found["recover.right"] >= MOVED["right"]["floor"]
