"""What the command line takes for an environment."""

from __future__ import annotations

from pathlib import Path

import pytest

from agents.__main__ import main

NO_SUCH = ["--algo", "ppo", "--variant", "nosuch"]


@pytest.mark.parametrize("given", ["KneeWalk-v0", "PAM/KneeWalk-v0"])
@pytest.mark.parametrize("command", ["train", "sweep", "tune", "classical"])
def test_the_namespace_may_be_left_out(
    command: str, given: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, given, *NO_SUCH]) == 2
    assert "no ppo-nosuch preset for 'PAM/KneeWalk-v0'" in capsys.readouterr().err


def test_a_sweep_of_a_short_id_has_the_folders_of_the_long_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", "KneeWalk-v0", "--seeds", "2", "--dry-run", "--out", str(tmp_path)]) == 0
    folder = tmp_path.resolve() / "PAM-KneeWalk-v0"
    assert capsys.readouterr().out.split() == [
        *("to", "run", str(folder / "ppo-seed0")),
        *("to", "run", str(folder / "ppo-seed1")),
    ]
