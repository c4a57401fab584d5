"""`nexus VERB ...`: the table of verbs, their exit codes, and the one place that reports errors.

Exit codes: 0 done, 1 a check failed, 2 usage, 3 bad input file, 130 cancelled.
"""

from __future__ import annotations

import argparse
import difflib
import errno
import importlib
import os
import re
import signal
import sys
import threading
from collections.abc import Sequence
from typing import NoReturn

from studio.console.extras import explain_missing
from studio.console.machine import program_version
from studio.verbs.verb import Verb

EXIT_DONE, EXIT_FAILED, EXIT_USAGE, EXIT_INPUT, EXIT_CANCELLED = 0, 1, 2, 3, 130
TRACEBACK_VARIABLE = "NEXUS_TRACEBACK"

MEASURING = "benchmarks.verbs.table"
"""Module with more verbs, those that measure; a checkout has it, the installed package does not."""

MEASURING_WORDS = ("bench", "evaluate")
"""First words of those."""

VERBS = (
    Verb(
        "rehearse",
        "studio.verbs.sessions.rehearse",
        "play a session on the twin with simulated devices and score it against the truth",
        "nexus rehearse lab --headless --seed 7 --out out/demo",
    ),
    Verb(
        "live",
        "studio.verbs.sessions.live",
        "receive a 360° camera, follow the objects and record it all",
        "nexus live lab --simulated --headless --seconds 60 --json",
    ),
    Verb(
        "replay",
        "studio.verbs.sessions.replay",
        "track a recording again and compare with the recorded tracks",
        "nexus replay out/demo/recording.mcap --headless",
    ),
    Verb(
        "fork",
        "studio.verbs.sessions.fork",
        "go on from an instant of a recorded rehearsal, as it was or with another scenario",
        "nexus fork out/demo/recording.mcap --at 12.4 --scenario other.toml --out out/run-b",
    ),
    Verb(
        "compare",
        "studio.verbs.sessions.compare",
        "hold one rehearsal or fork against another on one page; exit 1 if a figure got worse",
        "nexus compare out/demo out/run-b --out out/compare.html",
    ),
    Verb(
        "share",
        "studio.verbs.share",
        "make film, offline viewer, session sheet and archive of a rehearsal, to hand over",
        "nexus share out/demo --out out/shared",
    ),
    Verb(
        "prepare",
        "studio.verbs.prepare",
        "make a metric scene package of photos or a video",
        "nexus prepare room.mp4 --qr-size 0.2 --out room.gnx",
    ),
    Verb("studio", "studio.verbs.studio", "open the desktop window", "nexus studio lab"),
    Verb(
        "refine",
        "studio.verbs.refine",
        "sharpen objects, or a region of a room, with the photos' own resolution",
        "nexus refine room.gnx chair-1",
    ),
    Verb(
        "convert",
        "studio.verbs.convert",
        "convert between splat file formats",
        "nexus convert room.ply room.spz",
    ),
    Verb(
        "simulate dataset",
        "studio.verbs.simulate.dataset",
        "write a scenario's 360° pictures with exact truth per frame, for other people's trackers",
        "nexus simulate dataset lab --form bop --out out/lab-bop",
    ),
    Verb(
        "simulate camera",
        "studio.verbs.simulate.camera",
        "stream a simulated 360° camera over RTMP, RTSP or as an Insta360, with faults",
        "nexus simulate camera lab --push rtmp://127.0.0.1:1935/live/room",
    ),
    Verb(
        "simulate quest",
        "studio.verbs.simulate.quest",
        "let simulated people with headsets join a live session, with faults",
        "nexus simulate quest http://127.0.0.1:40123/ --code 123456 --seconds 60",
    ),
    Verb(
        "study new",
        "studio.verbs.study.new",
        "make a study's folder, with a description to edit",
        "nexus study new out/study",
    ),
    Verb(
        "study plan",
        "studio.verbs.study.plan",
        "say who does what in which order, and write forms to print",
        "nexus study plan out/study",
    ),
    Verb(
        "study run",
        "studio.verbs.study.run",
        "go live with a participant's next task",
        "nexus study run out/study --simulated",
    ),
    Verb(
        "study enter",
        "studio.verbs.study.enter",
        "enter what was answered on paper",
        "nexus study enter out/study BDF3-1 sus 4 1 5 2 4 1 5 1 5 1",
    ),
    Verb(
        "study report",
        "studio.verbs.study.report",
        "make tidy tables with a codebook, and a report with the right tests",
        "nexus study report out/study",
    ),
    Verb(
        "simulate hololens",
        "studio.verbs.simulate.hololens",
        "play a HoloLens on its real ports: somebody wears it in a room, with faults",
        "nexus simulate hololens lab --seconds 60",
    ),
    Verb(
        "sites router",
        "studio.verbs.sites.router",
        "run the router by which a building's rooms and sites reach each other",
        "nexus sites router --listen 0.0.0.0:7447",
    ),
    Verb(
        "sites admit",
        "studio.verbs.sites.admit",
        "make a pass by which the building's router knows a room, a site or a watcher",
        "nexus sites admit room hall-3",
    ),
    Verb(
        "sites list",
        "studio.verbs.sites.list",
        "list the rooms of a building that are live",
        "nexus sites list 10.0.0.5 --pass watcher-lobby.pass",
    ),
    Verb(
        "sites join",
        "studio.verbs.sites.join",
        "let people here into a live room on another machine",
        "nexus sites join 10.0.0.5/hall-3 hall.gnx --pass site-north.pass --people-open",
    ),
    Verb(
        "track",
        "studio.verbs.track",
        "follow a scene's objects in recorded footage and write their poses",
        "nexus track lab session.mp4 --camera camera.json --out tracks.json",
    ),
    Verb(
        "cut",
        "studio.verbs.cutting.cut",
        "make a movable object of a part of a scanned room, or put it back",
        "nexus cut room.gnx --name stool --box 12.jpg 40 21 56 43 --box 31.jpg 12 9 30 35",
    ),
    Verb(
        "objects",
        "studio.verbs.objects",
        "list a scene's objects, which sides photos saw, and which photos would help",
        "nexus objects room.gnx",
    ),
    Verb(
        "gallery",
        "studio.verbs.gallery",
        "pictures of before and after, from a prepared scene",
        "nexus gallery room.gnx --out docs/pictures/gallery",
    ),
    Verb(
        "doctor",
        "studio.verbs.doctor",
        "say what is installed, missing, and what to do",
        "nexus doctor",
    ),
)


def all_verbs() -> tuple[Verb, ...]:
    """Return the verbs that there are: the studio's own and, in a checkout, those that measure."""
    try:
        table = importlib.import_module(MEASURING)
    except ModuleNotFoundError as missing:
        if not f"{MEASURING}.".startswith(f"{missing.name}."):
            raise
        return VERBS
    return (*VERBS, *table.VERBS)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line.

    Args:
        argv: words after the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        return _dispatch(words)
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else EXIT_USAGE
    except KeyboardInterrupt:
        print("nexus: cancelled", file=sys.stderr)
        return EXIT_CANCELLED
    except BrokenPipeError:
        # Whoever read our output has left: nothing more can be said to it, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_DONE
    except (ValueError, OSError) as error:
        if os.environ.get(TRACEBACK_VARIABLE):
            raise
        print(f"nexus: {_one_line(error)}", file=sys.stderr)
        return EXIT_INPUT
    except Exception as error:
        if os.environ.get(TRACEBACK_VARIABLE):
            raise
        missing = explain_missing(error, what=f"nexus {words[0]}")
        if missing is not None:
            print(f"nexus: {missing}", file=sys.stderr)
            return EXIT_INPUT
        print(
            f"nexus: a defect of this program: {type(error).__name__}: {_one_line(error)}; "
            f"{TRACEBACK_VARIABLE}=1 shows where",
            file=sys.stderr,
        )
        return EXIT_FAILED


def _dispatch(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help", "help"):
        print(_overview())
        return EXIT_DONE if words else EXIT_USAGE
    if words[0] in ("-V", "--version"):
        print(f"nexus {program_version()}")
        return EXIT_DONE
    verb, rest = _find_verb(words)
    module = importlib.import_module(verb.module)
    parser = _Parser(
        prog=f"nexus {verb.name}",
        description=f"{verb.summary[0].upper()}{verb.summary[1:]}.",
        epilog=f"example:\n  {verb.example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    module.add_arguments(parser)
    args = parser.parse_args(rest)
    if threading.current_thread() is threading.main_thread():
        # SIGTERM is a cancellation like Ctrl+C: unfinished files are removed.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    return int(module.run(args))


def _find_verb(words: list[str]) -> tuple[Verb, list[str]]:
    verbs = all_verbs()
    for verb in verbs:
        parts = verb.name.split()
        if words[: len(parts)] == parts:
            return verb, words[len(parts) :]
    below = [verb.name for verb in verbs if verb.name.split()[0] == words[0]]
    if below and (len(words) == 1 or words[1] in ("-h", "--help")):
        print("\n".join(f"nexus {name}" for name in below))
        raise SystemExit(EXIT_DONE if len(words) > 1 else EXIT_USAGE)
    if words[0] in MEASURING_WORDS and not below:
        print(
            f"nexus: 'nexus {words[0]}' is not part of the installed package; "
            f"run './nexus {words[0]}' in a checkout of the source",
            file=sys.stderr,
        )
        raise SystemExit(EXIT_USAGE)
    asked = " ".join(words[:2]) if below else words[0]
    names = [verb.name for verb in verbs]
    close = difflib.get_close_matches(asked, names, n=1, cutoff=0.6)
    hint = f"did you mean 'nexus {close[0]}'?" if close else "'nexus --help' lists the verbs"
    what = "flag" if asked.startswith("-") else "verb"
    print(f"nexus: unknown {what} {asked!r}; {hint}", file=sys.stderr)
    raise SystemExit(EXIT_USAGE)


def _overview() -> str:
    verbs = all_verbs()
    width = max(len(verb.name) for verb in verbs)
    lines = [f"  {verb.name:<{width}}  {verb.summary}" for verb in verbs]
    return "\n".join(
        [
            "usage: nexus VERB [arguments]",
            "",
            "Rehearse, track and replay live Gaussian-splat telepresence.",
            "",
            *lines,
            "",
            "'nexus VERB --help' explains a verb. From a checkout, './nexus test' runs every test.",
            "Exit codes: 0 done, 1 a check failed, 2 usage, 3 bad input file, 130 cancelled.",
            "",
            "example:",
            f"  {VERBS[0].example}",
        ]
    )


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with a command line in one line, with the nearest flag that exists."""

    def error(self, message: str) -> NoReturn:
        unknown = re.match(r"unrecognized arguments: (.*)", message)
        if unknown:
            words = unknown[1].split()
            flags = [flag for action in self._actions for flag in action.option_strings]
            first = words[0].split("=")[0]
            close = difflib.get_close_matches(first, flags, n=1, cutoff=0.5)
            what = "flag" if first.startswith("-") else "argument"
            hint = f"did you mean {close[0]}?" if close else f"'{self.prog} --help' lists them"
            message = f"unknown {what} {first!r}; {hint}"
        else:
            message = f"{message}; '{self.prog} --help' explains"
        print(f"{self.prog}: {message}", file=sys.stderr)
        raise SystemExit(EXIT_USAGE)


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.errno is not None:
        where = f"{error.filename}: " if error.filename else ""
        reason = error.strerror or type(error).__name__
        if error.errno == errno.ENOSPC and "full" not in reason:
            reason = "the disk is full: free some space or choose another folder with --out"
        return where + reason
    return " ".join(str(error).split()) or type(error).__name__


if __name__ == "__main__":
    sys.exit(main())
