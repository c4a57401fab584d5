"""Actions of sessions: rehearse, stop, live surfaces, report, sharing."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

from studio.app.model.actions import Action
from studio.app.model.runs.session_folders import reserved
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.workbench import Workbench
from studio.app.shell.actions.tracker import TrackerActions


def add_session_actions(bench: Workbench, run: SessionRun) -> None:
    """Add what the Session menu holds."""
    TrackerActions(bench, run).add()

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

    def share(folder: str = "", out: str = "") -> None:
        rehearsal = Path(folder) if folder else run.shown_rehearsal
        if rehearsal is None:
            raise ValueError("there is nothing to share yet: rehearse, or open a recording first")
        beside = rehearsal.with_name(f"{rehearsal.name}-shared")
        run.share(rehearsal, reserved(Path(out) if out else beside))

    def share_command(folder: str = "", out: str = "") -> str:
        rehearsal = folder or str(run.shown_rehearsal or run.out)
        return shlex.join(["nexus", "share", rehearsal, *(["--out", out] if out else [])])

    for action in (
        Action(
            "share.make",
            "Share",
            "Session",
            share,
            "film, a viewer that opens offline in any browser, session sheet and archive",
            "Ctrl+E",
            ("folder", "out"),
            available=lambda: run.shown_rehearsal is not None and not run.is_sharing,
            command=share_command,
            icon="mdi6.export-variant",
        ),
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


def project_command(bench: Workbench) -> str:
    """The command that opens what is open."""
    project = bench.project
    return shlex.join(["nexus", "studio", str(project) if project else bench.document.scene])
