"""A random room: objects moved since the scan are found, and what stands still stays there.

The smallest development room by lens size; its stills each a session of its own, then some after
another in one session, and its sequence. `ceilings.toml` says what was measured and what is
allowed: one object fewer right, one wrong one more that is not flagged, none moved at rest. The
quick part takes two stills, a chain of two and the beginning of the sequence.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest

from benchmarks.evaluate.answers import (
    REST_BAR_CM,
    is_asked,
    is_right,
    is_unflagged,
    rest_moved_cm,
)
from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.evaluate.random_rooms.filming import RoomFilm
from benchmarks.evaluate.random_rooms.scanning import scan_of
from benchmarks.evaluate.random_rooms.staging import staged
from benchmarks.evaluate.random_rooms.tracking import CameraError, RoomTrial
from benchmarks.random_rooms.room import random_room
from studio.session.trackers.methods import make_method

CEILINGS = tomllib.loads((Path(__file__).parent / "ceilings.toml").read_text(encoding="utf-8"))
ALLOWED = CEILINGS["random_room"]
PICTURES, FRAME_NS = 10, 100_000_000
"""Each still of the chained session is shown for a second."""
EXTENTS = ["quick", pytest.param("whole", marks=pytest.mark.slow)]

pytestmark = [pytest.mark.golden, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """The room's stills and sequence."""
    room = random_room(ALLOWED["seed"])
    cache = TakeCache(tmp_path_factory.mktemp("takes"))
    return room, RoomFilm(room, staged(room), cache=cache, advance=lambda _share: None)


@pytest.fixture(scope="module")
def trial(filmed):
    """Our tracker in it."""
    room, _ = filmed
    scan = scan_of(room)
    return RoomTrial(
        room,
        scan,
        make_method("own", scan),
        camera_error=CameraError(),
        stopwatch_ns=lambda: 0,
    )


@pytest.fixture(scope="module", params=EXTENTS)
def allowed(request):
    """Frames that are played and errors that are allowed, of a part or of everything."""
    return ALLOWED[request.param]


@pytest.fixture(scope="module")
def answers(filmed, trial, allowed):
    """What the tracker says of every object in the stills, each a session of its own."""
    _, film = filmed
    return [judged.answer for number in allowed["stills"] for judged in trial.still(film, number)]


@pytest.fixture(scope="module")
def chained(filmed, trial, allowed):
    """The same at the end of each still of a chain, all in one session."""
    _, film = filmed
    stills = [film.still(number) for number in allowed["chained"]["stills"]]
    shown = [still for still in stills for _ in range(PICTURES)]
    session = (at(still, seq * FRAME_NS, seq) for seq, still in enumerate(shown))
    judged = list(trial.session("chained", session))
    return [one.answer for picture in judged[PICTURES - 1 :: PICTURES] for one in picture]


def at(still, t_ns, seq):
    """The still as the picture of a stream."""
    frame = replace(still.frame, seq=seq, t_ns=t_ns, received_ns=t_ns)
    return replace(still, frame=frame, moment=replace(still.moment, t_ns=t_ns))


def test_objects_are_found_where_they_were_put(answers, allowed):
    asked = [answer for answer in answers if is_asked(answer)]
    wrong = [answer for answer in asked if not is_right(answer)]
    unflagged = [answer for answer in wrong if is_unflagged(answer)]
    print(len(asked), len(wrong), len(unflagged), [(a.still, a.object_id) for a in wrong])
    assert len(asked) == allowed["asked"]
    assert len(asked) - len(wrong) >= allowed["right"]["floor"]
    assert len(unflagged) <= allowed["wrong_unflagged"]["ceiling"]


def test_what_was_not_moved_stays_at_its_place(answers):
    farthest_cm, too_far = rest_moved_cm(answers)
    assert too_far == 0, f"{farthest_cm:.1f} cm, allowed {REST_BAR_CM} cm"


def test_objects_moved_between_the_stills_of_a_session_are_found(chained, allowed):
    asked = [answer for answer in chained if is_asked(answer)]
    wrong = [answer for answer in asked if not is_right(answer)]
    unflagged = [answer for answer in wrong if is_unflagged(answer)]
    print(len(asked), len(wrong), len(unflagged), [(a.still, a.object_id) for a in wrong])
    chain = allowed["chained"]
    assert len(asked) - len(wrong) >= chain["right"]["floor"]
    assert len(unflagged) <= chain["wrong_unflagged"]["ceiling"]


def test_what_nobody_touches_in_a_sequence_stays_at_its_place(filmed, trial, allowed):
    _, film = filmed
    session = trial.session("sequence", islice(film.sequence(), allowed["sequence_pictures"]))
    answers = [judged.answer for picture in session for judged in picture]
    farthest_cm, too_far = rest_moved_cm(answers)
    assert too_far == 0, f"{farthest_cm:.1f} cm, allowed {REST_BAR_CM} cm"
