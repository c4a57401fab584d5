"""Figures that rehearse and fork print of what was played, and their exit code."""

import json
from argparse import Namespace
from types import SimpleNamespace

import pytest

from studio import rehearsal
from studio.console import display
from studio.console.rows import at_most
from studio.session.plan import SessionPlan
from studio.verbs.sessions.playing import play_and_print


@pytest.fixture
def performed(monkeypatch, tmp_path):
    """Plays nothing; what was asked is in `plans`."""
    kept = SimpleNamespace(plans=[], bar=2.0)

    def perform(plan, out, *, progress):
        kept.plans.append((plan, out))
        return SimpleNamespace(rows=[at_most("x.ms", 1.0, "ms", bar=kept.bar)], folder=out)

    monkeypatch.setattr(rehearsal, "perform", perform)
    return kept


def play(tmp_path, **flags):
    args = Namespace(**{"headless": True, "json": False, **flags})
    plan = SessionPlan(seed=7)
    return play_and_print(args, plan, out=tmp_path, verb="fork", doing="forking")


def test_figures_and_the_report_s_place_are_printed(performed, tmp_path, capsys):
    assert play(tmp_path) == 0
    assert performed.plans[0][1] == tmp_path
    printed = capsys.readouterr()
    assert "x.ms" in printed.out
    assert printed.err == f"report: {tmp_path / 'report.html'}\n"


def test_json_names_verb_and_seed_and_a_missed_bar_is_the_exit_code(performed, tmp_path, capsys):
    performed.bar = 0.5
    assert play(tmp_path, json=True) == 1
    said = json.loads(capsys.readouterr().out)
    assert (said["verb"], said["seed"]) == ("fork", 7)


def test_why_there_is_no_window_is_said(performed, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(display, "why_no_window", lambda: "no display")
    assert play(tmp_path, headless=False) == 0
    assert "no display: forking without a window" in capsys.readouterr().err
