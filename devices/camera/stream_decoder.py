"""Units of a camera to its pictures: one decoder a track, a picture once every track has one."""

from __future__ import annotations

from dataclasses import dataclass

from devices.camera.stream_picture import StreamPicture
from devices.camera.unit_decoder import Decoded, UnitDecoder
from devices.camera.unit_sets import Place, UnitSets
from devices.camera.units import StreamFormat, Unit


@dataclass(frozen=True, slots=True, eq=False)
class DecodedPictures:
    """Pictures of a camera at one moment.

    Attributes:
        number: of the unit that the last of the pictures came in.
        pictures: one for all lenses, or one a lens where the camera sends a track a lens.
    """

    number: int
    pictures: tuple[StreamPicture, ...]


@dataclass(slots=True)
class _Track:
    """One picture track: its decoder, and its part of the picture that is not whole yet."""

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
        self._sets = UnitSets(tracks)

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
            track.form, track.decoder = unit.format, UnitDecoder(unit.format)
        place = self._sets.place(unit.track)
        if place is Place.FIRST:
            self._forget()
        damaged = track.decoder.damaged
        decoded = track.decoder.decode(unit, number)
        self.damaged += track.decoder.damaged - damaged
        track.picture = None if decoded is None else decoded.picture
        return self._whole(decoded) if place is Place.LAST else None

    def leave_out(self, track: int) -> None:
        """Units of a track before the next one, a keyframe, were left out; the first leads."""
        if not track:
            self._sets.begin()
        decoder = self._tracks[track].decoder
        if decoder is not None:
            decoder.leave_out()

    def flush(self) -> list[DecodedPictures]:
        """Return the pictures that the decoders still hold after the last unit."""
        decoded: Decoded | None = None
        for track in self._tracks:
            decoded = None if track.decoder is None else track.decoder.flush()
            track.picture = None if decoded is None else decoded.picture
        whole = self._whole(decoded)
        return [] if whole is None else [whole]

    def _whole(self, last: Decoded | None) -> DecodedPictures | None:
        """The picture of all tracks, once the last one's is there; None if one has none."""
        pictures = tuple(track.picture for track in self._tracks if track.picture is not None)
        self._forget()
        if last is None or len(pictures) < len(self._tracks):
            return None
        return DecodedPictures(last.number, pictures)

    def _forget(self) -> None:
        for track in self._tracks:
            track.picture = None
