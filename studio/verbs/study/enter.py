"""`nexus study enter DIR WHO QUESTIONNAIRE VALUES…`: what was answered on paper."""

from __future__ import annotations

import argparse
from pathlib import Path

CONSENT = "consent"
"""In place of a questionnaire: the participant has signed."""

LEFT_OUT = "-"
"""In place of a value: not answered."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's folder")
    parser.add_argument(
        "who", help="trial after which it was answered, such as BDF3-2; before the first, BDF3"
    )
    parser.add_argument("questionnaire", help=f"its name, or '{CONSENT}'")
    parser.add_argument(
        "values",
        nargs="*",
        help=f"answers in the order of the form; words in quotes; '{LEFT_OUT}' where there is none",
    )


def run(args: argparse.Namespace) -> int:
    """Keep it.

    Raises:
        ValueError, OSError: an answer is not possible, or a file cannot be written.
    """
    from studio.study.folder import Answers, StudyFolder
    from studio.study.results.scoring import scores

    folder = StudyFolder(args.folder)
    participant, _, number = args.who.upper().partition("-")
    folder.trials_for(participant)
    if args.questionnaire == CONSENT:
        folder.agree(participant, how="paper")
        print(f"{participant} has agreed, on paper")
        return 0
    trial = folder.trial(args.who).name if number else ""
    found = folder.study.questionnaire(args.questionnaire)
    if len(args.values) != len(found.items):
        raise ValueError(
            f"{found.name}: {len(args.values)} values, wanted {len(found.items)}, one an item: "
            f"{' '.join(item.name for item in found.items)}"
        )
    answers = {
        item.name: "" if value == LEFT_OUT else value
        for item, value in zip(found.items, args.values, strict=True)
    }
    folder.keep_answers(Answers(participant, trial, found.name, "paper", answers))
    print(f"{args.who.upper()}: {found.name} kept")
    for name, value in scores(found, answers).items():
        print(f"  {name} = {value:g}")
    return 0
