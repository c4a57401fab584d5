"""Topics that listeners of the workbench are called for, and notices to be seen at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from studio.app.model.log import Level


class Topic(Enum):
    """Kinds of change that listeners can be called for."""

    DOCUMENT = auto()
    """The document is another value: an edit, undo, or another project."""
    OPENED = auto()
    """Another document takes the place of the one before, which is gone."""
    STATE = auto()
    """The shown state of the room has changed."""
    SCENE = auto()
    """A scene was opened, or is being opened."""
    SELECTION = auto()
    """Another item is selected."""
    SESSION = auto()
    """A session began, went on by a frame, or ended."""
    RECORDING = auto()
    """A recording was opened or closed."""
    LOG = auto()
    """A line was added."""
    SETTINGS = auto()
    """The user's settings are another value."""
    OFFERED = auto()
    """Plug-ins offer other trackers or faults."""
    NOTICE = auto()
    """There is something to be seen at once, see `Notice`."""


@dataclass(frozen=True, slots=True, eq=False)
class Notice:
    """A sentence that stays over the view until the user has answered or closed it.

    Attributes:
        text: the sentence.
        ways: what can be done about it, by a button's words.
        level: how bad it is.
    """

    text: str
    ways: Mapping[str, Callable[[], object]]
    level: Level
