"""Key bindings: presets in the manner of other programs, and the user's own changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from studio.app.model.actions import Action
from studio.app.model.settings import Settings

PRESETS: Mapping[str, Mapping[str, str]] = {
    "studio": {},
    "blender": {
        "view.tool_move": "G",
        "view.tool_turn": "R",
        "view.tool_scale": "S",
        "view.frame": "Num+.",
        "palette.open": "F3",
    },
    "unity": {
        "view.tool_select": "Q",
        "view.tool_move": "W",
        "view.tool_turn": "E",
        "view.tool_scale": "R",
        "view.frame": "F",
    },
}
"""By name: what differs from the actions' own keys."""


def keys_of(action: Action, settings: Settings) -> str:
    """The key sequence of an action, or ""."""
    preset = PRESETS.get(settings.key_preset, {})
    return settings.keys.get(action.id, preset.get(action.id, action.keys))


def clashes(actions: Iterable[Action], settings: Settings) -> dict[str, list[Action]]:
    """Key sequences that more than one action has."""
    found: dict[str, list[Action]] = {}
    for action in actions:
        keys = keys_of(action, settings)
        if keys:
            found.setdefault(keys.lower(), []).append(action)
    return {keys: same for keys, same in found.items() if len(same) > 1}
