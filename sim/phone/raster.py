# pyright: standard
"""Draws lit, textured meshes through a pinhole, off-screen, with VTK."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.misc import calldata_type
from vtkmodules.util.numpy_support import (
    numpy_to_vtk,
    numpy_to_vtkIdTypeArray,
    vtk_to_numpy,
)
from vtkmodules.vtkCommonCore import VTK_OBJECT, vtkCommand, vtkPoints, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPolyDataMapper

from scenes.cameras import Pinhole
from scenes.pose import Pose
from sim.camera.lens_raster import offscreen_window, texture_of

NEAR_M, FAR_M = 0.05, 40.0

NOTHING: Mapping[int, Pose] = MappingProxyType({})
"""No mesh has moved."""

VERTEX_SHADER = """//VTK::System::Dec
in vec4 vertexMC;
in vec2 tcoord;
in vec3 light;
uniform mat4 clip_from_mesh;
out vec2 uv;
out vec3 arriving;
void main()
{
  gl_Position = clip_from_mesh * vertexMC;
  uv = tcoord;
  arriving = light;
}
"""

FRAGMENT_SHADER = """//VTK::System::Dec
//VTK::Output::Dec
in vec2 uv;
in vec3 arriving;
uniform sampler2D actortexture;
void main()
{
  gl_FragData[0] = vec4(texture(actortexture, uv).rgb * arriving, 1.0);
}
"""


@dataclass(frozen=True, slots=True, eq=False)
class LitMesh:
    """A mesh in world coordinates with the light that falls on it.

    Attributes:
        vertices: (V, 3) float64, metres; of a mesh that moves, in its own frame.
        uv: (V, 2) in 0..1, (0, 0) at the bottom left of the texture.
        faces: (F, 3) vertex indices.
        texture: (H, W, 3) uint8 sRGB.
        light: (V, 3) factors on the texture's sRGB values.
    """

    vertices: NDArray[np.float64]
    uv: NDArray[np.floating[Any]]
    faces: NDArray[np.integer[Any]]
    texture: NDArray[np.uint8]
    light: NDArray[np.float64]


class PinholeRasteriser:
    """Holds the meshes of a still scene on the (software) graphics device.

    Not thread safe: use it from the thread that made it.

    Args:
        meshes: all that is to be seen.
        width_px: of the pictures.
        height_px: of the pictures.
    """

    def __init__(self, meshes: Sequence[LitMesh], width_px: int, height_px: int) -> None:
        self._window: Any = offscreen_window()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(width_px, height_px)
        self._size = (width_px, height_px)
        self._renderer = vtkRenderer()
        # The shader places vertices itself, so VTK's frustum says nothing about visibility.
        self._renderer.RemoveCuller(self._renderer.GetCullers().GetLastItem())
        self._renderer.SetBackground(0.0, 0.0, 0.0)
        self._window.AddRenderer(self._renderer)
        self._clips: list[vtkMatrix4x4] = []
        self._actors: list[vtkActor] = []
        for mesh in meshes:
            self._add(mesh)

    def draw(
        self,
        camera: Pinhole,
        world_from_camera: Pose,
        *,
        shift_px: tuple[float, float],
        moved: Mapping[int, Pose] = NOTHING,
    ) -> NDArray[np.uint8]:
        """(H, W, 3) uint8 RGB, one sample a pixel, `shift_px` right of and below its centre.

        Args:
            camera: of the rasteriser's size.
            world_from_camera: where it is.
            shift_px: of the samples.
            moved: `world_from_mesh` of meshes that are not where their vertices say, by place.

        Raises:
            ValueError: the camera's size is not the rasteriser's.
        """
        if (camera.width_px, camera.height_px) != self._size:
            raise ValueError(
                f"PinholeRasteriser: camera {camera.width_px}×{camera.height_px} px, "
                f"wanted {self._size[0]}×{self._size[1]}"
            )
        clip = _clip_from_camera(camera, shift_px) @ world_from_camera.inverse().matrix()
        for number, matrix in enumerate(self._clips):
            placed = clip @ moved[number].matrix() if number in moved else clip
            # GLSL stores matrices by column, VTK by row.
            matrix.DeepCopy(placed.T.ravel().tolist())
        self._window.Render()
        width, height = self._size
        colours = vtkUnsignedCharArray()
        self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, colours)
        # OpenGL counts rows from the bottom.
        return vtk_to_numpy(colours).reshape(height, width, 4)[::-1, :, :3]

    def close(self) -> None:
        """Free the window and everything on the device; the rasteriser is of no use afterwards."""
        for actor in self._actors:
            # An observer holds this rasteriser and VTK the observer: no garbage collector sees it.
            actor.GetMapper().RemoveAllObservers()
        self._actors.clear()
        self._renderer.RemoveAllViewProps()
        self._window.Finalize()

    def _add(self, mesh: LitMesh) -> None:
        mapper = vtkOpenGLPolyDataMapper()
        mapper.SetInputData(_poly_data(mesh))
        mapper.SetVBOShiftScaleMethod(0)
        mapper.MapDataArrayToVertexAttribute("light", "light", 0, -1)
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.SetTexture(texture_of(mesh.texture))
        shaders = actor.GetShaderProperty()
        shaders.SetVertexShaderCode(VERTEX_SHADER)
        shaders.SetFragmentShaderCode(FRAGMENT_SHADER)

        clip_from_mesh = vtkMatrix4x4()
        self._clips.append(clip_from_mesh)

        @calldata_type(VTK_OBJECT)
        def set_uniforms(_caller: Any, _event: str, program: Any) -> None:
            program.SetUniformMatrix("clip_from_mesh", clip_from_mesh)

        mapper.AddObserver(vtkCommand.UpdateShaderEvent, set_uniforms)
        self._renderer.AddActor(actor)
        self._actors.append(actor)


def _clip_from_camera(camera: Pinhole, shift_px: tuple[float, float]) -> NDArray[np.float64]:
    """(4, 4) OpenGL clip coordinates of points in OpenCV camera axes."""
    w, h = camera.width_px, camera.height_px
    cx, cy = camera.cx - shift_px[0], camera.cy - shift_px[1]
    deep = (FAR_M + NEAR_M) / (FAR_M - NEAR_M)
    return np.array(
        [
            [2 * camera.fx / w, 0.0, 2 * cx / w - 1.0, 0.0],
            [0.0, -2 * camera.fy / h, 1.0 - 2 * cy / h, 0.0],
            [0.0, 0.0, deep, -2 * FAR_M * NEAR_M / (FAR_M - NEAR_M)],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )


def _poly_data(mesh: LitMesh) -> vtkPolyData:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.vertices.astype(np.float32), deep=1))
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(mesh.faces.astype(np.int64).ravel(), deep=1))
    light = numpy_to_vtk(mesh.light.astype(np.float32), deep=1)
    light.SetName("light")
    poly = vtkPolyData()
    poly.SetPoints(points)
    poly.SetPolys(cells)
    poly.GetPointData().AddArray(light)
    poly.GetPointData().SetTCoords(numpy_to_vtk(mesh.uv.astype(np.float32), deep=1))
    return poly
