"""Actions of the timeline."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from studio.app.model.actions import Action
from studio.app.model.workbench import Workbench


class Timeline(Protocol):
    """The timeline, as the actions use it; see `TimelineDock`."""

    bench: Workbench

    @property
    def is_open(self) -> bool:
        """See the dock."""
        ...

    @property
    def is_compared(self) -> bool:
        """See the dock."""
        ...

    def open(self, path: str = "") -> None:
        """See the dock."""
        ...

    def play(self) -> None:
        """See the dock."""
        ...

    def seek(self, t_s: float) -> None:
        """See the dock."""
        ...

    def step(self, frames: int) -> None:
        """See the dock."""
        ...

    def jump(self, *, forward: bool) -> None:
        """See the dock."""
        ...

    def to_first_failure(self) -> None:
        """See the dock."""
        ...

    def change_speed(self, steps: int) -> None:
        """See the dock."""
        ...

    def loop(self) -> None:
        """See the dock."""
        ...

    def switch_curves(self) -> None:
        """See the dock."""
        ...

    def mark(self, text: str = "", t_s: float | None = None) -> None:
        """See the dock."""
        ...

    def close_recording(self) -> None:
        """See the dock."""
        ...

    def fork(self, t_s: float | None = None, out: str = "", anyway: bool = False) -> None:
        """See the dock."""
        ...

    def compare(self, a: str = "", b: str = "") -> None:
        """See the dock."""
        ...

    def open_page(self) -> None:
        """See the dock."""
        ...


GROUP, ICON = "Timeline", "mdi6."


@dataclass(frozen=True, slots=True)
class _Row:
    """An action that needs a recording or a comparison to play; see `Action`."""

    id: str
    title: str
    run: Callable[[Timeline], Callable[..., object]]
    hint: str = ""
    keys: str = ""
    icon: str = ""
    arguments: tuple[str, ...] = ()


PLAYBACK = (
    _Row(
        "timeline.play",
        "Play or pause",
        lambda dock: dock.play,
        "play the recording from here",
        "Space",
        "play-pause",
    ),
    _Row(
        "timeline.step_back",
        "One frame back",
        lambda dock: partial(dock.step, -1),
        keys=",",
        icon="step-backward",
    ),
    _Row(
        "timeline.step",
        "One frame on",
        lambda dock: partial(dock.step, 1),
        keys=".",
        icon="step-forward",
    ),
    _Row(
        "timeline.seek",
        "Go to a time",
        lambda dock: dock.seek,
        "seconds of the session",
        arguments=("t_s",),
    ),
    _Row(
        "timeline.previous",
        "Previous marker or event",
        lambda dock: partial(dock.jump, forward=False),
        keys="Shift+,",
        icon="skip-previous",
    ),
    _Row(
        "timeline.next",
        "Next marker or event",
        lambda dock: partial(dock.jump, forward=True),
        keys="Shift+.",
        icon="skip-next",
    ),
    _Row(
        "timeline.first_failure",
        "Go to the first failure",
        lambda dock: dock.to_first_failure,
        "first frame with an object lost, or off by more than the paper's mean error",
        icon="alert-outline",
    ),
    _Row(
        "timeline.slower",
        "Slower",
        lambda dock: partial(dock.change_speed, -1),
        keys="-",
        icon="rewind",
    ),
    _Row(
        "timeline.faster",
        "Faster",
        lambda dock: partial(dock.change_speed, 1),
        keys="=",
        icon="fast-forward",
    ),
    _Row("timeline.loop", "Loop", lambda dock: dock.loop, "begin again at the end", icon="repeat"),
    _Row(
        "timeline.yaw",
        "Position or yaw errors",
        lambda dock: dock.switch_curves,
        "which error the curves show: cm or degrees",
        icon="angle-acute",
    ),
    _Row(
        "timeline.mark",
        "Add marker",
        lambda dock: dock.mark,
        "a named instant of the project",
        "M",
        "map-marker-plus-outline",
        ("text", "t_s"),
    ),
)
"""Actions on a recording or a comparison, in the order of the menu."""


def add_timeline_actions(dock: Timeline) -> None:
    """Add what the Timeline menu holds."""
    add = dock.bench.actions.add
    add(
        Action(
            "timeline.open",
            "Open recording …",
            GROUP,
            dock.open,
            "a recording (.mcap), or the folder of a rehearsal",
            arguments=("path",),
            icon=f"{ICON}folder-open-outline",
        )
    )
    for row in PLAYBACK:
        add(
            Action(
                row.id,
                row.title,
                GROUP,
                row.run(dock),
                row.hint,
                row.keys,
                row.arguments,
                available=lambda: dock.is_open,
                icon=f"{ICON}{row.icon}" if row.icon else "",
            )
        )
    for action in _comparing(dock):
        add(action)


def _comparing(dock: Timeline) -> tuple[Action, ...]:
    bench = dock.bench
    return (
        Action(
            "timeline.fork",
            "Fork here",
            GROUP,
            dock.fork,
            "go on from this instant with the edited scenario",
            arguments=("t_s", "out", "anyway"),
            available=lambda: dock.is_open,
            command=partial(_fork_command, bench),
            icon=f"{ICON}source-fork",
        ),
        Action(
            "timeline.compare",
            "Compare two runs",
            GROUP,
            dock.compare,
            "the fork with what it comes from, or any two folders of rehearsals",
            arguments=("a", "b"),
            command=_compare_command,
            icon=f"{ICON}compare-horizontal",
        ),
        Action(
            "timeline.open_page",
            "Open the comparison as a page",
            GROUP,
            dock.open_page,
            "films side by side, plans and curves in the browser",
            available=lambda: dock.is_compared,
        ),
        Action(
            "timeline.close",
            "Close recording",
            GROUP,
            dock.close_recording,
            "",
            available=lambda: bench.recording is not None,
            icon=f"{ICON}close",
        ),
    )


def _fork_command(bench: Workbench, t_s: float = 0.0, out: str = "", anyway: bool = False) -> str:
    del anyway  # a command line is not asked
    words = ["nexus", "fork", str(bench.recording), "--at", f"{t_s:g}"]
    if bench.document.scenario:
        words += ["--scenario", f"{bench.document.scenario_name or 'scenario'}.toml"]
    return shlex.join(words + (["--out", out] if out else []))


def _compare_command(a: str = "", b: str = "") -> str:
    return shlex.join(["nexus", "compare", a, b])
