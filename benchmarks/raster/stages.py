# pyright: strict
"""The stages of drawing one picture, run one by one as often as asked: for benchmarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, RenderOptions

if TYPE_CHECKING:
    from scenes.render.native import NativeRenderer, Probe


@dataclass(frozen=True, slots=True)
class LaneCount:
    """Samples (a splat at a pixel) that a blend goes through.

    Attributes:
        useful: those that change their pixel.
        processed: all lanes of the vector registers that the kernel's inner loop fills.
    """

    useful: int
    processed: int


class Stages:
    """Draws a picture stage by stage. Made by `stages_of`; reads no clock.

    `project`, `sort` and `bin` run in this order; after them the others run any number of times.
    """

    def __init__(self, probe: Probe) -> None:
        self._probe = probe

    def project(self) -> None:
        """Cull chunks of splats, project the rest."""
        self._probe.project()

    def sort(self) -> None:
        """Sort what `project` found by depth; once after each `project`."""
        self._probe.sort()

    def bin(self) -> None:
        """List the splats of every tile."""
        self._probe.bin()

    def blend(self, instructions: str) -> None:
        """Blend every tile on one thread and keep nothing.

        Args:
            instructions: one of `NativeRenderer.available_instructions`; every kernel gets the same
                lists.

        Raises:
            ValueError: this machine does not have those instructions.
        """
        self._probe.blend(instructions)

    def count_lanes(self, instructions: str) -> LaneCount:
        """Count the lanes that `blend` goes through; "scalar" counts as eight pixels wide.

        Raises:
            ValueError: this machine does not have those instructions.
        """
        return LaneCount(*self._probe.count_lanes(instructions))

    def draw(self) -> None:
        """Blend and write the picture, with as many threads as `stages_of` was given."""
        self._probe.draw()

    def blend_back(self, d_rgb: NDArray[np.float32], d_alpha: NDArray[np.float32]) -> None:
        """Sum a loss's gradients by its splats over the tiles: `draw`, backwards.

        Args:
            d_rgb: (H, W, 3) float32, dL/d rendering.rgb.
            d_alpha: (H, W) float32, dL/d rendering.alpha.

        Raises:
            ValueError: an array has the wrong size.
        """
        d_depth = np.zeros_like(d_alpha)
        self._probe.blend_back(d_rgb.ravel(), d_alpha.ravel(), d_depth.ravel())

    def blend_everywhere(self, instructions: str, times: int) -> int:
        """Run a kernel's inner loop alone over one tile in the first-level cache, `times` over.

        All lanes of all splats are in use, and pixels stay in registers: no picture is blended
        faster. Returns how many lanes that were; 0 for "scalar", which has no inner loop.

        Raises:
            ValueError: this machine does not have those instructions.
        """
        return self._probe.blend_everywhere(instructions, times)


def stages_of(
    renderer: NativeRenderer,
    objects: Sequence[PosedSplats],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions | None = None,
) -> Stages:
    """The stages of one picture.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """
    options = options or RenderOptions()
    return Stages(renderer.probe(objects, camera, world_from_camera, options))
