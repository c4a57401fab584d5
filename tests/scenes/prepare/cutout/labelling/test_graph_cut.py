import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.graph_cut import cut, neighbour_links


def cost(labels, belief, links, smoothness):
    first, second, strength = links
    alone = np.where(labels, np.maximum(-belief, 0), np.maximum(belief, 0)).sum()
    return alone + smoothness * strength[labels[first] != labels[second]].sum()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), smoothness=st.sampled_from([0.0, 0.3, 2.0]))
def test_no_other_labels_are_cheaper(seed, smoothness):
    rng = np.random.default_rng(seed)
    positions, colours = rng.random((9, 3)), rng.random((9, 3))
    belief = rng.normal(0, 1, 9)
    links = neighbour_links(positions, colours)
    found = cost(cut(belief, links, smoothness=smoothness), belief, links, smoothness)
    every = (np.array(labels) for labels in itertools.product([False, True], repeat=9))
    # Costs are counted in thousandths.
    assert found <= min(cost(labels, belief, links, smoothness) for labels in every) + 0.05


def test_links_hold_by_nearness_and_colour():
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0.0]])
    colours = np.array([[0, 0, 0], [0, 0, 0], [1, 1, 1], [0, 0, 0.0]])
    first, second, strength = neighbour_links(positions, colours)
    held = dict(zip(zip(first.tolist(), second.tolist(), strict=True), strength, strict=True))
    assert len(held) == 6
    assert held[0, 1] > 0.5
    assert held[0, 1] > held[0, 3]
    assert held[0, 2] < 1e-3


def test_bodies_are_parted_by_gaps():
    line = np.zeros((40, 3))
    line[:, 0] = 0.01 * np.arange(40)
    line[20:, 0] += 0.3
    count, body = bodies(line, 0.06)
    assert count == 2
    assert len(set(body[:20])) == len(set(body[20:])) == 1
    line[20:, 0] -= 0.28
    assert bodies(line, 0.06)[0] == 1
