import subprocess
import sys
import time
from pathlib import Path

import pytest

from scenes.workers.child_process import ChildProcess, module_environment

LIMIT_S = 20.0

CHILD = (
    "import time; from scenes.workers.parent import end_with_parent\n"
    "end_with_parent(code=4); print('ready', flush=True); time.sleep(600)"
)

PARENT = (
    "import subprocess, sys, time\n"
    f"child = subprocess.Popen([sys.executable, '-c', {CHILD!r}], stdin=subprocess.PIPE,"
    " stdout=subprocess.PIPE)\n"
    "child.stdout.readline()\n"
    "print(child.pid, flush=True); time.sleep(600)"
)


def test_a_child_ends_when_its_pipe_closes():
    child = ChildProcess(
        [sys.executable, "-c", CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        environment=module_environment(),
    )
    assert child.stdout.readline() == b"ready\n"
    child.say("something that is not expected")
    assert child.code is None
    child.stdin.close()
    assert child.wait(LIMIT_S) == 4


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
def test_a_child_ends_with_a_killed_parent():
    parent = ChildProcess(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, environment=module_environment()
    )
    number = int(parent.stdout.readline())
    parent.end()
    until = time.monotonic() + LIMIT_S
    while time.monotonic() < until:
        try:
            stat = Path(f"/proc/{number}/stat").read_text(encoding="ascii")
        except OSError:
            return
        if stat.rpartition(")")[2].split()[0] == "Z":
            return
        time.sleep(0.02)
    raise AssertionError("the child lives on")
