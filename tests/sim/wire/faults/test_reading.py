import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.wire.faults.reading import read_fault, read_faults_file
from sim.wire.faults.schedule import RANGES, FaultError, FaultKind, WireFault


def test_what_is_not_said_is_usual():
    assert read_fault("restart") == WireFault(FaultKind.RESTART, 0.0, 3.0, 1.0)
    assert read_fault("delay:size=0.2") == WireFault(FaultKind.DELAY, 0.0, math.inf, 0.2)


@given(st.sampled_from(FaultKind), st.floats(0, 1000), st.floats(0.001, 1000), st.floats(0, 1))
def test_what_is_written_is_read(kind, at_s, for_s, share):
    usual = RANGES[kind]
    fault = WireFault(kind, at_s, for_s, usual.low + share * (usual.high - usual.low))
    text = f"{kind}: at={fault.at_s!r}, for={fault.for_s!r}, size={fault.size!r}"
    assert read_fault(text) == fault


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused(text):
    with suppress(FaultError):
        assert isinstance(read_fault(text), WireFault)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("flood", "wanted one of delay"),
        ("delay:at", "wanted at="),
        ("delay:at=soon", "a number"),
        ("delay:when=3", "'when'"),
        ("delay:at=nan", "a number"),
        ("delay:at=-1", "at=-1"),
        ("delay:for=0", "for=0"),
        ("loss:size=2", "0 to 1"),
    ],
)
def test_what_is_wrong_is_named(text, why):
    with pytest.raises(FaultError, match=why):
        read_fault(text)


def test_a_file_holds_several(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text('[[fault]]\nkind = "loss"\nat = 2\nsize = 0.5\n[[fault]]\nkind = "restart"\n')
    loss, restart = read_faults_file(path)
    assert (loss.kind, loss.at_s, loss.size) == (FaultKind.LOSS, 2.0, 0.5)
    assert restart.kind is FaultKind.RESTART


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[[fault]\n", "no TOML"),
        ("other = 1\n", "other"),
        ("fault = 3\n", "wanted tables"),
        ("fault = [3]\n", r"fault\[0\]"),
        ('[[fault]]\nkind = "delay"\nat = true\n', "at=True"),
    ],
)
def test_a_bad_file_is_refused_with_its_name(text, why, tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(FaultError, match=why) as caught:
        read_faults_file(path)
    assert str(path) in str(caught.value)
