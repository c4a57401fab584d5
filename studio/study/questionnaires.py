"""Questionnaires: their items, those that come along, and whether answers to them are valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

MAX_ITEMS = 60
"""Items of one questionnaire, chosen: three times NASA-TLX with its pairs."""

MAX_ANSWER = 4000
"""Characters of a written answer, chosen: two pages."""

KINDS = ("likert", "scale", "choice", "text", "number")
"""Kinds of items: points of a Likert scale, 0..100 in steps of 5, one of some words, free text, a
number."""

SCALE_STEP, SCALE_TOP = 5, 100
"""Step and end of a NASA-TLX scale: 21 marks, as its form has them."""


@dataclass(frozen=True, slots=True)
class Item:
    """One question.

    Attributes:
        name: unique in its questionnaire, a column of tables.
        text: as it is asked.
        kind: see `KINDS`.
        points: of a Likert scale, from 1.
        low: what the lowest answer means.
        high: what the highest answer means.
        options: of a choice.
        is_needed: whether it must be answered.
    """

    name: str
    text: str
    kind: str = "likert"
    points: int = 5
    low: str = ""
    high: str = ""
    options: tuple[str, ...] = ()
    is_needed: bool = True

    def checked(self, value: object) -> str:
        """Return an answer as it is kept; empty where none was given and none is needed.

        Raises:
            ValueError: it is none of those that are possible.
        """
        text = "" if value is None else str(value).strip()
        if not text:
            if self.is_needed:
                raise ValueError(f"{self.name}: not answered")
            return ""
        match self.kind:
            case "likert":
                allowed = [str(k) for k in range(1, self.points + 1)]
            case "scale":
                allowed = [str(k) for k in range(0, SCALE_TOP + 1, SCALE_STEP)]
            case "choice":
                allowed = list(self.options)
            case "number":
                if not text.isdigit() or len(text) > 6:
                    raise ValueError(f"{self.name} = {text!r}, wanted a whole number")
                return text
            case _:
                if len(text) > MAX_ANSWER:
                    raise ValueError(f"{self.name}: {len(text)} characters, at most {MAX_ANSWER}")
                return text
        if text not in allowed:
            wanted = ", ".join(allowed) if len(allowed) < 10 else f"{allowed[0]}..{allowed[-1]}"
            raise ValueError(f"{self.name} = {text!r}, wanted one of {wanted}")
        return text

    def fields(self) -> dict[str, Any]:
        """Return it as a page is given it."""
        return {
            "name": self.name,
            "text": self.text,
            "kind": self.kind,
            "points": self.points,
            "low": self.low,
            "high": self.high,
            "options": list(self.options),
            "needed": self.is_needed,
        }


@dataclass(frozen=True, slots=True)
class Questionnaire:
    """Questions that are answered together.

    Attributes:
        name: unique, in file names and columns.
        title: shown to those who answer.
        lead: what they are told first.
        items: the questions.
        source: where it comes from.
    """

    name: str
    title: str
    lead: str
    items: tuple[Item, ...]
    source: str = ""

    def checked(self, answers: Mapping[str, object]) -> dict[str, str]:
        """Return answers as they are kept, an entry an item.

        Raises:
            ValueError: one is missing, not possible, or to no item of this questionnaire.
        """
        unknown = sorted(answers.keys() - {item.name for item in self.items})
        if unknown:
            raise ValueError(f"{self.name}: no item {unknown[0]!r}")
        return {item.name: item.checked(answers.get(item.name)) for item in self.items}


AGREE = ("strongly disagree", "strongly agree")
"""Ends of an agreement scale, as of the System Usability Scale."""


def _agreed(prefix: str, texts: Sequence[str], *, points: int = 5) -> tuple[Item, ...]:
    low, high = AGREE
    return tuple(
        Item(f"{prefix}{k}", text, points=points, low=low, high=high)
        for k, text in enumerate(texts, start=1)
    )


SUS = Questionnaire(
    "sus",
    "System Usability Scale",
    "Think of the system that you have just used. Say how far you agree; do not think long.",
    _agreed(
        "SQ",
        (
            "I think that I would like to use this system frequently.",
            "I found the system unnecessarily complex.",
            "I thought the system was easy to use.",
            "I think that I would need the support of a technical person to be able to use this "
            "system.",
            "I found the various functions in this system were well integrated.",
            "I thought there was too much inconsistency in this system.",
            "I would imagine that most people would learn to use this system very quickly.",
            "I found the system very cumbersome to use.",
            "I felt very confident using the system.",
            "I needed to learn a lot of things before I could get going with this system.",
        ),
    ),
    "Brooke 1996",
)
"""The System Usability Scale in its own words: the paper's appendix has a garbled copy of them."""

PAPER_PRESENCE = Questionnaire(
    "paper-presence",
    "Presence",
    "Think of the place that you have just been in. Say how far you agree.",
    _agreed(
        "PQ",
        (
            "The virtual environment structures (furniture, objects) felt consistent with my "
            "real-world experiences.",
            "I had a sense of 'being there' in the virtual environment.",
            "Thinking back to the experience, I think virtual environments feel like a place I "
            "visited rather than something I just saw on a screen.",
            "At times, the virtual environment felt like my actual reality.",
            "During the experience, I think to myself that I was somewhere else in the world "
            "rather than I was in a virtual environment.",
            "During the experience, I do NOT think that I was in the virtual environment.",
        ),
    ),
    "GaussianNexus 2025, appendix A, figure 12",
)
"""The paper's presence questionnaire, five points, in its words; a higher answer is more presence
in all six."""

PRESENCE = Questionnaire(
    "presence",
    "Presence",
    "Think of the place that you have just been in.",
    tuple(
        Item(f"P{k}", text, points=7, low=low, high=high)
        for k, (text, low, high) in enumerate(
            (
                (
                    "Please rate your sense of being in the place.",
                    "not at all",
                    "as in a real place",
                ),
                (
                    "To what extent were there times during the experience when the place was the "
                    "reality for you?",
                    "at no time",
                    "almost all the time",
                ),
                (
                    "When you think back about the experience, do you think of the place more as "
                    "images that you saw, or more as somewhere that you visited?",
                    "images that I saw",
                    "somewhere that I visited",
                ),
                (
                    "During the experience, which was strongest on the whole: your sense of being "
                    "in the place, or of being elsewhere?",
                    "being elsewhere",
                    "being in the place",
                ),
                (
                    "How similar is your memory of the place to your memories of other places "
                    "where you have been today?",
                    "not at all",
                    "very much so",
                ),
                (
                    "During the experience, did you often think to yourself that you were actually "
                    "in the place?",
                    "not very often",
                    "very much so",
                ),
            ),
            start=1,
        )
    ),
    "after Slater, Usoh and Steed 1994",
)
"""The presence questionnaire of Slater, Usoh and Steed on its own seven points, the office of its
wording replaced by 'the place'."""

_LOW_HIGH = ("very low", "very high")
"""Ends of most scales of NASA-TLX."""

TLX_SCALES: Mapping[str, tuple[str, str, str, str]] = {
    "mental": ("Mental demand", "How mentally demanding was the task?", *_LOW_HIGH),
    "physical": ("Physical demand", "How physically demanding was the task?", *_LOW_HIGH),
    "temporal": ("Temporal demand", "How hurried or rushed was the pace of the task?", *_LOW_HIGH),
    "performance": (
        "Performance",
        "How successful were you in accomplishing what you were asked to do?",
        "perfect",
        "failure",
    ),
    "effort": (
        "Effort",
        "How hard did you have to work to accomplish your level of performance?",
        *_LOW_HIGH,
    ),
    "frustration": (
        "Frustration",
        "How insecure, discouraged, irritated, stressed and annoyed were you?",
        *_LOW_HIGH,
    ),
}
"""Scales of NASA-TLX: title, question and ends. Performance runs from perfect to failure: high is
more load in all of them."""

TLX_ITEMS = tuple(
    Item(name, f"{title}: {text}", "scale", low=low, high=high)
    for name, (title, text, low, high) in TLX_SCALES.items()
)
"""The scales as items."""

TLX_PAIRS = tuple(combinations(TLX_SCALES, 2))
"""The fifteen pairs by which its scales are weighed."""

TLX = Questionnaire(
    "tlx",
    "Task load (NASA-TLX)",
    "Think of the task that you have just done.",
    TLX_ITEMS,
    "Hart and Staveland 1988; unweighted ('raw TLX')",
)
"""NASA-TLX without weighing."""

TLX_WEIGHED = Questionnaire(
    "tlx-weighed",
    "Task load (NASA-TLX)",
    "Think of the task that you have just done. Of each pair at the end, choose what contributed "
    "more to the load of the task.",
    (
        *TLX_ITEMS,
        *(
            Item(
                f"{one}-{other}",
                "Which contributed more to the load?",
                "choice",
                options=(TLX_SCALES[one][0], TLX_SCALES[other][0]),
            )
            for one, other in TLX_PAIRS
        ),
    ),
    "Hart and Staveland 1988",
)
"""NASA-TLX with its fifteen comparisons."""

PAPER_FEEDBACK = Questionnaire(
    "paper-feedback",
    "Your experience",
    "In your own words; leave out what you have nothing to say about.",
    tuple(
        Item(f"FQ{k}", text, "text", is_needed=False)
        for k, text in enumerate(
            (
                "Reflecting on the task you just completed, how did the VR system compare to a "
                "typical 2D video call?",
                "How did the ability to move around the room help you during the task?",
                "How did the ability to use a camera in VR compare to a typical 2D video call for "
                "collaborating with others?",
                "How did the added freedom in interacting with the environment and the added "
                "freedom in interacting with other people feel?",
                "How did the system feel?",
                "Beyond the event setup demonstration, can you share any additional scenarios or "
                "reasons why it would be useful?",
            ),
            start=1,
        )
    ),
    "GaussianNexus 2025, appendix A, figure 14",
)
"""The paper's open questions."""

ABOUT = Questionnaire(
    "about",
    "About you",
    "For the description of all participants together; leave out what you do not want to say.",
    (
        Item("age", "Your age in years", "number", is_needed=False),
        Item("gender", "Your gender, in your own words", "text", is_needed=False),
        Item(
            "headsets",
            "Have you used an AR or VR headset before?",
            "choice",
            options=("never", "once or twice", "now and then", "often"),
            is_needed=False,
        ),
        Item(
            "video-calls",
            "How often do you make video calls?",
            "choice",
            options=("never", "once or twice a year", "every month", "every week"),
            is_needed=False,
        ),
    ),
)
"""Participants of the paper's study, in its words."""

KNOWN: Mapping[str, Questionnaire] = {
    each.name: each
    for each in (SUS, PAPER_PRESENCE, PRESENCE, TLX, TLX_WEIGHED, PAPER_FEEDBACK, ABOUT)
}
"""Questionnaires that come along, by name."""


def known_questionnaire(name: str) -> Questionnaire | None:
    """Return one that comes along; None where there is none of that name."""
    return KNOWN.get(name)
