"""Scores of questionnaires by their authors' rules."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from studio.study.questionnaires import TLX_PAIRS, TLX_SCALES, Questionnaire

SUS_POINT = 2.5
"""Points of a score of 0..100 for each of the 40 that ten items give."""

HIGH_PRESENCE = 6
"""Answer from which Slater, Usoh and Steed count an item as high, on seven points."""

Direction = Literal["higher", "lower", "none"]
"""Better direction of a score: higher, lower, or neither."""

BETTER: Mapping[str, Direction] = {
    "sus": "higher",
    "paper-presence.mean": "higher",
    "presence.mean": "higher",
    "presence.high": "higher",
    "tlx.raw": "lower",
    "tlx-weighed.raw": "lower",
    "tlx-weighed.weighed": "lower",
}
"""Better direction of each score, by name."""


def scores(questionnaire: Questionnaire, answers: Mapping[str, str]) -> dict[str, float]:
    """Return a questionnaire's scores by name; none where an answer that they need is missing.

    Of a study's own questionnaire every Likert item, scale and number is its own score: how they
    belong together only its author knows.

    Args:
        questionnaire: what was asked.
        answers: by item.
    """
    match questionnaire.name:
        case "sus":
            return sus_score(answers)
        case "paper-presence":
            values = _numbers(questionnaire, answers)
            return {"paper-presence.mean": sum(values) / len(values)} if values else {}
        case "presence":
            return presence_scores(questionnaire, answers)
        case "tlx" | "tlx-weighed":
            return tlx_scores(questionnaire.name, answers)
        case _:
            return {
                f"{questionnaire.name}.{item.name}": float(answers[item.name])
                for item in questionnaire.items
                if item.kind in ("likert", "scale", "number") and answers.get(item.name)
            }


def sus_score(answers: Mapping[str, str]) -> dict[str, float]:
    """Return the System Usability Scale's score, 0..100.

    Odd items are worth their answer less one, even ones five less their answer. An item that was
    left out on paper counts as the middle of its scale, as Brooke asks for; without any answer
    there is no score.
    """
    given = [answers.get(f"SQ{k}", "") for k in range(1, 11)]
    if not any(given):
        return {}
    values = [int(text) if text else 3 for text in given]
    points = sum(v - 1 if k % 2 == 0 else 5 - v for k, v in enumerate(values))
    return {"sus": SUS_POINT * points}


def presence_scores(questionnaire: Questionnaire, answers: Mapping[str, str]) -> dict[str, float]:
    """Return the mean of Slater, Usoh and Steed's items, and how many of them are high."""
    values = _numbers(questionnaire, answers)
    if not values:
        return {}
    high = sum(value >= HIGH_PRESENCE for value in values)
    return {"presence.mean": sum(values) / len(values), "presence.high": float(high)}


def tlx_scores(name: str, answers: Mapping[str, str]) -> dict[str, float]:
    """Return NASA-TLX's load, 0..100: the mean of its scales, and that by weight where it is asked.

    A scale's weight is how often it was chosen of the fifteen pairs, over fifteen.
    """
    if not all(answers.get(scale) for scale in TLX_SCALES):
        return {}
    load = {scale: float(answers[scale]) for scale in TLX_SCALES}
    found = {f"{name}.raw": sum(load.values()) / len(load)}
    chosen = [answers.get(f"{one}-{other}", "") for one, other in TLX_PAIRS]
    if all(chosen):
        scale_of = {title: scale for scale, (title, *_) in TLX_SCALES.items()}
        weighed = sum(load[scale_of[title]] for title in chosen) / len(TLX_PAIRS)
        found[f"{name}.weighed"] = weighed
    return found


def _numbers(questionnaire: Questionnaire, answers: Mapping[str, str]) -> list[float]:
    """Return all answers as numbers; none where one is missing."""
    given = [answers.get(item.name, "") for item in questionnaire.items]
    return [float(text) for text in given] if all(given) else []
