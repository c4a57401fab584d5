"""Fields of JSON texts: each of the type and in the range that is wanted, or refused by name."""

from __future__ import annotations

import json
import math
import re
from typing import Any, NoReturn, cast

MAX_COUNT = 2**53
"""Largest whole number that every JSON reader keeps."""

PERSON = re.compile(r"[A-Za-z0-9_.-]{1,120}")
"""Id of a person: a room's name, a site's and the hub's own, with dots between."""

ID = re.compile(rf"(?:{PERSON.pattern}/)?[A-Za-z0-9_.-]{{1,40}}")
"""Name that a client gives an entity, an operation or a drag; an entity's may begin with its
maker's id."""


class MessageError(ValueError):
    """A text that is no message; says which field."""


def read_object(text: str | bytes) -> dict[str, Any]:
    """Return the fields of a JSON object.

    Raises:
        MessageError: it is none.
    """
    try:
        value: Any = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"no JSON: {type(error).__name__}") from None
    if not isinstance(value, dict):
        raise MessageError("wanted a JSON object")
    return cast(dict[str, Any], value)


def read_text(fields: dict[str, Any], field: str) -> str:
    """Return a field that is a text.

    Raises:
        MessageError: it is none.
    """
    value = fields.get(field)
    if not isinstance(value, str):
        raise MessageError(f"{field}: wanted a text")
    return value


def read_count(fields: dict[str, Any], field: str) -> int:
    """Return a field that is a whole number of 0 or more.

    Raises:
        MessageError: it is none.
    """
    value = fields.get(field)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= MAX_COUNT:
        raise MessageError(f"{field}: wanted a whole number of 0 or more")
    return value


def read_number(value: object, field: str) -> float:
    """Return a finite number.

    Raises:
        MessageError: it is none.
    """
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not abs(cast(float, value)) <= MAX_COUNT:
        raise MessageError(f"{field}: wanted a number")
    number = float(cast(float, value))
    if not math.isfinite(number):
        raise MessageError(f"{field}: wanted a number")
    return number


def read_label(value: object) -> str | int | None:
    """Return a client's name of an operation or a drag, a number or a short text; None if none."""
    if isinstance(value, str) and ID.fullmatch(value):
        return value
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) <= MAX_COUNT:
        return value
    return None


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(name)
