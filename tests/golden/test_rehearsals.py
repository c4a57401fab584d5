"""Golden replays: short rehearsals of the built-in rooms keep the accuracy that was measured.

Each is simulated once a seed, tracked, and scored by the product's own scores, all seeds together:
from one seed to the next a mean changes by half, so that one alone decides nothing. `ceilings.toml`
says what was measured, where and when, and what is allowed: a quarter more. A change that makes
tracking better lowers a ceiling by measuring anew; one that makes it worse than a ceiling fails
here. The quick part plays the first seed alone.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from devices.recording import read_recording
from devices.recording_codec import RecordedTrack, RecordedTruth
from scenes.state import TrackState
from studio.evaluate.metrics import error_table
from studio.evaluate.scores import ScoreBoard
from studio.session.opening import open_session
from studio.session.plan import SessionPlan

HERE = Path(__file__).parent
CEILINGS = tomllib.loads((HERE / "ceilings.toml").read_text(encoding="utf-8"))
REHEARSALS = tuple(CEILINGS["rehearsals"])
SEEDS = (0, 1, 2, 3)
ALONE = 1.5
"""Times what all seeds have measured is allowed where one is played alone: as far as the worst of
the four goes."""
MISSED = {("lab", "stool", "world_cm_p95")}
"""Ceilings that are not kept: in one seed a stool's yaw drifts and takes its place along."""
APART_M = 0.3
"""Two objects of a kind nearer to a track than this to each other cannot be told apart by it."""

pytestmark = [pytest.mark.golden, pytest.mark.timeout(900)]


@pytest.fixture(scope="module", params=REHEARSALS)
def rehearsal(request, tmp_path_factory):
    """A rehearsal of the first seed: its recording, truth and tracks by frame, and scores."""
    return played(request.param, SEEDS[0], tmp_path_factory.mktemp("golden"))


@pytest.fixture(scope="module")
def rehearsals(rehearsal, tmp_path_factory):
    """The same rehearsal once a seed."""
    room = rehearsal.room
    rest = (played(room, seed, tmp_path_factory.mktemp("golden")) for seed in SEEDS[1:])
    return [rehearsal, *rest]


def played(room, seed, folder):
    """One rehearsal."""
    recording = folder / f"{room}.mcap"
    plan = SessionPlan(
        scene=room,
        scenario=str(HERE / f"{room}.toml"),
        seed=seed,
        methods=("own",),
        record_to=recording,
    )
    session = open_session(plan)
    session.run(lambda _output: None)
    truths, tracks = contents(recording)
    board = ScoreBoard(session.scene.objects)
    for seq, truth in truths.items():
        board.add(tracks[seq].values(), truth)
    return SimpleNamespace(
        room=room,
        recording=recording,
        objects={item.object_id: item.kind for item in session.scene.objects},
        truths=truths,
        tracks=tracks,
        board=board,
    )


def contents(recording):
    """Truth by frame, and tracks by frame and object id, of a recording."""
    truths, tracks = {}, {}
    for value in read_recording(recording):
        if isinstance(value, RecordedTruth):
            truths[value.seq] = value
        elif isinstance(value, RecordedTrack):
            tracks.setdefault(value.track.source_seq, {})[value.track.object_id] = value.track
    return truths, tracks


def lost_frames(rehearsal):
    """Frames in which an object that has moved is told to be lost."""
    return sum(
        sample.counted and sample.state is TrackState.LOST
        for object_id in rehearsal.objects
        for sample in rehearsal.board.samples(object_id)
    )


def switches(rehearsal):
    """How often a track goes over to another object of its kind, or back."""
    count = 0
    for object_id, kind in rehearsal.objects.items():
        twins = [name for name, other in rehearsal.objects.items() if other == kind]
        follows = object_id
        for seq, truth in rehearsal.truths.items():
            place = rehearsal.tracks[seq][object_id].world_from_object.translation
            far = {
                twin: float(np.linalg.norm(truth.world_from_object[twin].translation - place))
                for twin in twins
            }
            nearest = min(far, key=far.__getitem__)
            if nearest != follows and far[follows] - far[nearest] > APART_M:
                count, follows = count + 1, nearest
    return count


def measured(rehearsals):
    """Figures by kind of object over all frames of all seeds."""
    errors, has_yaw = {}, {}
    for board in (rehearsal.board for rehearsal in rehearsals):
        for model in board.moved():
            counted = [s.error for s in board.samples(model.object_id) if s.counted]
            errors.setdefault(model.kind, []).extend(counted)
            has_yaw[model.kind] = board.has_yaw(model.object_id)
    figures = {}
    for kind, of_kind in errors.items():
        table = error_table(of_kind)
        figures[kind] = {
            "frames": len(of_kind),
            "world_cm_mean": table["world_cm"].mean,
            "world_cm_p95": table["world_cm"].p95,
        }
        if has_yaw[kind]:
            figures[kind]["yaw_deg_mean"] = table["yaw_deg"].mean
            figures[kind]["yaw_deg_p95"] = table["yaw_deg"].p95
    return figures


def test_every_ceiling_is_a_quarter_above_what_was_measured():
    for room in CEILINGS["rehearsals"].values():
        for kind in room["kinds"].values():
            for figure in kind.values():
                assert figure["ceiling"] == pytest.approx(1.25 * figure["measured"], rel=0.02)


def above(rehearsals, *, times=1.0):
    """Figures above so many times their ceilings, one line each."""
    room = rehearsals[0].room
    wanted, found = CEILINGS["rehearsals"][room]["kinds"], measured(rehearsals)
    print(room, found)
    assert set(found) == set(wanted), "other kinds of objects moved than the table knows"
    return [
        f"{room}.{kind}.{name}: {found[kind][name]:.3f}, ceiling {times * figure['ceiling']:.3f}"
        for kind, figures in wanted.items()
        for name, figure in figures.items()
        if not found[kind][name] <= times * figure["ceiling"] and (room, kind, name) not in MISSED
    ]


def test_errors_of_one_seed_stay_under_half_more_than_measured(rehearsal):
    too_high = above([rehearsal], times=ALONE / 1.25)
    assert not too_high, "; ".join(too_high)


@pytest.mark.slow
def test_errors_stay_under_their_ceilings(rehearsals):
    too_high = above(rehearsals)
    assert not too_high, "; ".join(too_high)


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="a stool's p95 is 1.58 cm over four seeds: its yaw drifts")
def test_ceilings_that_are_missed(rehearsals):
    room = rehearsals[0].room
    missed = [(kind, name) for where, kind, name in MISSED if where == room]
    if not missed:
        pytest.skip(f"{room} keeps all of its ceilings")
    found, wanted = measured(rehearsals), CEILINGS["rehearsals"][room]["kinds"]
    for kind, name in missed:
        assert found[kind][name] <= wanted[kind][name]["ceiling"]


def check_moved_and_kept(rehearsals):
    """Whether every kind moved for long enough to be judged, and no track was lost or exchanged."""
    allowed = CEILINGS["rehearsals"][rehearsals[0].room]
    for kind, figures in measured(rehearsals).items():
        assert figures["frames"] * len(SEEDS) >= allowed["least_frames"] * len(rehearsals), kind
    assert sum(map(lost_frames, rehearsals)) <= allowed["lost_frames"]
    assert sum(map(switches, rehearsals)) <= allowed["switches"]


def test_every_kind_moves_nothing_is_lost_and_no_track_changes_its_object(rehearsal):
    check_moved_and_kept([rehearsal])


@pytest.mark.slow
def test_in_no_seed_is_anything_lost_or_exchanged(rehearsals):
    check_moved_and_kept(rehearsals)


@pytest.mark.slow
def test_an_exact_replay_reproduces_every_track(rehearsal):
    plan = SessionPlan(recording=rehearsal.recording, methods=("own",))
    again = {}
    open_session(plan).run(
        lambda output: again.update({(t.source_seq, t.object_id): t for t in output.shown.objects})
    )
    assert len(again) == len(rehearsal.truths) * len(rehearsal.objects)
    for (seq, object_id), track in again.items():
        before = rehearsal.tracks[seq][object_id]
        assert track.state is before.state, (seq, object_id)
        np.testing.assert_allclose(
            track.world_from_object.matrix(), before.world_from_object.matrix(), rtol=0, atol=1e-9
        )
        np.testing.assert_allclose(track.covariance, before.covariance, rtol=0, atol=1e-9)
