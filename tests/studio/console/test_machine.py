"""The machine's description and the doctor's say the same of the processor."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.console import machine

INFO = """processor\t: 0
model name\t: AMD EPYC 7B13
flags\t\t: fpu sse2 avx avx2 fma{more}
processor\t: 1
model name\t: another one
"""


@pytest.mark.parametrize(
    ("more", "vectors"), [("", "avx2"), (" avx512vl avx512f", "avx512f"), (" avx512vl", "avx2")]
)
def test_the_widest_vector_instructions_are_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, more: str, vectors: str
) -> None:
    info = tmp_path / "cpuinfo"
    info.write_text(INFO.format(more=more))
    monkeypatch.setattr(machine, "PROCESSOR_INFO", info)
    described = machine.describe_machine()
    assert (described["cpu"], described["vectors"]) == ("AMD EPYC 7B13", vectors)
    assert "fma" in machine.processor_flags()


def test_a_system_that_does_not_say_leaves_no_gap(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(machine, "PROCESSOR_INFO", tmp_path / "missing")
    described = machine.describe_machine()
    assert described["vectors"] == "unknown"
    assert described["cpu"]
    assert machine.processor_flags() == set()
