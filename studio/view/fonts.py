"""The program's own typefaces, so that it looks the same on every machine.

All are under the SIL Open Font License. Atkinson Hyperlegible Next and Mono hold the letters, Nexus
Symbols the signs beside them: arrows, marks of states, Greek and Cyrillic. What people name in
other scripts is drawn in a font of their machine.
"""

from __future__ import annotations

import base64
from pathlib import Path

FACES = Path(__file__).parent / "faces"
"""Folder of the font files and their licence."""

TEXT, FIXED, SYMBOLS = (
    "Atkinson Hyperlegible Next",
    "Atkinson Hyperlegible Mono",
    "Nexus Symbols",
)
"""Names of the families, as the files have them."""

WEIGHTS = {400: "AtkinsonHyperlegibleNext-Regular.ttf", 700: "AtkinsonHyperlegibleNext-Bold.ttf"}
"""Files of the text's weights, as CSS counts them."""


def font_files() -> tuple[Path, ...]:
    """Every font file, in the same order on every machine."""
    return tuple(sorted(FACES.glob("*.ttf")))


def font_faces() -> str:
    """CSS that brings the text's faces along inside a page."""
    return "\n".join(
        f'@font-face {{ font-family: "{TEXT}"; font-weight: {weight}; font-display: block; '
        f"src: url(data:font/ttf;base64,{_base64(FACES / name)}) format('truetype'); }}"
        for weight, name in WEIGHTS.items()
    )


def _base64(path: Path) -> str:
    return base64.b64encode(path.read_bytes()).decode("ascii")
