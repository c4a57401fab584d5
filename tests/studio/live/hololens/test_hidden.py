"""Surfaces that the headset alone sees, handed to hubs."""

import numpy as np

from scenes.mesh import CollisionMesh
from studio.live.hololens.hidden import HiddenSurfaces

PLATE = CollisionMesh(np.eye(3), np.array([[0, 1, 2]]))
NOTHING = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3)))


class Hub:
    def __init__(self):
        self.taken = []

    def hide_behind(self, cells):
        self.taken.append({cell: len(mesh.faces) for cell, mesh in cells.items()})


def test_a_hub_gets_what_changes_and_another_one_all_of_it():
    hidden, first, second = HiddenSurfaces(), Hub(), Hub()
    hidden.show(first)
    assert not first.taken, "nothing is sent while there is nothing"
    hidden.change({(0, 0, 0): PLATE, (1, 0, 0): PLATE})
    hidden.change({(1, 0, 0): NOTHING})
    hidden.show(first)
    hidden.show(first)
    assert first.taken == [{(0, 0, 0): 1, (1, 0, 0): 0}]
    hidden.change({(2, 0, 0): PLATE})
    hidden.show(second)
    assert second.taken == [{(0, 0, 0): 1, (2, 0, 0): 1}]
