"""`nexus doctor`: what is present, what is missing, and what to do about it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from dataclasses import asdict

from studio.console.probes import Finding, examine


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def run(args: argparse.Namespace) -> int:
    """Look at everything; exit 1 if something the program needs is missing."""
    findings = list(examine())
    if args.json:
        print(json.dumps({"verb": "doctor", "findings": [asdict(f) for f in findings]}, indent=2))
    else:
        print(as_table(findings))
    return 1 if any(f.state == "missing" for f in findings) else 0


def as_table(findings: Iterable[Finding]) -> str:
    """A plain table; state is a word and a sign, never colour alone."""
    signs = {"ok": "✓ ok", "optional": "- optional", "missing": "✗ missing"}
    lines = []
    for f in findings:
        lines.append(f"{signs[f.state]:<11} {f.subject:<22} {f.detail}")
        if f.remedy:
            lines.append(f"{'':<11} {'':<22} → {f.remedy}")
    return "\n".join(lines)
