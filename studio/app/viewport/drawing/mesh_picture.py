"""Shapes drawn by VTK, off the screen, with their depth: one OpenGL context, of one thread."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from studio.app.model.documents.added_mesh import Geometry
from studio.app.viewport.drawing.shapes import (
    Line,
    Shape,
    Skin,
    Solid,
    Squares,
    Surface,
    Wire,
    pieces,
)

NEAR_M, FAR_M = 0.05, 100.0
"""Depths that are drawn, metres: a 24-bit buffer resolves 0.03 mm at 5 m."""

ROUND = 28
"""Corners around a ball, cylinder or cone: smooth at the size that a head has in a window."""


CLEAR_M, OPAQUE_M, CLEAREST = 0.6, 0.9, 0.3
"""Distance up to which a person is as transparent as this before the viewer, and from which they
are opaque, metres: an arm's length."""

NO_OPENGL = (
    "no OpenGL here: people, notes, bodies and meshes are drawn as outlines; install libegl1 and "
    "libgl1-mesa-dri and open the studio again"
)
"""Hint about what works without it, and what to do."""


class NoOpenGLError(RuntimeError):
    """VTK could not draw off the screen here; says what would help."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshPicture:
    """Picture that VTK has drawn.

    Attributes:
        rgba: (H, W, 4) uint8, alpha 0 where nothing is.
        depth: (H, W) float32, metres along z; inf where nothing is.
    """

    rgba: NDArray[np.uint8]
    depth: NDArray[np.float32]


class MeshDrawer:
    """Draws shapes; actors are kept from picture to picture by the shapes' keys.

    Make it, use it and close it on one thread.

    Args:
        samples: of a pixel, for edges without steps; 0 leaves them as they are.

    Raises:
        NoOpenGLError: there is no way to draw off the screen.
    """

    def __init__(self, *, samples: int = 0) -> None:
        # EGL needs no display and no window of the desktop's; VTK falls back to others by itself.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - makes the window one of OpenGL
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

        self._window: Any = vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(samples)
        self._window.SetAlphaBitPlanes(1)
        self._renderer: Any = vtkRenderer()
        self._renderer.SetBackground(0.0, 0.0, 0.0)
        self._renderer.SetBackgroundAlpha(0.0)
        self._window.AddRenderer(self._renderer)
        self._actors: dict[str, tuple[Shape, Any]] = {}
        if not self._draws():
            self.close()
            raise NoOpenGLError(NO_OPENGL)

    def _draws(self) -> bool:
        """Whether a ball before the camera is seen: some drivers say yes and draw nothing."""
        ball = Solid("ball", "ball", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), _TRIAL_POSE)
        drawn = self.draw([ball], Pinhole.from_fov(16, 16, 1.0), Pose.identity())
        self._update([])
        return bool(drawn.rgba[8, 8, 3] > 0)

    def draw(
        self, shapes: Sequence[Shape], camera: Pinhole, world_from_camera: Pose
    ) -> MeshPicture:
        """Draw shapes through a camera."""
        self._update(shapes)
        self._fade(shapes, world_from_camera.translation)
        self._look(camera, world_from_camera)
        width, height = camera.width_px, camera.height_px
        if tuple(self._window.GetSize()) != (width, height):
            self._window.SetSize(width, height)
        self._window.Render()
        return self._read(width, height)

    def close(self) -> None:
        """Give the context back."""
        self._window.Finalize()

    def _update(self, shapes: Sequence[Shape]) -> None:
        wanted = {shape.key: shape for shape in shapes}
        for key in set(self._actors) - set(wanted):
            self._renderer.RemoveActor(self._actors.pop(key)[1])
        for key, shape in wanted.items():
            before, actor = self._actors.get(key, (None, None))
            if before is None or not _same_form(before, shape):
                if actor is not None:
                    self._renderer.RemoveActor(actor)
                actor = _actor(shape)
                self._renderer.AddActor(actor)
            if isinstance(shape, Solid):
                _place(actor, shape)
            elif isinstance(shape, Surface) and actor is not None:
                own = np.diag([*shape.scale, 1.0])
                actor.SetUserMatrix(_matrix(shape.world_from_body.matrix() @ own))
            elif isinstance(shape, Skin) and before is not shape:
                _move_skin(actor, shape)
            self._actors[key] = (shape, actor)

    def _fade(self, shapes: Sequence[Shape], eye: NDArray[np.float64]) -> None:
        """Make people transparent who stand before the viewer."""
        for shape in shapes:
            if isinstance(shape, Skin):
                look = self._actors[shape.key][1].GetProperty()
                look.SetOpacity(opacity_of(shape, eye))

    def _look(self, camera: Pinhole, world_from_camera: Pose) -> None:
        from vtkmodules.vtkCommonMath import vtkMatrix4x4

        lens = self._renderer.GetActiveCamera()
        eye, turn = world_from_camera.translation, world_from_camera.rotation
        lens.SetPosition(*eye)
        lens.SetFocalPoint(*(eye + turn[:, 2]))
        lens.SetViewUp(*(-turn[:, 1]))
        matrix = vtkMatrix4x4()
        for row, values in enumerate(_projection(camera)):
            for column, value in enumerate(values):
                matrix.SetElement(row, column, float(value))
        lens.SetExplicitProjectionTransformMatrix(matrix)
        lens.UseExplicitProjectionTransformMatrixOn()
        lens.SetClippingRange(NEAR_M, FAR_M)

    def _read(self, width: int, height: int) -> MeshPicture:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkFloatArray, vtkUnsignedCharArray

        # Where pixels have samples, the buffer that is shown is corrected for a screen's gamma,
        # which is wrong for what is not opaque.
        pixels, buffer = vtkUnsignedCharArray(), vtkFloatArray()
        self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
        self._window.GetZbufferData(0, 0, width - 1, height - 1, buffer)
        # OpenGL's rows begin at the bottom.
        if pixels.GetNumberOfValues() == 0:
            return MeshPicture(
                np.zeros((height, width, 4), np.uint8),
                np.full((height, width), np.inf, np.float32),
            )
        rgba = vtk_to_numpy(pixels).reshape(height, width, 4)[::-1].copy()
        level = np.asarray(vtk_to_numpy(buffer).reshape(height, width)[::-1], dtype=np.float32)
        # The depth of an edge's pixel is that of one of its samples, which may be the one behind.
        missed = (level >= 1.0) & (rgba[..., 3] > 0)
        if missed.any():
            level = np.where(missed, cv2.erode(level, np.ones((3, 3), np.uint8)), level)
        rgba[level >= 1.0] = 0
        # What is half transparent comes multiplied by its share.
        half = (rgba[..., 3] > 0) & (rgba[..., 3] < 255)
        share = rgba[half, 3:].astype(np.uint16)
        rgba[half, :3] = np.minimum(rgba[half, :3].astype(np.uint16) * 255 // share, 255)
        return MeshPicture(rgba, _metres(level))


def _projection(camera: Pinhole) -> NDArray[np.float64]:
    """(4, 4) OpenGL's projection of a pinhole, whose y and z are flipped against OpenCV's."""
    width, height, far, near = camera.width_px, camera.height_px, FAR_M, NEAR_M
    matrix = np.zeros((4, 4))
    matrix[0] = (2 * camera.fx / width, 0, 1 - 2 * camera.cx / width, 0)
    matrix[1] = (0, 2 * camera.fy / height, 2 * camera.cy / height - 1, 0)
    matrix[2] = (0, 0, -(far + near) / (far - near), -2 * far * near / (far - near))
    matrix[3] = (0, 0, -1, 0)
    return matrix


def _metres(level: NDArray[np.float32]) -> NDArray[np.float32]:
    """Depth along z of the buffer's 0..1; inf where nothing was drawn."""
    ndc = 2.0 * level - 1.0
    depth = 2 * NEAR_M * FAR_M / (FAR_M + NEAR_M - ndc * (FAR_M - NEAR_M))
    return np.where(level >= 1.0, np.inf, depth).astype(np.float32)


def _same_form(a: Shape, b: Shape) -> bool:
    """Whether an actor of one serves the other with another pose."""
    if isinstance(a, Solid) and isinstance(b, Solid):
        return (a.form, a.colour, a.opacity) == (b.form, b.colour, b.opacity)
    if isinstance(a, Line) and isinstance(b, Line):
        same = a.points is b.points or np.array_equal(a.points, b.points, equal_nan=True)
        return same and a.colour == b.colour
    if isinstance(a, Surface) and isinstance(b, Surface):
        return a.geometry is b.geometry
    if isinstance(a, Skin) and isinstance(b, Skin):
        return a.faces is b.faces and a.colours is b.colours
    if isinstance(a, Wire) and isinstance(b, Wire):
        return a.mesh is b.mesh
    return isinstance(a, Squares) and isinstance(b, Squares) and a.corners is b.corners


def _actor(shape: Shape) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper, actor = vtkPolyDataMapper(), vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    actor.ForceOpaqueOn()  # VTK's pass for transparent bodies writes no depth
    if isinstance(shape, Solid):
        mapper.SetInputData(_solid_data(shape.form))
        look.SetOpacity(shape.opacity)
        look.SetBackfaceCulling(int(shape.form != "cone"))  # else a glass ball is two layers deep
        look.SetAmbient(0.25)
        look.SetDiffuse(0.8)
        look.SetColor(*shape.colour)
        return actor
    if isinstance(shape, Surface):
        mapper.SetInputData(_surface_data(shape.geometry))
        look.SetAmbient(0.35)
        look.SetDiffuse(0.75)
        return actor
    if isinstance(shape, Skin):
        mapper.SetInputData(_skin_data(shape))
        look.SetBackfaceCulling(1)  # else a transparent body is many layers deep
        look.SetAmbient(0.38)
        look.SetDiffuse(0.68)
        look.SetSpecular(0.06)
        look.SetSpecularPower(12.0)
        return actor
    look.LightingOff()
    if isinstance(shape, Line):
        mapper.SetInputData(_line_data(shape.points))
        look.SetColor(*shape.colour)
        look.SetLineWidth(shape.width_px)
    elif isinstance(shape, Wire):
        mapper.SetInputData(_mesh_data(shape.mesh))
        look.SetColor(*shape.colour)
        look.SetRepresentationToWireframe()
    else:
        mapper.SetInputData(_squares_data(shape))
        look.SetOpacity(shape.opacity)
    return actor


def _solid_data(form: str) -> Any:
    """A body of unit size, which the actor scales; a cylinder stands along z."""
    import pyvista

    if form == "box":
        return pyvista.Cube()
    if form == "ball":
        return pyvista.Sphere(radius=0.5, theta_resolution=ROUND, phi_resolution=ROUND)
    if form == "cone":
        return pyvista.Cone(radius=0.5, height=1.0, resolution=ROUND)
    return pyvista.Cylinder(direction=(0, 0, 1), radius=0.5, height=1.0, resolution=ROUND)


def _place(actor: Any, shape: Solid) -> None:
    scale = np.diag([*shape.size_m, 1.0])
    actor.SetUserMatrix(_matrix(shape.world_from_body.matrix() @ scale))


def _matrix(values: NDArray[np.float64]) -> Any:
    from vtkmodules.vtkCommonMath import vtkMatrix4x4

    matrix = vtkMatrix4x4()
    matrix.DeepCopy(values.ravel().tolist())
    return matrix


def _line_data(points: NDArray[np.float64]) -> Any:
    import pyvista

    parts = pieces(points)
    starts = np.cumsum([0, *map(len, parts)])
    lines = [
        np.r_[len(part), first + np.arange(len(part))]
        for part, first in zip(parts, starts[:-1], strict=True)
    ]
    return pyvista.PolyData(
        np.concatenate(parts) if parts else np.zeros((0, 3)),
        lines=np.concatenate(lines) if lines else None,
    )


def _mesh_data(mesh: CollisionMesh) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)


def _surface_data(geometry: Geometry) -> Any:
    """Triangles with normals, parted at edges sharper than 40 degrees so that a box looks so."""
    import pyvista

    data = pyvista.PolyData.from_regular_faces(geometry.vertices, geometry.faces)
    data.point_data.set_array(geometry.colours, "colours")
    data.set_active_scalars("colours")
    return data.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=40.0, consistent_normals=False
    )


def _skin_data(shape: Skin) -> Any:
    import pyvista

    data = pyvista.PolyData.from_regular_faces(shape.vertices, shape.faces)
    data.point_data.set_array(shape.colours, "colours")
    data.set_active_scalars("colours")
    data.point_data.active_normals = shape.normals
    return data


def _move_skin(actor: Any, shape: Skin) -> None:
    """Put a figure's points where they are in another picture: nothing else of it has changed."""
    data = actor.GetMapper().GetInput()
    data.points = shape.vertices
    data.point_data.active_normals = shape.normals


def opacity_of(shape: Skin, eye: NDArray[np.float64]) -> float:
    """Return how opaque a person is for a viewer, 0..1."""
    if not shape.fades:
        return 1.0
    middle = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
    low, high = shape.vertices[:, 2].min(), shape.vertices[:, 2].max()
    nearest = np.array([middle[0], middle[1], np.clip(eye[2], low, high)])
    distance_m = float(np.linalg.norm(eye - nearest))
    share = np.clip((distance_m - CLEAR_M) / (OPAQUE_M - CLEAR_M), 0.0, 1.0)
    return float(CLEAREST + (1.0 - CLEAREST) * share)


def _squares_data(shape: Squares) -> Any:
    import pyvista

    faces = np.arange(4 * len(shape.corners)).reshape(-1, 4)
    data = pyvista.PolyData.from_regular_faces(shape.corners.reshape(-1, 3), faces)
    data.cell_data["colours"] = (255 * np.clip(shape.colours, 0, 1)).astype(np.uint8)
    data.set_active_scalars("colours")
    return data


_TRIAL_POSE = Pose(np.eye(3), np.array([0.0, 0.0, 3.0]))
"""Three metres before an untouched camera."""
