"""Editing, playing, recorded, live: the four modes of the studio, and all that leads between them.

Pure: a standing and what happens give the next standing, or a refusal in words. Whoever shows the
room, plays a session or opens a file asks here first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType


class Mode(StrEnum):
    """The one that decides where the objects of the room are."""

    EDITING = "editing"
    """The user's hands: objects can be moved, physics can run."""
    PLAYING = "playing"
    """A rehearsal, a fork or a replay that plays."""
    RECORDED = "recorded"
    """A recording at the instant of the timeline."""
    LIVE = "live"
    """A live session, from its checks to its end."""


class Happening(StrEnum):
    """A step from one mode to another."""

    PLAY = "play"
    GO_LIVE = "go live"
    END_KEPT = "end, with a recording to look at"
    END = "end, with nothing to look at"
    OPEN_RECORDING = "open a recording"
    CLOSE_RECORDING = "close the recording"
    OPEN_DOCUMENT = "open another document"


class StandingError(ValueError):
    """It cannot happen now; says why, and what to do first."""


@dataclass(frozen=True, slots=True)
class Standing:
    """The mode, and the recording that belongs to it.

    Attributes:
        mode: what decides where objects are.
        recording: that is open; while something plays, the one that comes back if that leaves none.
    """

    mode: Mode = Mode.EDITING
    recording: Path | None = None

    @property
    def is_session(self) -> bool:
        """Whether something plays or is live."""
        return self.mode in SESSIONS


SESSIONS = frozenset({Mode.PLAYING, Mode.LIVE})
"""Modes that come to an end by themselves."""

EDGES: Mapping[tuple[Mode, Happening], Mode | None] = MappingProxyType(
    {
        (Mode.EDITING, Happening.PLAY): Mode.PLAYING,
        (Mode.EDITING, Happening.GO_LIVE): Mode.LIVE,
        (Mode.EDITING, Happening.OPEN_RECORDING): Mode.RECORDED,
        (Mode.EDITING, Happening.CLOSE_RECORDING): Mode.EDITING,
        (Mode.EDITING, Happening.OPEN_DOCUMENT): Mode.EDITING,
        (Mode.RECORDED, Happening.PLAY): Mode.PLAYING,
        (Mode.RECORDED, Happening.GO_LIVE): Mode.LIVE,
        (Mode.RECORDED, Happening.OPEN_RECORDING): Mode.RECORDED,
        (Mode.RECORDED, Happening.CLOSE_RECORDING): Mode.EDITING,
        # A recording of another room asks for that room to be opened beneath it.
        (Mode.RECORDED, Happening.OPEN_DOCUMENT): Mode.RECORDED,
        (Mode.PLAYING, Happening.END_KEPT): Mode.RECORDED,
        (Mode.PLAYING, Happening.END): None,
        (Mode.LIVE, Happening.END_KEPT): Mode.RECORDED,
        (Mode.LIVE, Happening.END): None,
    }
)
"""Every way between the modes, None going back to where the session was begun: to `RECORDED` if a
recording was open, else to `EDITING`. What is not here is refused."""


def after(standing: Standing, happening: Happening, recording: Path | None = None) -> Standing:
    """The standing once something has happened.

    Args:
        standing: before it.
        happening: what happens.
        recording: that is opened, or that a session has left.

    Raises:
        StandingError: it cannot happen in that mode.
        ValueError: a recording is missing where there must be one.
    """
    key = (standing.mode, happening)
    if key not in EDGES:
        if standing.is_session:
            what = "a live session" if standing.mode is Mode.LIVE else "a session"
            raise StandingError(f"{happening}: {what} is playing; stop it first")
        raise StandingError(f"{happening}: nothing is playing that could end")
    mode = EDGES[key]
    if mode is None:
        mode = Mode.EDITING if standing.recording is None else Mode.RECORDED
        return Standing(mode, standing.recording)
    if happening in (Happening.END_KEPT, Happening.OPEN_RECORDING):
        if recording is None:
            raise ValueError(f"{happening}: wanted the recording's path")
        return Standing(mode, recording)
    return Standing(mode, None if mode is Mode.EDITING else standing.recording)
