"""Refined models are judged by true pictures, before and after; refusals are counted."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.evaluate.cuts.cases import cases_of
from benchmarks.evaluate.cuts.refining import (
    BY_BOXES,
    BY_TRUTH,
    RefineScore,
    quality_db,
    refine_rows,
    refine_table,
    refined_scores,
)
from benchmarks.evaluate.cuts.true_views import TrueRoom
from scenes.pose import Pose
from scenes.prepare.refine.refine import RefineOptions
from scenes.state import ObjectModel
from studio.console.progress import Progress

QUIET = Progress(lambda line, last: None)


@pytest.fixture(scope="module")
def draw(cube_meshes):
    def drawn(capture, *, aside):
        return TrueRoom(cube_meshes, capture, aside=aside, true_from_package=Pose.identity())

    return drawn


def test_a_model_in_its_place_is_better_than_one_beside_it(cubes, draw):
    splats = cubes.package.room.select(cases_of(cubes)[0].truth.labels)
    model = ObjectModel("red", "red", "", splats, (0.4, 0.4, 0.4), 0.0, Pose.identity())
    beside = replace(model, world_from_object=Pose.from_yaw(0.0, (0.3, 0.3, 0.0)))
    with draw(cubes, aside=cubes.photos[7::8]) as truth:
        views = truth.aside_views(0)
        # The side that this photo shows is in the shade, and the splats are not.
        shade = views[0].rgb[views[0].shown][:, 0].mean() / (200 / 255)
        colours = np.array([[shade, 0.0]] * 3)
        right, wrong = (quality_db(m, views, colours=colours) for m in (model, beside))
    assert right > wrong + 3
    assert math.isnan(quality_db(model, [], colours=colours))


def test_an_object_is_cut_refined_and_judged(cubes, draw):
    (score,) = refined_scores(
        cases_of(cubes)[:1],
        draw=draw,
        progress=QUIET,
        ways=[BY_BOXES],
        options=RefineOptions(steps=20, threads=1),
        stopwatch=iter([1, 3]).__next__,
    )
    assert (score.object_id, score.way, score.refused, score.seconds) == ("red", BY_BOXES, "", 2)
    assert score.photos == 11
    assert score.splats > 1000
    assert score.aside_db > score.aside_before_db - 3
    assert refined_scores([], draw=draw, progress=QUIET) == []


def test_rows_have_bars_for_the_products_own_cut():
    fine = RefineScore("random-1", "mug", "mug", BY_BOXES, 9, 3000, 12.0, 31.0, 26.0, 28.0, 20.0)
    scores = [
        fine,
        replace(fine, object_id="book", aside_db=27.0, unseen_db=math.nan),
        replace(fine, object_id="lamp", refused="2 photos show it"),
        replace(fine, way=BY_TRUTH, aside_db=20.0),
    ]
    rows = {row.name: row for row in refine_rows(scores)}
    assert rows["refine.aside_db"].value == 29.0
    assert rows["refine.aside_db"].passed is False
    assert rows["refine.unseen_side_db"].value == 26.0
    assert rows["refine.unseen_side_db"].passed is True
    assert rows["refine.seconds.p95"].passed is True
    assert rows["refine.refused"].value == 1
    assert rows["refine.true_labels.aside_db"].passed is None
    assert refine_rows([]) == []
    table = refine_table(scores)
    assert "2 photos show it" in table
    assert "28.0 ->  31.0" in table
