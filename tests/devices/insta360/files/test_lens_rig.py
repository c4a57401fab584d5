import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V2, OFFSET_V3
from devices.insta360.files.lens_rig import MAX_ANGLE_RAD, CarriedLenses, read_carried
from devices.insta360.files.metadata import WindowCrop, new_metadata, write_metadata
from devices.insta360.files.offsets import OffsetError, read_offsets, write_offsets
from devices.insta360.files.trailer import METADATA, PROTOBUF, Trailer, write_trailer
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from tests.insta360_file import offsets_of

SIZE_PX = 1440


def fisheye_rig(size_px, distortion=(0.0, 0.0, 0.0, 0.0)):
    half = size_px / 2
    lens = Fisheye(size_px, size_px, size_px / math.radians(200), half, half, 1.8, distortion)
    return Rig((lens, lens), (Pose.identity(), FRONT_FROM_BACK_LENS))


def places(lens, rays):
    return lens.project(rays)[0]


def directions():
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0, MAX_ANGLE_RAD, 500), rng.uniform(0, 2 * math.pi, 500)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.cos(theta)], axis=1)


def vendor_places(lens, rays, square):
    """Pixels of the published model, written down once more: (x, y) / (z + xi), distorted."""
    m = rays[:, :2] / (rays[:, 2:] + lens.xi)
    x, y, r2 = m[:, 0], m[:, 1], (m**2).sum(axis=1)
    radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + lens.k3 * r2**3
    u = radial * x + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x**2)
    v = radial * y + 2 * lens.p2 * x * y + lens.p1 * (r2 + 2 * y**2)
    shift = np.array([lens.cx_px - square * lens.height_px, lens.cy_px])
    return np.stack([lens.fx_px * u, lens.fy_px * v], axis=1) + shift


def test_a_real_x5_is_met_to_two_pixels_and_half_a_pixel_in_the_mean():
    rig = CarriedLenses(OFFSET_V3, "Insta360 X5").rig(SIZE_PX)
    for square, (lens, ours) in enumerate(
        zip(read_offsets(OFFSET_V3).lenses, rig.lenses, strict=True)
    ):
        wanted = vendor_places(lens, directions(), square) * SIZE_PX / lens.height_px
        off = np.linalg.norm(places(ours, directions()) - wanted, axis=1)
        assert off.max() < 2.0
        assert math.sqrt(float(np.mean(off**2))) < 0.65
    assert np.linalg.norm(rig.rig_from_lens[1].translation) == pytest.approx(0.032, abs=0.0005)


def test_lenses_that_are_written_are_read():
    rig = fisheye_rig(640, distortion=(0.02, -0.004, 0.0, 0.0))
    found = CarriedLenses(write_offsets(offsets_of(rig))).rig(640)
    for wanted, lens in zip(rig.lenses, found.lenses, strict=True):
        off = places(lens, directions()) - places(wanted, directions())
        assert np.abs(off).max() < 0.5


@pytest.mark.parametrize(("turn", "moved"), [(0, (9, 0)), (1, (0, -9)), (2, (-9, 0)), (3, (0, 9))])
def test_the_centre_turns_with_the_picture(turn, moved):
    offsets = offsets_of(fisheye_rig(640))
    lenses = tuple(replace(lens, cx_px=lens.cx_px + 9) for lens in offsets.lenses)
    text = write_offsets(replace(offsets, lenses=lenses))
    lens = CarriedLenses(text).rig(640, turns=(turn, turn)).lenses[1]
    assert (lens.cx - 320, lens.cy - 320) == pytest.approx(moved, abs=0.01)


@pytest.mark.parametrize(("x", "shift"), [(32, 0.0), (0, 0.0), (16, 16 / 2)])
def test_a_window_of_the_sensor_is_taken_off(x, shift):
    """An X6's 7744 px square without a border of 32, binned two by two."""
    words = write_offsets(offsets_of(fisheye_rig(7744)))
    whole = CarriedLenses(words).rig(3872).lenses[0]
    crop = WindowCrop(7744, 7744, 7680, 7680, x, x)
    lens = CarriedLenses(words, crop=crop).rig(3840).lenses[0]
    assert (lens.cx, lens.f_px) == pytest.approx((1920 + shift, whole.f_px), abs=0.05)


V3 = read_offsets(OFFSET_V3)


def changed(**values):
    return write_offsets(replace(V3, lenses=(replace(V3.lenses[0], **values), V3.lenses[1])))


@pytest.mark.parametrize(
    ("carried", "says"),
    [
        (CarriedLenses(""), "no calibration, wanted version 3 of 2 lenses"),
        (CarriedLenses(OFFSET_V1), "V1 of 2 lenses, wanted version 3"),
        (CarriedLenses(OFFSET_V2), "V2 of 2 lenses"),
        (CarriedLenses(changed(xi=0.1)), "xi 0.1, wanted more than 0.22"),
        (CarriedLenses(changed(fx_px=2000.0)), "lens 0: centre .* left over"),
        (CarriedLenses(changed(cx_px=9000.0)), "within a quarter of the middle"),
        (CarriedLenses(changed(fx_px=-4291.0, fy_px=-4291.0)), "lens 0: centre"),
        (CarriedLenses(changed(tz_m=32.0)), "32.032 m apart, wanted at most 0.2 m"),
        (CarriedLenses(OFFSET_V3, crop=WindowCrop(100, 100, 90, 90, 20, 20)), "inside it"),
        (CarriedLenses("2_1_2"), "lenses with 2 numbers"),
    ],
)
def test_another_camera_s_calibration_is_refused(carried, says):
    with pytest.raises(OffsetError, match=says):
        carried.rig(SIZE_PX)


def insv(folder, *, offset_v3=OFFSET_V3, data=None):
    path = folder / "VID_00_001.insv"
    path.write_bytes(b"media")
    metadata = new_metadata(
        serial="IXE36", camera_type="Insta360 X5", firmware="1", offset_v3=offset_v3
    )
    data = write_metadata(metadata) if data is None else data
    write_trailer(path, path, Trailer().with_record(METADATA, PROTOBUF, data))
    return path


def test_a_file_carries_its_camera_s_calibration(tmp_path):
    assert read_carried(insv(tmp_path)) == CarriedLenses(OFFSET_V3, "Insta360 X5")
    assert read_carried(insv(tmp_path, offset_v3="")) is None
    plain = tmp_path / "plain.mp4"
    plain.write_bytes(b"media")
    assert read_carried(plain) is None


def test_a_damaged_file_says_so(tmp_path):
    with pytest.raises(OffsetError, match=r"insv: metadata: .*copy it from the camera again"):
        read_carried(insv(tmp_path, data=b"\xff\xff"))
    path = insv(tmp_path)
    path.write_bytes(path.read_bytes()[40:])
    with pytest.raises(OffsetError, match=r"insv: trailer.*copy it from the camera again"):
        read_carried(path)
