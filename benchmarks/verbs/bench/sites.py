"""`nexus bench sites`: rooms and sites on loopback, measured; a thousand of them, reckoned."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the machine is described with it, which takes a moment
    from benchmarks.sites.building import BuildingFigures
    from benchmarks.sites.load import Costs
    from benchmarks.sites.thousand import Reckoning
    from studio.console.rows import Row

FITTED = (1, 4, 16)
"""People of the buildings of one room to which costs are fitted, and one of more rooms beside
them: the smallest that is asked for. The largest is held against the reckoning."""

ERROR_PERCENT = 35.0
"""Bar of the reckoning's error, chosen: what is full first is several times nearer to its limit
than the next."""

ENOUGH = 0.8
"""Share of the states that have to arrive: where fewer do, the machine was full, and what it took
is no measure of what is needed."""

SITES = 2
"""Sites of each room that is reckoned, among which its people are divided."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("--rooms", type=int, nargs="+", default=[4, 16], metavar="N", help="(4 16)")
    parser.add_argument("--clients", type=int, default=2, metavar="N", help="people of each (2)")
    parser.add_argument("--hz", type=float, default=72.0, metavar="N", help="bodies a second (72)")
    parser.add_argument(
        "--check-hz",
        type=float,
        default=10.0,
        metavar="N",
        help="the same where the reckoning is checked: 16 rooms fit two cores (10)",
    )
    parser.add_argument("--seconds", type=float, default=8.0, metavar="N", help="each (8)")
    parser.add_argument(
        "--reckon",
        type=int,
        nargs=2,
        default=[1000, 20],
        metavar=("ROOMS", "CLIENTS"),
        help="a building that is reckoned (1000 20)",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the reckoning (0)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure and reckon; exit 1 if the reckoning is off by more than its bar."""
    from benchmarks.sites.load import fit_costs
    from benchmarks.sites.thousand import reckon
    from studio.console.extras import require_extra
    from studio.console.rows import as_json, as_table, exit_code

    if not 1 <= args.clients <= 16 or args.seconds < 1 or min(args.hz, args.check_hz) <= 0:
        raise ValueError("wanted --clients of 1..16, --seconds of 1 or more, --hz above 0")
    if not all(1 <= count <= 64 for count in args.rooms) or min(args.reckon) < 1:
        raise ValueError("wanted --rooms of 1..64 and --reckon of 1 or more")
    require_extra("sites", what="nexus bench sites")
    fitted = [_measured(1, people, hz=args.hz, seconds=args.seconds) for people in FITTED]
    checked = [
        _measured(count, args.clients, hz=args.check_hz, seconds=args.seconds)
        for count in args.rooms
    ]
    costs = fit_costs([*fitted, min(checked, key=lambda each: each.rooms)])
    errors = {each.rooms: _error(costs, each) for each in checked}
    within = max((_error(costs, each) for each in fitted), key=abs)
    rooms, clients = args.reckon
    reckoned = reckon(costs, rooms=rooms, clients=clients, sites=SITES, hz=args.hz, seed=args.seed)
    rows = [row for figures in (*fitted, *checked) for row in building_rows(figures)]
    rows += reckoned_rows(reckoned, {1: within, **errors})
    if args.json:
        print(json.dumps(as_json("bench sites", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    print(f"{rooms} rooms of {clients} people: {reckoned_words(reckoned)}", file=sys.stderr)
    return exit_code(rows)


def _measured(rooms: int, clients: int, *, hz: float, seconds: float) -> BuildingFigures:
    from benchmarks.sites.building import run_building

    print(f"rooms {rooms}, people of each {clients} …", file=sys.stderr)
    return run_building(rooms, clients, hz=hz, seconds=seconds)


def _error(costs: Costs, measured: BuildingFigures) -> float:
    """Return the reckoning's error in percent; NaN where the machine was too busy to measure."""
    from benchmarks.sites.load import error_percent

    return error_percent(costs, measured) if measured.states_share >= ENOUGH else math.nan


def reckoned_words(reckoned: Reckoning) -> str:
    """Return in words what is full first, and what a building needs."""
    share = 100 * reckoned.utilisation[reckoned.bottleneck]
    return (
        f"the bottleneck is the {reckoned.bottleneck}, {share:.0f} % of one; "
        f"one router takes {reckoned.rooms_a_router} rooms, so {reckoned.routers} of them; "
        f"a site takes {reckoned.site_people} people"
    )


def building_rows(figures: BuildingFigures) -> list[Row]:
    """Return the figures of one building as rows."""
    from studio.console.rows import Row

    at = f"sites.{figures.rooms}x{figures.clients}"
    rooms, people = figures.rooms, figures.rooms * figures.clients
    return [
        Row(f"{at}.router_cpu_percent_a_room", 100 * figures.router_cpu / rooms, "%"),
        Row(f"{at}.room_cpu_percent", 100 * figures.rooms_cpu / rooms, "%"),
        Row(f"{at}.site_cpu_percent", 100 * figures.sites_cpu / rooms, "%"),
        Row(f"{at}.client_cpu_percent", 100 * figures.sites_cpu / people, "%"),
        Row(f"{at}.room_kb_s", figures.room_bytes / 1e3, "kB/s"),
        Row(f"{at}.site_kb_s", figures.site_bytes / 1e3, "kB/s"),
        Row(f"{at}.client_kb_s", figures.client_bytes / 1e3, "kB/s"),
        Row(f"{at}.messages_hz", figures.room_messages + figures.site_messages, "Hz"),
        Row(f"{at}.states_percent", 100 * figures.states_share, "%"),
        Row(f"{at}.state_age_ms.p50", figures.age_ms[0], "ms"),
        Row(f"{at}.state_age_ms.p95", figures.age_ms[1], "ms"),
    ]


def reckoned_rows(reckoned: Reckoning, errors: Mapping[int, float]) -> list[Row]:
    """Return a reckoned building as rows, and the reckoning's errors where it was measured."""
    from studio.console.rows import Row, at_most

    at = f"sites.reckoned_{reckoned.rooms}x{reckoned.clients}"
    rows = [
        Row(f"{at}.{_plain(name)}_percent", 100 * share, "%")
        for name, share in reckoned.utilisation.items()
    ]
    rows.append(Row(f"{at}.rooms_a_router", float(reckoned.rooms_a_router), ""))
    rows.append(Row(f"{at}.routers", float(reckoned.routers), ""))
    rows.append(Row(f"{at}.site_people", float(reckoned.site_people), ""))
    rows.append(Row(f"{at}.router_wait_ms.p95", reckoned.at_router.wait_ms[1], "ms"))
    for rooms, error in errors.items():
        name = f"sites.reckoning_error_percent.{rooms}_rooms"
        if math.isnan(error):
            rows.append(Row(name, None, "%"))
        else:
            rows.append(at_most(name, abs(error), "%", bar=ERROR_PERCENT))
    return rows


def _plain(name: str) -> str:
    """Return a machine's name as part of a row's."""
    return name.replace("'s ", "_")
