"""Published figures of the paper's study: nine remote instructors who furnished a room."""

from __future__ import annotations

from collections.abc import Mapping

PARTICIPANTS = 9
"""Students, of 25.5 years on average (section 7.1)."""

SUS_SCORE = 85.0
"""Score of the System Usability Scale (section 7.3)."""

SUS_ITEMS: Mapping[str, tuple[float, float]] = {
    "SQ3": (4.44, 0.53),
    "SQ6": (4.11, 1.05),
    "SQ7": (4.67, 0.50),
}
"""Means and standard deviations that section 7.3.1 prints, negative items turned. The cells of its
figure 13 do not reproduce them and are not used."""

PRESENCE: Mapping[str, tuple[int, ...]] = {
    "PQ1": (5, 5, 5, 4, 5, 4, 5, 2, 3),
    "PQ2": (5, 5, 5, 4, 4, 5, 5, 5, 5),
    "PQ3": (5, 5, 3, 4, 4, 4, 5, 5, 5),
    "PQ4": (5, 5, 4, 4, 3, 4, 4, 4, 5),
    "PQ5": (4, 5, 3, 5, 4, 5, 5, 4, 4),
    "PQ6": (4, 5, 3, 5, 3, 1, 5, 2, 1),
}
"""Answers of P1 to P9 to its presence questionnaire, 1..5 (appendix A, figure 12)."""
