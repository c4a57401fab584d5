"""Circumstances of a measured figure: this machine and this version of the program."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

DISTRIBUTION = "gaussiannexus-studio"

PROCESSOR_INFO = Path("/proc/cpuinfo")
"""File in which Linux lists its processors."""

VECTOR_FLAGS = ("avx512f", "avx2", "asimd")
"""Names that processors have for vector instructions, the widest first."""


def program_version() -> str:
    """The installed version, or "unknown" when the program runs from a bare checkout."""
    try:
        return metadata.version(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return "unknown"


def describe_machine() -> dict[str, Any]:
    """Processor, its vector instructions, usable cores, memory in GiB, system and Python.

    Two processors of one name may differ by a factor of two; their instruction sets differ.
    """
    flags = processor_flags()
    return {
        "cpu": _processor_name(),
        "vectors": next((name for name in VECTOR_FLAGS if name in flags), "unknown"),
        "cores": _usable_cores(),
        "memory_gib": _memory_gib(),
        "os": platform.platform(),
        "python": platform.python_version(),
    }


def processor_flags() -> set[str]:
    """Return the processor's features as the system lists them; empty where it does not say."""
    match = re.search(r"^(?:flags|Features)\s*:\s*(.*)$", _processor_info(), re.MULTILINE)
    return set(match.group(1).split()) if match else set()


def _processor_name() -> str:
    match = re.search(r"^model name\s*:\s*(.*?)\s*$", _processor_info(), re.MULTILINE)
    return match.group(1) if match else platform.processor() or platform.machine()


def _processor_info() -> str:
    if not PROCESSOR_INFO.is_file():
        return ""
    return PROCESSOR_INFO.read_text(encoding="utf-8", errors="replace")


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _memory_gib() -> float | None:
    if sys.platform == "win32" or "SC_PHYS_PAGES" not in os.sysconf_names:
        return None
    return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
