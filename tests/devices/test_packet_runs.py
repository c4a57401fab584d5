from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.packet_pictures import PacketPictures
from devices.packet_runs import PacketRun, RunError
from devices.session_info import LiveStream, SessionInfo
from devices.video import H264Encoder
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose

LENS_PX, COUNT = 48, 14
LENS = Fisheye.from_fov(LENS_PX, np.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
SIMULATED = SessionInfo("none", "0", 0, "", "", "exact", ("own",), {}, RIG, 10.0)
SIDE_BY_SIDE = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))
LIVE = replace(SIMULATED, stream=LiveStream(SIDE_BY_SIDE, LENS_PX))


def encoded():
    """Packets of moving noise, keyframes at 0 and 7."""
    picture = np.random.default_rng(1).integers(0, 256, (LENS_PX, 2 * LENS_PX, 3)).astype(np.uint8)
    encoder = H264Encoder(2 * LENS_PX, LENS_PX, 10.0, 2_000_000, keyframe_interval=7)
    return [encoder.encode(np.roll(picture, 2 * n, axis=1), n, 10**8 * n)[0] for n in range(COUNT)]


PACKETS = encoded()


def one_by_one(session, packets):
    decoder = PacketPictures(session)
    return [decoder.lenses(packet, is_wanted=True) for packet in packets]


def in_a_run(session, packets, threads):
    run, made = PacketRun(session, "h264", threads=threads), {}
    for number, packet in enumerate(packets):
        for picture in run.feed(packet, number):
            made[picture.number] = run.lenses(picture)
    for picture in run.flush():
        made[picture.number] = run.lenses(picture)
    run.close()
    return made


@pytest.mark.parametrize("threads", [1, 2, 4, 8])
@pytest.mark.parametrize("session", [SIMULATED, LIVE], ids=["simulated", "live"])
def test_a_run_gives_every_pixel_as_one_packet_after_the_other(session, threads):
    made = in_a_run(session, PACKETS, threads)
    assert sorted(made) == list(range(COUNT))
    for number, lenses in enumerate(one_by_one(session, PACKETS)):
        assert all(np.array_equal(a, b) for a, b in zip(made[number], lenses, strict=True))


@given(st.sets(st.integers(1, COUNT - 1), max_size=4), st.sampled_from([1, 3, 8]))
def test_a_run_with_lost_packets_gives_the_same_pictures(lost, threads):
    left = [packet for packet in PACKETS if packet.seq not in lost]
    made = in_a_run(SIMULATED, left, threads)
    alone = one_by_one(SIMULATED, left)
    assert all(np.array_equal(lenses[0], alone[number][0]) for number, lenses in made.items())
    # Without its keyframe a group of pictures may come late: whoever waits for one notices.
    assert 7 in lost or len(made) == len(left)


@given(
    st.integers(0, COUNT - 1),
    st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 7)), min_size=1, max_size=6),
    st.sampled_from([1, 4]),
)
def test_a_damaged_packet_is_refused_or_decoded_alike(which, flips, threads):
    data = bytearray(PACKETS[which].data)
    for place, bit in flips:
        data[place % len(data)] ^= 1 << bit
    packets = [*PACKETS]
    packets[which] = replace(PACKETS[which], data=bytes(data))
    try:
        made = in_a_run(SIMULATED, packets, threads)
    except RunError:
        return
    decoder = PacketPictures(SIMULATED)
    for number, packet in enumerate(packets):
        lenses = decoder.lenses(packet, is_wanted=True)
        assert lenses is None or np.array_equal(made[number][0], lenses[0])


def test_a_run_that_is_dropped_in_the_middle_ends():
    run = PacketRun(SIMULATED, "h264", threads=8)
    for number, packet in enumerate(PACKETS[:5]):
        run.feed(packet, number)
    run.close()
    del run
    unclosed = PacketRun(SIMULATED, "h264", threads=8)
    unclosed.feed(PACKETS[0], 0)
    del unclosed


def test_what_needs_no_run_is_refused():
    with pytest.raises(RunError, match="mjpeg"):
        PacketRun(LIVE, "mjpeg")
    two = replace(LIVE, stream=LiveStream(LensLayout(Arrangement.ONE_LENS, (0,)), LENS_PX, 2))
    with pytest.raises(RunError, match="2 tracks"):
        PacketRun(two, "h264")
