"""`nexus evaluate cuts`: what is refused before hours of work."""

import argparse

import pytest

from benchmarks.verbs.evaluate import cuts


def parsed(*words):
    parser = argparse.ArgumentParser()
    cuts.add_arguments(parser)
    return parser.parse_args(words)


def test_seeds_that_are_none_are_refused(tmp_path):
    with pytest.raises(ValueError, match="--seeds"):
        cuts.run(parsed("--seeds", "9-3", "--captures", str(tmp_path)))


def test_a_folder_that_is_no_dataset_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"objects\.json"):
        cuts.run(parsed("--dataset", str(tmp_path), "--captures", str(tmp_path)))


def test_ways_that_there_are_not_are_refused(capsys):
    with pytest.raises(SystemExit):
        parsed("--only", "guess")
    assert "two_boxes" in capsys.readouterr().err
