"""JSON of a dataset's files, whose errors name file and field."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose


@dataclass(frozen=True, slots=True)
class Field:
    """A JSON value that knows where it stands, for messages.

    Raises:
        ValueError: in every method, where the value is of another kind; names file and field.
    """

    path: Path
    name: str
    value: Any

    def get(self, key: str) -> Field:
        """Return the value of a key."""
        if not isinstance(self.value, dict) or key not in self.value:
            raise self.wrong(f"field {key!r} is missing")
        return Field(self.path, f"{self.name}.{key}".lstrip("."), self.value[key])

    def optional(self, key: str) -> Any:
        """Return the plain value of a key, None without one."""
        return self.value.get(key) if isinstance(self.value, dict) else None

    def __iter__(self) -> Any:
        if not isinstance(self.value, dict):
            raise self.wrong("wanted an object")
        return iter(
            (str(key), Field(self.path, f"{self.name}.{key}".lstrip("."), value))
            for key, value in self.value.items()
        )

    def items(self) -> list[Field]:
        """Return the values of a list."""
        if not isinstance(self.value, list):
            raise self.wrong("wanted a list")
        return [
            Field(self.path, f"{self.name}[{index}]", item) for index, item in enumerate(self.value)
        ]

    def number(self) -> float:
        """Return the number that it is."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.wrong(f"{self.value!r}, wanted a number")
        return float(self.value)

    def text(self) -> str:
        """Return the text that it is."""
        if not isinstance(self.value, str):
            raise self.wrong(f"{self.value!r}, wanted text")
        return self.value

    def array(self, *shape: int) -> NDArray[np.float64]:
        """Return finite numbers of a shape."""
        try:
            values = np.array(self.value, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.empty(0)
        if values.shape != shape or not np.isfinite(values).all():
            raise self.wrong(f"wanted {' × '.join(map(str, shape))} finite numbers")
        return values

    def pose(self) -> Pose:
        """Return the pose of a 4 × 4 matrix."""
        try:
            return Pose.from_matrix(self.array(4, 4))
        except ValueError as error:
            raise self.wrong(str(error)) from None

    def wrong(self, what: str) -> ValueError:
        """Return the error that says what is wrong with the value, and where it stands."""
        return ValueError(f"{self.path}: {self.name or 'the file'}: {what}")


def read_json(path: Path) -> Field:
    """Return the value of a JSON file.

    Raises:
        ValueError: it is missing or no JSON.
    """
    try:
        return Field(path, "", json.loads(existing(path).read_text(encoding="utf-8-sig")))
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: no JSON ({error})") from None


def existing(path: Path) -> Path:
    """Return the path of a file that is there.

    Raises:
        ValueError: it is not.
    """
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file; docs/datasets.md says what is wanted")
    return path
