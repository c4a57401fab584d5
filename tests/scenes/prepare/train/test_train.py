"""The built-in trainer end to end, on a small scene."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.prepare.progress import Cancelled, silent
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train import checkpoint
from scenes.prepare.train.train import STEREO_SHARE, BuiltInTrainer
from scenes.prepare.train.trainer import PRESETS, TrainingOptions

OPTIONS = TrainingOptions(iterations=300, budget=900, held_out_every=8, exposure=False, previews=3)


class Watch:
    """A stopwatch that goes on by a second each time it is read."""

    def __init__(self, step=1.0):
        self.now, self.step = 0.0, step

    def __call__(self):
        self.now += self.step
        return self.now


def trainer(options=OPTIONS, watch=None, seed=4):
    return BuiltInTrainer(
        options, rng=lambda: np.random.default_rng(seed), stopwatch=watch or Watch(1e-6)
    )


def arrays_of(cloud):
    return cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh


@pytest.fixture(scope="module")
def result(filmed_ball, tmp_path_factory):
    folder = tmp_path_factory.mktemp("training")
    previews, notes = [], []
    result = trainer().train(
        filmed_ball,
        folder,
        progress=lambda done, note: notes.append((done, note)),
        show=previews.append,
    )
    return result, previews, notes


def test_views_kept_aside_are_drawn_well(result):
    trained, previews, _ = result
    assert [score.view for score in trained.held_out] == ["07.png", "15.png"]
    assert trained.psnr_db > 26
    assert trained.ssim > 0.85
    assert trained.psnr_db > previews[0].psnr_db + 6


def test_the_budget_is_filled_and_kept(result):
    trained, _, _ = result
    assert 0.9 * OPTIONS.budget <= len(trained.cloud) <= OPTIONS.budget


def test_splats_lie_on_what_was_filmed(result):
    trained, _, _ = result
    from_ball = np.abs(np.linalg.norm(trained.cloud.means, axis=1) - 1)
    assert np.median(from_ball) < 0.05
    assert trained.floating is not None
    assert trained.floating < 0.05


def test_it_tells_how_it_goes(result):
    trained, previews, notes = result
    assert [done for done, _ in notes] == sorted(done for done, _ in notes)
    assert notes[-1][0] == 1
    assert "left" in next(note for _, note in notes if "step" in note)
    assert len(previews) == OPTIONS.previews
    assert all(preview.picture.shape == preview.photo.shape for preview in previews)
    assert [m.psnr_db for m in trained.history][:-1] == [p.psnr_db for p in previews]
    assert trained.history[-1].iteration == OPTIONS.iterations


def test_the_same_seed_gives_the_same_splats(result, filmed_ball, tmp_path):
    again = trainer().train(filmed_ball, tmp_path, progress=silent)
    for one, other in zip(arrays_of(result[0].cloud), arrays_of(again.cloud), strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_interrupted_training_goes_on_to_the_same_bits(result, filmed_ball, tmp_path):
    def stop(done, note):
        if done > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        trainer().train(filmed_ball, tmp_path, progress=stop)
    assert (tmp_path / checkpoint.NAME).is_file()
    seen = []
    trained = trainer(seed=99).train(
        filmed_ball, tmp_path, progress=lambda done, note: seen.append((done, note))
    )
    assert min(done for done, note in seen if "step" in note) > 0.5
    for one, other in zip(arrays_of(result[0].cloud), arrays_of(trained.cloud), strict=True):
        np.testing.assert_array_equal(one, other)
    assert [m.iteration for m in trained.history] == [m.iteration for m in result[0].history]


def test_another_job_does_not_go_on_from_a_checkpoint(filmed_ball, tmp_path):
    def stop(done, note):
        if done > STEREO_SHARE:
            raise Cancelled

    with pytest.raises(Cancelled):
        trainer().train(filmed_ball, tmp_path, progress=stop)
    fewer = Reconstruction(
        filmed_ball.views[1:], filmed_ball.points, filmed_ball.colours, filmed_ball.errors_px
    )
    seen = []
    with pytest.raises(Cancelled):
        trainer().train(fewer, tmp_path, progress=lambda d, n: (seen.append(d), stop(d, n)))
    assert STEREO_SHARE < seen[-1] < STEREO_SHARE + 0.2


def test_time_ends_it_too(filmed_ball, tmp_path):
    options = TrainingOptions(seconds=600, budget=500, exposure=True, previews=0)
    trained = trainer(options, Watch(2.0)).train(filmed_ball, tmp_path, progress=silent)
    last = trained.history[-1]
    assert 50 < last.iteration < 300
    assert last.seconds >= 600
    # A long training leaves checkpoints on its way.
    assert (tmp_path / checkpoint.NAME).is_file()


@pytest.mark.parametrize("quality", PRESETS)
def test_qualities_end_by_work_and_not_by_the_clock(quality):
    assert PRESETS[quality].seconds is None
    assert PRESETS[quality].iterations


def test_a_busy_machine_takes_longer_and_makes_the_same_splats(filmed_ball, tmp_path):
    options = replace(OPTIONS, iterations=60, previews=0)
    seen, made = [], []
    for step in (1e-6, 100.0):
        folder = tmp_path / str(step)
        folder.mkdir()
        made.append(
            trainer(options, Watch(step)).train(
                filmed_ball, folder, progress=lambda done, note: seen.append((done, note))
            )
        )
    quick, busy = (trained.history[-1] for trained in made)
    assert (quick.iteration, busy.iteration) == (60, 60)
    assert busy.seconds > 1000 * max(quick.seconds, 1)
    for one, other in zip(*(arrays_of(trained.cloud) for trained in made), strict=True):
        np.testing.assert_array_equal(one, other)
    assert "min left" in seen[-2][1]


def test_progress_counts_the_depth_from_pairs_too(filmed_ball, tmp_path):
    seen = []
    trainer(replace(OPTIONS, iterations=60, previews=0)).train(
        filmed_ball, tmp_path, progress=lambda done, note: seen.append((done, note))
    )
    shares = [done for done, _ in seen]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    depth = [done for done, note in seen if "depth" in note]
    assert len(depth) == 14
    assert max(depth) < STEREO_SHARE
    assert min(done for done, note in seen if "step" in note) > STEREO_SHARE


def test_exposure_is_made_up_for(filmed_ball, tmp_path):
    import cv2

    from scenes.prepare.reconstruction import View

    dim = []
    rng = np.random.default_rng(3)
    for view in filmed_ball.views:
        gain = rng.uniform(0.6, 1.0)
        picture = cv2.imread(str(view.image)).astype(np.float64) * gain
        path = tmp_path / view.name
        cv2.imwrite(str(path), np.round(picture).astype(np.uint8))
        dim.append(View(view.name, path, view.camera, view.world_from_camera))
    uneven = Reconstruction(
        tuple(dim), filmed_ball.points, filmed_ball.colours, filmed_ball.errors_px
    )
    scores = []
    for exposure in (False, True):
        options = TrainingOptions(iterations=400, budget=900, exposure=exposure, previews=0)
        folder = tmp_path / str(exposure)
        folder.mkdir()
        scores.append(trainer(options).train(uneven, folder, progress=silent).psnr_db)
    assert scores[1] > scores[0] + 2


@pytest.mark.parametrize(
    "change",
    [
        {"seconds": None},
        {"seconds": 0.0},
        {"budget": 0},
        {"sh_degree": 4},
        {"held_out_every": 1},
        {"longest_px": 0},
        {"threads": -1},
    ],
)
def test_options_out_of_range_are_refused(change):
    with pytest.raises(ValueError, match="TrainingOptions"):
        TrainingOptions(**change)


def test_too_few_points_or_views_are_refused(filmed_ball, tmp_path):
    few = Reconstruction(
        filmed_ball.views,
        filmed_ball.points[:5],
        filmed_ball.colours[:5],
        filmed_ball.errors_px[:5],
    )
    with pytest.raises(ValueError, match="5 points to start from, wanted at least 10"):
        trainer().train(few, tmp_path, progress=silent)
    one = Reconstruction(
        filmed_ball.views[:1], filmed_ball.points, filmed_ball.colours, filmed_ball.errors_px
    )
    with pytest.raises(ValueError, match="1 views to train on"):
        trainer().train(one, tmp_path, progress=silent)


def test_points_that_no_view_sees_are_refused(filmed_ball, tmp_path):
    elsewhere = Reconstruction(
        filmed_ball.views, filmed_ball.points + 1000, filmed_ball.colours, filmed_ball.errors_px
    )
    with pytest.raises(ValueError, match="not of one world"):
        trainer().train(elsewhere, tmp_path, progress=silent)
