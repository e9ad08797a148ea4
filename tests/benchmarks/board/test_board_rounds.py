"""Rows as they are run and audited, on the board and on the page."""

import json

from benchmarks.board import accessors as views
from benchmarks.board import leaderboard, site, standings
from benchmarks.runs import verified
from benchmarks.runs.store import CHECKSUM, read_json
from tests.benchmarks.row_helpers import draw, place, run_row

PAGE = "leaderboard/MusclePositioning.md"


def test_board_shows_round_missing_entrants_and_outsiders(tmp_path, monkeypatch):
    with place(tmp_path):
        run_row(tmp_path, "middle")
        draw(tmp_path, "trained", "low", "integral")
        path = run_row(tmp_path, "trained")
        run_row(tmp_path, "low")
        held = read_json(path)
        verified.note(path, held[CHECKSUM], verified.BITS)
        monkeypatch.setattr(verified, "committed", verified.read)
        loaded = leaderboard.load(tmp_path / "out")
        (tracks,) = standings.tracks(loaded).values()
        found = standings.listing(tracks)
        assert [views.name_of(row) for row in found.outside] == ["middle"]
        assert {views.name_of(row) for row in found.inside} == {"low", "trained"}
        assert found.missing == ("integral",)
        assert len({views.pairs_of(row, "audit") for row in found.inside}) == 1

        text = leaderboard.files(loaded)[PAGE]
        assert "Audit round 1, drawn" in text
        assert "30 episodes with seeds unknown before, 2 of 3 rows" in text
        assert "In the round and without a row: integral." in text
        day = verified.read(tmp_path / "out")["tiny--trained"]["date"]
        assert f"| verified {day} |" in text

        site.build(tmp_path / "out", tmp_path / "site")
        assert json.loads((tmp_path / "site/rows/tiny--trained.json").read_text()) == read_json(
            path
        )

        draw(tmp_path, "trained", "middle")
        assert not any(views.is_audited(row) for row in leaderboard.load(tmp_path / "out"))
