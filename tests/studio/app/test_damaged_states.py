"""The display vanishes, there is no OpenGL, the disk is full: in a process, for real."""

import os
import shutil
import subprocess
import sys
import time

import cv2
import pytest

from studio.app.model.documents.autosave import recoverable

pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb here"),
]
LIMIT_S = 240


@pytest.fixture
def display():
    """Starts X servers; each gives its process and its name."""
    started = []

    def start(*more):
        reads, writes = os.pipe()
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writes), "-screen", "0", "1280x800x24", "-noreset", *more],
            pass_fds=(writes,),
            stderr=subprocess.DEVNULL,
        )
        started.append(server)
        os.close(writes)
        with os.fdopen(reads) as chosen:
            return server, f":{chosen.readline().strip()}"

    yield start
    for server in started:
        server.kill()
        server.wait()


def studio(script, display, home, **more):
    """`nexus studio desk` with a script, on a display."""
    home.mkdir(exist_ok=True)
    file = home / "script.txt"
    file.write_text(script)
    env = {**os.environ, "DISPLAY": display, "NEXUS_HOME": str(home), **more}
    env.pop("WAYLAND_DISPLAY", None)
    env.pop("QT_QPA_PLATFORM", None)
    return subprocess.Popen(
        [sys.executable, "-m", "studio.cli", "studio", "desk", "--script", str(file)],
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_the_display_vanishes_and_unsaved_edits_are_offered_again(display, tmp_path):
    server, name = display()
    mark = tmp_path / "edited.png"
    child = studio(
        "wait.scene\ntwin.add_primitive shape=box place=[0.1,0.2,0.8]\nwait.drawn\n"
        f"window.picture path={mark}\nwait.seconds s=600\n",
        name,
        tmp_path / "home",
    )
    deadline = time.monotonic() + LIMIT_S
    kept = tmp_path / "home"
    while not (mark.exists() and any(kept.glob("autosave-*"))) and child.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    server.kill()
    _, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 1, errors
    assert "nexus: the display is gone. Unsaved work is kept in" in errors
    assert "Restore" in errors
    found = recoverable(tmp_path / "home")
    assert len(found) == 1
    (body,) = found[0].document.twin.primitives.values()
    assert body.world_from_primitive.translation == pytest.approx([0.1, 0.2, 0.8])


def test_without_opengl_the_window_opens_says_what_to_do_and_draws_splats(display, tmp_path):
    _, name = display("-extension", "GLX")
    picture = tmp_path / "view.png"
    child = studio(
        "wait.scene\nwait.drawn\ntwin.add_avatar role=remote place=[0,0,0]\n"
        f"wait.drawn\nview.picture path={picture}\n",
        name,
        tmp_path / "home",
        __EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent",
        __EGL_VENDOR_LIBRARY_DIRS="/nonexistent",
    )
    _, errors = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 0, errors  # VTK itself would have ended the process
    drawn = cv2.imread(str(picture))
    assert drawn is not None
    assert drawn.std() > 20  # the room, by the processor


FULL_DISK = """
import resource, sys, time
from pathlib import Path
from PySide6.QtWidgets import QApplication
from studio.app.model.documents.document import Document
from studio.app.window import make_window

home = Path(sys.argv[1])
application = QApplication([])
window = make_window(Document("desk"), rehearse_to=home / "out", home=home)
bench, project = window.bench, home / "work"
window.content("twin")
assert bench.do("file.save", path=str(project))
project = bench.project
before = project.read_bytes()
bench.perform("twin.add_primitive", shape="box", place=[0.1, 0.2, 0.8])
soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (64, hard))
done = bench.do("file.save")
words = bench.log.lines()[-1].text
resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
assert not done
assert "cannot be saved" in words and "save it elsewhere" in words, words
assert str(project) in words
assert project.read_bytes() == before
until_s = time.monotonic() + 60  # the autosave's own file, on its thread, is there for a moment
while list(home.glob("*.part*")) and time.monotonic() < until_s:
    time.sleep(0.01)
assert not list(home.glob("*.part*"))
assert not bench.is_saved and len(bench.document.twin.primitives) == 1
assert bench.do("file.save")
assert project.read_bytes() != before and bench.is_saved
window.close()
print("all is well")
"""


def test_a_full_disk_while_saving_loses_nothing(display, tmp_path):
    """A limit on files' size stands for the full disk: both fail in the midst of writing."""
    _, name = display()
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(tmp_path)],
        env={**os.environ, "DISPLAY": name, "NEXUS_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.stdout.endswith("all is well\n"), done.stderr
