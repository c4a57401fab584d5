"""What a preparation came to is written as plain values."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.prepare.train.trainer import PRESETS, Moment, TrainingResult
from studio.evaluate.prepared.outcome import outcome_of


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
