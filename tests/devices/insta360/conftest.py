import numpy as np
import pytest

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V2, OFFSET_V3
from devices.clock import WallClock
from devices.insta360.commands import CameraInfo
from devices.video import H264Encoder
from sim.wire.preview_server import PreviewServer

INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.83, OFFSET_V1, OFFSET_V2, OFFSET_V3)


@pytest.fixture(scope="session")
def encoded():
    """Half a second of H.264 as an X3 sends it, smaller: two lenses side by side."""
    rng = np.random.default_rng(4)
    picture = rng.integers(0, 256, (96, 192, 3)).astype(np.uint8)
    encoder = H264Encoder(192, 96, 50, 2_000_000, keyframe_interval=10)
    return [
        frame
        for seq in range(25)
        for frame in encoder.encode(np.roll(picture, 3 * seq, axis=1), seq, seq * 20_000_000)
    ]


@pytest.fixture
def clock():
    return WallClock()


@pytest.fixture
def camera(encoded, clock):
    """A simulated camera whose preview begins anew with every start."""
    server = PreviewServer(lambda: iter(encoded), clock, INFO)
    yield server
    server.close()
