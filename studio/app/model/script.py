"""Scripts of user actions: one action a line, `group.verb name=value ...`, `#` begins a comment.

Values are JSON, and words without quotes are texts: `twin.move object=chair-1 x=0.4 y=-1.2`.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

READING = "a recording"
"""Names the reading of a recording in `Workbench.busy`: every step waits for its end, since what a
recording is opened for comes next."""


class ScriptError(ValueError):
    """A script cannot be read or a line of it failed: names file, line and reason."""


@dataclass(frozen=True, slots=True)
class Step:
    """One line of a script.

    Attributes:
        line: its number, from 1.
        action_id: what to do.
        values: with which arguments.
    """

    line: int
    action_id: str
    values: Mapping[str, Any]


def read_script(text: str, *, source: str) -> list[Step]:
    """The steps of a script.

    Raises:
        ScriptError: a line is malformed.
    """
    steps: list[Step] = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            words = _words(line)
            if words:
                steps.append(Step(number, words[0], dict(_pair(word) for word in words[1:])))
        except ValueError as error:
            raise ScriptError(f"{source}:{number}: {error}: {line.strip()!r}") from None
    return steps


def script_line(action_id: str, values: Mapping[str, Any]) -> str:
    """One step as a line; `read_script` gives the same step."""
    parts = [f"{name}={_written(value)}" for name, value in values.items()]
    return " ".join([action_id, *parts])


def _words(line: str) -> list[str]:
    lexer = shlex.shlex(line, posix=True, punctuation_chars=False)
    lexer.whitespace_split = True
    lexer.commenters = "#"
    return list(lexer)


def _pair(word: str) -> tuple[str, Any]:
    name, equals, value = word.partition("=")
    if not equals or not name.isidentifier():
        raise ValueError(f"{word!r}, wanted name=value")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def _written(value: Any) -> str:
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    # A bare word is read as a text, unless it is spelled as a number, null, true or false.
    if isinstance(value, str) and _is_bare(value):
        return value
    return shlex.quote(text)


def _is_bare(value: str) -> bool:
    if not value or shlex.quote(value) != value:
        return False
    try:
        json.loads(value)
    except json.JSONDecodeError:
        return True
    return False
