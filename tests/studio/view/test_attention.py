"""Who points and looks at what."""

import numpy as np

from scenes.frames import look_at
from scenes.state import Avatar
from studio.view.attention import attention_of

SPHERES = {
    "near": (np.array([0.0, 2.0, 0.5]), 0.4),
    "far": (np.array([0.3, 4.0, 0.5]), 0.4),
    "aside": (np.array([3.0, 2.0, 0.5]), 0.4),
}
EYE = np.array([0.0, 0.0, 1.6])


def somebody(target, ray=None):
    target = np.array(target)
    return Avatar("p1", "remote", look_at(EYE, target), ray=None if ray is None else np.array(ray))


def test_what_a_ray_ends_in_is_meant_not_what_it_passes():
    through = attention_of(somebody([0, 2, 0.5], [EYE, SPHERES["far"][0]]), SPHERES)
    assert through.points_at == "far"
    assert attention_of(somebody([0, 2, 0.5], [EYE, [0, 2, 0.9]]), SPHERES).points_at == "near"
    assert attention_of(somebody([0, 2, 0.5], [EYE, [-3, 1, 0]]), SPHERES).points_at == ""
    assert attention_of(somebody([0, 2, 0.5], [EYE, EYE]), SPHERES).points_at == ""
    short = attention_of(somebody([0, 2, 0.5], [EYE, [0, 0.5, 1.4]]), SPHERES)
    assert short.points_at == ""  # it ends before


def test_what_is_nearest_to_the_middle_of_the_view_is_looked_at():
    assert attention_of(somebody([0, 2, 0.5]), SPHERES).looks_at == "near"
    assert attention_of(somebody([3, 2, 0.5]), SPHERES).looks_at == "aside"
    assert attention_of(somebody([-3, 0, 1.6]), SPHERES).looks_at == ""
    assert attention_of(somebody([0, 2, 0.5]), SPHERES).points_at == ""
