"""Every pose of every method as one JSON file, written while the session runs.

A session of hours has more of them than fit beside it in memory: each method's frames go to a file
of their own, and those are put together at the end.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO

from devices.recording_codec import track_to_json
from devices.session_info import SessionInfo
from scenes.state import TrackedObject


class TracksFile:
    """Takes frames as they come. Use as a context manager: its end makes the file whole.

    `world_from_object` is a 4×4 row-major matrix in metres.

    Args:
        path: of the JSON file; while the session runs, `path` + ".METHOD" are beside it.
        info: of the session.
        methods: names of the trackers, in order.

    Raises:
        OSError: a file cannot be made or written.
    """

    def __init__(self, path: Path, info: SessionInfo, methods: Sequence[str]) -> None:
        self._path, self._info = path, info
        self._parts = {name: path.with_name(f"{path.name}.{name}") for name in methods}
        self._files: dict[str, IO[str]] = {}
        self._stack = ExitStack()

    def add(self, method: str, objects: Sequence[TrackedObject]) -> None:
        """Take a method's answer to one frame; an empty one leaves nothing.

        Raises:
            OSError: the disk is full or gone.
        """
        if not objects:
            return
        frame = {
            "seq": objects[0].source_seq,
            "t_ns": objects[0].t_ns,
            "objects": [track_to_json(track) for track in objects],
        }
        file = self._files[method]
        file.write(f"{', ' if file.tell() else ''}{json.dumps(frame, allow_nan=False)}")

    def __enter__(self) -> TracksFile:
        for name, part in self._parts.items():
            file = self._stack.enter_context(part.open("w", encoding="utf-8"))
            self._files[name] = file
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stack.close()
        try:
            if kind is None:
                self._join()
        finally:
            for part in self._parts.values():
                part.unlink(missing_ok=True)

    def _join(self) -> None:
        info = self._info
        head = {
            "format": "gaussiannexus tracks",
            "version": 1,
            "units": {"length": "m", "time": "ns"},
            "scene": info.scene,
            "scenario": info.scenario_name,
            "seed": info.seed,
        }
        with self._path.open("w", encoding="utf-8") as whole:
            whole.write(f'{json.dumps(head, allow_nan=False)[:-1]}, "methods": {{')
            for place, (name, part) in enumerate(self._parts.items()):
                whole.write(f"{', ' if place else ''}{json.dumps(name)}: [")
                with part.open(encoding="utf-8") as file:
                    shutil.copyfileobj(file, whole)
                whole.write("]")
            whole.write("}}\n")
