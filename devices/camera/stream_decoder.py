"""Units of a camera to its pictures: one decoder a track, a picture once every track has one."""

from __future__ import annotations

from dataclasses import dataclass

from devices.camera.stream_picture import StreamPicture
from devices.camera.unit_decoder import Decoded, UnitDecoder
from devices.camera.units import StreamFormat, Unit


@dataclass(frozen=True, slots=True, eq=False)
class DecodedPictures:
    """What a camera showed at one moment.

    Attributes:
        number: of the unit that the last of the pictures came in.
        pictures: one for all lenses, or one a lens where the camera sends a track a lens.
    """

    number: int
    pictures: tuple[StreamPicture, ...]


@dataclass(slots=True)
class _Track:
    """One picture track: its decoder, and what of it waits for the other tracks."""

    form: StreamFormat | None = None
    decoder: UnitDecoder | None = None
    picture: StreamPicture | None = None


class StreamDecoder:
    """Decodes all tracks of a camera; the same units always give the same pictures.

    Args:
        tracks: picture tracks of which one unit each make a picture of the camera.

    Attributes:
        damaged: units that gave no picture because they are damaged.
    """

    def __init__(self, tracks: int) -> None:
        self.damaged = 0
        self._tracks = [_Track() for _ in range(tracks)]

    def begins(self, unit: Unit) -> bool:
        """Whether the unit is the first of a stream, for which its track's decoder starts anew."""
        # Another connection has another format object, even where it says the same.
        return self._tracks[unit.track].form is not unit.format

    def decode(self, unit: Unit, number: int) -> DecodedPictures | None:
        """The pictures that a unit completes.

        Args:
            unit: the next encoded picture.
            number: returned with the pictures.

        Raises:
            SourceError: the codec is none that is decoded, or the picture is too large.
        """
        track = self._tracks[unit.track]
        if track.decoder is None or self.begins(unit):
            self.leave_out(unit.track)
            track.form, track.decoder = unit.format, UnitDecoder(unit.format)
        damaged = track.decoder.damaged
        decoded = track.decoder.decode(unit, number)
        self.damaged += track.decoder.damaged - damaged
        return self._completed(track, decoded)

    def leave_out(self, track: int) -> None:
        """Start a track anew: units before the next one, a keyframe, were left out.

        Nothing that waited of it or of a later track is shown with what comes, so that after a gap
        in all of them the first leads.
        """
        for later in self._tracks[track:]:
            later.picture = None
        decoder = self._tracks[track].decoder
        if decoder is not None:
            decoder.leave_out()

    def flush(self) -> list[DecodedPictures]:
        """What the decoders still hold after the last unit."""
        left: list[DecodedPictures] = []
        for track in self._tracks:
            decoded = None if track.decoder is None else track.decoder.flush()
            completed = self._completed(track, decoded)
            if completed is not None:
                left.append(completed)
        return left

    def _completed(self, track: _Track, decoded: Decoded | None) -> DecodedPictures | None:
        if decoded is None:
            return None
        track.picture = decoded.picture
        pictures = tuple(t.picture for t in self._tracks if t.picture is not None)
        if len(pictures) < len(self._tracks):
            return None
        for other in self._tracks:
            other.picture = None
        return DecodedPictures(decoded.number, pictures)
