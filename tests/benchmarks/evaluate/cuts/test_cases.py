"""A whole room is judged: the product's cut, the truth's own labels, and a cut that is refused."""

from benchmarks.evaluate.cuts.cases import BY_TRUTH, MADE, cases_of, scores_of, scores_without_marks
from benchmarks.evaluate.cuts.cutting import cut_by_product


def test_the_product_cuts_a_cube_with_two_boxes(cubes):
    case = cases_of(cubes)[0]
    (score,) = scores_of(case, cut_by_product, ways=["two_boxes"], stopwatch=iter([1, 3]).__next__)
    assert (score.room, score.object_id, score.family) == (cubes.folder.name, "red", "cube")
    assert (score.way, score.seconds, score.refused) == ("two_boxes", 2, "")
    assert score.iou > 0.9
    assert score.iou_by_mesh > 0.9
    assert score.outline > 0.78
    assert score.missing < 0.05
    assert score.foreign < 0.05


def test_a_refused_cut_is_scored_with_its_words(cubes):
    def refuse(capture, prompted):
        raise ValueError("no object in the box")

    (score,) = scores_of(cases_of(cubes)[0], refuse, ways=["one_box"])
    assert (score.iou, score.missing, score.refused) == (0.0, 1.0, "no object in the box")


def test_the_truth_is_the_upper_bound(cubes):
    scores = scores_without_marks(cases_of(cubes))
    assert {score.way for score in scores} == {"propose", MADE, BY_TRUTH}
    for score in scores:
        if score.way == BY_TRUTH:
            assert (score.iou, score.missing, score.left) == (1.0, 0.0, 0.0)
        if score.way == MADE:
            assert score.iou > 0.95
            assert score.box_cm < 10.0
