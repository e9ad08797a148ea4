"""LEADERBOARD.md: a summary first, wide tables folded, the same bytes for the same rows."""

from __future__ import annotations

import re

import board_fakes as fakes
import pytest

from benchmarks import claims, leaderboard, plots, standings
from benchmarks.board_format import duration, number, table
from benchmarks.board_tables import with_costs
from benchmarks.metrics import of_track


@pytest.fixture(scope="module")
def text() -> str:
    return leaderboard.board_text(fakes.board())


def section(text: str, title: str) -> str:
    return re.split(r"^## ", text.partition(f"## {title}\n")[2], flags=re.MULTILINE)[0]


def test_the_board_is_the_same_whatever_order_and_machine(text: str) -> None:
    rows = fakes.board()[::-1]
    for row in rows:
        row["volatile"] = {"predict_us": {"median": 1e9, "p99": 1e9}, "host": "elsewhere"}
    assert leaderboard.board_text(rows) == text


def test_the_verdict_stands_first_and_says_what_was_beaten(text: str) -> None:
    (line,) = re.findall(r"^\| `PAM/Mus.*$", section(text, "Nominal tracks"), re.MULTILINE)
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[1] == "`inverse`"
    assert cells[3] == "`ppo`"
    assert cells[4].startswith("0.500 [")
    assert cells[5] == "1.00 [1.00, 1.00]"
    assert cells[7] == "**better**"


def test_rank_changes_are_a_headline_table(text: str) -> None:
    assert text.index("## Rank changes between tracks") < text.index("## Tracks")
    changes = section(text, "Rank changes between tracks")
    assert "| wrong model | `ppo` | 1 | `inverse` 2 → 3 | `pid` 3 → 2 | 0.67 |" in changes
    assert "| `inverse` | 2 | 3 (▼1) |" in changes


def test_audited_and_self_reported_rows_stand_apart(text: str) -> None:
    track = section(text, "Tracks").split("### ")[1]
    audited, _, rest = track.partition("Self-reported, without an audit, not ranked:")
    reported, _, young = rest.partition("Not ranked, fewer than 5 training seeds:")
    names = [re.findall(r"^\| (\S+) \| \[`(\w+)`\]", part, re.MULTILINE)
             for part in (audited, reported, young.partition("<details>")[0])]  # fmt: skip
    assert names == [
        [("1", "ppo"), ("2", "inverse"), ("3", "pid"), ("4", "zero")],
        [("-", "told")],
        [("-", "young")],
    ]


def test_a_row_that_does_worse_unseen_is_marked(text: str) -> None:
    (line,) = re.findall(r"^\| 3 \| \[`pid`\]\(results/short_nominal--pid.*$", text, re.MULTILINE)
    assert "**2.60**" in line
    assert re.search(r"\*\*\+0\.600 \[\+0\.\d+, \+0\.\d+\]\*\*", line)


def test_a_second_salt_shows() -> None:
    row = fakes.row("pid", 1e-3, audit=1.0)
    assert "(salt" not in leaderboard.board_text([row])
    row["audit"]["draw"] = 3
    assert "(salt 3)" in leaderboard.board_text([row])


def test_costs_to_make_are_told(text: str) -> None:
    costs = section(text, "What they cost to make")
    assert "| `ppo` | learned | search | 40 | 10 | 1 M | 5.00 min | 2 cores |" in costs
    assert "| `pid` | classical | by rule | 0 | - | - | - | - |" in costs


def test_wide_tables_are_folded(text: str) -> None:
    opened = re.sub(r"<details>.*?</details>", "", text, flags=re.DOTALL)
    assert "p95" in text
    assert "p95" not in opened
    assert "interquartile" in text.lower()
    assert text.count("<details>") == text.count("</details>") == 7


def test_rows_of_a_track_without_an_audit_say_so() -> None:
    text = leaderboard.board_text([fakes.row("pid", 1e-3), fakes.row("zero", 2e-3)])
    assert "no row of this track has been audited yet" in text
    assert "no learned controller has been run" in text


def test_rows_of_two_tasks_are_called_out() -> None:
    rows = [fakes.row("pid", 1e-3), fakes.row("zero", 2e-3) | {"task": "an older plant"}]
    assert "not of one scenario file" in leaderboard.board_text(rows)


def test_the_figure_has_the_same_bytes_each_time() -> None:
    ordered = standings.tracks(fakes.board())["short_nominal"]
    first = plots.track_figure(ordered)
    assert plots.track_figure(ordered) == first
    assert all(name in first for name in ("ppo", "inverse", "pid", "episodes with at most"))


def test_only_the_best_classical_controllers_are_drawn_but_all_learned_ones() -> None:
    many = [fakes.row(f"c{k:02}", 1e-3 * (k + 1)) for k in range(12)]
    worst = fakes.row("ppo", [0.1] * 5, kind="learned")
    drawn = plots.drawn_rows(standings.ordered([*many, worst]))
    assert len(drawn) == plots.DRAWN + 1
    assert drawn[-1]["controller"]["name"] == "ppo"


def test_every_cost_that_a_claim_rests_on_is_a_column() -> None:
    for metrics in ([], ["range"], ["range", "gait"]):
        columns = with_costs(leaderboard.columns_of({"metrics": metrics}))
        wanted = set(claims.COSTS) & set(of_track({"metrics": metrics}))
        assert wanted <= {metric for metric, _, _ in columns}


def test_numbers_and_tables_as_printed() -> None:
    assert [number(x) for x in (0.0, 1.0, 0.012345, 123456.0, 2e-5, None)] == [
        "0", "1.00", "0.0123", "123456", "2e-05", "-",
    ]  # fmt: skip
    assert [duration(x) for x in (5.0, 600.0, 7200.0, None)] == [
        "5.00 s",
        "10.0 min",
        "2.00 h",
        "-",
    ]
    assert table(["controller", "n"], [["a|b", "1"]])[2] == "| a\\|b | 1 |"
