import itertools

import numpy as np
import pytest

from devices.messages import EncodedFrame
from devices.video import H264Decoder
from scenes.samples import sample_room
from sim.scenarios.scenario import load_scenario
from sim.wire.faults import film_faults, read_fault
from sim.wire.film.drawn import FilmOptions, draw_film, filmed_scenario
from sim.wire.film.film_file import cached_film, read_film
from sim.wire.film.layouts import Layout

OPTIONS = FilmOptions((256, 128), 10, 1.3, bitrate=2_000_000, keyframe_s=0.5)
FAULTS = film_faults(map(read_fault, ("bump:at=0.4,size=2", "light:at=0.7,for=0.3,size=0.25")))


@pytest.fixture(scope="module")
def room():
    return sample_room("lab")


@pytest.fixture(scope="module")
def film(room, tmp_path_factory):
    folder = tmp_path_factory.mktemp("film")
    scenario = filmed_scenario(load_scenario("lab-short"), OPTIONS, FAULTS)
    draw_film(folder, room, scenario, seed=3, options=OPTIONS)
    return read_film(folder)


def decoded(film, count):
    decoder = H264Decoder()
    units = [film.unit(number) for number in range(count)]
    packets = [EncodedFrame("film", u.number, u.t_ns, u.data, u.keyframe) for u in units]
    return units, [decoder.decode(packet) for packet in packets]


def test_it_is_shown_forward_and_then_backward(film):
    assert len(film) == 2 * 13 - 2
    shows = [film.unit(number).shows for number in range(2 * len(film))]
    assert shows[:24] == [*range(13), *range(11, 0, -1)]
    assert shows[24:] == shows[:24]
    assert film.duration_ns == 2_400_000_000


def test_every_unit_can_be_decoded_and_no_round_begins_with_a_jump(film):
    units, pictures = decoded(film, 2 * len(film))
    of_picture = {}
    for unit, picture in zip(units, pictures, strict=True):
        of_picture.setdefault(unit.shows, []).append(picture.astype(int))
    for same in of_picture.values():
        assert all(np.abs(other - same[0]).mean() < 3.0 for other in same[1:])
    assert max(b.number - a.number for a, b in itertools.pairwise(units)) == 1
    distances = np.diff([unit.number for unit in units if unit.keyframe])
    assert distances.max() <= OPTIONS.keyframe_interval


def test_the_truth_of_every_picture_is_kept_with_its_faults(film):
    bumps = [film.truth_of(k).faults.get("bump", 0.0) for k in range(13)]
    assert bumps == [0.0] * 4 + [2.0] * 9
    assert [film.truth_of(k).faults.get("exposure", 0.0) for k in range(6, 12)] == [
        *(0.0, -2.0, -2.0, -2.0, 0.0, 0.0)
    ]
    before, after = film.truth_of(3).world_from_rig, film.truth_of(4).world_from_rig
    turned = np.arccos((np.trace(before.rotation.T @ after.rotation) - 1) / 2)
    assert np.rad2deg(turned) == pytest.approx(2.0, abs=1e-6)
    assert "chair-1" in film.truth_of(12).world_from_object


def test_less_light_is_seen(film):
    _units, pictures = decoded(film, 13)
    assert pictures[8].mean() < 0.75 * pictures[5].mean()


def test_another_layout_is_encoded_in_it(room, tmp_path):
    options = FilmOptions((128, 256), 10, 0.3, Layout.STACKED, bitrate=2_000_000)
    scenario = filmed_scenario(load_scenario("lab-short"), options, ())
    draw_film(tmp_path, room, scenario, seed=3, options=options)
    film = read_film(tmp_path)
    assert film.form.layout == "stacked"
    assert decoded(film, 1)[1][0].shape == (256, 128, 3)


def test_whoever_watches_the_progress_can_cancel(room, tmp_path):
    scenario = filmed_scenario(load_scenario("lab-short"), OPTIONS, ())

    def enough(done, _note):
        if done > 0.2:
            raise KeyboardInterrupt

    def fill(folder):
        draw_film(folder, room, scenario, seed=3, options=OPTIONS, progress=enough)

    with pytest.raises(KeyboardInterrupt):
        cached_film(tmp_path, "film", fill)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "values", [{"fps": 0.1}, {"seconds": 1e6}, {"bitrate": 1}, {"size_px": (64, 64)}]
)
def test_options_out_of_range_are_refused(values):
    with pytest.raises(ValueError, match="wanted"):
        FilmOptions(**values)
