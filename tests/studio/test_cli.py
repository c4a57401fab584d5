import errno
import subprocess
import sys
import time

import pytest

from studio import cli
from studio.cli import VERBS, all_verbs, main
from studio.verbs.sessions import rehearse

pytestmark = pytest.mark.usefixtures("no_display", "no_traceback")


def one_line(capsys):
    out, err = capsys.readouterr()
    assert err.count("\n") == 1, err
    assert "Traceback" not in err
    return err.strip(), out


def test_help_lists_every_verb_and_the_exit_codes(capsys):
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for verb in all_verbs():
        assert f"  {verb.name} " in out
    assert "3 bad input file" in out


@pytest.mark.parametrize("verb", all_verbs(), ids=lambda verb: verb.name)
def test_every_verb_has_help_with_an_example(verb, capsys):
    assert main([*verb.name.split(), "--help"]) == 0
    out = capsys.readouterr().out
    assert "example:" in out
    assert verb.example in out


def test_no_verb_is_a_usage_error_that_shows_the_verbs(capsys):
    assert main([]) == 2
    assert "rehearse" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["reherse"], "unknown verb 'reherse'; did you mean 'nexus rehearse'?"),
        (["bench", "rasta"], "unknown verb 'bench rasta'; did you mean 'nexus bench raster'?"),
        (["xyzzy"], "unknown verb 'xyzzy'; 'nexus --help' lists the verbs"),
        (["--fast"], "unknown flag '--fast'"),
        (["rehearse", "--headles"], "unknown flag '--headles'; did you mean --headless?"),
        (["rehearse", "--seed", "x"], "argument --seed: invalid int value: 'x'"),
        (["rehearse", "lab", "desk"], "unknown argument 'desk'"),
        (["rehearse", "--exact", "--paced"], "not allowed with"),
        (["replay"], "the following arguments are required: recording"),
    ],
)
def test_usage_errors_are_one_line_with_a_hint(words, said, capsys):
    assert main(words) == 2
    err, out = one_line(capsys)
    assert said in err
    assert out == ""


@pytest.mark.parametrize("word", cli.MEASURING_WORDS)
def test_the_installed_package_says_where_verbs_that_measure_are(word, monkeypatch, capsys):
    monkeypatch.setattr(cli, "MEASURING", "no_benchmarks_here.verbs.table")
    assert all_verbs() == VERBS
    assert main([word, "--json"]) == 2
    err, out = one_line(capsys)
    assert f"run './nexus {word}' in a checkout of the source" in err
    assert out == ""


def test_a_module_that_verbs_that_measure_lack_is_not_hidden(monkeypatch, tmp_path):
    (tmp_path / "measuring.py").write_text("import no_such_module\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(cli, "MEASURING", "measuring")
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        all_verbs()


def test_flags_are_not_abbreviated(capsys):
    assert main(["rehearse", "--head"]) == 2
    assert "unknown flag '--head'" in capsys.readouterr().err


def test_input_errors_are_one_line_and_exit_3(tmp_path, capsys):
    missing = tmp_path / "nothing.mcap"
    assert main(["replay", str(missing), "--headless"]) == 3
    err, _out = one_line(capsys)
    assert str(missing) in err
    assert "No such file" in err


def test_a_foreign_recording_is_refused(tmp_path, capsys):
    foreign = tmp_path / "song.mcap"
    foreign.write_bytes(b"ID3 this is music")
    assert main(["replay", str(foreign), "--headless"]) == 3
    assert "song.mcap: not a recording" in one_line(capsys)[0]


def test_a_foreign_output_folder_is_refused_before_any_work(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert main(["rehearse", "--headless", "--out", str(tmp_path)]) == 3
    assert "thesis.tex" in one_line(capsys)[0]
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_studio_without_a_display_says_what_to_do(capsys):
    assert main(["studio"]) == 3
    assert "--headless" in one_line(capsys)[0]


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "nexus: cancelled"),
        (ValueError("lab.toml:\n object 'sofa-1'"), 3, "nexus: lab.toml: object 'sofa-1'"),
        (OSError(errno.ENOSPC, "No space left on device", "a.mp4"), 3, "a.mp4: the disk is full"),
        (PermissionError(errno.EACCES, "Permission denied", "out"), 3, "out: Permission denied"),
        (KeyError("pose"), 1, "nexus: a defect of this program: KeyError: 'pose'"),
    ],
)
def test_what_a_verb_raises_becomes_one_line_and_a_code(error, code, said, monkeypatch, capsys):
    def fail(_args):
        raise error

    monkeypatch.setattr(rehearse, "run", fail)
    assert main(["rehearse"]) == code
    assert said in one_line(capsys)[0]


def test_stack_traces_are_shown_when_asked_for(monkeypatch):
    def fail(_args):
        raise ValueError("bad")

    monkeypatch.setattr(rehearse, "run", fail)
    monkeypatch.setenv(cli.TRACEBACK_VARIABLE, "1")
    with pytest.raises(ValueError, match="bad"):
        main(["rehearse"])


def test_help_is_fast_because_nothing_heavy_is_imported():
    code = (
        "import sys; from studio.cli import main; main(['--help']);"
        "heavy = {'numpy', 'cv2', 'vtk', 'PySide6', 'mujoco', 'matplotlib'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    times = []
    for _repeat in range(3):
        started = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
        )
        times.append(time.perf_counter() - started)
        assert done.returncode == 0, done.stderr
    assert min(times) < 1.0


def test_methods_put_the_shown_tracker_first():
    assert rehearse.methods("own", without_paper=False) == ("own", "paper")
    assert rehearse.methods("both", without_paper=False) == ("own", "paper")
    assert rehearse.methods("own", without_paper=True) == ("own",)
    assert rehearse.methods("paper", without_paper=False) == ("paper",)
