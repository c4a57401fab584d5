"""Makes a prepared scan fit to rehearse in: trains, once, what stands for the real room."""

from __future__ import annotations

import sys
import time
from pathlib import Path


def make_rehearsable(scene: Path, work_folder: Path | None, *, seed: int = 0) -> None:
    """Add a second reconstruction to a scene package that has none; other scenes stay as they are.

    Args:
        scene: a package's folder; anything else is left alone.
        work_folder: of its preparation; beside the package if not given.
        seed: of the training.

    Raises:
        ValueError: the work folder is not there or another room's; the scene is damaged.
        OSError: the disk is full; the training goes on from there the next time.
    """
    from scenes.package import is_package, load_package, save_package
    from scenes.prepare.reality import with_reality
    from studio.console.progress import StageProgress, text_progress

    if not scene.is_dir() or not is_package(scene):
        return
    package = load_package(scene)
    if package.physical is not None or package.reality is not None:
        return
    print(
        f"{scene}: training what stands for the real room, once; the scan itself would show the "
        "tracker its own model",
        file=sys.stderr,
    )
    stages = StageProgress(text_progress())
    package = with_reality(
        package,
        work_folder or scene.with_name(f"{scene.name}.prepare"),
        seed=seed,
        seconds=time.monotonic,
        progress=stages,
    )
    stages.finish()
    save_package(package, scene)
