"""Checkpoints come back as they went, or not at all."""

import numpy as np
import pytest

from scenes.prepare.train import checkpoint
from scenes.prepare.train.checkpoint import Checkpoint
from scenes.prepare.train.optimiser.rows import fresh_rows
from scenes.prepare.train.trainer import Moment


def some(job="a room"):
    rng = np.random.default_rng(0)
    return Checkpoint(
        job=job,
        rows=fresh_rows(rng.normal(size=(9, 23)).astype(np.float32)),
        iteration=120,
        densified_at=100,
        seconds=3.5,
        first_splats=7,
        queue=(3, 1, 2),
        random=dict(rng.bit_generator.state),
        exposure=(rng.normal(size=26), rng.normal(size=(2, 26)), np.arange(5)),
        history=(Moment(100, 2.5, 9, 0.1, None), Moment(110, 3.0, 9, 0.09, 21.5)),
    )


def test_everything_comes_back(tmp_path):
    before = some()
    checkpoint.save(before, tmp_path)
    after = checkpoint.load(tmp_path, "a room")
    assert after is not None
    for name in (
        "job",
        "iteration",
        "densified_at",
        "seconds",
        "first_splats",
        "queue",
        "random",
        "history",
    ):
        assert getattr(after, name) == getattr(before, name)
    np.testing.assert_array_equal(after.rows.values, before.rows.values)
    for one, other in zip(after.exposure, before.exposure, strict=True):
        np.testing.assert_array_equal(one, other)
    assert [path.name for path in tmp_path.iterdir()] == [checkpoint.NAME]


def test_another_job_does_not_take_it(tmp_path):
    checkpoint.save(some(), tmp_path)
    assert checkpoint.load(tmp_path, "another room") is None
    assert checkpoint.load(tmp_path / "elsewhere", "a room") is None


@pytest.mark.parametrize("share", [0.0, 0.3, 0.98])
def test_a_damaged_one_counts_as_none(tmp_path, share):
    checkpoint.save(some(), tmp_path)
    path = tmp_path / checkpoint.NAME
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert checkpoint.load(tmp_path, "a room") is None


def test_it_can_be_forgotten(tmp_path):
    checkpoint.save(some(), tmp_path)
    checkpoint.remove(tmp_path)
    checkpoint.remove(tmp_path)
    assert checkpoint.load(tmp_path, "a room") is None
