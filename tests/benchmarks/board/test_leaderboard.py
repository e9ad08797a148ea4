"""LEADERBOARD.md: a summary first, wide tables folded, the same bytes for the same rows."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import board_fakes as fakes
import pytest

from benchmarks.board import accessors as views
from benchmarks.board import claims, leaderboard, plots, standings
from benchmarks.board.format import duration, number, table
from benchmarks.board.tables import with_costs
from benchmarks.identity import audit, verified
from benchmarks.runs import cells, rows
from benchmarks.runs.controllers import available, find
from benchmarks.scoring.metrics import of_track


@pytest.fixture(scope="module")
def text() -> str:
    return leaderboard.board_text(fakes.board())


def section(text: str, title: str) -> str:
    return re.split(r"^## ", text.partition(f"## {title}\n")[2], flags=re.MULTILINE)[0]


def test_the_board_is_the_same_whatever_order_and_machine(text: str) -> None:
    turned = fakes.board()[::-1]
    for row in turned:
        row["volatile"] = {"predict_us": {"median": 1e9, "p99": 1e9}, "host": "elsewhere"}
    assert leaderboard.board_text(turned) == text


def test_the_verdict_stands_first_and_says_what_was_beaten(text: str) -> None:
    (line,) = re.findall(r"^\| `PAM/Mus.*$", section(text, "Nominal tracks"), re.MULTILINE)
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[1:3] == ["audit", "`inverse`"]
    assert cells[4] == "`ppo`"
    assert cells[5].startswith("0.500 [")
    assert cells[6] == "+50 % [+46, +54]"
    assert cells[7] == "1.00 [1.00, 1.00]"
    assert cells[9] == "**better (settings tried: 40, paper's 0)**"


def test_rank_changes_are_a_headline_table(text: str) -> None:
    assert text.index("## Rank changes between tracks") < text.index("## Tracks")
    changes = section(text, "Rank changes between tracks")
    assert "| wrong model | `ppo` | 1 | `inverse` 2 → 3 | `pid` 3 → 2 | 0.67 | audit |" in changes
    assert "| `inverse` | 2 | 3 (▼1) |" in changes


def test_rows_outside_of_the_round_and_young_ones_stand_apart(text: str) -> None:
    track = section(text, "Tracks").split("### ")[1]
    assert "Audit round 2, drawn 2026-01-02: 6 episodes that nobody could tune to, 5 of 6" in track
    ranked, _, rest = track.partition("Not ranked, fewer than 5 training seeds:")
    young, _, outside = rest.partition("Not in the audit round, not ranked;")
    names = [re.findall(r"^\| (\S+) \| \[`(\w+)`\]", part, re.MULTILINE)
             for part in (ranked, young, outside.partition("<details>")[0])]  # fmt: skip
    assert names == [
        [("1", "ppo"), ("2", "inverse"), ("3", "pid"), ("4", "zero")],
        [("-", "young")],
        [("-", "told")],
    ]
    assert "P(improvement), audit episodes" in ranked
    assert "P(improvement), public episodes" in outside


def test_a_row_that_does_worse_unseen_is_marked(text: str) -> None:
    (line,) = re.findall(r"^\| 3 \| \[`pid`\]\(results/short_nominal--pid.*$", text, re.MULTILINE)
    assert "**2.60**" in line
    assert "| 2.00 |" in line
    assert re.search(r"\*\*\+0\.600 \[\+0\.\d+, \+0\.\d+\]\*\*", line)


def test_a_second_artefact_of_a_name_shows() -> None:
    row = fakes.row("pid", 1e-3, audit=1e-3)
    assert "(artefact" not in leaderboard.board_text([row])
    row["audit"]["entry"] = 3
    assert "(artefact 3)" in leaderboard.board_text([row])


def test_an_entrant_of_the_round_that_has_no_row_is_named() -> None:
    text = leaderboard.board_text([fakes.row("pid", 1e-3, audit=1e-3)])
    assert "In the round and without a row: inverse, ppo, young, zero." in text


def test_a_verified_row_says_when() -> None:
    row = fakes.row("pid", 1e-3)
    assert "not verified yet" in leaderboard.board_text([row])
    assert "0 of 1 rows are verified with the code as it is.\n" in leaderboard.board_text([row])
    row["verified"] = {"date": "2026-01-03", "mode": "bits", "older": False}
    assert "| verified 2026-01-03 |" in leaderboard.board_text([row])
    said = leaderboard.board_text([row, fakes.row("zero", 2e-3)])
    assert "1 of 2 rows are verified with the code as it is, last on 2026-01-03.\n" in said
    row["verified"]["mode"] = "elsewhere"
    assert "| verified 2026-01-03 elsewhere |" in leaderboard.board_text([row])
    assert ", 1 of them elsewhere and nearly." in leaderboard.verified_of([row])
    row["verified"]["older"] = True
    words = "| verified 2026-01-03 elsewhere, at an older code |"
    assert words in leaderboard.board_text([row])
    assert "0 of 1 rows are verified" in leaderboard.board_text([row])


def test_a_row_of_an_older_round_is_self_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    given = [fakes.row("pid", 1e-3, audit=1e-3), fakes.row("zero", 2e-3, audit=2e-3)]
    last = SimpleNamespace(entrants={"pid": "a" * 64})
    monkeypatch.setattr(rows, "load_all", lambda folder: given)
    monkeypatch.setattr(audit, "last", lambda track: last)
    monkeypatch.setattr(audit, "in_last_round", lambda row: row["controller"]["name"] == "pid")
    pid, zero = leaderboard.load(tmp_path)
    assert views.round_of(pid)["entrants"] == last.entrants
    assert not views.is_audited(zero)
    assert [views.name_of(r) for r in standings.listing([pid, zero]).outside] == ["zero"]


def test_a_verification_counts_for_the_row_that_it_was_of(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    given = [fakes.row("pid", 1e-3), fakes.row("zero", 2e-3)]
    monkeypatch.setattr(rows, "load_all", lambda folder: given)
    sources = cells.sources(find("pid"))
    entry = {"checksum": "e" * 64, "date": "2026-01-03", "mode": "bits", "sources": sources}
    held = {given[0]["row"]: entry, given[1]["row"]: {**entry, "checksum": "an older row"}}
    (tmp_path / "verified.json").write_text(json.dumps(held))
    words = [views.verified_words(row) for row in leaderboard.load(tmp_path)]
    assert words == ["verified 2026-01-03", "not verified yet"]


@pytest.mark.parametrize("package", ["pam_envs", "baselines", "benchmarks", ""])
def test_a_verification_is_of_the_code_that_it_ran(package: str) -> None:
    row = fakes.row("pid", 1e-3)
    now = cells.sources(find("pid"))
    entry = {"checksum": row["checksum"], "date": "2026-01-03", "mode": "bits"}

    def older(**others: object) -> bool:
        found = verified.of(row, {row["row"]: {**entry, **others}}, available())
        assert found is not None
        return bool(found["older"])

    assert not older(sources=now)
    assert older(sources={**now, package: "another"}) if package else older()
    row["controller"]["name"] = "nobody"
    assert older(sources=now)


def test_a_checkout_without_rows_has_a_board_that_says_so(tmp_path: Path) -> None:
    written = leaderboard.write(tmp_path, tmp_path / "LEADERBOARD.md")
    assert leaderboard.NO_ROWS in written[0].read_text()
    with pytest.raises(ValueError, match="no such folder of rows"):
        leaderboard.write(tmp_path / "nowhere", tmp_path / "LEADERBOARD.md")


def test_costs_to_make_are_told(text: str) -> None:
    costs = section(text, "What they cost to make")
    assert "As stated by its maker, not verified" in costs
    assert "not equal: up to 40 trials of a learned controller, up to 0 of a classical one" in costs
    assert "| `ppo` | learned | search of 40 | 40 | 10 | 1 M | 5.00 min | 2 cores |" in costs
    assert "| `pid` | classical | by rule | 0 | - | - | - | - |" in costs


def test_wide_tables_are_folded(text: str) -> None:
    opened = re.sub(r"<details>.*?</details>", "", text, flags=re.DOTALL)
    assert "| p95 [mm]" in text
    assert "| p95 [mm]" not in opened
    assert "interquartile" in text.lower()
    assert text.count("<details>") == text.count("</details>") == 7


def test_rows_of_a_track_without_an_audit_say_so() -> None:
    text = leaderboard.board_text([fakes.row("pid", 1e-3), fakes.row("zero", 2e-3)])
    assert "Self-reported: no audit round yet" in text
    assert "no learned controller has been run" in text


def test_the_figure_has_the_same_bytes_each_time() -> None:
    ordered = standings.tracks(fakes.board())["short_nominal"]
    first = plots.track_figure(ordered)
    assert plots.track_figure(ordered) == first
    assert all(name in first for name in ("ppo", "inverse", "pid", "episodes with at most"))
    assert "audit episodes" in first
    assert "told" not in first


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
