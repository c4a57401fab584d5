"""Self-contained HTML pages: the templates, and pictures inside them."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import jinja2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.view.fonts import font_faces

TEMPLATES = Path(__file__).parent / "templates"
PICTURE_WIDTH_PX = 980
JPEG_QUALITY = 82


def page(name: str) -> jinja2.Template:
    """A template; what it names and is not given is an error."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["font_faces"] = font_faces()
    return environment.get_template(name)


def embedded_jpeg(picture: NDArray[np.uint8], *, width_px: int = PICTURE_WIDTH_PX) -> str:
    """An (H, W, 3) RGB picture as a data URL of that width."""
    image = Image.fromarray(picture)
    height = max(1, round(image.height * width_px / image.width))
    image = image.resize((width_px, height), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=JPEG_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
