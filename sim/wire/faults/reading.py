"""Faults as a person writes them: on a command line, or as TOML."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from sim.wire.faults.schedule import RANGES, FaultError, FaultKind, WireFault

KEYS = ("at", "for", "size")
"""What may be said of a fault: begin and duration in seconds, and its size."""


def read_fault(text: str) -> WireFault:
    """The fault of `KIND:at=SECONDS,for=SECONDS,size=VALUE`; all but the kind may be left out.

    Raises:
        FaultError: it is none; says what is wanted.
    """
    kind, _, rest = text.strip().partition(":")
    values: dict[str, Any] = {}
    for part in filter(None, (part.strip() for part in rest.split(","))):
        key, mark, value = part.partition("=")
        if not mark:
            raise FaultError(
                f"fault {text!r}: {part!r}, wanted {', '.join(f'{k}=…' for k in KEYS)}"
            )
        try:
            values[key.strip()] = float(value)
        except ValueError:
            raise FaultError(f"fault {text!r}: {key.strip()}={value!r}, wanted a number") from None
    return _fault(kind.strip(), values, text)


def read_faults_file(path: Path) -> tuple[WireFault, ...]:
    """The faults of a TOML file: tables `[[fault]]` with `kind`, `at`, `for` and `size`.

    Raises:
        FaultError: one is none, or the file is no TOML.
        OSError: it cannot be read.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FaultError(f"{path}: no TOML ({error})") from None
    tables: Any = values.pop("fault", [])
    if values or not isinstance(tables, list):
        raise FaultError(f"{path}: {', '.join(values) or 'fault'}, wanted tables [[fault]] only")
    faults: list[WireFault] = []
    for number, table in enumerate(cast("list[Any]", tables)):
        where = f"{path}: fault[{number}]"
        if not isinstance(table, Mapping):
            raise FaultError(f"{where}: {table!r}, wanted a table")
        given = dict(cast("Mapping[str, Any]", table))
        faults.append(_fault(given.pop("kind", ""), given, where))
    return tuple(faults)


def _fault(kind: object, values: Mapping[str, Any], source: str) -> WireFault:
    try:
        known = FaultKind(str(kind))
    except ValueError:
        raise FaultError(f"{source}: kind {kind!r}, wanted one of {', '.join(FaultKind)}") from None
    for key, value in values.items():
        if key not in KEYS:
            raise FaultError(f"{source}: {key!r}, wanted some of {', '.join(KEYS)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise FaultError(f"{source}: {key}={value!r}, wanted a number")
    usual = RANGES[known]
    return WireFault(
        known,
        float(values.get("at", 0.0)),
        float(values.get("for", usual.usual_for_s)),
        float(values.get("size", usual.usual)),
    )
