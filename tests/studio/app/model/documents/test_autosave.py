import os
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import pytest

from studio.app.model.documents.autosave import Autosave, discard, recoverable
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import save_document

WRITER = """
import sys
from pathlib import Path
from studio.app.model.documents.autosave import Autosave
from studio.app.model.documents.document import Document
folder, rooms = Path(sys.argv[1]), []
print("ready", flush=True)
for line in sys.stdin:
    room, seed = line.split()
    if room not in rooms:
        if rooms:
            autosave.stop(keep=True)
        rooms.append(room)
        autosave = Autosave(folder, number=len(rooms))
    autosave.keep(Document(room, seed=int(seed)), folder / f"{room}.nexus")
    print(line.strip(), flush=True)
"""


def gone_pid():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    return child.pid


def wait_for(condition):
    deadline = time.monotonic() + 120
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


@pytest.mark.parametrize("seed", range(4))
def test_killed_at_any_moment_all_but_the_last_two_seconds_is_there_again(tmp_path, seed):
    """Of the document that was edited, and with it of one that was left unsaved before."""
    random = Random(seed)
    child = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[4])},
    )
    assert child.stdout.readline() == "ready\n"
    done = []
    for number in range(1, random.randint(5, 60)):
        room = "lab" if number < 4 else "desk"
        child.stdin.write(f"{room} {number}\n")
        child.stdin.flush()
        child.stdout.readline()
        done.append((time.monotonic(), room, number))
        time.sleep(random.uniform(0.0, 0.02))
    killed = time.monotonic()
    child.kill()
    child.wait()
    found = {item.document.scene: item for item in recoverable(tmp_path)}
    assert found["lab"].document.seed == 3
    assert found["lab"].project == tmp_path / "lab.nexus"
    sure = [number for when, room, number in done if when < killed - 2.0 and room == "desk"]
    if "desk" in found:
        assert found["desk"].document.seed >= max(sure, default=4)
        assert found["desk"].document.seed <= done[-1][2]
    else:
        assert not sure


def test_what_was_done_before_a_kill_is_there_again(tmp_path):
    child = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[4])},
    )
    assert child.stdout.readline() == "ready\n"
    for number in range(1, 30):
        child.stdin.write(f"lab {number}\n")
        child.stdin.flush()
        child.stdout.readline()
    wait_for(lambda: any('"seed": 29,' in f.read_text() for f in tmp_path.glob("autosave-*.*")))
    child.kill()
    child.wait()
    (found,) = recoverable(tmp_path)
    assert found.document.seed == 29


def test_a_process_of_the_same_number_does_not_claim_what_another_has_left(tmp_path):
    """In a container every studio may be process 7."""
    left = tmp_path / f"autosave-{os.getpid()}-1-0.nexus"
    save_document(Document("lab", seed=3), left)
    assert [item.document.seed for item in recoverable(tmp_path)] == [3]


@pytest.mark.skipif(not Path("/proc/stat").exists(), reason="only there a start is known")
def test_a_later_process_of_a_killed_studio_s_number_does_not_hide_its_work(tmp_path):
    """After a power cut, numbers begin anew: something else has the studio's."""
    other = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    now_ns = time.time_ns()
    for seed, begun_ns in ((1, now_ns - 3_600_000_000_000), (2, now_ns)):
        left = tmp_path / f"autosave-{other.pid}-{begun_ns}-{seed}.nexus"
        save_document(Document("lab", seed=seed), left)
    assert [item.document.seed for item in recoverable(tmp_path)] == [1]
    other.communicate()


def test_what_is_saved_is_not_offered(tmp_path):
    autosave = Autosave(tmp_path, pid=gone_pid())
    autosave.keep(Document("lab"))
    wait_for(autosave.path.exists)
    autosave.forget()
    wait_for(lambda: not autosave.path.exists())
    autosave.stop(keep=True)
    assert recoverable(tmp_path) == []
