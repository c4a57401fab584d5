"""Actions of the views: how to move, tools, what is drawn, pictures of a view."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Protocol

from studio.app.model.actions import Action, Choice
from studio.app.model.names import CAMERA
from studio.app.model.workbench import Workbench
from studio.app.viewport.by_hand.tools import HINTS, ICONS, Tool
from studio.app.viewport.drawing.shapes import Shown
from studio.app.viewport.view import TwinView
from studio.app.viewport.viewer import MODES

LAYERS = {
    "labels": "Labels",
    "avatars": "People",
    "cameras": "Cameras",
    "annotations": "Notes",
    "surfaces": "Edges of live surfaces",
    "collision": "Collision mesh",
    "covariance": "Uncertainty of poses",
    "errors": "Tracking error on the floor",
    "unseen": "Sides that no photo saw",
}
"""Titles of the layers of `Shown`."""


class SmallPictures(Protocol):
    """The small pictures in the corner."""

    def choices(self) -> list[Choice]:
        """All views that can be shown, and which are."""
        ...

    def switch(self, source: str) -> None:
        """Open or close what a camera, person or object sees."""
        ...

    def switch_people(self) -> None:
        """Open or close the views of the local and of the remote person."""
        ...

    def close_all(self) -> None:
        """Close them all."""
        ...


class Views(Protocol):
    """The views, as these actions use them."""

    bench: Workbench
    views: list[TwinView]
    active: TwinView
    is_linked: bool

    @property
    def insets(self) -> SmallPictures:
        """The small pictures in the corner."""
        ...

    def set_count(self, count: int) -> None:
        """Show so many views."""
        ...

    def take(self, tool: Tool) -> None:
        """Take a tool in hand, in all views."""
        ...


def add_view_actions(grid: Views) -> None:
    """Add what concerns the view in hand."""
    for actions_of in (_looking, _arranging, _others_views, _tools, _drawn, _pictures):
        for action in actions_of(grid):
            grid.bench.actions.add(action)


def _looking(grid: Views) -> list[Action]:
    def mode(name: str = "") -> None:
        viewer = grid.active.viewer
        if not name and viewer is not None:
            name = MODES[(MODES.index(viewer.mode) + 1) % len(MODES)]
        grid.active.set_mode(name)

    def orbit(yaw_deg: float = 0.0, pitch_deg: float = 0.0, steps: float = 0.0) -> None:
        viewer = grid.active.viewer
        if viewer is not None:
            turned = replace(
                viewer.orbit,
                yaw=viewer.orbit.yaw + math.radians(yaw_deg),
                pitch=viewer.orbit.pitch + math.radians(pitch_deg),
            )
            grid.active.set_viewer(replace(viewer, orbit=turned.zoomed(steps)))

    def look(x: float, y: float, z: float, yaw_deg: float, pitch_deg: float, away: float) -> None:
        from studio.app.viewport.orbit import Orbit

        viewer = grid.active.viewer
        if viewer is not None:
            target = Orbit((x, y, z), math.radians(yaw_deg), math.radians(pitch_deg), away)
            grid.active.set_viewer(replace(viewer, orbit=target, mode="orbit"))

    return [
        *_seeing(grid),
        Action(
            "view.mode", "Orbit, fly or walk", "View", mode, "the next, or by name", "V", ("name",)
        ),
        Action(
            "view.stand",
            "Stand at a place",
            "View",
            lambda x, y: grid.active.stand_at(x, y),
            "and walk from there",
            arguments=("x", "y"),
        ),
        Action(
            "view.orbit",
            "Turn the view",
            "View",
            orbit,
            arguments=("yaw_deg", "pitch_deg", "steps"),
        ),
        Action(
            "view.look",
            "Look at a place",
            "View",
            look,
            arguments=("x", "y", "z", "yaw_deg", "pitch_deg", "away"),
        ),
    ]


def _seeing(grid: Views) -> list[Action]:
    return [
        Action(
            "view.frame",
            "See the selection",
            "View",
            lambda: grid.active.frame(),
            "",
            "F",
            icon="mdi6.image-filter-center-focus",
        ),
        Action(
            "view.home",
            "See the whole room",
            "View",
            lambda: grid.active.go_home(),
            "",
            "Shift+F",
            icon="mdi6.home-outline",
        ),
    ]


def _arranging(grid: Views) -> list[Action]:
    def link() -> None:
        grid.is_linked = not grid.is_linked
        grid.bench.say("info", "views are linked" if grid.is_linked else "views are free")

    def shows(count: int) -> Callable[[], bool]:
        return lambda: len(grid.views) == count

    return [
        Action(
            "view.count",
            "Number of views",
            "View",
            grid.set_count,
            "1 to 4",
            arguments=("count",),
        ),
        Action("view.one", "One view", "View", partial(grid.set_count, 1), "", is_on=shows(1)),
        Action("view.four", "Four views", "View", partial(grid.set_count, 4), "", is_on=shows(4)),
        Action(
            "view.link",
            "Link the views",
            "View",
            link,
            "they move together",
            is_on=lambda: grid.is_linked,
        ),
    ]


def _others_views(grid: Views) -> list[Action]:
    return [
        Action(
            "view.inset",
            "Picture in picture",
            "View",
            lambda source=CAMERA: grid.insets.switch(source),
            "the 360° camera, or what a person or object sees; again closes it",
            "P",
            ("source",),
            choices=grid.insets.choices,
        ),
        Action(
            "view.people",
            "Both people's views",
            "View",
            grid.insets.switch_people,
            "what the local and the remote person see, beside each other; again closes both",
        ),
        Action(
            "view.follow",
            "Look from a person's eyes",
            "View",
            lambda person="": grid.active.follow(person),
            "the view follows them until it is moved by hand; nobody's ends it",
            arguments=("person",),
            choices=lambda: _followed(grid),
        ),
        Action(
            "view.no_insets",
            "Close all pictures in the picture",
            "View",
            grid.insets.close_all,
            "",
            "Shift+P",
        ),
    ]


def _followed(grid: Views) -> list[Choice]:
    """Return everybody who is here, and whose eyes the view is seen through."""
    bench, followed = grid.active.bench, grid.active.followed
    return [
        Choice(
            bench.name_of(key),
            {"person": "" if key == followed else key},
            is_on=key == followed,
        )
        for key in bench.state.avatars
    ]


def _tools(grid: Views) -> list[Action]:
    def take(tool: Tool) -> Callable[[], None]:
        return lambda: grid.take(tool)

    def is_in_hand(tool: Tool) -> bool:
        return grid.active.hand.tool is tool

    titles = {
        "select": "Select",
        "move": "Move",
        "turn": "Turn",
        "scale": "Scale",
        "measure": "Measure",
        "draw": "Draw a note",
        "surface": "Live surface of four corners",
    }
    return [
        *(
            Action(
                f"view.tool_{tool}",
                titles[tool],
                "Twin",
                take(tool),
                HINTS[tool],
                str(number),
                icon=ICONS[tool],
                is_on=partial(is_in_hand, tool),
            )
            for number, tool in enumerate(Tool, 1)
        ),
        Action(
            "view.select",
            "Select by name",
            "Twin",
            grid.bench.select,
            arguments=("item_id",),
        ),
    ]


def _drawn(grid: Views) -> list[Action]:
    bench = grid.bench

    def is_on_now(name: str) -> bool:
        return bool(getattr(Shown.of(bench.settings.layers), name))

    def toggle(name: str) -> None:
        is_on = not is_on_now(name)
        bench.set(layers={**bench.settings.layers, name: is_on})
        bench.say("info", f"{LAYERS[name]}: {'shown' if is_on else 'hidden'}")
        if name == "errors" and is_on and bench.recording is None:
            bench.say("info", "errors on the floor appear when a session has ended or is open")

    return [
        Action(
            f"view.show_{name}",
            f"Show {title[0].lower()}{title[1:]}",
            "View",
            partial(toggle, name),
            "again hides them",
            is_on=partial(is_on_now, name),
        )
        for name, title in LAYERS.items()
    ]


def _pictures(grid: Views) -> list[Action]:
    def picture(path: str = "view.png") -> None:
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        if not grid.active.picture().save(str(target)):
            raise OSError(f"{path}: the picture cannot be written; wanted a name such as view.png")
        grid.bench.say("info", f"saved {path}")

    return [
        Action(
            "view.picture",
            "Picture of the view",
            "View",
            picture,
            "a PNG file",
            arguments=("path",),
        )
    ]
