"""The clouds, lenses and renderers of the renderer's own tests."""

from tests.scenes.render.conftest import (
    at_origin,
    ball,
    camera,
    drawn_cloud,
    native,
    reference,
    renderer,
    small_lens,
    wild_cloud,
)

__all__ = (
    "at_origin",
    "ball",
    "camera",
    "drawn_cloud",
    "native",
    "reference",
    "renderer",
    "small_lens",
    "wild_cloud",
)
