"""Command line: environment ids and errors."""

import pytest

from agents.__main__ import main

NO_SUCH = ["--algo", "ppo", "--variant", "nosuch"]


@pytest.mark.parametrize("given", ["KneeWalk-v0", "PAM/KneeWalk-v0"])
@pytest.mark.parametrize("command", ["train", "sweep", "tune", "classical"])
def test_namespace_of_an_id_is_optional(command, given, capsys):
    assert main([command, given, *NO_SUCH]) == 2
    assert "no ppo-nosuch preset for 'PAM/KneeWalk-v0'" in capsys.readouterr().err


def test_sweep_of_a_short_id_uses_the_full_id(tmp_path, capsys):
    assert main(["sweep", "KneeWalk-v0", "--seeds", "2", "--dry-run", "--out", str(tmp_path)]) == 0
    folder = tmp_path.resolve() / "PAM-KneeWalk-v0"
    assert capsys.readouterr().out.split() == [
        *("to", "run", str(folder / "ppo-seed0")),
        *("to", "run", str(folder / "ppo-seed1")),
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["sweep", "KneeWalk-v0", "--seeds", "0"], "seeds = 0 is below 1"),
        (["sweep", "KneeWalk-v0", "--first-seed", "-1"], "first_seed = -1 is below 0"),
        (["tune", "KneeWalk-v0", "--trials", "-1"], "trials = -1 is below 1"),
        (["tune", "KneeWalk-v0", "--steps", "0"], "steps = 0 is below 1"),
        (["train", "KneeWalk-v0", "--seed", "-1"], "seed = -1 is below 0"),
        (["train", "KneeWalk-v0", "--out", "file/run"], "Not a directory; give another place"),
        (["evaluations"], "name policies"),
    ],
)
def test_errors_are_one_sentence_and_leave_no_files(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert [*tmp_path.iterdir()] == [tmp_path / "file"]
