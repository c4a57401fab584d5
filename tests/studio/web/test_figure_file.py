"""The figure as browsers get it: small, complete, and where the program's own figure is."""

import gzip
import json

import numpy as np
import pytest

from scenes.bodies.bones import rest_skeleton
from scenes.bodies.figure import posed, rest_figure
from scenes.bodies.goals import unknown
from scenes.bodies.skeleton import BONES, ELBOW, EYE_M
from scenes.bodies.solve import solve_bodies
from studio.web.figure_file import COARSER, constants_module, figure_file

MAX_PACKED_BYTES = 300_000


@pytest.fixture(scope="module")
def figures():
    """What the file says of the fine and the coarse figure, with its arrays read."""
    data = figure_file()
    line, _, rest = data.partition(b"\n")
    found = json.loads(line)["figures"]
    for figure in found:
        for name, (at, kind, size) in figure["arrays"].items():
            figure[name] = np.frombuffer(rest, f"<{kind}", size, at)
        grown = np.cumsum(figure["places"].reshape(-1, 3).astype(np.int64), axis=0) % 65_536
        low, high = np.array(figure["low"]), np.array(figure["high"])
        figure["at"] = low + (high - low) * grown / figure["steps"]
        figure["triangles"] = (np.cumsum(figure["faces"].astype(np.int64)) % 65_536).reshape(-1, 3)
        figure["weights"] = np.zeros((len(grown), BONES))
        bones = figure["bones"].reshape(-1, 4)
        rows = np.arange(len(grown))[:, None]
        np.add.at(figure["weights"], (rows, bones), figure["shares"].reshape(-1, 4) / 255.0)
    return found


def test_it_is_small_and_the_same_every_time():
    assert len(gzip.compress(figure_file(), 6)) < MAX_PACKED_BYTES
    assert figure_file() == figure_file()


def test_both_figures_are_whole_and_every_point_is_moved_by_bones(figures):
    for figure, made in zip(figures, (rest_figure(), rest_figure(COARSER)), strict=True):
        assert len(figure["at"]) == len(made.dyes)
        assert len(figure["triangles"]) == len(made.faces)
        assert figure["weights"].sum(axis=1) == pytest.approx(1.0)
        assert np.unique(figure["triangles"]).size == len(figure["at"])
        assert [figure["dyes"].max(), len(made.dye_names)] == [8, 9]
    assert len(figures[1]["triangles"]) < 0.3 * len(figures[0]["triangles"])


def test_skinned_as_browsers_do_it_is_where_the_program_s_figure_is(figures):
    goals = unknown(1)
    goals.wrists[0, 0] = (0.35, 0.25, 1.35)
    _, skeleton = solve_bodies(None, goals)
    origins, turns = skeleton.origins[0], skeleton.rotations[0]
    figure = figures[0]
    local = figure["at"][:, None] - rest_skeleton().origins[0]
    moved = np.einsum("bij,vbj->vbi", turns, local) * skeleton.scales[0] + origins
    places = (figure["weights"][..., None] * moved).sum(axis=1)
    wanted, _ = posed(rest_figure(), skeleton)
    # In another order: corners of the same triangles.
    corners = places[figure["triangles"]].reshape(-1, 3)
    gap = np.linalg.norm(corners - wanted[rest_figure().faces].reshape(-1, 3), axis=1)
    assert np.quantile(gap, 0.999) < 0.002
    assert gap.max() < 0.01


def test_the_solver_s_numbers_are_those_of_the_program():
    lines = constants_module().decode().splitlines()
    values = {}
    for line in lines[1:]:
        name, value = line.removeprefix("export const ").removesuffix(";").split(" = ", 1)
        values[name] = json.loads(value)
    assert values["EYE_M"] == EYE_M
    assert values["ELBOW"] == [ELBOW.low, ELBOW.high]
    assert values["BONE"]["HEAD"] == 4
    assert len(values["REST_ORIGINS"]) == BONES
