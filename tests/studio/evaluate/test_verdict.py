"""When a room is called good, and what is said when it is not."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.prepare.footage.capture import Capture, CaptureKind, Rejected
from scenes.prepare.footage.sharpness import Reason
from scenes.prepare.train.trainer import PRESETS, Moment, TrainingResult, ViewScore
from studio.evaluate.verdict import outcome_of, verdict_of

ENOUGH = PRESETS["default"].iterations


def prepared(psnrs, *, steps=ENOUGH, placed=40, failed=0, sigma=0.001, is_guess=False, rejected=()):
    """What the verdict looks at of a preparation."""
    scores = tuple(ViewScore(f"{k:03d}.jpg", psnr, 0.9) for k, psnr in enumerate(psnrs))
    history = (Moment(steps, 100.0, 1000, 0.02, None),)
    return SimpleNamespace(
        training=TrainingResult(None, scores, history, "a test"),
        sfm=SimpleNamespace(placed=range(placed), failed=range(failed), advice=()),
        alignment=SimpleNamespace(
            metres_per_unit=lambda: (1.0, sigma), warnings=(), is_guess=is_guess
        ),
        capture=Capture(CaptureKind.PHOTOS, "photos", Path(), (), rejected),
    )


def test_sharp_views_of_a_whole_room_are_good():
    verdict = verdict_of(prepared([33.0] * 10))
    assert verdict.good
    assert verdict.headline == "The room is ready"
    assert not verdict.notes


def test_a_blurred_room_is_not_called_ready():
    verdict = verdict_of(prepared([24.5] * 10))
    assert not verdict.good
    assert "ready" not in verdict.headline
    assert "24.5 dB" in verdict.headline
    assert "good is 28 or more" in verdict.notes[0]


def test_few_steps_are_named():
    verdict = verdict_of(prepared([24.5] * 10, steps=640))
    assert not verdict.good
    assert "hardly trained (24.5 dB after 640 steps)" in verdict.headline
    assert f"--steps {ENOUGH}" in verdict.notes[0]


def test_few_steps_that_were_enough_are_no_fault():
    assert verdict_of(prepared([33.0] * 10, steps=640)).good


def test_a_missing_part_is_not_hidden_by_the_mean():
    psnrs = [34.0] * 9 + [14.0, 15.0, 17.0]
    assert np.mean(psnrs) > 28
    verdict = verdict_of(prepared(psnrs))
    assert not verdict.good
    assert "wrong from 3 of 12 new places" in verdict.headline
    assert "009.jpg, 010.jpg, 011.jpg" in verdict.notes[0]


def test_one_poor_view_of_many_is_none():
    assert verdict_of(prepared([34.0] * 11 + [17.0])).good


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"placed": 40, "failed": 20}, "only 40 of 60 pictures"),
        ({"placed": 12}, "12 pictures only"),
        ({"sigma": 0.2}, "its scale is uncertain"),
    ],
)
def test_other_faults_are_named_too(change, words):
    verdict = verdict_of(prepared([33.0] * 10, **change))
    assert not verdict.good
    assert words in verdict.headline


def test_a_room_whose_unit_is_estimated_is_ready_with_the_remedy():
    verdict = verdict_of(prepared([31.6] * 10, is_guess=True, sigma=0.25))
    assert verdict.good
    assert verdict.headline == (
        "The room is ready, its unit is estimated: measure one known length in it"
    )


def test_files_that_were_not_read_are_named_and_counted_with_the_remedy():
    rejected = tuple(Rejected(f"IMG_{k}.HEIC", Reason.UNREADABLE) for k in range(24))
    verdict = verdict_of(prepared([33.0] * 10, rejected=rejected))
    assert verdict.good
    assert verdict.notes[0].startswith("24 files were not read: IMG_0.HEIC, IMG_1.HEIC, ")
    assert "and 19 more. Export them as JPEG" in verdict.notes[0]


def test_no_view_kept_aside_is_no_fault():
    assert verdict_of(prepared([])).good


def test_codes_residuals_size_scale_and_verdict_are_plain_values():
    anchor = SimpleNamespace(
        payload="A", side_m=0.2, views=("1", "2", "3"), residual_px=0.4, residual_mm=1.25
    )

    class Room(SimpleNamespace):
        def __len__(self):
            return 2

    prepared = SimpleNamespace(
        training=TrainingResult(
            None, (), (Moment(PRESETS["default"].iterations, 1.0, 2, 0.02, None),), "a test"
        ),
        sfm=SimpleNamespace(placed=range(12), failed=("9.jpg",), advice=("Film the corner.",)),
        alignment=SimpleNamespace(
            metres_per_unit=lambda: (2.0, 0.01), warnings=(), anchors=(anchor,), is_guess=False
        ),
        capture=SimpleNamespace(not_read=lambda: "", notes=()),
        package=SimpleNamespace(room=Room(means=np.array([[0.0, -1, 0], [3, 1, 2.5]]))),
    )
    found = json.loads(json.dumps(outcome_of(prepared)))
    assert found["codes"] == [
        {"payload": "A", "side_m": 0.2, "photos": 3, "residual_px": 0.4, "residual_mm": 1.25}
    ]
    assert (found["low_m"], found["high_m"]) == ([0.0, -1.0, 0.0], [3.0, 1.0, 2.5])
    assert found["scale_sigma_share"] == 0.005
    assert (found["splats"], found["photos_placed"], found["good"]) == (2, 12, False)
    assert found["photos_failed"] == ["9.jpg"]
    assert "Film the corner." in found["notes"]
    means = np.zeros((200, 3))
    means[:, 0] = np.linspace(0.0, 4.0, 200)
    means[100] = (60.0, -40.0, 9.0)  # seen through a window
    prepared.package.room.means = means
    found = outcome_of(prepared)
    size_m = np.subtract(found["high_m"], found["low_m"])
    assert size_m.tolist() == [pytest.approx(4.0, abs=0.1), 0.0, 0.0]
