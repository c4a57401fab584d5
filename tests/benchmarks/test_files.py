"""The bench of files: what is right is counted, what is wrong is named."""

from __future__ import annotations

import json
import shutil

from benchmarks.files import CASES, measure_files
from studio.cli import main


def test_recordings_splats_and_photos_come_out_right(tmp_path, capsys):
    for name in ("06_heic_and_jpg", "08_ply_bad_rows", "11_mcap"):
        shutil.copytree(CASES / name, tmp_path / name)
    assert main(["bench", "files", "--json", "--cases", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    rows = {row["name"]: row["value"] for row in json.loads(out)["rows"]}
    assert rows == {"files.cases": 9, "files.right": 9}
    assert not err


def test_a_file_that_cannot_be_read_is_named(tmp_path, capsys):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.mcap").write_bytes(b"no recording")
    (tmp_path / "bad" / "b.ply").write_bytes(b"no splats")
    rows = {row.name: row.value for row in measure_files(tmp_path)}
    assert rows == {"files.cases": 2, "files.right": 0}
    assert "bad/a.mcap: " in capsys.readouterr().err
