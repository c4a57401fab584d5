import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.wire.rtsp.transport import OverTcp, OverUdp, read_transport


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("RTP/AVP/TCP;unicast;interleaved=2-3", OverTcp(2, 3)),
        ("RTP/AVP/TCP", OverTcp(0, 1)),
        ("RTP/AVP;unicast;client_port=5000-5001", OverUdp(5000, 5001)),
        ("RTP/AVP/UDP;client_port=5000", OverUdp(5000, 5001)),
        ("RTP/AVP;multicast, RTP/AVP/TCP;interleaved=0-1", OverTcp(0, 1)),
        ("RTP/AVP;unicast;destination=8.8.8.8;client_port=9-10", OverUdp(9, 10)),
        ("RTP/AVP;multicast", None),
        ("RTP/AVP;unicast", None),
        ("RTP/AVP;client_port=0-1", None),
        ("RTP/AVP;client_port=65535", None),
        ("RTP/AVP/TCP;interleaved=300-301", OverTcp(0, 1)),
        ("RAW/RAW/UDP;client_port=9-10", None),
        ("", None),
    ],
)
def test_the_first_that_can_be_served_is_taken(text, wanted):
    assert read_transport(text) == wanted


@given(st.text(alphabet="RTP/AVCUDinterlavdc_pot=-;,0123456789 ", max_size=200))
def test_any_text_gives_ports_in_range_or_none(text):
    found = read_transport(text)
    if found is not None:
        most = 255 if isinstance(found, OverTcp) else 65535
        assert 0 <= min(found.rtp, found.rtcp) <= max(found.rtp, found.rtcp) <= most
