"""The truth of a stream as JSON lines: of every picture that was due, and of every one sent.

A line `{"taken": …}` is a picture of the camera: `number`, `boot`, `stamp_ns` (its time on the
camera's clock), `wall_ns` (since 1970), `objects` (4×4 `world_from_object`, row by row), `camera`
(`world_from_rig`), and `visible` (share of each object that is seen). While the camera is switched
off there is such a line, too, with `"on": false`: the room goes on. A line `{"sent": …}` says when
a picture was handed to the network, and to which output.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, cast

from scenes.pose import Pose
from sim.wire.film.film import PictureTruth
from sim.wire.unit_faults import OutgoingUnit

TAKEN = '{"taken":'
"""Beginning of a line of a picture that was taken, as `TruthWriter` writes it."""


@dataclass(frozen=True, slots=True)
class PictureTime:
    """When a picture was taken.

    Attributes:
        number: counts the pictures that were due.
        boot: how often the camera had restarted before.
        stamp_ns: on the camera's own clock.
        wall_ns: since 1970.
        is_on: whether there was a camera that could take it.
    """

    number: int
    boot: int
    stamp_ns: int
    wall_ns: int
    is_on: bool = True


@dataclass(frozen=True, slots=True)
class TruthRow:
    """One picture of a file.

    Attributes:
        time: when it was taken.
        world_from_object: by object id; empty where the film knows nothing.
        visible_fraction: by object id.
        world_from_rig: of the camera; None where the film knows nothing.
        sent_ns: by output, when it was sent, since 1970.
    """

    time: PictureTime
    world_from_object: Mapping[str, Pose]
    visible_fraction: Mapping[str, float]
    world_from_rig: Pose | None
    sent_ns: dict[str, int] = field(default_factory=dict[str, int])


class TruthWriter:
    """Writes lines as pictures are taken and sent, from any thread.

    Args:
        path: is written anew.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        self._file: IO[str] = path.open("w", encoding="utf-8", buffering=1)

    def taken(self, time: PictureTime, truth: PictureTruth | None) -> None:
        """A picture was taken, or would have been."""
        values: dict[str, Any] = {
            "number": time.number,
            "boot": time.boot,
            "stamp_ns": time.stamp_ns,
            "wall_ns": time.wall_ns,
            "on": time.is_on,
        }
        if truth is not None:
            values["camera"] = _numbers(truth.world_from_rig)
            values["objects"] = {k: _numbers(p) for k, p in truth.world_from_object.items()}
            values["visible"] = {k: round(v, 4) for k, v in truth.visible_fraction.items()}
            if truth.faults:
                values["faults"] = dict(truth.faults)
        self._write({"taken": values})

    def sent(self, unit: OutgoingUnit, output: str, wall_ns: int) -> None:
        """A picture was handed to the network."""
        self._write({"sent": {"number": unit.number, "to": output, "wall_ns": wall_ns}})

    def close(self) -> None:
        """No more lines; harmless when closed."""
        with self._lock:
            self._file.close()

    def _write(self, values: Mapping[str, Any]) -> None:
        line = json.dumps(values, separators=(",", ":")) + "\n"
        with self._lock:
            if not self._file.closed:
                self._file.write(line)


def read_truth(path: Path) -> list[TruthRow]:
    """Every picture of a file, in order; a last line that is not whole yet is left out.

    Raises:
        ValueError: a line is none of ours; names it.
        OSError: the file cannot be read.
    """
    rows: dict[int, TruthRow] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(keepends=True), 1):
        if not line.endswith("\n"):
            break
        try:
            values = cast("dict[str, dict[str, Any]]", json.loads(line))
            if "taken" in values:
                row = _row(values["taken"])
                rows[row.time.number] = row
            else:
                sent = values["sent"]
                rows[sent["number"]].sent_ns[sent["to"]] = sent["wall_ns"]
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{path}:{number}: no line of truth ({error})") from None
    return list(rows.values())


def newest_row(lines: str) -> TruthRow | None:
    """Return the last picture of some whole lines of a file; None where there is none.

    Raises:
        ValueError: a line is none of ours.
    """
    for line in reversed(lines.splitlines()):
        if line.startswith(TAKEN):
            try:
                return _row(json.loads(line)["taken"])
            except (ValueError, KeyError, TypeError) as error:
                raise ValueError(f"{line[:60]}: no line of truth ({error})") from None
    return None


def _row(values: Mapping[str, Any]) -> TruthRow:
    camera = values.get("camera")
    objects = cast("Mapping[str, list[float]]", values.get("objects", {}))
    return TruthRow(
        PictureTime(
            values["number"],
            values["boot"],
            values["stamp_ns"],
            values["wall_ns"],
            values["on"],
        ),
        {name: _pose(numbers) for name, numbers in objects.items()},
        values.get("visible", {}),
        None if camera is None else _pose(camera),
    )


def _numbers(pose: Pose) -> list[float]:
    return [round(float(value), 9) for value in pose.matrix().ravel()]


def _pose(numbers: list[float]) -> Pose:
    return Pose.from_matrix([numbers[at : at + 4] for at in range(0, 16, 4)])
