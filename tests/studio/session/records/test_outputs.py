import pytest

from studio.session.records.outputs import RECORDING, REPORT_HTML, output_folder


def fill(target, text="new"):
    with output_folder(target) as part:
        (part / REPORT_HTML).write_text(text)


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def test_the_folder_appears_when_it_is_complete(tmp_path):
    target = tmp_path / "out" / "demo"
    with output_folder(target) as part:
        (part / REPORT_HTML).write_text("x")
        assert not target.exists()
    assert names(target) == [REPORT_HTML]
    assert names(tmp_path / "out") == ["demo"]


def test_an_earlier_result_is_replaced_whole(tmp_path):
    target = tmp_path / "demo"
    target.mkdir()
    (target / REPORT_HTML).write_text("old")
    (target / RECORDING).write_text("old")
    fill(target)
    assert names(target) == [REPORT_HTML]
    assert (target / REPORT_HTML).read_text() == "new"
    assert names(tmp_path) == ["demo"]


def test_someone_elses_files_are_never_touched(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"holds 'notes\.txt', which no rehearsal wrote"):
        fill(tmp_path)
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(ValueError, match="is a file"):
        fill(file)
    assert file.read_text() == "mine"


def test_a_failure_keeps_the_earlier_result_and_an_unfinished_folder(tmp_path):
    target = tmp_path / "demo"
    fill(target, "old")

    def fail():
        with output_folder(target) as part:
            (part / "recording.mcap.part").write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        fail()
    assert (target / REPORT_HTML).read_text() == "old"
    assert [n.startswith("demo.part-") for n in names(tmp_path) if n != "demo"] == [True]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_cancelling_leaves_nothing(tmp_path, error):
    def cancel():
        with output_folder(tmp_path / "demo") as part:
            (part / "recording.mcap.part").write_text("half")
            raise error

    with pytest.raises(error):
        cancel()
    assert names(tmp_path) == []
