"""Shown names: one rule for every place in which people read a name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from scenes.package import ScenePackage
from scenes.state import Avatar
from studio.app.model.documents.document import Document

CAMERA, CAMERA_NAME = "camera", "360° camera"
"""Id of the 360° camera where a view is chosen, and what it is called."""


NOBODY: Mapping[str, Avatar] = MappingProxyType({})
"""Nobody is there."""


def shown_name(
    item_id: str,
    document: Document,
    scene: ScenePackage | None,
    *,
    people: Mapping[str, Avatar] = NOBODY,
) -> str:
    """The name that a user gave, else the scan's or a person's own, else the id.

    Args:
        item_id: of an object, person or body; an unknown one is its own name.
        document: with the names that were given.
        scene: that is open, or None.
        people: who is there, by id: they are called as they call themselves.
    """
    given = document.twin.names.get(item_id)
    if given:
        return given
    for item in () if scene is None else scene.objects:
        if item.object_id == item_id:
            return item.name or item_id
    if item_id in people and people[item_id].name:
        return people[item_id].name
    return CAMERA_NAME if item_id == CAMERA else item_id


def distinct_names(ids: Sequence[str], name: Callable[[str], str]) -> list[str]:
    """Return names for a list to choose from, each that several have with its id.

    Args:
        ids: each once.
        name: what each is called.
    """
    names = [name(item_id) for item_id in ids]
    count = Counter(names)
    return [
        shown if count[shown] == 1 else f"{shown} ({item_id})"
        for item_id, shown in zip(ids, names, strict=True)
    ]
