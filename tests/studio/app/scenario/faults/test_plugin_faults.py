"""Faults of plug-ins: their knobs, their line in a scenario, their part in the truth."""

import importlib.util
from pathlib import Path
from types import MappingProxyType

import pytest

from sim.faults.fault import LightFault, read_span
from sim.faults.settings import read_faults
from sim.tables import ScenarioError, Table
from studio.app.model.documents.document import Document
from studio.app.model.offered import Offered
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.scenario.faults.plugin_faults import fault_fields, fields_of, title_of
from studio.app.scenario.faults.trial import TrialPlan, trial_text
from studio.app.scenario.scenario_actions import ScenarioActions
from studio.app.scenario.text import edits
from studio.app.scenario.text.editing import ScenarioEditing
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
EXAMPLES = Path(__file__).parents[5] / "examples" / "plugins"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FLICKER = example("flicker").Flicker


class Fog(LightFault):
    name = "fog"
    sizes = MappingProxyType({"thickness": "1/m"})

    @classmethod
    def read(cls, table):
        table.number("thickness", 0.0, low=0.0, high=4.0)
        read_span(table)
        table.integer("layers", low=1, high=8)
        return cls()

    def size_at(self, t_s):
        return 1.0

    def seen(self, pictures, t_s):
        return tuple(pictures)


class Steps(list):
    push = list.append


@pytest.fixture
def editing():
    bench = Workbench(Document("lab"), Settings(), Steps())
    bench.offer(Offered(faults={"flicker": FLICKER}))
    editing = ScenarioEditing(bench)
    ScenarioActions(editing, lambda *_: "", lambda: ("chair-1",))
    return editing


def test_a_form_asks_for_what_the_reader_asks_for():
    found = {field.key: field for field in fields_of(Fog)}
    assert list(found) == ["thickness", "from_s", "to_s", "lasts_s", "layers"]
    size = found["thickness"]
    assert (size.low, size.high, size.usual, size.unit) == (0.0, 4.0, 1.0, "1/m")
    assert (found["to_s"].usual, found["to_s"].unit, found["to_s"].title) == (None, "s", "until")
    assert (found["layers"].kind, found["layers"].usual) == ("count", 1)
    assert list(fault_fields({"fog": Fog}))[-1] == "fog"
    assert title_of("thick_fog") == "Thick fog"


def test_it_is_added_changed_and_removed_as_any_other(editing):
    bench = editing.bench
    assert bench.do("scenario.add_fault", name="flicker")
    (fault,) = [f for f in editing.scenario.faults.each if f.name == "flicker"]
    assert fault.share == 0.2
    assert bench.do("scenario.set_fault", name="flicker", field="share", value=0.5)
    assert editing.scenario.faults.sizes(1.0)["flicker"] == 0.5
    assert not bench.do("scenario.set_fault", name="flicker", field="share", value=2.0)
    assert bench.do("scenario.remove_fault", name="flicker")
    assert "flicker" not in editing.scenario.faults.sizes(1.0)
    assert edits.faults_of(editing.text, more=("flicker",)) == []


def test_without_its_plug_in_the_line_is_named_and_comes_back_with_it(editing):
    bench = editing.bench
    assert bench.do("scenario.add_fault", name="flicker")
    bench.offer(Offered())
    with pytest.raises(ScenarioError, match=r"faults\.flicker: no such key"):
        _ = editing.scenario
    assert not bench.do("scenario.add_fault", name="flicker")
    bench.offer(Offered(faults={"flicker": FLICKER}))
    assert "flicker" in editing.scenario.faults.sizes(1.0)


def test_what_is_typed_before_its_plug_in_is_there_becomes_good_with_it(editing):
    bench = editing.bench
    bench.offer(Offered())
    text = editing.text.rstrip() + "\n[faults.flicker]\nshare = 0.3\n"
    editing.type(text)
    assert editing.draft == text
    bench.offer(Offered(faults={"flicker": FLICKER}))
    assert editing.draft is None
    assert bench.document.scenario == text


def test_one_that_raises_while_it_is_read_is_named():
    class Broken(Fog):
        @classmethod
        def read(cls, table):
            return 1 / 0

    with pytest.raises(ScenarioError, match=r"faults\.fog = 'Broken', wanted one that reads"):
        read_faults(Table({"fog": {}}, "a.toml", "faults"), more=[Broken])
    assert fields_of(Broken) == ()


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_its_knobs_come_go_and_are_made_anew_with_the_plug_in(editing, qtbot):
    from studio.app.scenario.faults.knobs import FaultKnobs
    from studio.app.scenario.form import Number

    bench = editing.bench
    knobs = FaultKnobs(bench, editing, lambda: ("chair-1",))
    qtbot.addWidget(knobs)
    editing.listen(knobs.show_scenario)
    row = knobs._rows["flicker", 0]
    row.box.click()
    assert row.box.isChecked()
    (share,) = row.findChildren(Number)
    assert (share.value(), share.maximum(), share.suffix()) == (0.2, 0.9, " share")
    share.setValue(0.6)
    assert editing.scenario.faults.sizes(0.1)["flicker"] == 0.6
    bench.offer(Offered())
    assert ("flicker", 0) not in knobs._rows
    bench.offer(Offered(faults={"flicker": FLICKER, "fog": Fog}))
    assert knobs._rows["flicker", 0].box.isChecked()
    assert not knobs._rows["fog", 0].box.isChecked()
    knobs.close_knobs()


def test_a_trial_plays_it(editing):
    assert editing.bench.do("scenario.add_fault", name="flicker")
    plan = TrialPlan("lab", editing.text, 0, 2.0, editing.more_faults)
    assert "flicker" in trial_text(plan)


def test_its_size_is_in_the_truth_of_a_session(tmp_path, editing):
    from studio.session.opening import open_session
    from studio.session.plan import SessionPlan

    mini = (
        'room = "lab"\nduration_s = 0.4\n[camera]\nfps = 5\nlens_size_px = 200\n'
        "[faults.flicker]\nshare = 0.4\n"
    )
    path = tmp_path / "mini.toml"
    path.write_text(mini)
    seen = []
    plan = SessionPlan("lab", str(path), methods=("own",), more_faults=(FLICKER,))
    open_session(plan).run(seen.append)
    assert [o.message.truth.recorded.faults["flicker"] for o in seen] == [0.4, 0.4]
