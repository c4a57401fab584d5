"""The page of a sweep shows every fault, size, seed and tracker, and needs nothing beside it."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import pytest

from studio.sweep.page import Series, chart, sweep_page

SVG = "{http://www.w3.org/2000/svg}"


def points(svg: str, kind: str):
    tree = ElementTree.fromstring(svg)
    for group in tree.iter("g"):
        if group.get("class") == kind:
            return [(float(c.get("cx")), float(c.get("cy"))) for c in group.iter("circle")]
    return []


def test_a_point_stands_where_its_size_and_value_say():
    values = {1.0: [2.0, 4.0], 2.0: [8.0]}
    svg = chart(
        [Series("own", True, values, [2.0])], size_label="blur (px)", value_label="e", floor=1.0
    )
    (x1, y2), (x1b, y4), (x2, y8) = points(svg, "series own")
    assert x1 == x1b < x2
    assert y2 > y4 > y8
    # Linear from 0: the same way up from 0 to 4 as from 4 to 8.
    assert y2 - y4 == pytest.approx(0.5 * (y4 - y8), abs=0.2)
    without = re.search(r'class="without"[^>]*y1="([\d.]+)"', svg)
    assert without is not None
    assert float(without[1]) == pytest.approx(y2, abs=0.1)
    line = re.search(r'polyline points="([^"]+)"', svg)
    assert line is not None
    (_, y_middle), _ = (tuple(map(float, p.split(","))) for p in line[1].split())
    assert y_middle == pytest.approx(0.5 * (y2 + y4), abs=0.1)


def test_sizes_below_zero_and_missing_values_are_drawn():
    svg = chart(
        [Series("own", True, {-1.0: [1.0], 1.0: []}, [])],
        size_label="ev & more",
        value_label="<e>",
        floor=1.0,
    )
    assert len(points(svg, "series own")) == 1
    ElementTree.fromstring(svg)


def test_the_page_has_all_runs_and_nothing_of_elsewhere(fake):
    rows = [row for run in fake.plan.runs for row in fake.give(run)["rows"]]
    html = sweep_page(fake.plan, rows)
    assert html.count("<svg") == 2 * 4
    svgs = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(points(svgs[0], "series own")) == 3 * 2
    assert len(points(svgs[0], "series paper weak")) == 3 * 2
    assert points(svgs[1], "series paper") == []  # no yaw
    for words in ("blur (px)", "exposure (EV)", "-1 EV", "4 px", "this tracker", "Without faults"):
        assert words in html
    assert not re.search(r'(src|href)="(?!data:)', html)
    assert "prefers-color-scheme: dark" in html


def test_a_table_s_line_is_the_median_of_the_seeds(fake):
    rows = [row for run in fake.plan.runs for row in fake.give(run)["rows"]]
    html = sweep_page(fake.plan, rows)
    line = next(t for t in html.split("<tr>") if "4 px" in t and "this tracker" in t)
    cells = re.findall(r"<td>([^<]*)</td>", line)
    assert cells == ["4 px", "this tracker", "5.5", "6.5", "4.5", "5.5", "4.0", "0", "30", "2"]
