"""Figures: skin that follows the bones, colours that tell people apart."""

import numpy as np
import pytest

from scenes.bodies.bones import rest_skeleton
from scenes.bodies.crowd import ROLE_COLOURS
from scenes.bodies.figure import colours_of, posed, rest_figure, tint
from scenes.bodies.goals import unknown
from scenes.bodies.solve import solve_bodies

MAX_VERTICES = 16_000


@pytest.fixture(scope="module")
def figure():
    return rest_figure()


def test_at_rest_the_skin_is_where_it_was_made(figure):
    places, normals = posed(figure, rest_skeleton())
    assert len(places) < MAX_VERTICES
    assert places[:, 2].min() == pytest.approx(0.0, abs=0.015)
    assert 1.68 < places[:, 2].max() < 1.78, "a head over eyes at 1.6 m"
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-3
    left, right = places[:, 1].max(), -places[:, 1].min()
    assert left == pytest.approx(right, abs=0.01)


def test_each_closed_part_stays_closed_and_faces_look_outward(figure):
    _, skeleton = solve_bodies(None, unknown(1))
    places, normals = posed(figure, skeleton)
    a, b, c = (places[figure.faces[:, k]] for k in range(3))
    out = np.cross(b - a, c - a)
    towards = np.einsum("ni,ni->n", out, normals[figure.faces].mean(axis=1))
    assert (towards >= 0.0).mean() > 0.985
    volume = np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0
    assert 0.04 < volume < 0.11, (
        "cubic metres of a person, clothes counted twice where they overlap"
    )


def test_somebody_taller_is_larger_as_a_whole(figure):
    goals = unknown(2)
    goals.eyes[1, 2] = 1.8
    _, skeleton = solve_bodies(None, goals)
    small, tall = (posed(figure, skeleton, row=row)[0] for row in (0, 1))
    assert tall[:, 2].max() / small[:, 2].max() == pytest.approx(1.8 / 1.6, rel=0.01)


def test_two_people_differ_and_a_person_stays_the_same(figure):
    looks = {
        name: colours_of(figure, name=name, top=tint(ROLE_COLOURS["remote"], name))
        for name in ("p1", "p2", "p3")
    }
    assert len({look.tobytes() for look in looks.values()}) == 3
    again = colours_of(figure, name="p1", top=tint(ROLE_COLOURS["remote"], "p1"))
    assert np.array_equal(looks["p1"], again)


def test_arms_are_what_people_see_of_themselves(figure):
    share = figure.is_arm.mean()
    assert 0.2 < share < 0.6
    places, _ = posed(figure, rest_skeleton())
    arms = places[figure.faces[figure.is_arm]]
    assert np.abs(arms[..., 1]).min() > 0.3, "nothing of the trunk"
