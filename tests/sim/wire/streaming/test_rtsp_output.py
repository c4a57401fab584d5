"""The RTSP server against players that were written elsewhere: PyAV, and Debian's ffmpeg."""

import itertools
import shlex
import shutil
import subprocess
import time

import av
import pytest

from sim.wire.streaming.rtsp_output import RtspOutput, RtspPlace
from tests.pushed_camera import read_number

OPTIONS = {"fflags": "nobuffer", "flags": "low_delay", "probesize": "32768", "analyzeduration": "0"}
WANTED = "-frames:v 40 -f framecrc -"


def served(camera, film):
    output = RtspOutput(RtspPlace(), film, camera.setting(), wall_ns=time.time_ns)
    camera.add(output)
    camera.start()
    return output


def pulled(url, *, udp=False, until):
    """(arrival in seconds, time, number) of pictures that PyAV pulls."""
    options = {**OPTIONS, "rtsp_transport": "udp" if udp else "tcp"}
    taken = []
    with av.open(url, options=options, timeout=(5, 5)) as container:
        for frame in container.decode(video=0):
            taken.append((time.monotonic(), frame.time, read_number(frame.to_ndarray()[:160])))
            if until(taken):
                return taken
    return taken


def steps(taken):
    numbers = [number for _, _, number in taken]
    return {(b - a) % 50 for a, b in itertools.pairwise(numbers)}


@pytest.mark.parametrize("udp", [False, True], ids=["tcp", "udp"])
def test_pyav_pulls_every_picture(udp, make_camera, film):
    output = served(make_camera(), film)
    taken = pulled(output.url, udp=udp, until=lambda t: len(t) >= 40)
    assert steps(taken[5:]) == {1}
    times = [t for _, t, _ in taken[5:]]
    assert (times[-1] - times[0]) / (len(times) - 1) == pytest.approx(0.04, abs=0.001)


@pytest.mark.parametrize("transport", ["tcp", "udp"])
def test_ffmpeg_pulls_every_picture(transport, make_camera, film):
    if shutil.which("ffmpeg") is None:
        pytest.skip("needs the ffmpeg program: apt-get install ffmpeg")
    output = served(make_camera(), film)
    done = subprocess.run(
        shlex.split(f"ffmpeg -v error -rtsp_transport {transport} -i {output.url} {WANTED}"),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert sum(not line.startswith("#") for line in done.stdout.splitlines()) == 40
    assert "error" not in done.stderr.lower()


def test_several_players_see_it_at_once(make_camera, film):
    output = served(make_camera(), film)
    opened = [av.open(output.url, options={"rtsp_transport": "tcp"}, timeout=5) for _ in range(3)]
    try:
        for container in opened:
            frames = container.decode(video=0)
            assert [next(frames).width for _ in range(5)] == [320] * 5
    finally:
        for container in opened:
            container.close()
    assert output.connections == 3


def test_packets_that_are_lost_over_udp_damage_pictures(make_camera, film):
    output = served(make_camera("loss:size=0.3"), film)
    taken = pulled(output.url, udp=True, until=lambda t: t[-1][0] - t[0][0] > 1.5)
    assert steps(taken) != {1}


def test_a_black_hole_is_a_gap_on_the_same_connection(make_camera, film, event_log):
    output = served(make_camera("black_hole:at=1.5,for=1"), film)
    taken = pulled(output.url, until=lambda t: t[-1][0] - t[0][0] > 2.5)
    assert max(b[0] - a[0] for a, b in itertools.pairwise(taken)) > 0.8
    assert len(event_log.named("connected")) == 1


def test_after_a_restart_it_serves_at_the_same_port(make_camera, film):
    output = served(make_camera("restart:at=2,for=0.5"), film)
    first = pulled(output.url, until=lambda _t: False)
    assert len(first) >= 1
    end = time.monotonic() + 120
    while time.monotonic() < end:
        try:
            again = pulled(output.url, until=lambda t: len(t) > 5)
        except (av.error.FFmpegError, OSError):
            time.sleep(0.1)
            continue
        break
    assert len(again) > 5


def test_a_camera_that_vanished_keeps_old_connections_and_takes_new_ones(make_camera, film):
    output = served(make_camera("half_open:at=1.2,for=0.4"), film)
    container = av.open(output.url, options={"rtsp_transport": "tcp"}, timeout=5)
    frames = container.decode(video=0)
    assert next(frames).width == 320
    time.sleep(2.0)
    assert len(pulled(output.url, until=lambda t: len(t) > 5)) > 5
    assert output.connections == 2
    container.close()
