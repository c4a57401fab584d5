"""Faults applied to access units before they are sent: late, lost, frozen, wrongly stamped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from random import Random

from devices.messages import EncodedFrame
from devices.video import H264Decoder, H264Encoder
from sim.wire.faults import FaultKind, FaultSchedule
from sim.wire.film.film import Film

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class OutgoingUnit:
    """An access unit on its way.

    Attributes:
        number: counts the pictures that were due, from 0; gaps are pictures that nobody sends.
        boot: how often the camera has restarted before; its stamps begin anew then.
        stamp_ns: its time on the camera's own clock.
        taken_ns: when it was taken, from the stream's beginning.
        send_ns: not to be sent before, from the stream's beginning.
        data: H.264 Annex B.
        keyframe: whether decoding may start here.
        shows: the film's picture in it.
        loss: share of packets that get lost over a protocol of packets.
        is_lost: whether it is lost as a whole over a protocol without packets.
    """

    number: int
    boot: int
    stamp_ns: int
    taken_ns: int
    send_ns: int
    data: bytes
    keyframe: bool
    shows: int
    loss: float
    is_lost: bool


@dataclass(frozen=True, slots=True)
class Still:
    """A frozen picture, encoded: units that show it again and again, a keyframe first."""

    units: tuple[tuple[bytes, bool], ...]
    shows: int


def still_of(film: Film, number: int) -> Still:
    """The picture of `film.unit(number)`, encoded once as a keyframe and then without a change.

    Decodes the group up to there and encodes about a second of the same picture, so it takes a
    second itself: before the stream begins, not in it.

    Raises:
        ValueError: the film cannot be decoded there.
    """
    decoder = H264Decoder()
    picture = None
    for each in range(film.keyframe_before(number), number + 1):
        unit = film.unit(each)
        picture = decoder.decode(EncodedFrame(film.name, each, unit.t_ns, unit.data, unit.keyframe))
    if picture is None:
        raise ValueError(f"{film.name}: no whole picture at unit {number}, nothing to freeze")
    count = max(1, round(film.form.fps))
    # With the film's own rate the parameter sets stay the same: a camera's do not change either.
    rate = film.form.bitrate or round(8 * film.size_bytes * NANOSECONDS / film.duration_ns)
    height, width = picture.shape[:2]
    encoder = H264Encoder(width, height, film.form.fps, max(100_000, rate), keyframe_interval=count)
    units: list[tuple[bytes, bool]] = []
    for k in range(count):
        packet = encoder.encode(picture, k, round(k * NANOSECONDS / film.form.fps))[0]
        units.append((packet.data, packet.keyframe))
    return Still(tuple(units), film.unit(number).shows)


def stills_of(film: Film, schedule: FaultSchedule) -> Mapping[float, Still]:
    """Frozen unit of every freeze of a schedule, by its beginning in seconds."""
    begins = [f.at_s for f in schedule.faults if f.kind is FaultKind.FREEZE]
    return {at_s: still_of(film, film.number_at(round(at_s * NANOSECONDS))) for at_s in begins}


class UnitFaults:
    """Turns a film into what leaves a faulty camera, a unit at a time.

    Args:
        film: what is played.
        schedule: when what goes wrong.
        random: of jitter and loss.
        stills: from `stills_of`.
    """

    def __init__(
        self,
        film: Film,
        schedule: FaultSchedule,
        random: Random,
        stills: Mapping[float, Still],
    ) -> None:
        self._film, self._schedule, self._random = film, schedule, random
        self._stills = stills
        self._frozen_at = 0
        self._still: Still | None = None
        self._wants_keyframe = True
        self._last_send_ns = 0

    def passed(self, number: int) -> OutgoingUnit | None:
        """Apply the faults to the film's unit `number`; None where the camera takes no picture.

        Asked for every number, in order.
        """
        t_ns = self._film.time_ns(number)
        state = self._schedule.at(t_ns)
        if not state.is_on:
            self._wants_keyframe, self._still = True, None
            return None
        data, keyframe, shows = self._picture(number, frozen=state.frozen)
        if self._wants_keyframe and not keyframe:
            return None
        self._wants_keyframe = False
        late_s = state.delay_s + state.jitter_s * self._random.random()
        send_ns = max(t_ns + round(late_s * NANOSECONDS), self._last_send_ns)
        self._last_send_ns = send_ns
        return OutgoingUnit(
            number,
            self._schedule.boot(t_ns),
            self._schedule.stamp_ns(t_ns),
            t_ns,
            send_ns,
            data,
            keyframe,
            shows,
            state.loss,
            self._random.random() < state.loss,
        )

    def _picture(self, number: int, *, frozen: bool) -> tuple[bytes, bool, int]:
        """The film's own, or the frozen one; out of a freeze a keyframe leads."""
        if frozen and self._still is None:
            self._still, self._frozen_at = self._still_at(number), number
        unit = self._film.unit(number)
        if self._still is None or (not frozen and unit.keyframe):
            self._still = None
            return unit.data, unit.keyframe, unit.shows
        units = self._still.units
        data, keyframe = units[(number - self._frozen_at) % len(units)]
        return data, keyframe, self._still.shows

    def _still_at(self, number: int) -> Still:
        t_s = self._film.time_ns(number) / NANOSECONDS
        began = max(at_s for at_s in self._stills if at_s <= t_s)
        return self._stills[began]
