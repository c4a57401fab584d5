"""A short session of the small room, written once in each form."""

from __future__ import annotations

import pytest

from sim.dataset.write import DatasetOptions, write_dataset
from sim.phone.phone import PhoneOptions
from sim.scenarios.scenario import parse_scenario

SCENARIO = """
room = "small"
duration_s = 0.6
[camera]
fps = 10
lens_size_px = 320
bitrate_mbps = 4.0
[[people]]
id = "ann"
start = [-1.05, 1.58]
facing_deg = -60.0
actions = [{ do = "push", object = "chair-1", to = [-0.3, 0.2] }]
"""

PHOTOS = PhoneOptions(frames=6, width_px=240, height_px=180, samples=1)


@pytest.fixture(scope="session")
def scenario():
    return parse_scenario(SCENARIO, source="small.toml")


@pytest.fixture(scope="session")
def write(scenario):
    """Writes the session into a folder: `write(room, folder, form="bop", ...)`."""

    def write(room, folder, seed=3, **options):
        chosen = DatasetOptions(**{"every": 2, "photos": PHOTOS, **options})
        return write_dataset(folder, room, scenario, seed=seed, options=chosen)

    return write


@pytest.fixture(scope="session")
def room_folder(small_room, write, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sets") / "room-c"
    return folder, write(small_room, folder)


@pytest.fixture(scope="session")
def bop_folder(small_room, write, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sets") / "bop"
    return folder, write(small_room, folder, form="bop", pictures="jpg")
