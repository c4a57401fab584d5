import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from scenes.workers.child_process import ChildProcess, module_command, module_environment

LIMIT_S = 20.0

DEAF = (
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    "print('ready', flush=True)\n"
    "time.sleep(600)"
)
"""A program that does not end when it is asked to."""


def python(program):
    return [sys.executable, "-c", program]


def reading_threads():
    return [t for t in threading.enumerate() if t.name.startswith(("lines of", "last words of"))]


def is_alive(process_id):
    stat = Path(f"/proc/{process_id}/stat").read_text(encoding="ascii")
    return stat.rpartition(")")[2].split()[0] != "Z"


def gone_within(process_id, limit_s):
    until = time.monotonic() + limit_s
    while time.monotonic() < until:
        try:
            if not is_alive(process_id):
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False


def test_lines_both_ways_and_last_words():
    heard = []
    child = ChildProcess(
        python(
            "import sys\n"
            "for line in sys.stdin: print(line.strip()[::-1], flush=True)\n"
            "for n in range(50): print('word', n, file=sys.stderr)\n"
            "sys.exit(3)"
        ),
        stdin=subprocess.PIPE,
        on_line=heard.append,
        last_words=2,
    )
    child.say("abc")
    child.say("é")
    child.stdin.close()
    assert child.join(LIMIT_S)
    assert child.code == 3
    assert heard == ["cba", "é"]
    assert child.last_words() == ["word 48", "word 49"]
    assert not child.is_running
    assert not reading_threads()
    child.end()


def test_a_deaf_child_is_killed_after_its_patience():
    ready = threading.Event()
    child = ChildProcess(python(DEAF), on_line=lambda line: ready.set())
    assert ready.wait(LIMIT_S)
    began = time.monotonic()
    child.end(patience_s=0.2)
    assert 0.2 <= time.monotonic() - began < LIMIT_S
    assert child.code == -9
    assert child.join(LIMIT_S)
    assert not reading_threads()


def test_a_child_that_ends_when_asked_is_not_killed():
    child = ChildProcess(python("import time; time.sleep(600)"))
    child.end(patience_s=LIMIT_S)
    assert child.code == -15


def test_it_says_nothing_to_a_child_that_is_gone():
    child = ChildProcess(python("pass"), stdin=subprocess.PIPE)
    assert child.wait(LIMIT_S) == 0
    with pytest.raises(BrokenPipeError):
        child.say("hello")


def test_a_group_ends_together():
    heard, said = [], threading.Event()

    def hear(line):
        heard.append(int(line))
        said.set()

    child = ChildProcess(
        python(
            "import subprocess, sys, time\n"
            f"inner = subprocess.Popen([sys.executable, '-c', {DEAF!r}], stdout=subprocess.PIPE)\n"
            "inner.stdout.readline()\n"
            "print(inner.pid, flush=True)\n"
            "time.sleep(600)"
        ),
        on_line=hear,
        has_group=True,
    )
    assert said.wait(LIMIT_S)
    child.end()
    assert gone_within(heard[0], LIMIT_S)


def test_many_threads_may_end_it_at_once():
    child = ChildProcess(python("import time; time.sleep(600)"))
    threads = [threading.Thread(target=child.end, args=(0.1 * (n % 2),)) for n in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LIMIT_S)
    assert not any(thread.is_alive() for thread in threads)
    assert child.code in (-9, -15)


def test_a_program_that_is_not_there_cannot_be_started():
    with pytest.raises(FileNotFoundError):
        ChildProcess(["/nonexistent/program"])


def test_modules_are_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    child = ChildProcess(
        module_command("scenes.workers.task"), environment=module_environment(), last_words=5
    )
    assert child.join(LIMIT_S)
    assert (child.code, child.last_words()) == (0, [])
