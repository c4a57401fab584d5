"""Files that come with the program and are no code: manual, licence, lists of libraries."""

from __future__ import annotations

from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parents[2]

IS_CHECKOUT = (_CHECKOUT / "pyproject.toml").is_file()
"""Whether this program runs from its sources, not from an installed package."""

PROGRAM_FILES = _CHECKOUT if IS_CHECKOUT else Path(__file__).resolve().parents[1] / "bundled"
"""Folder with `docs`, `LICENSE` and `web`, laid out as in a checkout (`packaging/bundle.py`)."""
