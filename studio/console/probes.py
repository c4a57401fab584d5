"""Parts that are present or missing on this machine, and remedies."""

from __future__ import annotations

import ctypes.util
import importlib.metadata
import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from studio.console.extras import EXTRAS, why_incomplete
from studio.console.machine import DISTRIBUTION, processor_flags
from studio.console.program_files import IS_CHECKOUT, PROGRAM_FILES

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


def examine() -> Iterable[Finding]:
    """Every finding, cheapest first."""
    yield _python()
    if IS_CHECKOUT:
        yield from packages(PROGRAM_FILES / "requirements" / "run.txt")
    else:
        yield from installed_packages(importlib.metadata.requires(DISTRIBUTION) or ())
    yield native()
    yield from _libraries()
    yield display()
    yield offscreen_drawing()
    yield h264()
    yield disk(Path.cwd())
    yield memory()
    yield _gpu()


def _python() -> Finding:
    return Finding("Python", "ok", f"{platform.python_version()} in {sys.prefix}")


def packages(list_file: Path) -> Iterable[Finding]:
    """Whether the pinned packages are those that are installed."""
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


def installed_packages(requirements: Iterable[str]) -> Iterable[Finding]:
    """Whether what an installed program names is here; extras may be left out.

    Args:
        requirements: as the program's metadata names them.
    """
    from packaging.requirements import Requirement

    wrong: list[str] = []
    checked = 0
    for requirement in map(Requirement, requirements):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        checked += 1
        try:
            found = importlib.metadata.version(requirement.name)
        except importlib.metadata.PackageNotFoundError:
            found = "absent"
        if found == "absent" or not requirement.specifier.contains(found, prereleases=True):
            wrong.append(f"{requirement.name} {found} (wanted {requirement.specifier})")
    remedy = f"pip install --force-reinstall {DISTRIBUTION}"
    if wrong:
        yield Finding("Python packages", "missing", "; ".join(wrong[:5]), remedy)
    else:
        yield Finding("Python packages", "ok", f"{checked} as wanted")
    for extra in EXTRAS:
        remedy = why_incomplete(extra, what="it")
        if remedy is None:
            yield Finding(f"extra {extra}", "ok", "installed")
        else:
            yield Finding(f"extra {extra}", "optional", "not installed", remedy)


def native() -> Finding:
    """Whether the splat engine was built."""
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


def display() -> Finding:
    """Whether windows have a display to open on."""
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display:
        return Finding("display", "ok", display)
    remedy = "only windows need one; use --headless, or xvfb-run ./nexus studio"
    return Finding("display", "optional", "none", remedy)


def offscreen_drawing() -> Finding:
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


def h264() -> Finding:
    """Whether films can be written and read."""
    import av
    from av.codec import Codec
    from av.error import FFmpegError

    try:
        Codec("libx264", "w")
        Codec("h264", "r")
    except FFmpegError as error:
        return Finding("H.264 video", "missing", str(error), "./nexus setup")
    return Finding("H.264 video", "ok", f"PyAV {av.__version__}, libx264")


def disk(folder: Path) -> Finding:
    """Whether the disk that a folder is on has space left."""
    free_gib = shutil.disk_usage(folder).free / 2**30
    if free_gib < FREE_DISK_WANTED_GIB:
        remedy = f"free {FREE_DISK_WANTED_GIB:.0f} GiB, or write elsewhere with --out"
        return Finding("disk", "missing", f"{free_gib:.1f} GiB free at {folder}", remedy)
    return Finding("disk", "ok", f"{free_gib:.0f} GiB free at {folder}")


def memory() -> Finding:
    """Whether there is memory enough."""
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
