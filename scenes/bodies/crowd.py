"""People of a state as figures, from picture to picture: feet step, arms go and come back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenes.bodies.figure import Colour, colours_of, posed, rest_figure, tint
from scenes.bodies.furniture import Furniture
from scenes.bodies.goals import goals_of
from scenes.bodies.skeleton import Skeleton
from scenes.bodies.solids import Solids
from scenes.bodies.solve import BodyState, fresh_bodies, solve_bodies
from scenes.pose import Pose
from scenes.state import Avatar

T = TypeVar("T")

ROLE_COLOURS: Mapping[str, Colour] = {
    "remote": (0.337, 0.706, 0.914),
    "local": (0.800, 0.475, 0.655),
}
"""Of people elsewhere and on site, sRGB: blue and pink that the colour-blind can tell apart (Okabe
and Ito 2008)."""


REACH_M = 1.3
"""From eyes to what a hand reaches at most, metres: a tall person's arm, bent down."""

NOWHERE: Mapping[str, Pose] = MappingProxyType({})
"""Furniture before any was seen: none."""


@dataclass(frozen=True, slots=True, eq=False)
class PosedPerson:
    """A person's figure as it stands there.

    Attributes:
        vertices: (V, 3) float32 world metres.
        normals: (V, 3) float32.
        faces: (F, 3) of the whole figure, the same array every time.
        arm_faces: (F, 3) of forearms and hands alone: what people see of themselves.
        colours: (V, 3) uint8, the same array as long as the person is here.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.int32]
    arm_faces: NDArray[np.int32]
    colours: NDArray[np.uint8]


class Crowd:
    """Figures of all people of a state; of a state that was asked for before, the same ones.

    One thread uses it. Time that goes back, stands or jumps lays people out anew.

    Args:
        furniture: what hands stay out of.
    """

    def __init__(self, furniture: Furniture | None = None) -> None:
        self.furniture = furniture
        self._avatars: dict[str, Avatar] = {}
        self._t_ns = 0
        self._bodies: BodyState | None = None
        self._colours: dict[tuple[str, str], NDArray[np.uint8]] = {}
        self._figures: dict[str, PosedPerson] = {}
        self._arm_faces: NDArray[np.int32] | None = None

    def figures(
        self, avatars: Mapping[str, Avatar], t_ns: int, *, objects: Mapping[str, Pose] = NOWHERE
    ) -> Mapping[str, PosedPerson]:
        """Return a figure for everybody.

        Args:
            avatars: by user id.
            t_ns: time of the state.
            objects: where movable furniture is, by object id.
        """
        if t_ns == self._t_ns and _are_same(avatars, self._avatars):
            return self._figures
        solids = None
        if self.furniture is not None and avatars:
            eyes = np.array([each.world_from_head.translation for each in avatars.values()])
            solids = self.furniture.at(objects).near(eyes, REACH_M)
        self._figures = self._made(avatars, t_ns, solids=solids) if avatars else {}
        self._avatars, self._t_ns = dict(avatars), t_ns
        return self._figures

    def _made(
        self, avatars: Mapping[str, Avatar], t_ns: int, *, solids: Solids | None
    ) -> dict[str, PosedPerson]:
        goals = goals_of(list(avatars.values()))
        since_s = (t_ns - self._t_ns) * 1e-9
        before = self._bodies if since_s > 0.0 else None
        if before is not None and list(avatars) != list(self._avatars):
            places = {key: row for row, key in enumerate(self._avatars)}
            rows = np.array([places.get(key, -1) for key in avatars])
            before = _rows(before, fresh_bodies(goals), rows=rows)
        self._bodies, skeleton = solve_bodies(before, goals, dt_s=since_s, solids=solids)
        self._keep_colours(avatars)
        return {
            key: self._person(skeleton, row, colours=self._colours[key, item.role])
            for row, (key, item) in enumerate(avatars.items())
        }

    def _person(self, skeleton: Skeleton, row: int, *, colours: NDArray[np.uint8]) -> PosedPerson:
        figure = rest_figure()
        if self._arm_faces is None:
            self._arm_faces = figure.faces[figure.is_arm]
        vertices, normals = posed(figure, skeleton, row=row)
        return PosedPerson(vertices, normals, figure.faces, self._arm_faces, colours)

    def _keep_colours(self, avatars: Mapping[str, Avatar]) -> None:
        """Colour who has come, and forget who has gone."""
        before, self._colours = self._colours, {}
        for key, avatar in avatars.items():
            known = before.get((key, avatar.role))
            if known is None:
                known = colours_of(rest_figure(), name=key, top=colour_of(avatar))
            self._colours[key, avatar.role] = known


def colour_of(avatar: Avatar) -> Colour:
    """Return a person's own colour: a tint of their role's."""
    return tint(ROLE_COLOURS.get(avatar.role, ROLE_COLOURS["local"]), avatar.user_id)


def _are_same(first: Mapping[str, Avatar], second: Mapping[str, Avatar]) -> bool:
    return len(first) == len(second) and all(second.get(key) is item for key, item in first.items())


def _rows(before: T, fresh: T, *, rows: NDArray[np.int64]) -> T:
    """Return rows of a state, by their numbers; -1 takes the row of the fresh one."""
    if is_dataclass(before):
        parts: dict[str, Any] = {
            item.name: _rows(getattr(before, item.name), getattr(fresh, item.name), rows=rows)
            for item in fields(before)
        }
        return type(before)(**parts)
    old, new = np.asarray(before)[np.maximum(rows, 0)], np.asarray(fresh)
    known = (rows >= 0).reshape(-1, *(1,) * (new.ndim - 1))
    return np.where(known, old, new)  # pyright: ignore[reportReturnType]
