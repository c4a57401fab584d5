"""The project's rule: a picture given to the tracker is never drawn from splats."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
FORBIDDEN = ("scenes.splats", "scenes.render", "scenes._native", "scenes.prepare", "tracking")
SCRIPT = """
import sys
before = set(sys.modules)
import sim.camera.camera360, sim.camera.lens_picture, sim.camera.lens_raster
import sim.camera.shadows, sim.camera.sensor, sim.bodies
print("\\n".join(sorted(set(sys.modules) - before)))
"""


def test_the_camera_loads_nothing_that_knows_splats():
    loaded = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert "sim.camera.camera360" in loaded
    guilty = [m for m in loaded if any(m == f or m.startswith(f + ".") for f in FORBIDDEN)]
    assert guilty == []


def test_the_simulator_draws_with_no_splat_renderer():
    folders = (ROOT / "sim", *(ROOT / "sim" / name for name in ("camera", "phone", "people")))
    for path in sorted(path for folder in folders for path in folder.glob("*.py")):
        source = path.read_text(encoding="utf-8")
        for name in ("scenes.render", "scenes.splats", "scenes._native", "SplatCloud", "tracking"):
            assert f"from {name}" not in source, f"{path.name} imports {name}"
            assert f"import {name}" not in source, f"{path.name} imports {name}"
