import numpy as np
import pytest

from scenes.prepare.cutout.marks.masks import GrabCutMasks, Prompt

RED, GREY = (200, 40, 30), (150, 150, 150)


def picture_of(spots, size=(90, 120), seed=0):
    """Red rectangles (top, bottom, left, right) on grey, a little noisy."""
    picture = np.full((*size, 3), GREY, dtype=np.int16)
    truth = np.zeros(size, dtype=bool)
    for top, bottom, left, right in spots:
        picture[top:bottom, left:right] = RED
        truth[top:bottom, left:right] = True
    noise = np.random.default_rng(seed).integers(-12, 13, picture.shape)
    return (picture + noise).astype(np.uint8), truth


@pytest.mark.parametrize("pad", [3, 9])
@pytest.mark.parametrize("scale", [1, 12])
def test_a_box_finds_what_differs_from_its_surroundings(pad, scale):
    picture, truth = picture_of([(30, 60, 40, 80)])
    picture, truth = (np.repeat(np.repeat(a, scale, 0), scale, 1) for a in (picture, truth))
    box = tuple(scale * float(v) for v in (40 - pad, 30 - pad, 80 + pad, 60 + pad))
    mask = GrabCutMasks().mask(picture, Prompt(box))
    assert (mask & truth).sum() / (mask | truth).sum() > 0.95


def test_nothing_outside_the_box():
    picture, _ = picture_of([(30, 60, 20, 50), (30, 60, 60, 100)])
    mask = GrabCutMasks().mask(picture, Prompt((55.0, 25.0, 105.0, 65.0)))
    assert mask[35:55, 62:98].all()
    assert not mask[:, :55].any()


def test_strokes_decide_between_two_alike():
    picture, _ = picture_of([(30, 60, 20, 50), (30, 60, 60, 100)])
    prompt = Prompt(
        (15.0, 25.0, 105.0, 65.0), [[35.0, 45.0]], [[65 + 5.0 * k, 45.0] for k in range(7)]
    )
    mask = GrabCutMasks().mask(picture, prompt)
    assert mask[45, 35]
    assert not mask[44:47, 64:96].any()


def test_the_same_prompt_gives_the_same_mask():
    picture, _ = picture_of([(30, 60, 40, 80)])
    prompt = Prompt((35.0, 25.0, 85.0, 65.0))
    np.testing.assert_array_equal(*(GrabCutMasks().mask(picture, prompt) for _ in range(2)))


def test_what_cannot_be_meant_is_refused():
    with pytest.raises(ValueError, match="neither a box nor a point"):
        Prompt()
    with pytest.raises(ValueError, match="left < right"):
        Prompt((3.0, 1.0, 2.0, 5.0))
    with pytest.raises(ValueError, match="inside_px: a point is not finite"):
        Prompt(None, [[np.nan, 1.0]])
    picture, _ = picture_of([])
    with pytest.raises(ValueError, match="leaves nothing of the 120×90 px picture"):
        GrabCutMasks().mask(picture, Prompt((130.0, 5.0, 150.0, 20.0)))
