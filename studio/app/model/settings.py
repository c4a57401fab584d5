"""The user's settings: theme, keys, text size, recent scenes, layout."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, get_args

import platformdirs

from scenes.formats.storage.atomic import write_whole

Recent = Literal["recent", "recent_sessions", "recent_scenarios"]
"""Lists of what was opened."""

RECENT = 12
"""Scenes and projects that are remembered."""

TEXT_SCALES = (0.8, 0.9, 1.0, 1.15, 1.3, 1.5, 1.75, 2.0)
"""Sizes of text that can be chosen, relative to the system's."""

THEMES = ("dark", "light")


@dataclass(frozen=True, slots=True)
class Settings:
    """One user's settings.

    Attributes:
        theme: of `THEMES`.
        text_scale: of `TEXT_SCALES`.
        key_preset: name of the keys that are changed by `keys`.
        keys: key sequences by action id, where they differ from the preset.
        recent: scenes and projects, newest first.
        recent_sessions: recordings that were opened, newest first.
        recent_scenarios: files of scenarios that were opened or saved, newest first.
        layout: of the docks, as their library writes it, base64; empty for the first.
        geometry: of the window, base64.
        layouts: by name, those that were saved.
        has_started: whether the studio was ever opened: the first page is shown until then.
        plugin_folder: where plug-ins are looked for; empty for the usual place.
        panels: titles of plug-ins' panels that are open.
        cameras: addresses of live cameras, newest first, without passwords.
        layers: whether each layer of the view is drawn, by name, where it differs from the first.
    """

    theme: str = "dark"
    text_scale: float = 1.0
    key_preset: str = "studio"
    keys: Mapping[str, str] = field(default_factory=dict)
    recent: tuple[str, ...] = ()
    recent_sessions: tuple[str, ...] = ()
    recent_scenarios: tuple[str, ...] = ()
    layout: str = ""
    geometry: str = ""
    layouts: Mapping[str, str] = field(default_factory=dict)
    has_started: bool = False
    plugin_folder: str = ""
    panels: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    layers: Mapping[str, bool] = field(default_factory=dict)

    def opened(self, path: str, kind: Recent = "recent") -> Settings:
        """After something was opened: a scene or project, a recording, a scenario."""
        others = [name for name in getattr(self, kind) if name != path]
        return replace(self, **{kind: tuple([path, *others][:RECENT])})


def settings_folder() -> Path:
    """Return the folder of settings and autosaved work; NEXUS_HOME names another one."""
    named = os.environ.get("NEXUS_HOME")
    return Path(named) if named else Path(platformdirs.user_data_dir("gaussiannexus", False))


def load_settings(path: Path) -> tuple[Settings, str]:
    """Settings from a file, and what was wrong with it, or "".

    A missing file gives the first settings. Of a damaged one, what can be read is kept and the file
    is put aside, so that nothing is lost.
    """
    try:
        values: dict[str, Any] = dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return Settings(), ""
    except (OSError, ValueError, TypeError) as error:
        kept = path.with_name(f"{path.name}.damaged")
        try:
            path.replace(kept)
        except OSError:
            kept = path
        return Settings(), f"{path}: settings cannot be read ({error}); kept as {kept.name}"
    wrong: list[str] = []
    found: dict[str, Any] = {}
    for item in fields(Settings):
        if item.name not in values:
            continue
        value = _checked(item.name, values[item.name])
        if value is None:
            wrong.append(item.name)
        else:
            found[item.name] = value
    problem = f"{path}: {', '.join(wrong)} cannot be read; the first values are used"
    return Settings(**found), problem if wrong else ""


def save_settings(settings: Settings, path: Path) -> None:
    """Write settings, whole or not at all.

    Raises:
        OSError: they cannot be written.
    """
    write_whole(
        path, json.dumps(asdict(settings), indent=1, sort_keys=True) + "\n", makes_folder=True
    )


def _checked(name: str, value: Any) -> Any:
    """The value if it is a good one for that setting, else None."""
    if name in ("keys", "layouts"):
        good = isinstance(value, dict) and all(isinstance(v, str) for v in value.values())
        return value if good else None
    if name == "layers":
        good = isinstance(value, dict) and all(isinstance(v, bool) for v in value.values())
        return value if good else None
    if name in (*get_args(Recent), "panels", "cameras"):
        good = isinstance(value, list) and all(isinstance(v, str) for v in value)
        return tuple(value[:RECENT]) if good else None
    if name == "theme":
        return value if value in THEMES else None
    if name == "text_scale":
        return value if value in TEXT_SCALES else None
    if name == "has_started":
        return value if isinstance(value, bool) else None
    return value if isinstance(value, str) and _decodes(name, value) else None


def _decodes(name: str, value: str) -> bool:
    if name not in ("layout", "geometry"):
        return True
    try:
        base64.b64decode(value, validate=True)
    except ValueError:
        return False
    return True
