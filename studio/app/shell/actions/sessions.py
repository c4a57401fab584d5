"""Actions of sessions: rehearse, stop, live surfaces, report, sharing."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
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
    _add_sharing(bench, run, ask_share)

    def rehearse(
        out: str = "", seed: int | None = None, paced: bool = False, trains_again: bool = False
    ) -> None:
        if seed is not None and seed != bench.document.seed:
            bench.change(f"Seed {seed}", replace(bench.document, seed=int(seed)))
        place = Path(out) if out else None
        run.rehearse(out=place, is_paced=paced, trains_again=trains_again)

    def command(
        out: str = "", seed: int | None = None, paced: bool = False, trains_again: bool = False
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
            command=command,
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


def _add_sharing(bench: Workbench, run: SessionRun, ask_share: AskShare) -> None:
    def place_of(rehearsal: Path) -> Path:
        return rehearsal.with_name(f"{rehearsal.name}-shared")

    def shown() -> Path:
        rehearsal = run.shown_rehearsal
        if rehearsal is None:
            raise ValueError("there is nothing to share yet: rehearse, or open a recording first")
        return rehearsal

    def make(folder: str = "", out: str = "", parts: Sequence[str] | None = None) -> None:
        rehearsal = Path(folder) if folder else shown()
        run.handing.begin(rehearsal, reserved(Path(out) if out else place_of(rehearsal)), parts)

    def ask() -> None:
        rehearsal = shown()

        def share(out: Path, parts: Sequence[str]) -> None:
            bench.do("share.make", folder=str(rehearsal), out=str(out), parts=list(parts))

        size_mb = sum(f.stat().st_size for f in rehearsal.iterdir() if f.is_file()) / 1e6
        ask_share(place_of(rehearsal), size_mb, share)

    def command(folder: str = "", out: str = "", parts: Sequence[str] | None = None) -> str:
        words = ["nexus", "share", folder or str(run.shown_rehearsal or run.out)]
        words += ["--out", out] if out else []
        return shlex.join(words + (["--only", *parts] if parts else []))

    def show(*, is_folder: bool) -> None:
        shared = run.handing.shared
        if shared is None:
            raise ValueError("nothing was shared since the studio was opened")
        path = shared.folder if is_folder else shared.first
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(path.absolute())))

    def can_share() -> bool:
        return run.shown_rehearsal is not None and not run.is_sharing

    def is_shared() -> bool:
        return run.handing.shared is not None

    for action in (
        Action(
            "share.ask",
            "Share …",
            "Session",
            ask,
            "choose where to and what: viewer, film, session sheet, archive",
            "Ctrl+E",
            available=can_share,
            command=command,
            icon="mdi6.export-variant",
        ),
        Action(
            "share.make",
            "Share in a folder",
            "Session",
            make,
            "a viewer that opens offline in any browser, film, session sheet and archive",
            arguments=("folder", "out", "parts"),
            available=can_share,
            command=command,
        ),
        Action(
            SHOW,
            "Show the folder that was shared",
            "Session",
            lambda: show(is_folder=True),
            available=is_shared,
        ),
        Action(
            OPEN,
            "Open what was shared",
            "Session",
            lambda: show(is_folder=False),
            available=is_shared,
        ),
    ):
        bench.actions.add(action)


def project_command(bench: Workbench) -> str:
    """The command that opens what is open."""
    project = bench.project
    return shlex.join(["nexus", "studio", str(project) if project else bench.document.scene])
