"""A simulated voice: its tone, its pauses, the same for the same seed."""

import numpy as np

from devices.hub.media.voice_wire import opus_samples
from sim.headset.voice.tone import LEVEL_DB, MOMENT, SILENT, SPOKEN, ToneVoice, decoded, spoken_tone


def test_it_is_a_tone_of_its_level():
    packets = spoken_tone(440)
    assert {opus_samples(packet) for packet in packets} == {MOMENT}
    samples = decoded(list(packets))[4800:]
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert abs(48000 * np.argmax(spectrum) / len(samples) - 440) < 10
    assert abs(20 * np.log10(np.sqrt(np.mean(samples**2))) + LEVEL_DB) < 3
    assert len(decoded([])) == 0


def test_it_pauses_and_is_the_same_for_the_same_seed():
    one, other, same = ToneVoice(1), ToneVoice(2), ToneVoice(1)
    moments = [one.moment(number, 960 * number) for number in range(SPOKEN + SILENT)]
    assert sum(moment is None for moment in moments) == SILENT
    assert moments == [same.moment(number, 960 * number) for number in range(SPOKEN + SILENT)]
    assert one.tone_hz != other.tone_hz
    assert one.moment(70_000, 1 << 33) is None or one.moment(70_000, 1 << 33).seq < 1 << 16
