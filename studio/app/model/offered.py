"""Trackers and faults that plug-ins offer to everybody at the bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what makes trackers takes a second to import: not before the window is shown
    from sim.faults.fault import Fault
    from studio.session.trackers.methods import MethodMaker


def _nothing() -> Mapping[str, Any]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class Offered:
    """Trackers and faults beside the built-in ones.

    Attributes:
        trackers: makers by name.
        faults: kinds by name.
    """

    trackers: Mapping[str, MethodMaker] = field(default_factory=_nothing)
    faults: Mapping[str, type[Fault]] = field(default_factory=_nothing)
