import json

import pytest

from scenes.prepare.progress import Cancelled, silent
from scenes.prepare.stages import open_work_folder


class Kitchen:
    """Counts what is made, under a clock that ticks a second a look."""

    def __init__(self, path, progress=silent):
        self.now = 0.0
        self.made = []
        self.work = open_work_folder(path, seconds=self.tick, progress=progress)

    def tick(self):
        self.now += 1.0
        return self.now

    def stage(self, name, ingredients, *, fail=None):
        def make(folder, progress):
            self.made.append(name)
            progress(0.5, "half way")
            if fail is not None:
                (folder / "half").write_text("something")
                raise fail
            (folder / "result").write_text(json.dumps(ingredients))
            return ingredients

        return self.work.run(
            name,
            ingredients,
            make=make,
            load=lambda folder, progress: json.loads((folder / "result").read_text()),
            detail=lambda result: f"{len(result)} things",
        )


def test_finished_stages_are_not_made_again(tmp_path):
    first, second = Kitchen(tmp_path / "w"), Kitchen(tmp_path / "w")
    for kitchen in (first, second):
        assert kitchen.stage("dough", {"flour": 2}) == {"flour": 2}
        assert kitchen.stage("bread", {"heat": 220}) == {"heat": 220}
    assert first.made == ["dough", "bread"]
    assert second.made == []
    assert first.work.log == second.work.log
    assert first.work.log[0].detail == "1 things"
    assert first.work.log[0].seconds == 1.0


def test_a_changed_stage_and_all_after_it_are_made_again(tmp_path):
    first, second = Kitchen(tmp_path / "w"), Kitchen(tmp_path / "w")
    for kitchen, heat in ((first, 220), (second, 250)):
        kitchen.stage("dough", {"flour": 2})
        kitchen.stage("bread", {"heat": heat})
        kitchen.stage("slices", {})
    assert second.made == ["bread", "slices"]


@pytest.mark.parametrize("fail", [Cancelled(), OSError("the disk is full"), KeyboardInterrupt()])
def test_an_unfinished_stage_goes_on_with_what_it_left(tmp_path, fail):
    first = Kitchen(tmp_path / "w")
    first.stage("dough", {"flour": 2})
    with pytest.raises(type(fail)):
        first.stage("bread", {"heat": 220}, fail=fail)
    second = Kitchen(tmp_path / "w")
    second.stage("dough", {"flour": 2})
    assert (tmp_path / "w" / "bread" / "half").is_file()
    second.stage("bread", {"heat": 220})
    assert second.made == ["bread"]
    assert second.work.log[-1].seconds == 2.0


def test_other_ingredients_throw_an_unfinished_attempt_away(tmp_path):
    first = Kitchen(tmp_path / "w")
    with pytest.raises(Cancelled):
        first.stage("bread", {"heat": 220}, fail=Cancelled())
    second = Kitchen(tmp_path / "w")
    second.stage("bread", {"heat": 100})
    assert not (tmp_path / "w" / "bread" / "half").exists()


def test_progress_names_the_stage(tmp_path):
    told = []
    kitchen = Kitchen(tmp_path / "w", progress=lambda done, note: told.append((done, note)))
    kitchen.stage("dough", {})
    assert told == [(0.5, "dough: half way")]


@pytest.mark.parametrize("damage", [b"", b"[]", b"{not json"])
def test_a_damaged_stamp_only_costs_the_stage(tmp_path, damage):
    Kitchen(tmp_path / "w").stage("dough", {"flour": 2})
    (tmp_path / "w" / "dough" / "stage.json").write_bytes(damage)
    again = Kitchen(tmp_path / "w")
    again.stage("dough", {"flour": 2})
    assert again.made == ["dough"]


def test_foreign_folders_are_left_alone(tmp_path):
    (tmp_path / "w").mkdir()
    (tmp_path / "w" / "thesis.txt").write_text("precious")
    with pytest.raises(ValueError, match="no preparation; choose another folder with --work"):
        Kitchen(tmp_path / "w")
    assert (tmp_path / "w" / "thesis.txt").read_text() == "precious"
