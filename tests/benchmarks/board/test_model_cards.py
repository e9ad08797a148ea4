"""Model cards: one for each trained policy, of its present files and rows."""

import dataclasses

import pytest

from agents.policies import catalogue
from benchmarks.board import model_cards
from benchmarks.board.leaderboard import load
from benchmarks.runs import rows
from tests.agents.short_runs import with_card


@pytest.fixture(scope="module")
def texts():
    return model_cards.texts()


def test_committed_cards_are_those_of_the_policies(texts):
    held = {path: path.read_text(encoding="utf-8") for path in catalogue.FOLDER.glob("*.md")}
    assert held == texts, "run python -m benchmarks cards"


def test_every_policy_file_is_on_one_card(texts):
    for path in catalogue.FOLDER.glob("*.onnx"):
        named = [card for card, text in texts.items() if f"]({path.name})" in text]
        assert [card.stem for card in named] == [path.stem.rpartition(".")[0]]


def test_links_of_cards_resolve(texts):
    for path, text in texts.items():
        links = model_cards.LINK.findall(text)
        assert len(links) >= 2
        assert [link for link in links if not (path.parent / link).is_file()] == []


def test_rows_of_a_policy_are_on_its_card(texts):
    held = [row["row"] for row in load(rows.RESULTS) if row["controller"]["kind"] != "classical"]
    assert len(held) >= 10
    for row in held:
        entry = catalogue.CONTROLLERS[row.partition("--")[2]]
        assert f"| `{row}` |" in texts[catalogue.FOLDER / f"{entry.preset}.md"]


def test_card_states_signals_with_units_and_the_training(texts):
    text = texts[catalogue.FOLDER / "KneeWalk-v0.ppo-robust.md"]
    assert "| input | `tension` | N | 0 to 600 |  |" in text
    assert "| output | `pressure_set_point` | Pa | 0 to 450000 |  |" in text
    assert "train PAM/KneeWalk-v0 --algo ppo --steps 14000000 --seed 0 --variant robust" in text
    assert "`wearer='adaptive'`" in text
    assert "not ranked, which needs 5" in text


def test_card_follows_policy_and_author(tmp_path, monkeypatch):
    name = "robust_knee_walk"
    entry = catalogue.CONTROLLERS[name]
    source = entry.first
    before = model_cards.card_text(name, entry, [])
    assert "No row of `robust_knee_walk`" in before
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    place = tmp_path / source.name
    place.write_bytes(with_card(source, steps=2_000_000))
    record = source.with_suffix(".json").read_text()
    place.with_suffix(".json").write_text(record.replace("{", '{"author": "Doe, J.",', 1))
    after = model_cards.card_text(name, dataclasses.replace(entry), [])
    assert "| author | Doe, J. |" in after
    assert "2 M control periods" in after
