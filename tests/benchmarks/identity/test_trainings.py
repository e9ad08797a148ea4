"""Training seeds of a learned row: the first n of one training, none copied, chosen or left out."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import bench_fakes
import pytest

from benchmarks.identity import trainings
from benchmarks.runs import rows
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, run
from benchmarks.runs.verify import verify
from tests.benchmarks.row_helpers import GAINS, draw, place, run_row, tiny


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    with place(tmp_path_factory.mktemp("trainings")) as folder:
        run_row(folder, "trained")
        yield folder


@pytest.fixture(autouse=True)
def put_back(board):
    yield
    bench_fakes.write_policies(board / "policies", *GAINS)


def card(board: Path, seed: int) -> Path:
    return board / "policies" / f"trained.s{seed}.json"


def edit(board: Path, **changes: object) -> None:
    """Change entries of the file of training seed 1, which is its own card."""
    said = json.loads(card(board, 1).read_text())
    card(board, 1).write_text(json.dumps(said | changes))


COPIES = "training seeds 0 and 1 are one policy"
CARD = "training seed 1 has seed 7 on its card"
OTHER = "training seed 1 was trained with other settings than seed 0"
CHANGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "copied": (lambda board: shutil.copy(card(board, 0), card(board, 1)), COPIES),
    "copied and renamed": (lambda board: edit(board, gain=GAINS[0]), COPIES),
    "renamed": (lambda board: edit(board, seed=7), CARD),
    "renamed beside": (lambda board: edit(board, training={"seed": 7}), CARD),
    "left out": (
        lambda board: card(board, 0).rename(card(board, 2)),
        "training seeds 1, 2, and they must be 0 to 1",
    ),
    "longer": (lambda board: edit(board, steps=2e6), OTHER),
    "tuned": (lambda board: edit(board, config={"ppo": {"gamma": 0.9}}), OTHER),
    "of another plant": (lambda board: edit(board, plants=["0" * 16]), OTHER),
}


@pytest.mark.parametrize("what", CHANGES)
def test_seeds_that_are_not_independent_trainings_make_no_row(what, board):
    change, words = CHANGES[what]
    change(board)
    options = Options(jobs=1, out=board / "new", cells=board / "cells")
    report = run([(find("trained"), tiny(board))], options)
    assert report.rows == []
    (line,) = report.missing
    assert line.startswith("tiny--trained: trained: ")
    assert words in line
    assert any(
        words in line for line in verify(rows.path_of("tiny--trained", board / "out")).drifted
    )


def test_round_refuses_copied_policies(board):
    CHANGES["copied"][0](board)
    with pytest.raises(ValueError, match="are one policy"):
        draw(board, "trained")


def test_settings_without_effect_on_the_training_may_differ(board):
    edit(board, config={"checkpoint_steps": 10, "search": {"trials": 3}})
    edit(board, baseline={"probe": [0.1]})
    row = rows.load(run_row(board, "trained", out=board / "other"))
    assert row["training_seeds"] == [0, 1]


def test_row_has_the_trainings_of_the_cards(board):
    found = trainings.of(find("trained"))
    assert [(run["training_seed"], run["command"]) for run in found] == [
        (0, "train --seed 0"),
        (1, "train --seed 1"),
    ]
    assert trainings.of(find("low")) is None
