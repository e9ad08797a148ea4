"""LEADERBOARD.md and its pages: summary, narrow tables, equal bytes for equal rows."""

import json
import math
import re
import subprocess
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import board_fakes as fakes
import pytest

from benchmarks.__main__ import main
from benchmarks.board import accessors as views
from benchmarks.board import claims, format, leaderboard, plots, standings, summary
from benchmarks.board.format import duration, number, reduction_words, table
from benchmarks.bounds import run as bounding
from benchmarks.bounds.run import Bound, Bounds
from benchmarks.identity import audit
from benchmarks.runs import rows
from benchmarks.scoring.group import Column
from benchmarks.scoring.metrics import GROUPS, columns_of, of_track
from benchmarks.scoring.statistics import Interval

AUTHOR = ("-c", "user.name=test", "-c", "user.email=test@example.org")
BOARD, PAGE = leaderboard.BOARD.name, "leaderboard/MusclePositioning.md"


@pytest.fixture(scope="module")
def files():
    return leaderboard.files(fakes.board())


def page(*rows: dict[str, Any]) -> str:
    """Return the page of the rows' environment."""
    return leaderboard.files(rows)[PAGE]


def section(text: str, title: str) -> str:
    return re.split(r"^## ", text.partition(f"## {title}\n")[2], flags=re.MULTILINE)[0]


def cells_of(text: str, name: str) -> list[list[str]]:
    """Return the cells of every table line of a controller."""
    lines = [line for line in text.splitlines() if f"| `{name}` |" in line]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (Interval(0.5, 0.46, 0.54), "lower by 50 % [46, 54]"),
        (Interval(-0.18, -0.42, 0.05), "higher by 18 % [-5, 42]"),
        (Interval(-0.18, -0.42, 0.0), "higher by 18 % [0, 42]"),
        (Interval(0.05, math.nan, math.nan), "lower by 5 %"),
    ],
)
def test_reduction_says_lower_or_higher(gain, words):
    assert reduction_words(gain) == words


def test_files_do_not_depend_on_order_and_machine(files):
    turned = fakes.board()[::-1]
    for row in turned:
        times = {"predict_us": {"median": 1e9, "p99": 1e9}, "machine": "x", "date": "y"}
        row["volatile"] = times
    made = leaderboard.files(turned)
    assert {name for name in made if made[name] != files[name]} == {"leaderboard/times.md"}
    assert made.keys() == files.keys()


def best_cells(texts: dict[str, str]) -> dict[str, list[list[str]]]:
    """Return the cells of the first table, each in its lines, by environment and kind of track."""
    found = {}
    for line in section(texts[BOARD], "Best controllers").splitlines():
        first, *cells = [cell.strip().split("<br>") for cell in line.strip("|").split(" | ")]
        if first[0].startswith("`"):
            found[" ".join(first).replace("`", "")] = cells
    return found


def test_first_table_shows_paper_classical_learned_and_oracle(files):
    paper, classical, learned, oracle = best_cells(files)["MusclePositioning nominal"]
    assert paper[0] == classical[0] == "`inverse`" and learned[0] == "`ppo`"
    assert learned[1].startswith("0.500 [") and learned[1].endswith("] mm")
    assert oracle == ["-"]


def test_claim_of_each_track_is_a_line_with_its_reasons(files):
    (detail,) = re.findall(r"^- short_nominal: .*$", files[BOARD], re.MULTILINE)
    assert "`ppo` 0.500 [" in detail and "against `inverse` 1.00 [" in detail
    assert "; lower by 50 % [46, 54]; P(improvement) 1.00 [1.00, 1.00]; largest" in detail
    assert detail.endswith("; better (settings tried: 40, 0 for inverse)")


def test_oracle_of_the_same_task_is_in_the_first_table():
    made = standings.tracks(fakes.board())["short_nominal"]
    episodes = (
        Bound("a", 1, False, {"rms_error": 1e-4}),
        Bound("b", 1, False, {"rms_error": 3e-4}),
    )
    bounds = Bounds(made[0]["task"], 5, episodes)
    for task, words, short in ((bounds.task, "0.200 mm", "0.200 / -"), ("0" * 64, "-", "-")):
        given = {"short_nominal": replace(bounds, task=task)}
        assert f" | {words} |" in summary.board_text(made, {}, given)
        assert f" | {short} |" in summary.excerpt([*made, *drawn(made)], given)


def drawn(made: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows as those of the track with drawn plants."""
    return [{**r, "scenarios": {**r["scenarios"], "name": "short_randomised"}} for r in made]


def test_declared_headline_is_beside_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    made = leaderboard.files(fakes.board() + fakes.gait())
    (_, classical, learned, _) = best_cells(made)["KneeWalk nominal"]
    assert classical[:2] == ["`pid`", next(x for x in classical if x.startswith("2.00 ["))]
    assert classical[2].startswith("EMG effort 0.960 [0.9")
    assert learned[2].startswith("EMG effort 0.920 [")

    def change(name: str, headline: tuple[Column, ...]) -> None:
        monkeypatch.setitem(GROUPS, name, replace(GROUPS[name], headline=headline))

    change("gait", ())
    assert len(best_cells(leaderboard.files(fakes.gait()))["KneeWalk nominal"][1]) == 2
    change("range", (("air_use", "air [mg/s]", 1e6),))
    classical = best_cells(leaderboard.files(fakes.gait()))["KneeWalk nominal"][1]
    assert classical[2].startswith("air [mg/s] 30.0")


@pytest.mark.xdist_group("committed rows")
def test_excerpt_of_readme_is_that_of_the_rows(committed):
    text = leaderboard.README.read_text(encoding="utf-8")
    made = leaderboard.with_excerpt(text, committed, bounding.read())
    assert made == text
    assert text.count("| `KneeWalk` | N |") == 1


def test_first_ranking_table_has_error_and_declared_headline() -> None:
    text = leaderboard.files(fakes.gait())["leaderboard/KneeWalk.md"]
    ranks = text.partition("| rank |")[2].partition("<details>")[0]
    assert ranks.startswith(" controller | audit RMS [mm] [95 %] | EMG effort [95 %] |")
    efforts = {name: cells_of(ranks, name)[0][3] for name in ("ppo", "pid")}
    for name, mean in (("ppo", 0.92), ("pid", 0.96)):
        value, low, high = (float(x.strip(",[]")) for x in efforts[name].split(" "))
        assert low < value == mean < high < low + 0.03
    costs = text.partition("Public episodes, smooth")[2].partition("</details>")[0]
    assert "air [mg/s]" in costs
    assert "EMG effort" not in costs


def test_rank_changes_are_in_summary_and_page(files):
    changes = section(files[BOARD], "Rank changes between tracks")
    assert "| `MusclePositioning` | wrong model | `ppo` | 1 | 0.67 | audit |" in changes
    changes = section(files[PAGE], "Rank changes between tracks")
    line = "- *wrong model*: first `ppo` (nominal: 1); largest fall `inverse` 2 → 3; largest rise "
    assert f"{line}`pid` 3 → 2; Kendall's tau 0.67; audit episodes" in changes
    assert "| `inverse` | 2 | 3 (▼1) |" in changes


def test_rows_outside_the_round_and_with_few_seeds_are_apart(files):
    track = files[PAGE].split("\n## A short track\n")[1]
    assert "Audit round 2, drawn 2026-01-02: 6 episodes with seeds unknown before, 5 of 6" in track
    ranked, _, rest = track.partition("Not ranked, fewer than 5 training seeds:")
    young, _, outside = rest.partition("Not in the audit round, not ranked,")
    names = [re.findall(r"^\| (\S+) \| `(\w+)`", part, re.MULTILINE)
             for part in (ranked, young, outside.partition("<details>")[0])]  # fmt: skip
    assert names == [
        [("1", "ppo"), ("2", "inverse"), ("3", "pid"), ("4", "zero")],
        [("-", "young")],
        [("-", "outside")],
    ]
    assert "P(improvement), audit episodes" in ranked
    assert "P(improvement), public episodes" in outside


def test_row_with_higher_audit_error_is_marked(files):
    track = files[PAGE].split("\n## A short track\n")[1]
    line = cells_of(track, "pid")[0]
    assert line[0] == "3"
    assert line[2].startswith("**2.60** [")
    assert re.fullmatch(r"\*\*\+0\.600 \[\+0\.\d+, \+0\.\d+\]\*\*", line[3])
    public = track.partition("Public episodes, smooth")[2]
    assert cells_of(public, "pid")[0][2] == "2.00"


def test_no_table_is_wider_than_a_screen(files):
    made = "\n".join(format.tables(["controller", *("x" * 20,) * 9], [["`a`", *"123456789"]] * 3))
    assert made.count("| controller |") == 2
    for text in (made, *(text for name, text in files.items() if name.endswith(".md"))):
        for line in text.splitlines():
            assert not line.startswith("|") or max(map(len, line.split("<br>"))) <= format.WIDTH


def test_committed_summary_is_short():
    assert leaderboard.BOARD.stat().st_size <= 60_000
    pages = sorted((leaderboard.BOARD.parent / leaderboard.PAGES).glob("*.md"))
    assert len(pages) > 9
    links = re.findall(r"\]\((leaderboard/\w+\.md)\)", leaderboard.BOARD.read_text())
    assert set(links) == {f"{leaderboard.PAGES}/{path.name}" for path in pages}


def test_second_artefact_of_a_name_is_marked():
    row = fakes.row("pid", 1e-3, audit=1e-3)
    assert "(artefact" not in page(row)
    row["audit"]["entry"] = 3
    assert "(artefact 3)" in page(row)


def test_entrant_of_the_round_without_row_is_named():
    text = page(fakes.row("pid", 1e-3, audit=1e-3))
    assert "In the round and without a row: inverse, ppo, young, zero." in text


def test_verified_row_shows_its_day():
    row = fakes.row("pid", 1e-3)
    assert "not verified yet" in page(row)
    assert "0 of 1 rows are verified.\n" in summary.board_text([row])
    row["verified"] = {"date": "2026-01-03", "mode": "bits"}
    assert "| verified 2026-01-03 |" in page(row)
    board = summary.board_text([row, fakes.row("zero", 2e-3)])
    assert "1 of 2 rows are verified, last on 2026-01-03.\n" in board
    row["verified"]["mode"] = "elsewhere"
    assert "| verified 2026-01-03 elsewhere |" in page(row)
    assert ", 1 of them within tolerance on another machine." in summary.verified_words([row])


def test_row_of_an_older_round_is_self_reported(monkeypatch, tmp_path):
    given = [fakes.row("pid", 1e-3, audit=1e-3), fakes.row("zero", 2e-3, audit=2e-3)]
    last = SimpleNamespace(entrants={"pid": "a" * 64})
    monkeypatch.setattr(rows, "load_all", lambda folder: given)
    monkeypatch.setattr(audit, "last", lambda track: last)
    monkeypatch.setattr(audit, "in_last_round", lambda row: row["controller"]["name"] == "pid")
    pid, zero = leaderboard.load(tmp_path)
    assert pid["audit"]["entrants"] == last.entrants
    assert not views.is_audited(zero)
    assert [views.name_of(r) for r in standings.listing([pid, zero]).outside] == ["zero"]


def test_verification_counts_only_for_the_row_with_its_checksum(monkeypatch, tmp_path):
    given = [fakes.row("pid", 1e-3), fakes.row("zero", 2e-3)]
    monkeypatch.setattr(rows, "load_all", lambda folder: given)
    entry = {"checksum": "e" * 64, "date": "2026-01-03", "mode": "bits"}
    held = {given[0]["row"]: entry, given[1]["row"]: {**entry, "checksum": "an older row"}}
    (tmp_path / "verified.json").write_text(json.dumps(held))

    def words() -> list[str]:
        return [views.verified_words(row) for row in leaderboard.load(tmp_path)]

    assert words() == ["not verified yet"] * 2  # in another folder than this checkout's
    monkeypatch.setattr(rows, "RESULTS", tmp_path)
    assert words() == ["not verified yet"] * 2  # not committed
    for command in (["init", "-q"], ["add", "."], [*AUTHOR, "commit", "-qm", "verified"]):
        subprocess.run(["git", "-C", str(tmp_path), *command], check=True)
    assert words() == ["verified 2026-01-03", "not verified yet"]
    held[given[1]["row"]] = entry
    (tmp_path / "verified.json").write_text(json.dumps(held))
    assert words() == ["verified 2026-01-03", "not verified yet"]


def test_message_names_the_row_with_an_unknown_citation_or_a_repeated_episode():
    cited, repeated = fakes.row("pid", 1e-3), fakes.row("zero", 1e-3)
    cited["controller"]["citation"] = "no key"
    repeated["episodes"].append(repeated["episodes"][0])
    for row, words in ((cited, "citation of pid: no key"), (repeated, f"{repeated['row']}: ")):
        with pytest.raises(ValueError, match=words):
            leaderboard.files([row])


def test_text_of_a_row_is_no_html_link_or_code(monkeypatch):
    row = fakes.row("pid", 1e-3)
    evil = '<img src=x onerror="alert(1)"> ![](http://x) `{download}`'
    row["volatile"]["machine"] = row["controller"]["author"] = row["controller"]["summary"] = evil
    row["controller"]["tuning"]["how"] = row["scenarios"]["content"]["title"] = evil
    texts = leaderboard.files([row])
    assert "&lt;img src=x" in texts["leaderboard/times.md"]
    pages = [text for name, text in texts.items() if name.endswith(".md")]
    assert not any(part in page for page in pages for part in ("<img src=x", "![]", " `{"))


def test_board_of_another_folder_writes_nothing_outside_of_it(tmp_path, monkeypatch):
    (tmp_path / "rows").mkdir()
    monkeypatch.setattr(leaderboard, "BOARD", tmp_path / "own" / "LEADERBOARD.md")
    for command in ("board", "site"):
        assert main([command, "--results", str(tmp_path / "rows")]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["rows"]
    assert {path.name for path in (tmp_path / "rows").iterdir()} == {
        *("LEADERBOARD.md", "leaderboard", "site")
    }


def test_board_without_rows_has_a_message(tmp_path):
    written = leaderboard.write(tmp_path, tmp_path / "LEADERBOARD.md")
    assert summary.NO_ROWS in written[0].read_text()
    with pytest.raises(ValueError, match="no such folder of rows"):
        leaderboard.write(tmp_path / "nowhere", tmp_path / "LEADERBOARD.md")


def test_tuning_and_training_costs_are_shown(files):
    costs = section(files[PAGE], "Tuning and training")
    assert "As stated by the author of the row, not verified" in costs
    assert "| `ppo` | learned | search of 40 | 40 | 10 | 1 M | 5.00 min | 2 cores |" in costs
    assert "| `pid` | classical | by rule | 0 | - | - | - | - |" in costs
    unequal = "not equal: up to 40 trials of a learned controller, up to 0 of a classical one"
    assert unequal in files[BOARD]


def test_secondary_tables_are_folded(files):
    text = files[PAGE]
    opened = re.sub(r"<details>.*?</details>", "", text, flags=re.DOTALL)
    assert "| p95 [mm]" in text
    assert "| p95 [mm]" not in opened
    assert "interquartile" in text.lower()
    assert text.count("<details>") == text.count("</details>") == 11


def test_controllers_name_their_sources(files):
    assert "- `pid`: what pid is (skogestad2003)\n" in section(files[PAGE], "Controllers")
    assert "- skogestad2003: Skogestad, Sigurd, Simple" in section(files[PAGE], "Sources")


def test_rows_of_a_track_without_audit_are_self_reported():
    text = page(fakes.row("pid", 1e-3), fakes.row("zero", 2e-3))
    assert "Self-reported: no audit round yet" in text
    board = summary.board_text([fakes.row("pid", 1e-3), fakes.row("zero", 2e-3)])
    assert "No learned controller has been run in `MusclePositioning`." in board


def test_figure_is_deterministic():
    ordered = standings.tracks(fakes.board())["short_nominal"]
    first = plots.track_figure(ordered)
    assert plots.track_figure(ordered) == first
    assert all(name in first for name in ("ppo", "inverse", "pid", "episodes with at most"))
    assert "audit episodes" in first
    assert "outside" not in first


def test_all_learned_and_only_the_best_classical_controllers_are_drawn():
    many = [fakes.row(f"c{k:02}", 1e-3 * (k + 1)) for k in range(12)]
    worst = fakes.row("ppo", [0.1] * 5, kind="learned")
    drawn = plots.drawn_rows(standings.ordered([*many, worst]))
    assert len(drawn) == plots.DRAWN + 1
    assert drawn[-1]["controller"]["name"] == "ppo"


def test_every_cost_of_a_claim_is_a_column():
    for metrics in ([], ["range"], ["range", "gait"]):
        columns = columns_of({"metrics": metrics})
        expected = set(claims.COSTS) & set(of_track({"metrics": metrics}))
        assert expected <= {metric for metric, _, _ in columns}


def test_numbers_and_tables_are_formatted():
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
