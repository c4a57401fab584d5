# pyright: standard
"""MuJoCo for the rest of the simulator: its compiled module has no type stubs, so it is `Any`."""

from __future__ import annotations

from typing import Any

import mujoco as _mujoco

mujoco: Any = _mujoco
"""The physics engine."""

Spec = Any
"""A `mujoco.MjSpec`: a model that is being built."""
