"""The timeline with its actions."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from studio.app.model.actions import Action
from studio.app.model.workbench import Workbench
from studio.app.timeline.dock import TimelineDock

GROUP, ICON = "Timeline", "mdi6."


@dataclass(frozen=True, slots=True)
class _Row:
    """An action that needs a recording or a comparison to play; see `Action`."""

    id: str
    title: str
    run: Callable[[TimelineDock], Callable[..., object]]
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


def make_timeline(bench: Workbench) -> TimelineDock:
    """Make the timeline, and add what its menu holds."""
    dock = TimelineDock(bench)
    add = bench.actions.add
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
    dock.begin()
    return dock


def _comparing(dock: TimelineDock) -> tuple[Action, ...]:
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
