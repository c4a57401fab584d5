"""Obstacles in a page for screen readers, keyboards and weak eyes: axe-core's rules."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

WEIGHTS = {"minor": 1, "moderate": 3, "serious": 7, "critical": 10}
"""Of a rule by its impact, as Lighthouse's score of accessibility has it."""

RUN = """
axe.run(document, {resultTypes: ['violations', 'passes']}).then((found) => {
  const impact = (rule) => rule.impact
    ?? (axe.getRules().find(({ruleId}) => ruleId === rule.id).tags.includes('best-practice')
      ? 'moderate' : 'serious');
  return {
    violations: found.violations.map((rule) => [rule.id, impact(rule),
      rule.nodes.map((node) => node.target.join(' '))]),
    passes: found.passes.map((rule) => [rule.id, impact(rule)]),
  };
})
"""


class Evaluates(Protocol):
    """A tab of a browser."""

    def evaluate(self, script: str) -> Any: ...


class Audit(NamedTuple):
    """What was found.

    Attributes:
        violations: (rule, impact, places in the page).
        score: share of the applicable rules that are kept, by weight; 100 is all.
    """

    violations: tuple[tuple[str, str, tuple[str, ...]], ...]
    score: float

    @property
    def serious(self) -> list[tuple[str, str, tuple[str, ...]]]:
        """Violations that keep somebody from using the page."""
        return [found for found in self.violations if found[1] in ("serious", "critical")]


def audited(page: Evaluates, axe_source: str) -> Audit:
    """Return what is found in a page as it is shown now."""
    page.evaluate(f"{axe_source};1")
    found = page.evaluate(RUN)
    broken = sum(WEIGHTS[impact] for _, impact, _ in found["violations"])
    kept = sum(WEIGHTS[impact] for _, impact in found["passes"])
    violations = tuple((rule, impact, tuple(at)) for rule, impact, at in found["violations"])
    return Audit(violations, 100.0 * kept / max(kept + broken, 1))
