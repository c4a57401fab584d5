"""Offers of strangers: what is read, what is written anew, and 10,000 that are none."""

from dataclasses import replace

import numpy as np
import pytest

from devices.hub.media.offer import (
    MAX_OFFER_BYTES,
    OfferError,
    asking_for_speech,
    clean_offer,
    read_offer,
)


def test_an_offer_of_chromium_is_read(chromium_offer):
    offer = read_offer(chromium_offer())
    assert (offer.user, offer.password[:4]) == ("4ZcD", "FyI7")
    assert offer.ports == (50123, 50124), "over UDP, of the device itself"
    mic, *voices, video = offer.tracks
    assert mic.is_from_guest
    assert not any(track.is_from_guest for track in voices)
    assert (mic.payload, mic.source, mic.extensions) == (111, 3570614608, {"level": 1, "mid": 2})
    assert (video.payload, video.repair, video.mid) == (96, 97, "3")


def test_what_our_side_sees_has_no_address_and_no_text_of_the_offer(chromium_offer):
    text = clean_offer(read_offer(chromium_offer()), "192.168.1.7")
    for of_the_offer in ("local", "10.1.2.3", "84.1.2.3", "4TOk42mSjXCkVIa6", "transport-cc"):
        assert of_the_offer not in text
    assert "candidate:0 1 udp 1000 192.168.1.7 50123 typ host" in text
    # It is an offer again, and the same one but for streams that the browser does not send.
    before, after = read_offer(chromium_offer()).tracks, read_offer(text).tracks
    assert [replace(t, source=None) for t in after] == [replace(t, source=None) for t in before]
    assert after[0].source == 3570614608


@pytest.mark.parametrize(
    ("before", "after", "why"),
    [
        ("a=ice-ufrag:4ZcD\r\n", "", "ice-ufrag"),
        ("a=mid:1", "a=mid:0", "mid"),
        ("a=mid:1", "a=mid:" + "m" * 40, "mid"),
        ("opus/48000", "speex/48000", "opus"),
        ("m=video 9", "m=application 9", "neither"),
        ("m=video 9", "m=video 0", "vp8"),
        ("a=fingerprint:sha-256 AB", "a=fingerprint:sha-256 ZZ", "fingerprint"),
        ("a=rtpmap:111", "a=rtpmap:77", "77"),
        ("a=fmtp:97 apt=96", "a=fmtp:96 apt=96", "itself"),
        ("s=-", "s=" + "x" * 2000, "line"),
        ("s=-", "\n" * 3000, "lines"),
        ("s=-", "x" * MAX_OFFER_BYTES, "letters"),
    ],
)
def test_what_cannot_be_answered_is_refused(chromium_offer, before, after, why):
    with pytest.raises(OfferError, match=why):
        read_offer(chromium_offer().replace(before, after))


def test_two_bundles_are_refused(chromium_offer):
    text = chromium_offer()
    at = text.rindex("a=ice-ufrag:4ZcD")
    with pytest.raises(OfferError, match="bundle"):
        read_offer(text[:at] + text[at:].replace("4ZcD", "5ZcD"))
    with pytest.raises(OfferError, match="tracks"):
        read_offer(chromium_offer(voices=40))


def test_ten_thousand_hostile_offers_are_refused_or_read(chromium_offer):
    random, text = np.random.default_rng(1), chromium_offer()
    read = 0
    for number in range(10_000):
        data = bytearray(text.encode())
        if number % 4 == 0:
            data = data[: int(random.integers(len(data)))]
        elif number % 4 == 1:
            for place in random.integers(0, len(data), 1 + number % 20):
                data[place] = int(random.integers(256))
        elif number % 4 == 2:
            lines = data.split(b"\r\n")
            random.shuffle(lines)
            data = bytearray(b"\r\n".join(lines))
        else:
            data = bytearray(random.bytes(int(random.integers(2000))))
        try:
            offer = read_offer(data.decode("utf-8", errors="replace"))
        except OfferError:
            continue
        read += 1
        clean = clean_offer(offer, "127.0.0.1")
        assert clean.isascii()
        assert len(clean) < MAX_OFFER_BYTES
    assert read > 100, "those that are hardly changed"


def test_speech_is_asked_for_in_our_answer():
    answer = "a=rtpmap:96 opus/48000/2\r\na=fmtp:96 minptime=20\r\na=rtpmap:97 VP8/90000\r\n"
    asked = asking_for_speech(answer)
    assert "usedtx=1" in asked
    assert "minptime=20" not in asked
    assert asking_for_speech("v=0\r\n") == "v=0\r\n"
