import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.storage.axes import flipped
from scenes.frames import RDF_FROM_RUB
from scenes.harmonics import basis, turned


@given(degree=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
def test_a_flip_is_the_turn_by_name_and_undoes_itself(random_cloud, degree, seed):
    cloud = random_cloud(10, degree, seed)
    flip, turn = flipped(cloud), turned(cloud, RDF_FROM_RUB)
    np.testing.assert_array_equal(flip.means, turn.means)
    np.testing.assert_allclose(flip.covariances(), turn.covariances(), atol=1e-6)
    np.testing.assert_array_equal(flip.sh, turn.sh)
    back = flipped(flip)
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(back, name), getattr(cloud, name))


def test_colours_seen_from_a_flipped_direction_are_the_same(random_cloud):
    cloud = random_cloud(4, 3)
    directions = np.array([[0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [-0.8, 0.6, 0.0]])
    seen = np.einsum("dk,nkc->ndc", basis(directions, 3), cloud.sh.astype(float))
    turned_directions = directions @ RDF_FROM_RUB.rotation.T
    again = np.einsum("dk,nkc->ndc", basis(turned_directions, 3), flipped(cloud).sh.astype(float))
    np.testing.assert_allclose(again, seen, atol=1e-6)
