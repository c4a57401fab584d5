"""`nexus doctor`: what is present, what is missing, and what to do about it."""

from __future__ import annotations

import argparse
import ctypes.util
import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from studio.console.machine import processor_flags

ROOT = Path(__file__).resolve().parents[2]
PROBE_TIMEOUT_S = 60
FREE_DISK_WANTED_GIB = 2.0
MEMORY_WANTED_GIB = 4.0

State = Literal["ok", "optional", "missing"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the doctor's table.

    Attributes:
        subject: what was looked at.
        state: "ok", "optional" (missing, and nothing needs it) or "missing".
        detail: what was found.
        remedy: what to do; empty when there is nothing to do.
    """

    subject: str
    state: State
    detail: str
    remedy: str = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def run(args: argparse.Namespace) -> int:
    """Look at everything; exit 1 if something the program needs is missing."""
    findings = list(examine())
    if args.json:
        print(json.dumps({"verb": "doctor", "findings": [asdict(f) for f in findings]}, indent=2))
    else:
        print(as_table(findings))
    return 1 if any(f.state == "missing" for f in findings) else 0


def examine() -> Iterable[Finding]:
    """Every finding, cheapest first."""
    yield _python()
    yield from _packages(ROOT / "requirements" / "run.txt")
    yield _native()
    yield from _libraries()
    yield _display()
    yield _offscreen_drawing()
    yield _h264()
    yield _disk()
    yield _memory()
    yield _gpu()


def as_table(findings: Iterable[Finding]) -> str:
    """A plain table; state is a word and a sign, never colour alone."""
    signs = {"ok": "✓ ok", "optional": "- optional", "missing": "✗ missing"}
    lines = []
    for f in findings:
        lines.append(f"{signs[f.state]:<11} {f.subject:<22} {f.detail}")
        if f.remedy:
            lines.append(f"{'':<11} {'':<22} → {f.remedy}")
    return "\n".join(lines)


def _python() -> Finding:
    return Finding("Python", "ok", f"{platform.python_version()} in {sys.prefix}")


def _packages(list_file: Path) -> Iterable[Finding]:
    wrong = []
    pins = re.findall(r"^([\w.-]+)==([^\s;\\]+)([^\\\n]*)", list_file.read_text(), re.MULTILINE)
    checked = 0
    for name, version, marker in pins:
        if marker.strip().startswith(";"):
            continue
        checked += 1
        try:
            found = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found = "absent"
        if found != version:
            wrong.append(f"{name} {found} (pinned {version})")
    if wrong:
        yield Finding("Python packages", "missing", "; ".join(wrong[:5]), "./nexus setup")
    else:
        yield Finding("Python packages", "ok", f"{checked} at their pinned versions")


def _native() -> Finding:
    if importlib.util.find_spec("scenes._native") is None:
        return Finding("native renderer", "missing", "not built", "./nexus setup")
    flags = processor_flags()
    simd = [name for name in ("avx2", "fma", "avx512f", "asimd") if name in flags]
    return Finding("native renderer", "ok", f"built; processor has {', '.join(simd) or 'no SIMD'}")


def _libraries() -> Iterable[Finding]:
    if sys.platform != "linux":
        return
    needed = {
        "EGL": "libegl1",
        "GL": "libgl1",
        "usb-1.0": "libusb-1.0-0",
        "xcb-cursor": "libxcb-cursor0",
        "xkbcommon-x11": "libxkbcommon-x11-0",
        "fontconfig": "libfontconfig1",
        "dbus-1": "libdbus-1-3",
    }
    missing = [package for lib, package in needed.items() if ctypes.util.find_library(lib) is None]
    if missing:
        remedy = f"apt-get install --no-install-recommends {' '.join(missing)}"
        yield Finding("system libraries", "missing", ", ".join(missing), remedy)
    else:
        yield Finding("system libraries", "ok", ", ".join(needed))


def _display() -> Finding:
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display:
        return Finding("display", "ok", display)
    remedy = "only windows need one; use --headless, or xvfb-run ./nexus studio"
    return Finding("display", "optional", "none", remedy)


def _offscreen_drawing() -> Finding:
    """Draw in a process of its own: a broken driver aborts instead of raising."""
    program = (
        "import vtk; w = vtk.vtkRenderWindow(); w.SetOffScreenRendering(1); w.SetSize(8, 8);"
        "w.AddRenderer(vtk.vtkRenderer()); w.Render();"
        "print([l for l in w.ReportCapabilities().splitlines() if 'renderer string' in l][0])"
    )
    environment = {**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
    remedy = "apt-get install --no-install-recommends libegl1 libgl1-mesa-dri"
    try:
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            timeout=PROBE_TIMEOUT_S,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding("off-screen drawing", "missing", f"no answer in {PROBE_TIMEOUT_S} s", remedy)
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
        return Finding("off-screen drawing", "missing", reason, remedy)
    return Finding("off-screen drawing", "ok", done.stdout.strip().partition(":")[2].strip())


def _h264() -> Finding:
    import av
    from av.codec import Codec
    from av.error import FFmpegError

    try:
        Codec("libx264", "w")
        Codec("h264", "r")
    except FFmpegError as error:
        return Finding("H.264 video", "missing", str(error), "./nexus setup")
    return Finding("H.264 video", "ok", f"PyAV {av.__version__}, libx264")


def _disk() -> Finding:
    free_gib = shutil.disk_usage(Path.cwd()).free / 2**30
    if free_gib < FREE_DISK_WANTED_GIB:
        remedy = f"free {FREE_DISK_WANTED_GIB:.0f} GiB, or write elsewhere with --out"
        return Finding("disk", "missing", f"{free_gib:.1f} GiB free here", remedy)
    return Finding("disk", "ok", f"{free_gib:.0f} GiB free here")


def _memory() -> Finding:
    if not hasattr(os, "sysconf"):
        return Finding("memory", "ok", "size unknown on this system")
    total_gib = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    detail = f"{total_gib:.0f} GiB, {os.cpu_count()} cores"
    if total_gib < MEMORY_WANTED_GIB:
        remedy = "rehearse with a small scenario: --scenario lab-short"
        return Finding("memory", "missing", detail, remedy)
    return Finding("memory", "ok", detail)


def _gpu() -> Finding:
    if shutil.which("nvidia-smi"):
        return Finding("GPU", "ok", "nvidia-smi is here; the program does not need it")
    return Finding("GPU", "optional", "none; nothing needs one")
