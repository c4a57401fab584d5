"""Figures and events as people say them: words for parts of a name, names in place of ids."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping

WORDS: Mapping[str, str] = {
    "world_cm": "place",
    "yaw_deg": "heading",
    "ms": "time",
    "mean": "mean",
    "p50": "usual",
    "p95": "95 %",
    "object": "",
    "rehearse": "",
    "live": "",
    "stage": "step",
    "paper": "the paper's method",
    "own": "this tracker",
}
"""Parts of a figure's name as people say them; "" leaves a part out, others stay."""

UNITS: Mapping[str, str] = {"deg": "°"}
"""Units as they are printed; others stay."""

Called = Callable[[str], str]
"""Gives the name of the object of an id."""


def spoken(name: str, called: Called = str) -> str:
    """A figure's name in words: `rehearse.object.chair-1.world_cm.mean` is "Chair 1, place, mean".

    Args:
        name: of the figure.
        called: what the object of an id is called.
    """
    parts = name.split(".")
    words = [
        called(part) if before == "object" else WORDS.get(part, part.replace("_", " "))
        for before, part in zip(["", *parts], parts, strict=False)
    ]
    return ", ".join(word for word in words if word)


def with_names(text: str, ids: Iterable[str], called: Called) -> str:
    """A sentence with the names of objects in place of their ids.

    Args:
        text: such as "pushes chair-1".
        ids: that may stand in it.
        called: what the object of an id is called.
    """
    known = sorted(ids, key=len, reverse=True)  # chair-10 before chair-1
    if not known:
        return text
    pattern = re.compile(rf"(?<![\w-])({'|'.join(map(re.escape, known))})(?![\w-])")
    return pattern.sub(lambda match: called(match[1]), text)
