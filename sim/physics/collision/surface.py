"""A scanned surface as patches and planes, and how both change where a part is scanned anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import CollisionMesh
from sim.physics.collision.depths import smooth, with_depths
from sim.physics.collision.grid import Array, Grid, cells_of, centres, cut_at_grid, grid_along_walls
from sim.physics.collision.limits import Plane, off_planes, planes_of
from sim.physics.collision.patches import CELL_M, Patches, fit_patches, joined

Cell = tuple[int, int, int]

REACH_CELLS = 1
"""How far a change is felt: a patch and its body behind it end in the next cell."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Static surface, ready for physics.

    Attributes:
        grid: the cells that patches are fitted in.
        pieces: by cell, its triangles (T, 3, 3) in the grid's frame.
        patches: what is solid beside the planes.
        planes: half-spaces around the room.
    """

    grid: Grid
    pieces: Mapping[Cell, Array]
    patches: Patches
    planes: tuple[Plane, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """From one surface to the next.

    Attributes:
        before: the surface it changes.
        surface: as it is now; its patches are those kept, in order, and then the new ones.
        kept: (K,) int64, which patches of the surface before stay.
        rethought: (K,) whether one that stays has got another thickness.
    """

    before: Surface
    surface: Surface
    kept: NDArray[np.int64]
    rethought: NDArray[np.bool_]

    @property
    def fresh(self) -> Patches:
        """The patches that were not there before."""
        return self.surface.patches.chosen(np.arange(len(self.kept), len(self.surface.patches)))


def triangles_of(mesh: CollisionMesh) -> Array:
    """(T, 3, 3) corners in world metres, counter-clockwise seen from the free side."""
    return mesh.vertices[mesh.faces].astype(np.float64)


def surface_of(triangles: Array) -> Surface:
    """Patches and planes of a room's triangles (T, 3, 3), world metres.

    Raises:
        ValueError: there is no surface, or a corner is not finite.
    """
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or not np.isfinite(triangles).all():
        raise ValueError(f"surface: triangles {triangles.shape}, wanted finite (T, 3, 3)")
    grid = grid_along_walls(triangles, CELL_M)
    pieces = cut_at_grid(grid.from_world(triangles), grid.cell_m)
    patches = fit_patches(pieces, grid)
    if not len(patches):
        raise ValueError(f"surface: {len(triangles)} triangles, but none covers 3 cm²")
    planes = planes_of(patches, grid)
    patches = patches.chosen(off_planes(patches, planes))
    patches = smooth(patches, patches)
    return Surface(grid, _by_cell(pieces, grid), with_depths(patches, patches), planes)


def rescanned(surface: Surface, region_m: Array, triangles: Array) -> Change:
    """The surface after a part of it was scanned anew.

    Planes stay: whoever opens a wall does not open the way out of the scanned room.

    Args:
        surface: as it was.
        region_m: (2, 3) lowest and highest corner of a box, world; all of the old surface in it
            goes.
        triangles: (T, 3, 3) world; what is there instead, possibly nothing.

    Raises:
        ValueError: the region or a corner is not finite.
    """
    region = np.asarray(region_m, dtype=np.float64)
    if region.shape != (2, 3) or not (np.isfinite(region).all() and np.isfinite(triangles).all()):
        raise ValueError(f"region {region.tolist()}: wanted finite (2, 3), and finite triangles")
    grid = surface.grid
    pieces = dict(surface.pieces)
    touched = _without_region(pieces, grid, region)
    added = cut_at_grid(grid.from_world(triangles.reshape(-1, 3, 3)), grid.cell_m)
    for cell, more in _by_cell(added, grid).items():
        pieces[cell] = np.concatenate([pieces[cell], more]) if cell in pieces else more
        touched.add(cell)
    return _changed(surface, pieces, touched=touched)


def exchanged(surface: Surface, cells: Mapping[Cell, Array]) -> Change:
    """The surface after the content of some cells was exchanged.

    Args:
        surface: as it was.
        cells: (T, 3, 3) pieces of the grid's frame by cell, each within it; all that is there then,
            possibly nothing.
    """
    pieces = dict(surface.pieces)
    for cell, content in cells.items():
        pieces.pop(cell, None)
        if len(content):
            pieces[cell] = content
    return _changed(surface, pieces, touched=set(cells))


def pieces_of(triangles: Array, grid: Grid) -> dict[Cell, Array]:
    """Triangles (T, 3, 3) of the world as pieces of a grid's frame, by the cell they lie in."""
    return _by_cell(cut_at_grid(grid.from_world(triangles.reshape(-1, 3, 3)), grid.cell_m), grid)


def _changed(surface: Surface, pieces: Mapping[Cell, Array], *, touched: set[Cell]) -> Change:
    """The surface with other pieces in the touched cells."""
    grid = surface.grid
    again = [pieces[cell] for cell in sorted(touched) if cell in pieces]
    fresh = fit_patches(np.concatenate(again) if again else np.zeros((0, 3, 3)), grid)
    fresh = fresh.chosen(off_planes(fresh, surface.planes))
    old = surface.patches
    kept = np.flatnonzero(~_is_among(old.cell, touched))
    patches, rethought = _rethought(old.chosen(kept), fresh, touched, grid)
    return Change(surface, Surface(grid, pieces, patches, surface.planes), kept, rethought)


def _rethought(
    kept: Patches, fresh: Patches, touched: set[Cell], grid: Grid
) -> tuple[Patches, NDArray[np.bool_]]:
    """Patches with their thickness, and which of the kept ones got another one."""
    if not touched or not len(kept) + len(fresh):
        return joined(kept, fresh), np.zeros(len(kept), dtype=np.bool_)
    cells = np.array(sorted(touched))
    low, high = cells.min(axis=0), cells.max(axis=0)

    def within(patches: Patches, reach: int) -> NDArray[np.bool_]:
        return ((patches.cell >= low - reach) & (patches.cell <= high + reach)).all(axis=1)

    around = kept.chosen(within(kept, 2 * REACH_CELLS))
    both = joined(kept, smooth(fresh, joined(around, fresh)))
    near = np.flatnonzero(within(both, REACH_CELLS))
    depth = both.depth_m.copy()
    depth[near] = with_depths(both.chosen(near), both.chosen(within(both, 2 * REACH_CELLS))).depth_m
    changed = np.abs(depth - both.depth_m)[: len(kept)] > 1e-9
    return (
        Patches(both.centre, both.world_from_patch, both.half_m, depth, both.cell),
        changed,
    )


def _without_region(pieces: dict[Cell, Array], grid: Grid, region: Array) -> set[Cell]:
    """Take what lies in a region out of `pieces`; the cells that lost something."""
    corners = np.stack(np.meshgrid(*region.T, indexing="ij"), axis=-1).reshape(-1, 3)
    local = grid.from_world(corners) / grid.cell_m
    low, high = np.floor(local.min(axis=0)), np.floor(local.max(axis=0))
    touched: set[Cell] = set()
    if np.prod(high - low + 1.0) <= len(pieces):
        x, y, z = (range(int(a), int(b) + 1) for a, b in zip(low, high, strict=True))
        cells = [cell for cell in product(x, y, z) if cell in pieces]
    else:
        cells = [c for c in pieces if all(low[k] <= c[k] <= high[k] for k in range(3))]
    for cell in cells:
        centre = grid.to_world(centres(pieces[cell]))
        stays = ~((centre >= region[0]) & (centre <= region[1])).all(axis=1)
        if stays.all():
            continue
        touched.add(cell)
        if stays.any():
            pieces[cell] = pieces[cell][stays]
        else:
            del pieces[cell]
    return touched


def _by_cell(pieces: Array, grid: Grid) -> dict[Cell, Array]:
    """Pieces by the cell they lie in."""
    if not len(pieces):
        return {}
    cells, index = np.unique(cells_of(pieces, grid.cell_m), axis=0, return_inverse=True)
    order = np.argsort(index, kind="stable")
    ends = np.cumsum(np.bincount(index))
    groups = np.split(pieces[order], ends[:-1])
    return {(x, y, z): group for (x, y, z), group in zip(cells.tolist(), groups, strict=True)}


def _is_among(cells: NDArray[np.int64], some: set[Cell]) -> NDArray[np.bool_]:
    """(N,) which cells (N, 3) are among some."""
    if not some or not len(cells):
        return np.zeros(len(cells), dtype=np.bool_)
    wanted = np.array(sorted(some))
    low = np.minimum(cells.min(axis=0), wanted.min(axis=0))
    spans = tuple((np.maximum(cells.max(axis=0), wanted.max(axis=0)) - low + 1).tolist())
    mine = np.ravel_multi_index(tuple((cells - low).T), spans)
    return np.isin(mine, np.ravel_multi_index(tuple((wanted - low).T), spans))
