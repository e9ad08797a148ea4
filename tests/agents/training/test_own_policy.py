"""Film and score table of a policy file."""

import pytest
from short_runs import ID, LOOK, tiny, trained

from agents.__main__ import main
from agents.training import own_policy
from agents.training.evaluation import evaluate


def test_policy_is_filmed_in_the_environment_of_its_training(ppo, tmp_path, capsys):
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v2")
    film = tmp_path / "policy.gif"
    policy = str(ppo[1] / "policy.onnx")
    assert main(["watch", policy, "--video", str(film), "--seconds", "0.3", "--fps", "10"]) == 0
    assert "reference mixed" in capsys.readouterr().out
    with imageio.get_reader(film) as reader:
        assert len(list(reader)) == 4
    assert main(["watch", policy, "--seconds", "0"]) == 2
    assert main(["watch", policy, "--video", str(tmp_path / "film.txt")]) == 2
    assert "must end in .mp4 or .gif" in capsys.readouterr().err


def test_residual_policy_is_filmed_with_its_controller(short_run, tmp_path):
    pytest.importorskip("pygame")
    pytest.importorskip("imageio.v2")
    policy = short_run("residual")[1] / "policy.onnx"
    own_policy.watch(policy, tmp_path / "film.gif", 0.1, seed=1, fps=10)
    assert (tmp_path / "film.gif").stat().st_size > 0


def test_scores_of_policies_and_controllers_are_in_one_table(tmp_path, capsys):
    config = tiny(evaluation=LOOK)
    trained(tmp_path, config)
    policy = str(tmp_path / "policy.onnx")
    assert main(["evaluate", policy, "--controllers", "pid", "--episodes", "4"]) == 0
    heading, *rows = capsys.readouterr().out.splitlines()
    assert heading.split() == ["RMS", "return", "travel", "failures", "name"]
    assert [row.split()[-1] for row in rows] == [policy, "pid"]
    expected = evaluate("pid", config, 4)
    assert float(rows[1].split()[0]) == pytest.approx(expected.rms, rel=1e-4)
    assert float(rows[1].split()[1]) == pytest.approx(expected.mean_return, rel=1e-4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "name policies"),
        (["POLICY", "--episodes", "0"], "episodes = 0 is below 1"),
        (["POLICY", "--controllers", "pdi"], f"no controller named 'pdi' for {ID}; did you mean"),
        (["POLICY", "--controllers", "knee_pid"], f"no controller named 'knee_pid' for {ID}"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(ppo, arguments, said, capsys):
    policy = str(ppo[1] / "policy.onnx")
    assert main(["evaluate", *[policy if a == "POLICY" else a for a in arguments]]) == 2
    assert said in capsys.readouterr().err
