"""Rows of many cuts: their names, their bars, and the tables for people."""

import math

from benchmarks.evaluate.cuts.rows import breakdown, cut_rows
from benchmarks.evaluate.cuts.scores import CutScore


def score(name, iou, **other):
    usual = {
        "room": "random-1",
        "family": "mug",
        "way": "two_boxes",
        "photos": 2,
        "iou_by_mesh": iou,
        "outline": iou,
        "missing": 0.0,
        "foreign": 0.0,
        "taken": 0.0,
        "box_cm": 1.0,
        "left": 0.0,
        "seconds": 3.0,
    }
    return CutScore(object_id=name, iou=iou, **{**usual, **other})


def test_bars_are_for_two_boxes_and_one_click():
    scores = [
        score("a", 0.96),
        score("b", 0.80, missing=0.2, family="chair"),
        score("a", 0.93, way="click"),
        score("a", 0.99, way="true_labels", box_cm=math.nan),
    ]
    rows = {row.name: row for row in cut_rows(scores)}
    assert rows["cuts.iou.mean"].value == 0.88
    assert rows["cuts.iou.mean"].passed is False
    assert rows["cuts.iou.ge_90_percent"].value == 50.0
    assert rows["cuts.outline.mean"].value == 0.88
    assert rows["cuts.missing_percent"].value == 50.0
    assert rows["cuts.foreign_percent"].passed is True
    assert rows["cuts.box_cm.p95"].passed is True
    assert rows["cuts.seconds.p95"].passed is True
    assert rows["cuts.click_iou.mean"].passed is True
    assert rows["cuts.true_labels.iou.mean"].bar is None
    assert "cuts.true_labels.box_cm.p95" not in rows
    assert rows["cuts.family.chair.iou.mean"].value == 0.80


def test_the_worst_come_first_with_what_is_wrong():
    scores = [score("good", 0.97), score("bad", 0.1, foreign=0.9), score("no", 0.0, refused="why")]
    families, worst = breakdown(scores)
    assert "mug" in families
    lines = worst.splitlines()
    assert "no" in lines[1]
    assert "why" in lines[1]
    assert "bad" in lines[2]
    assert "foreign 90 %" in lines[2]


def test_no_cut_gives_no_row():
    assert cut_rows([]) == []
    assert breakdown([]) == []
