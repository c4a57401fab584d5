"""Actions of the timeline."""

from __future__ import annotations

import shlex
from typing import Protocol

from studio.app.model.actions import Action
from studio.app.model.workbench import Workbench


class Timeline(Protocol):
    """What the actions ask for; see `TimelineDock`."""

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


def add_timeline_actions(dock: Timeline) -> None:
    """Add what the Timeline menu holds."""
    bench = dock.bench

    def is_open() -> bool:
        return dock.is_open

    def fork_command(t_s: float = 0.0, out: str = "", anyway: bool = False) -> str:
        del anyway  # a command line is not asked
        words = ["nexus", "fork", str(bench.recording), "--at", f"{t_s:g}"]
        if bench.document.scenario:
            words += ["--scenario", f"{bench.document.scenario_name or 'scenario'}.toml"]
        return shlex.join(words + (["--out", out] if out else []))

    def compare_command(a: str = "", b: str = "") -> str:
        return shlex.join(["nexus", "compare", a, b])

    group = "Timeline"
    icon = "mdi6."
    step = dock.step
    for action in (
        Action(
            "timeline.open",
            "Open recording …",
            group,
            dock.open,
            "a recording (.mcap), or the folder of a rehearsal",
            arguments=("path",),
            icon=icon + "folder-open-outline",
        ),
        Action(
            "timeline.play",
            "Play or pause",
            group,
            dock.play,
            "play the recording from here",
            "Space",
            available=is_open,
            icon=icon + "play-pause",
        ),
        Action(
            "timeline.step_back",
            "One frame back",
            group,
            lambda: step(-1),
            "",
            ",",
            available=is_open,
            icon=icon + "step-backward",
        ),
        Action(
            "timeline.step",
            "One frame on",
            group,
            lambda: step(1),
            "",
            ".",
            available=is_open,
            icon=icon + "step-forward",
        ),
        Action(
            "timeline.seek",
            "Go to a time",
            group,
            dock.seek,
            "seconds of the session",
            arguments=("t_s",),
            available=is_open,
        ),
        Action(
            "timeline.previous",
            "Previous marker or event",
            group,
            lambda: dock.jump(forward=False),
            "",
            "Shift+,",
            available=is_open,
            icon=icon + "skip-previous",
        ),
        Action(
            "timeline.next",
            "Next marker or event",
            group,
            lambda: dock.jump(forward=True),
            "",
            "Shift+.",
            available=is_open,
            icon=icon + "skip-next",
        ),
        Action(
            "timeline.first_failure",
            "Go to the first failure",
            group,
            dock.to_first_failure,
            "first frame with an object lost, or off by more than the paper's mean error",
            available=is_open,
            icon=icon + "alert-outline",
        ),
        Action(
            "timeline.slower",
            "Slower",
            group,
            lambda: dock.change_speed(-1),
            "",
            "-",
            available=is_open,
            icon=icon + "rewind",
        ),
        Action(
            "timeline.faster",
            "Faster",
            group,
            lambda: dock.change_speed(1),
            "",
            "=",
            available=is_open,
            icon=icon + "fast-forward",
        ),
        Action(
            "timeline.loop",
            "Loop",
            group,
            dock.loop,
            "begin again at the end",
            available=is_open,
            icon=icon + "repeat",
        ),
        Action(
            "timeline.yaw",
            "Position or yaw errors",
            group,
            dock.switch_curves,
            "which error the curves show: cm or degrees",
            available=is_open,
            icon=icon + "angle-acute",
        ),
        Action(
            "timeline.mark",
            "Add marker",
            group,
            dock.mark,
            "a named instant of the project",
            "M",
            ("text", "t_s"),
            available=is_open,
            icon=icon + "map-marker-plus-outline",
        ),
        Action(
            "timeline.fork",
            "Fork here",
            group,
            dock.fork,
            "go on from this instant with the edited scenario",
            arguments=("t_s", "out", "anyway"),
            available=is_open,
            command=fork_command,
            icon=icon + "source-fork",
        ),
        Action(
            "timeline.compare",
            "Compare two runs",
            group,
            dock.compare,
            "the fork with what it comes from, or any two folders of rehearsals",
            arguments=("a", "b"),
            command=compare_command,
            icon=icon + "compare-horizontal",
        ),
        Action(
            "timeline.open_page",
            "Open the comparison as a page",
            group,
            dock.open_page,
            "films side by side, plans and curves in the browser",
            available=lambda: dock.is_compared,
        ),
        Action(
            "timeline.close",
            "Close recording",
            group,
            dock.close_recording,
            "",
            available=lambda: bench.recording is not None,
            icon=icon + "close",
        ),
    ):
        bench.actions.add(action)
