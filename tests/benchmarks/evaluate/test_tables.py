"""Whole tables on small pictures: minutes on a busy machine."""

import importlib
from dataclasses import replace

import pytest

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.takes import TakeCache
from studio.console.progress import Progress

FIGURES = {
    "rest": ("rest.jitter_mm", "rest.jitter_deg"),
    "camera": ("camera.left_deg", "live.located_percent", "live.calibration.px"),
}


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    return Asked(
        methods=("own",),
        seeds=(0,),
        conditions=Conditions(lens_size_px=320),
        cache=TakeCache(tmp_path_factory.mktemp("takes")),
        progress=Progress(lambda _text, _final: None),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_a_table_gives_its_figures_and_gives_them_again(name, asked):
    module = importlib.import_module(f"benchmarks.evaluate.tables.{name}")
    first, second = (module.evaluate(asked).rows for _ in range(2))
    assert set(FIGURES[name]) <= {row.name for row in first}
    first, second = (
        [(row.name, row.value) for row in rows if row.unit != "s"] for rows in (first, second)
    )
    assert first == second


@pytest.mark.slow
def test_the_paper_s_method_stands_beside_ours(asked):
    from benchmarks.evaluate.tables.rest import evaluate

    rows = evaluate(replace(asked, methods=("own", "paper"))).rows
    names = {row.name for row in rows}
    assert {"rest.jitter_mm", "paper.rest.jitter_mm"} <= names
