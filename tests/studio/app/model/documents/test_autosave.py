import os
import subprocess
import sys
import time
from pathlib import Path

from studio.app.model.documents.autosave import Autosave, discard, recoverable
from studio.app.model.documents.document import Document

WRITER = """
import sys
from dataclasses import replace
from pathlib import Path
from studio.app.model.documents.autosave import Autosave
from studio.app.model.documents.document import Document
keep = Autosave(Path(sys.argv[1])).keep
print("ready", flush=True)
seed = 0
for line in sys.stdin:
    keep(Document("lab", seed=int(line)))
    print(line.strip(), flush=True)
"""


def gone_pid():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    return child.pid


def wait_for(condition):
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_work_of_a_running_studio_is_not_offered(tmp_path):
    autosave = Autosave(tmp_path)
    autosave.keep(Document("lab"))
    wait_for(autosave.path.exists)
    assert recoverable(tmp_path) == []
    autosave.stop()
    assert not autosave.path.exists()


def test_work_that_was_left_behind_is_found_newest_first(tmp_path):
    for age, scene in ((5, "old"), (0, "new")):
        autosave = Autosave(tmp_path, pid=gone_pid())
        autosave.keep(Document(scene))
        autosave.stop(keep=True)
        os.utime(autosave.path, (time.time() - age, time.time() - age))
    found = recoverable(tmp_path)
    assert [item.document.scene for item in found] == ["new", "old"]
    discard(found[0])
    assert [item.document.scene for item in recoverable(tmp_path)] == ["old"]


def test_a_damaged_file_is_neither_offered_nor_removed(tmp_path):
    path = tmp_path / f"autosave-{gone_pid()}.nexus"
    path.write_text("{")
    assert recoverable(tmp_path) == []
    assert path.exists()


def test_a_folder_that_cannot_be_written_is_reported(tmp_path):
    folder = tmp_path / "file"
    folder.write_text("")
    autosave = Autosave(folder)
    said = []
    autosave.keep(Document("lab"))
    wait_for(lambda: said or (said.append(line) if (line := autosave.problem()) else None) or said)
    autosave.stop(keep=True)
    assert "cannot be kept" in said[0]


def test_what_was_done_before_a_kill_is_there_again(tmp_path):
    child = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[4])},
    )
    assert child.stdout.readline() == "ready\n"
    for seed in range(1, 30):
        child.stdin.write(f"{seed}\n")
        child.stdin.flush()
        child.stdout.readline()
    time.sleep(0.5)
    child.kill()
    child.wait()
    (found,) = recoverable(tmp_path)
    assert found.document.seed == 29
