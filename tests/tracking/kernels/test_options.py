"""The kernels' constants, which both languages take from one object."""

from dataclasses import FrozenInstanceError, fields

import pytest

from tracking.kernels.background import LEARNING, LearningOptions
from tracking.kernels.options import OPTIONS, KernelOptions
from tracking.kernels.reduction import REDUCTION, ReductionOptions


def test_the_native_kernels_get_every_constant_but_those_of_a_request():
    names = {field.name for field in fields(KernelOptions)}
    left_out = {"texture_correlation", "plain_correlation"}
    assert left_out < names
    assert OPTIONS.for_native() == {n: getattr(OPTIONS, n) for n in names - left_out}


def test_nobody_changes_what_the_product_runs_with():
    with pytest.raises(FrozenInstanceError):
        OPTIONS.foreign = 0.5


def test_learning_gives_the_native_kernel_all_of_its_constants():
    names = {field.name for field in fields(LearningOptions)}
    assert LEARNING.for_native() == {name: getattr(LEARNING, name) for name in names}


def test_contour_and_surface_share_the_constants_of_a_reduction_between_them():
    outline, surface = REDUCTION.outline_for_native(finer=3), REDUCTION.surface_for_native()
    assert outline["finer"] == 3
    assert outline["points"] == (REDUCTION.fewest_points, REDUCTION.most_points)
    sent = (set(outline) - {"finer", "points"}) | {"fewest_points", "most_points"} | set(surface)
    assert sent == {field.name for field in fields(ReductionOptions)}
    assert not set(outline) & set(surface)
