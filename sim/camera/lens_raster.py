# pyright: standard
"""Draws textured meshes straight into an equidistant fisheye, off-screen, with VTK.

The vertex shader places each vertex by r = f·θ (paper eq. 1) with w = range, so textures are
perspective correct and the depth buffer holds range. Only a square tile of the lens is drawn at a
time: a moving chair costs a chair, not a lens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.util.misc import calldata_type
from vtkmodules.util.numpy_support import (
    numpy_to_vtk,
    numpy_to_vtkIdTypeArray,
    vtk_to_numpy,
)
from vtkmodules.vtkCommonCore import (
    VTK_OBJECT,
    vtkCommand,
    vtkFloatArray,
    vtkPoints,
    vtkUnsignedCharArray,
)
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer, vtkRenderWindow, vtkTexture
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPolyDataMapper

from scenes.cameras import Fisheye
from scenes.pose import Pose
from sim.camera.tessellate import FineMesh

TILE_PX = 1024
FAR_M = 40.0

VERTEX_SHADER = """//VTK::System::Dec
in vec4 vertexMC;
in vec3 normalMC;
in vec2 tcoord;
uniform mat4 lens_from_mesh;
uniform vec3 lens_f_cx_cy;
uniform vec4 tile_x_y_w_h;
uniform float far_m;
out vec2 uv;
out vec3 normal_in_lens;
out float off_axis;
void main()
{
  vec3 p = (lens_from_mesh * vertexMC).xyz;
  float range = length(p);
  float side = length(p.xy);
  off_axis = atan(side, p.z);
  vec2 px = lens_f_cx_cy.yz;
  if (side > 1e-9) { px += lens_f_cx_cy.x * off_axis / side * p.xy; }
  vec2 ndc = 2.0 * (px - tile_x_y_w_h.xy) / tile_x_y_w_h.zw - 1.0;
  gl_Position = vec4(ndc.x, -ndc.y, 2.0 * range / far_m - 1.0, 1.0) * range;
  uv = tcoord;
  normal_in_lens = mat3(lens_from_mesh) * normalMC;
}
"""

FRAGMENT_SHADER = """//VTK::System::Dec
//VTK::Output::Dec
in vec2 uv;
in vec3 normal_in_lens;
in float off_axis;
uniform sampler2D actortexture;
uniform vec3 light_in_lens;
uniform vec2 ambient_key;
uniform float max_angle;
void main()
{
  if (off_axis > max_angle) { discard; }
  float facing = max(0.0, dot(normalize(normal_in_lens), light_in_lens));
  vec3 albedo = texture(actortexture, uv).rgb;
  gl_FragData[0] = vec4(albedo * (ambient_key.x + ambient_key.y * facing), 1.0);
}
"""


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """One distant light and light from everywhere: `albedo · (ambient + key · max(0, n·l))`.

    Attributes:
        direction: (3,) unit vector towards the light, in the frame of the lens.
        ambient: share from everywhere.
        key: share from `direction`.
    """

    direction: NDArray[np.float64]
    ambient: float
    key: float


UNLIT = Light(np.array([0.0, 0.0, 1.0]), 1.0, 0.0)
"""For meshes whose texture already holds the light."""


@dataclass(frozen=True, slots=True)
class PixelRect:
    """Pixels `x0 <= x < x1`, `y0 <= y < y1`."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width_px(self) -> int:
        """Columns."""
        return self.x1 - self.x0

    @property
    def height_px(self) -> int:
        """Rows."""
        return self.y1 - self.y0

    @property
    def rows_columns(self) -> tuple[slice, slice]:
        """Index of the rectangle in an image array."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def counted_from(self, other: PixelRect) -> PixelRect:
        """The same rectangle, counted from the corner of another."""
        x, y = other.x0, other.y0
        return PixelRect(self.x0 - x, self.y0 - y, self.x1 - x, self.y1 - y)

    def divided(self, by: int) -> PixelRect:
        """The rectangle in pixels that are `by` times as large."""
        return PixelRect(self.x0 // by, self.y0 // by, self.x1 // by, self.y1 // by)

    def grown(self, margin: int, bound: PixelRect) -> PixelRect:
        """The rectangle with a margin all around, as far as `bound` goes."""
        return PixelRect(
            max(bound.x0, self.x0 - margin),
            max(bound.y0, self.y0 - margin),
            min(bound.x1, self.x1 + margin),
            min(bound.y1, self.y1 + margin),
        )


@dataclass(slots=True, eq=False)
class _Uniforms:
    """Uniforms of one mesh's shaders for its next drawing; read by VTK's callback."""

    lens_from_mesh: vtkMatrix4x4
    light: Light = UNLIT


class FisheyeRasteriser:
    """Holds meshes on the (software) graphics device and draws them through a fisheye.

    Not thread safe: use it from the thread that made it.

    Args:
        tile_px: side of the square drawn at a time. Every tile costs all vertices of what is drawn
            and all of its own pixels, so small meshes want small tiles.
    """

    def __init__(self, tile_px: int = TILE_PX) -> None:
        self._tile_px = tile_px
        self._window: Any = offscreen_window()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        # Pictures are read back from the buffer that they are drawn in; nobody looks at the other.
        self._window.SwapBuffersOff()
        self._window.SetSize(tile_px, tile_px)
        self._renderer = vtkRenderer()
        # The shader places vertices itself, so VTK's frustum says nothing about visibility.
        self._renderer.RemoveCuller(self._renderer.GetCullers().GetLastItem())
        self._renderer.SetBackground(0.0, 0.0, 0.0)
        self._window.AddRenderer(self._renderer)
        self._actors: list[vtkActor] = []
        self._uniforms: list[_Uniforms] = []
        self._lens = (1.0, 0.0, 0.0)
        self._max_angle = 1.0
        self._tile = (0.0, 0.0, 1.0, 1.0)

    def add(self, mesh: FineMesh) -> int:
        """Upload a mesh; returns the number to draw it by."""
        mapper = vtkOpenGLPolyDataMapper()
        mapper.SetInputData(_poly_data(mesh))
        mapper.SetVBOShiftScaleMethod(0)
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.SetTexture(texture_of(mesh.texture))
        actor.SetVisibility(False)
        shaders = actor.GetShaderProperty()
        shaders.SetVertexShaderCode(VERTEX_SHADER)
        shaders.SetFragmentShaderCode(FRAGMENT_SHADER)
        uniforms = _Uniforms(vtkMatrix4x4())
        mapper.AddObserver(vtkCommand.UpdateShaderEvent, self._uniform_setter(uniforms))
        self._renderer.AddActor(actor)
        self._actors.append(actor)
        self._uniforms.append(uniforms)
        return len(self._actors) - 1

    def close(self) -> None:
        """Free the window and everything on the device; the rasteriser is of no use afterwards."""
        for actor in self._actors:
            # An observer holds this rasteriser and VTK the observer: no garbage collector sees it.
            actor.GetMapper().RemoveAllObservers()
        self._actors.clear()
        self._uniforms.clear()
        self._renderer.RemoveAllViewProps()
        self._window.Finalize()

    def draw(
        self,
        parts: Sequence[tuple[int, Pose]],
        lens: Fisheye,
        rect: PixelRect,
        *,
        light: Light,
        shift_px: tuple[float, float] = (0.0, 0.0),
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Draw meshes inside a rectangle of the lens image.

        Args:
            parts: mesh numbers from `add` with their `lens_from_mesh`.
            lens: the camera, in the pixels of `rect`.
            rect: which part of the image.
            light: how to light them.
            shift_px: sample this far right of and below the pixel centres (for supersampling).

        Returns:
            (h, w, 3) uint8 RGB and (h, w) float32 range in metres, inf where nothing was drawn.

        Raises:
            ValueError: the lens is distorted.
        """
        if not lens.is_equidistant:
            raise ValueError(
                f"lens.distortion: got {lens.distortion}, wanted zeros: the simulated camera's "
                "lenses are equidistant"
            )
        for number, lens_from_mesh in parts:
            # GLSL stores matrices by column, VTK by row.
            self._uniforms[number].lens_from_mesh.DeepCopy(
                lens_from_mesh.matrix().T.ravel().tolist()
            )
            self._uniforms[number].light = light
            self._actors[number].SetVisibility(True)
        self._lens = (lens.f_px, lens.cx - shift_px[0], lens.cy - shift_px[1])
        self._max_angle = lens.max_angle
        size = self._tile_px
        rgb = np.empty((rect.height_px, rect.width_px, 3), np.uint8)
        range_m = np.empty((rect.height_px, rect.width_px), np.float32)
        for y in range(rect.y0, rect.y1, size):
            for x in range(rect.x0, rect.x1, size):
                tile = PixelRect(x, y, min(x + size, rect.x1), min(y + size, rect.y1))
                target = (
                    slice(y - rect.y0, tile.y1 - rect.y0),
                    slice(x - rect.x0, tile.x1 - rect.x0),
                )
                rgb[target], range_m[target] = self._draw_tile(tile)
        for number, _ in parts:
            self._actors[number].SetVisibility(False)
        return rgb, range_m

    def _draw_tile(self, tile: PixelRect) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        self._tile = (float(tile.x0), float(tile.y0), float(self._tile_px), float(self._tile_px))
        self._window.Render()
        # OpenGL counts rows from the bottom.
        corners = (0, self._tile_px - tile.height_px, tile.width_px - 1, self._tile_px - 1)
        colours = vtkUnsignedCharArray()
        self._window.GetRGBACharPixelData(*corners, 0, colours)
        depths = vtkFloatArray()
        self._window.GetZbufferData(*corners, depths)
        shape = (tile.height_px, tile.width_px)
        rgba = vtk_to_numpy(colours).reshape(*shape, 4)[::-1]
        depth = vtk_to_numpy(depths).reshape(shape)[::-1]
        range_m = np.where(depth < 1.0, depth * np.float32(FAR_M), np.float32(np.inf))
        return rgba[..., :3], range_m

    def _uniform_setter(self, uniforms: _Uniforms) -> Any:
        @calldata_type(VTK_OBJECT)
        def set_uniforms(_caller: Any, _event: str, program: Any) -> None:
            light = uniforms.light
            program.SetUniformMatrix("lens_from_mesh", uniforms.lens_from_mesh)
            program.SetUniform3f("lens_f_cx_cy", self._lens)
            program.SetUniform4f("tile_x_y_w_h", self._tile)
            program.SetUniformf("far_m", FAR_M)
            program.SetUniformf("max_angle", self._max_angle)
            program.SetUniform3f("light_in_lens", light.direction.tolist())
            program.SetUniform2f("ambient_key", [light.ambient, light.key])

        return set_uniforms


def offscreen_window() -> vtkRenderWindow:
    """A window that needs no display; EGL where there is one, whatever a desktop uses."""
    window_class = getattr(vtkRenderingOpenGL2, "vtkEGLRenderWindow", vtkRenderWindow)
    return window_class()


def _poly_data(mesh: FineMesh) -> vtkPolyData:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.vertices.astype(np.float32), deep=1))
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(mesh.faces.ravel(), deep=1))
    poly = vtkPolyData()
    poly.SetPoints(points)
    poly.SetPolys(cells)
    poly.GetPointData().SetNormals(numpy_to_vtk(mesh.normals.astype(np.float32), deep=1))
    poly.GetPointData().SetTCoords(numpy_to_vtk(mesh.uv.astype(np.float32), deep=1))
    return poly


def texture_of(picture: NDArray[np.uint8]) -> vtkTexture:
    """A mipmapped texture of an (H, W, 3) sRGB picture, row 0 at its top."""
    height, width = picture.shape[:2]
    image = vtkImageData()
    image.SetDimensions(width, height, 1)
    bottom_first = np.ascontiguousarray(picture[::-1]).reshape(-1, 3)
    image.GetPointData().SetScalars(numpy_to_vtk(bottom_first, deep=1))
    texture = vtkTexture()
    texture.SetInputData(image)
    texture.InterpolateOn()
    texture.MipmapOn()
    # Software GL walks the whole footprint of an anisotropic sample, and where a triangle's edge is
    # extrapolated the footprint is boundless: single frames then take 20 s. Supersampling does it.
    texture.SetMaximumAnisotropicFiltering(1)
    texture.RepeatOn()
    return texture
