"""Words of clients about their media, and those that are refused."""

import pytest

from devices.hub.media.offer import MAX_OFFER_BYTES, OfferError
from devices.hub.media.signals import MediaSignal, OfferSignal, Way, read_signal

MEDIA = {"kind": "media", "voice": "rtc", "microphone": True, "videos": ["p1/a", "wall"]}


def test_signals_are_read():
    assert read_signal({"kind": "offer", "sdp": "v=0"}) == OfferSignal("v=0")
    assert read_signal(MEDIA) == MediaSignal(Way.RTC, True, frozenset({"p1/a", "wall"}))
    assert read_signal({"kind": "other"}) is None


@pytest.mark.parametrize(
    "wrong",
    [
        {"kind": "offer"},
        {"kind": "offer", "sdp": 5},
        {"kind": "offer", "sdp": "x" * (MAX_OFFER_BYTES + 1)},
        {**MEDIA, "voice": "loud"},
        {**MEDIA, "microphone": 1},
        {**MEDIA, "videos": "p1/a"},
        {**MEDIA, "videos": ["a"] * 5},
        {**MEDIA, "videos": [{}]},
        {**MEDIA, "videos": ["../../etc"]},
    ],
)
def test_what_is_wrong_is_refused(wrong):
    with pytest.raises(OfferError):
        read_signal(wrong)
