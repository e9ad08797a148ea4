"""Inventory of the papers: each item has a row, each row an item; numbering and verdicts."""

import re
import shlex
from collections import Counter
from pathlib import Path

import pytest
import yaml
from pages import Page

from benchmarks.papers import figures as papers
from benchmarks.papers import inventory
from benchmarks.papers.published import VERDICTS, Figure, declared

pytestmark = pytest.mark.xdist_group("inventory")  # one process computes all figures
NUMBERS = {
    "yeh2010": {"figures": 17, "tables": 0, "equations": 13},
    "chakarov2018": {"figures": 7, "tables": 0, "equations": 23},
    "fluidic_muscles": {"figures": 16, "tables": 0, "equations": 18},
    "positioning2021": {"figures": 15, "tables": 6, "equations": 12},
}
"""Highest numbers in the papers."""
SECTIONS = ("1.1", *(f"2.{n}" for n in range(1, 13)), *(f"3.{n}" for n in range(1, 6)))
"""Numbers of the equations of fluidic_muscles, counted by section."""


@pytest.fixture(scope="module")
def counted() -> tuple[list[Figure], list[int]]:
    """Return all figures, and what their progress counted: the total, then each step."""
    counts: list[int] = []

    def start(total: int):
        counts.append(total)
        return lambda count=1, note="": counts.append(count)

    return papers.all_figures(start=start), counts


@pytest.fixture(scope="module")
def rows(counted) -> list[Figure]:
    return counted[0]


def test_progress_counts_every_group_of_figures(counted):
    total, *steps = counted[1]
    assert total == sum(steps) == len(papers.GROUPS)


@pytest.mark.parametrize("paper", NUMBERS)
def test_figures_tables_and_equations_are_numbered_without_a_gap(paper: str) -> None:
    places = inventory.items()[paper]
    for kind, last in NUMBERS[paper].items():
        found = [re.findall(r"\d+(?:\.\d+)?", p)[0] for p in places if inventory.kind(p) == kind]
        by_section = (paper, kind) == ("fluidic_muscles", "equations")
        assert sorted(found) == sorted(SECTIONS if by_section else map(str, range(1, last + 1)))


def test_every_item_has_a_row_and_every_row_an_item(rows: list[Figure]) -> None:
    listed = {(paper, place) for paper, found in inventory.items().items() for place in found}
    given = {(row.source.partition(", ")[0], place) for row in rows for place in row.places}
    assert given == listed
    stated = [row for row in rows if row.ours is None]
    assert len(stated) == sum(
        row is not None for found in inventory.items().values() for row in found.values()
    )


def test_item_without_a_computed_row_has_no_other_row(rows: list[Figure]) -> None:
    count = Counter((r.source.partition(", ")[0], place) for r in rows for place in r.places)
    for paper, found in inventory.items().items():
        for place, row in found.items():
            assert row is None or count[paper, place] == 1
            assert row is None or row.absent in VERDICTS[2:]


def test_every_verdict_has_a_reason(rows: list[Figure]) -> None:
    assert [row.name for row in rows if row.unexplained] == []
    assert {row.verdict for row in rows} == {*VERDICTS}


def test_only_the_listed_figures_differ(rows: list[Figure]) -> None:
    listed = yaml.safe_load(Path(__file__).with_name("differing.yaml").read_text())
    found = {paper: [] for paper in listed}
    for row in rows:
        if row.verdict == "differs":
            found[row.source.partition(", ")[0]].append(row.name)
    assert found == listed


def test_every_declared_figure_is_computed(rows: list[Figure]) -> None:
    for paper, names in declared().items():
        there = [row.name for row in rows if row.source.startswith(f"{paper}, ")]
        for name in names:
            pattern = ".*".join(map(re.escape, re.split(r"\{[^}]*\}", name)))
            assert any(re.fullmatch(pattern, one) for one in there), name


def test_selection_by_place_has_its_rows_only() -> None:
    found = papers.all_figures(["positioning2021"], ["Table 6"])
    assert len(found) == 3
    assert all("Table 6" in row.places for row in found)
    with pytest.raises(ValueError, match=r"no place 'Fig\. 99'"):
        papers.all_figures((), ["Fig. 99"])
    with pytest.raises(ValueError, match="paper 'other'"):
        papers.all_figures(["other"])


def test_page_has_the_coverage(rows: list[Figure]) -> None:
    page = Page("reproduction.md")
    for paper, kind, *counts in inventory.coverage(rows)[1:]:
        assert page.row(f"{paper}, {kind}") == counts
    found = Counter(row.verdict for row in rows)
    counts = ", ".join(f"{found[verdict]} {verdict}" for verdict in VERDICTS)
    assert f"{len(rows)} rows: {counts}" in page.flat


def test_commands_of_the_page_select_items_of_the_inventory() -> None:
    commands = re.findall(r"python -m benchmarks papers ([^`\n#]+)", Page("reproduction.md").text)
    chosen = [shlex.split(words) for words in commands if "--place" in words]
    assert len(chosen) > 25
    for _, paper, option, *places in chosen:
        assert option == "--place"
        assert {*places} <= inventory.items()[paper].keys()
