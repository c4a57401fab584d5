"""`nexus replay` on recordings that other programs wrote, or that were cut off."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.cli import main

CASES = Path(__file__).parents[3] / "data" / "cases" / "11_mcap"


@pytest.mark.parametrize("name", ["control", "no_checksums", "no_summary", "cut_off"])
def test_a_recording_without_pictures_is_read_and_is_no_pass(capsys, name):
    assert main(["replay", str(CASES / f"{name}.mcap"), "--headless"]) == 1
    said = capsys.readouterr().err
    assert "nothing was compared: the recording holds no pictures" in said
    assert ("was cut off; it was read to its last whole chunk" in said) == (name == "cut_off")
