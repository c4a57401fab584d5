"""Resistance of the air to what flies."""

from __future__ import annotations

from typing import Any

AIR_PER_S = 0.1
"""Share of its speed and spin that a thrown object loses to the air in a second: of a carton of
20 cm at 5 m/s (drag coefficient 1, 300 kg/m³)."""


def set_drag(model: Any, body: int) -> None:
    """Let the air take `AIR_PER_S` of a free body's momentum and spin a second."""
    first = int(model.body_dofadr[body])
    if first >= 0:
        model.dof_damping[first : first + 3] = AIR_PER_S * model.body_mass[body]
        model.dof_damping[first + 3 : first + 6] = AIR_PER_S * model.body_inertia[body].mean()
