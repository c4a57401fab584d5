"""Files of the product that a value passes, by a trace of their calls."""

from __future__ import annotations

import dataclasses
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("scenes", "devices", "sim", "tracking", "studio")
MAX_DEPTH = 5
"""Levels of dataclasses and collections that are looked through for what is followed."""

MAX_LOOKED_AT = 8
"""Values of a collection that are looked at."""


class Passing:
    """Notes each file with a function that is given, or gives back, what `is_it` knows.

    Args:
        is_it: whether a value itself is what is followed; records and collections are searched.
        ends_in: beginnings of paths in which the value is used, no longer passed on: neither those
            files count nor what they call.
        skips: beginnings of paths that do not count, while what they call does.
    """

    def __init__(
        self,
        is_it: Callable[[Any], bool],
        *,
        ends_in: tuple[str, ...] = (),
        skips: tuple[str, ...] = (),
    ) -> None:
        self.files: dict[str, str] = {}
        """Name of the first function of each file that had it."""
        self.types: set[str] = set()
        """Names of the product's records that held it."""
        self.is_on = False
        self._is_it, self._ends_in, self._skips = is_it, ends_in, skips
        self._names: dict[CodeType, str] = {}

    @contextmanager
    def watching(self) -> Iterator[Passing]:
        """Trace this thread and all that begin within; notes are made while `is_on`."""
        threading.setprofile(self._see)
        sys.setprofile(self._see)
        try:
            yield self
        finally:
            self.is_on = False
            sys.setprofile(None)
            threading.setprofile(None)

    def _see(self, frame: FrameType, event: str, value: Any) -> None:
        if not self.is_on or event not in ("call", "return"):
            return
        code = frame.f_code
        name = self._name(code)
        if not name:
            return
        if event == "call":
            count = code.co_argcount + code.co_kwonlyargcount
            given = [frame.f_locals.get(v) for v in code.co_varnames[:count] if v != "self"]
        else:
            given = [value]
        types: set[str] = set()
        # A list, not a generator: every argument's types are noted.
        if any([self._holds(v, types, 0) for v in given]) and not self._is_used(frame):
            self.types |= types
            taker = frame.f_back.f_code if event == "return" and frame.f_back else code
            for one in (code, taker):
                if (file := self._name(one)) and not file.startswith(self._skips or ("/",)):
                    self.files.setdefault(file, one.co_qualname)

    def _name(self, code: CodeType) -> str:
        """Path of a file of the product in the tree; empty for others."""
        if code not in self._names:
            path = Path(code.co_filename)
            name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
            self._names[code] = name if name.startswith(FLOORS) else ""
        return self._names[code]

    def _is_used(self, frame: FrameType | None) -> bool:
        while frame is not None:
            if self._name(frame.f_code).startswith(self._ends_in or ("/",)):
                return True
            frame = frame.f_back
        return False

    def _holds(self, value: Any, types: set[str], depth: int) -> bool:
        """Whether a value is, or contains, what is followed; adds the types of records with it."""
        if self._is_it(value):
            self._note(value, types)
            return True
        if depth == MAX_DEPTH:
            return False
        if isinstance(value, list | tuple):
            return any(self._holds(v, types, depth + 1) for v in value[:MAX_LOOKED_AT])
        if isinstance(value, Mapping):
            some = list(value.values())[:MAX_LOOKED_AT]
            return any(self._holds(v, types, depth + 1) for v in some)
        if not dataclasses.is_dataclass(value) or isinstance(value, type):
            return False
        fields = [getattr(value, f.name, None) for f in dataclasses.fields(value)]
        found = any(self._holds(v, types, depth + 1) for v in fields)
        if found:
            self._note(value, types)
        return found

    def _note(self, value: Any, types: set[str]) -> None:
        if type(value).__module__.split(".")[0] in FLOORS:
            types.add(type(value).__name__)
