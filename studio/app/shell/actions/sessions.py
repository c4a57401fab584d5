"""Actions of sessions: rehearse, stop, live surfaces, report, sharing."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices

from studio.app.model.actions import Action
from studio.app.model.runs.handing_over import OPEN, SHOW
from studio.app.model.runs.session_folders import reserved
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.workbench import Workbench
from studio.app.shell.actions.tracker import TrackerActions

AskShare = Callable[[Path, float, Callable[[Path, Sequence[str]], object]], object]
"""Asks where to and what of it: the folder that is proposed, the recording's size in MB, and what
takes the answer."""


def add_session_actions(bench: Workbench, run: SessionRun, ask_share: AskShare) -> None:
    """Add what the Session menu holds."""
    TrackerActions(bench, run).add()
    SharingActions(bench, run, ask_share).add()

    def rehearse(
        out: str = "", seed: int | None = None, paced: bool = False, trains_again: bool = False
    ) -> None:
        if seed is not None and seed != bench.document.seed:
            bench.change(f"Seed {seed}", replace(bench.document, seed=int(seed)))
        place = Path(out) if out else None
        run.rehearse(out=place, is_paced=paced, trains_again=trains_again)

    def make_live(corners: list[list[float]], name: str = "") -> None:
        count = len(bench.state.surfaces) + 1
        run.make_live(name or f"surface {count}", corners)

    for action in (
        Action(
            "session.rehearse",
            "Rehearse",
            "Session",
            rehearse,
            "play the scenario with a simulated camera, and track the objects in its video",
            "F5",
            ("out", "seed", "paced", "trains_again"),
            available=lambda: bench.scene is not None and not run.is_busy and not run.is_playing,
            command=partial(_rehearse_command, bench),
            icon="mdi6.play",
        ),
        Action(
            "session.stop",
            "Stop",
            "Session",
            run.stop,
            "end what is playing; what was recorded until then is kept, marked as cut short",
            "Shift+F5",
            available=lambda: run.is_busy,
            icon="mdi6.stop",
        ),
        Action(
            "session.make_live",
            "Make a live surface of four corners",
            "Session",
            make_live,
            "corners are pixels of the front lens's picture, top left first",
            arguments=("corners", "name"),
            available=lambda: run.is_playing and run.output is not None,
        ),
    ):
        bench.actions.add(action)


def _rehearse_command(
    bench: Workbench,
    out: str = "",
    seed: int | None = None,
    paced: bool = False,
    trains_again: bool = False,
) -> str:
    del trains_again  # the verb does it where it is needed
    document = bench.document
    words = ["nexus", "rehearse", document.scene]
    if document.scenario:
        words += ["--scenario", f"{document.scenario_name or 'scenario'}.toml"]
    elif document.scenario_name:
        words += ["--scenario", document.scenario_name]
    words += ["--seed", str(document.seed if seed is None else seed)]
    words += [*(["--out", out] if out else []), "--no-paper"]
    return shlex.join(words + (["--paced"] if paced else []))


class SharingActions:
    """Actions that share a rehearsal that was played or opened.

    Args:
        bench: gets the actions.
        run: has the rehearsal, and hands it over.
        ask_share: asks where to and what of it.
    """

    def __init__(self, bench: Workbench, run: SessionRun, ask_share: AskShare) -> None:
        self._bench, self._run, self._ask_share = bench, run, ask_share

    def add(self) -> None:
        """Add them to the Session menu."""
        for action in self._actions():
            self._bench.actions.add(action)

    def _shown(self) -> Path:
        rehearsal = self._run.shown_rehearsal
        if rehearsal is None:
            raise ValueError("there is nothing to share yet: rehearse, or open a recording first")
        return rehearsal

    def make(self, folder: str = "", out: str = "", parts: Sequence[str] | None = None) -> None:
        """Share a rehearsal, the shown one unless a folder is given, in a folder.

        Raises:
            ValueError: there is nothing to share.
        """
        rehearsal = Path(folder) if folder else self._shown()
        self._run.handing.begin(
            rehearsal, reserved(Path(out) if out else _place_of(rehearsal)), parts
        )

    def ask(self) -> None:
        """Ask where to and what of it, then share.

        Raises:
            ValueError: there is nothing to share.
        """
        rehearsal = self._shown()

        def share(out: Path, parts: Sequence[str]) -> None:
            self._bench.do("share.make", folder=str(rehearsal), out=str(out), parts=list(parts))

        size_mb = sum(f.stat().st_size for f in rehearsal.iterdir() if f.is_file()) / 1e6
        self._ask_share(_place_of(rehearsal), size_mb, share)

    def _command(self, folder: str = "", out: str = "", parts: Sequence[str] | None = None) -> str:
        words = ["nexus", "share", folder or str(self._run.shown_rehearsal or self._run.out)]
        words += ["--out", out] if out else []
        return shlex.join(words + (["--only", *parts] if parts else []))

    def show(self, *, is_folder: bool) -> None:
        """Show what was shared: its folder, or its first page.

        Raises:
            ValueError: nothing was shared.
        """
        shared = self._run.handing.shared
        if shared is None:
            raise ValueError("nothing was shared since the studio was opened")
        path = shared.folder if is_folder else shared.first
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(path.absolute())))

    def _can_share(self) -> bool:
        return self._run.shown_rehearsal is not None and not self._run.is_sharing

    def _is_shared(self) -> bool:
        return self._run.handing.shared is not None

    def _actions(self) -> tuple[Action, ...]:
        return (
            Action(
                "share.ask",
                "Share …",
                "Session",
                self.ask,
                "choose where to and what: viewer, film, session sheet, archive",
                "Ctrl+E",
                available=self._can_share,
                command=self._command,
                icon="mdi6.export-variant",
            ),
            Action(
                "share.make",
                "Share in a folder",
                "Session",
                self.make,
                "a viewer that opens offline in any browser, film, session sheet and archive",
                arguments=("folder", "out", "parts"),
                available=self._can_share,
                command=self._command,
            ),
            Action(
                SHOW,
                "Show the folder that was shared",
                "Session",
                partial(self.show, is_folder=True),
                available=self._is_shared,
            ),
            Action(
                OPEN,
                "Open what was shared",
                "Session",
                partial(self.show, is_folder=False),
                available=self._is_shared,
            ),
        )


def _place_of(rehearsal: Path) -> Path:
    return rehearsal.with_name(f"{rehearsal.name}-shared")
