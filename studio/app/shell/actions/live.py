"""Actions of the live session: its one button and all that is beside it, for keys and scripts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtGui import QGuiApplication

from studio.app.model.actions import Action
from studio.app.model.own_address import reachable
from studio.app.model.runs.live_run import NO_STEP, LiveRun, Step
from studio.app.model.workbench import Workbench

TOML = "Devices (*.toml)"

Ask = Callable[[str, str, bool], str]
"""Asks for a file: title, kinds, whether it is written; an empty path if nobody chose one."""


class LiveActions:
    """Actions of live sessions.

    Args:
        bench: whose actions they become.
        live: the live session.
        ask: for a file.
    """

    def __init__(self, bench: Workbench, live: LiveRun, ask: Ask) -> None:
        self._bench, self._live, self._ask = bench, live, ask

    def add(self) -> None:
        """Add them to the bench."""
        for action in (*self._steps(), *self._beside(), *self._devices()):
            self._bench.actions.add(action)

    def _steps(self) -> tuple[Action, ...]:
        live = self._live
        return (
            Action(
                "live.next",
                "Next step of the live session",
                "Live",
                live.go_on,
                "check and connect, confirm, go live, end: what its button says",
                "F6",
                available=lambda: live.step not in NO_STEP,
                command=live.command,
                icon="mdi6.broadcast",
            ),
            Action(
                "live.check",
                "Check and connect the live camera",
                "Live",
                live.begin,
                "connect to it, and look at its stream, the light, the disk and the rest",
                available=lambda: self._bench.scene is not None and not live.is_running,
                command=live.command,
            ),
            Action(
                "live.confirm",
                "Confirm how the picture holds the lenses",
                "Live",
                self.confirm,
                "as it is shown, or such as side_by_side 0 180",
                arguments=("layout",),
                available=lambda: live.step is Step.CONFIRM,
            ),
            Action(
                "live.try_again",
                "Look for the camera again after it was refused",
                "Live",
                live.try_again,
                available=lambda: live.step is Step.TRY_AGAIN,
            ),
            Action(
                "live.go_live",
                "Go live",
                "Live",
                live.go_live,
                "at once, or as soon as camera and objects are found",
                available=lambda: live.session is not None and live.step is not Step.END,
                command=live.command,
            ),
            Action(
                "live.end",
                "End the live session",
                "Live",
                live.end,
                "its recording is closed and its report opens",
                "Shift+F6",
                available=lambda: live.is_running,
            ),
        )

    def _beside(self) -> tuple[Action, ...]:
        live = self._live
        return (
            Action(
                "live.find_camera",
                "Find the live camera again",
                "Live",
                live.find_camera,
                "anywhere in the room, beside the session",
                "Ctrl+F6",
                available=lambda: live.session is not None,
            ),
            Action(
                "live.undo_tracker",
                "Undo the tracker's settings in the live session",
                "Live",
                live.undo_tracker,
                "takes back the last change; both are in the recording",
                available=lambda: live.session is not None,
            ),
            Action(
                "live.check_again",
                "Check the live session again",
                "Live",
                live.check_again,
                available=lambda: live.session is not None,
            ),
            Action(
                "live.copy_address",
                "Copy the address to enter in the camera",
                "Live",
                self.copy_address,
                "of a camera that pushes; where the studio listens",
                available=lambda: bool(self.listening_at()),
            ),
        )

    def _devices(self) -> tuple[Action, ...]:
        return (
            Action(
                "live.use",
                "Choose the live camera",
                "Live",
                self.use,
                "address, layout (auto, side_by_side 0 0 …), place (find, scan), simulated",
                arguments=("address", "layout", "place", "simulated"),
            ),
            Action(
                "live.save_devices",
                "Save devices as TOML",
                "Live",
                self.save_devices,
                "for nexus live --devices; a password of the address is in it",
                arguments=("path",),
            ),
            Action(
                "live.open_devices",
                "Open devices from TOML",
                "Live",
                self.open_devices,
                "address, layout and place of a file",
                arguments=("path",),
            ),
        )

    def confirm(self, layout: str = "") -> None:
        """Confirm the layout that is shown, or another one in words.

        Raises:
            ValueError: it is none.
        """
        from studio.live.setup import parse_layout

        if layout:
            self._live.look_at(parse_layout(layout))
        self._live.confirm()

    def use(
        self,
        address: str | None = None,
        layout: str | None = None,
        place: str | None = None,
        simulated: bool | None = None,
    ) -> None:
        """Ask for other devices; what is not named stays.

        Raises:
            AddressError, ValueError: a word is wrong, or a session plays.
        """
        live = self._live
        before = live.choice
        is_simulated = simulated
        if is_simulated is None:
            is_simulated = before.is_simulated if address is None else False
        live.choose(
            replace(
                before,
                address=before.address if address is None else address,
                layout=layout or before.layout,
                place=place or before.place,
                is_simulated=bool(is_simulated),
            )
        )
        live.setup()

    def save_devices(self, path: str = "") -> None:
        """Write them to a file, which is asked for where none is named.

        Raises:
            ValueError, OSError: they are wrong, or it cannot be written.
        """
        chosen = path or self._ask("Save devices", TOML, True)
        if chosen:
            self._live.save_devices(Path(chosen).with_suffix(".toml"))

    def open_devices(self, path: str = "") -> None:
        """Read them from a file, which is asked for where none is named.

        Raises:
            ValueError, OSError: it is wrong, or cannot be read.
        """
        chosen = path or self._ask("Open devices", TOML, False)
        if chosen:
            self._live.open_devices(Path(chosen))

    def listening_at(self) -> str:
        """Return the address that a camera may push to; empty where none can."""
        session = self._live.session
        return "" if session is None else session.listening_at

    def copy_address(self) -> None:
        """Put it on the clipboard."""
        address = reachable(self.listening_at())
        QGuiApplication.clipboard().setText(address)
        self._bench.say("info", f"copied: {address}")
