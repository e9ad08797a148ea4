"""Command that shows one episode of any environment."""

import pytest

from benchmarks.__main__ import main
from benchmarks.runs.controllers import available
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scoring.metrics import shown

TRACKS = {track.env: track for track in scenarios.available().values()}
CLASSICAL = [(n, made) for n, made in available().items() if made.kind == "classical"]
FIRST = {env: next(n for n, made in CLASSICAL if made.runs_in(env)) for env in sorted(TRACKS)}


@pytest.mark.parametrize(("env", "controller"), FIRST.items())
def test_every_environment_is_shown(env, controller, capsys):
    options = ["--controller", controller, "--episode-seconds", "2"]
    assert main(["show", env.removeprefix("PAM/"), *options]) == 0
    shown_scores = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert {"rms_error", "sensed_rms_error", "pressure_travel"} <= set(shown_scores)
    assert shown_scores["pressure_travel"].endswith(" Pa/s")
    assert "nan" not in shown_scores.values()
    value, _, unit = shown_scores["rms_error"].partition(" ")
    assert 0.0 < float(value) < float("inf")
    assert unit == TRACKS[env].content.get("unit", "m")


@pytest.mark.parametrize(
    "env", ["MusclePositioning-v0", "ElbowOrthosis-v0", "RedundantManipulator-v0"]
)
def test_episode_is_drawn(env, tmp_path):
    plot = tmp_path / "episode.svg"
    options = ["--controller", FIRST[f"PAM/{env}"], "--episode-seconds", "0.5"]
    assert main(["show", env, *options, "--plot", str(plot)]) == 0
    assert plot.read_text().rstrip().endswith("</svg>")


def test_arguments_reach_the_environment(capsys):
    short = ["show", "MusclePositioning-v0", "--controller", "zero", "--episode-seconds", "0.5"]
    found = []
    for load in ("0.0", "4.5"):
        assert main([*short, "--reference", "staircase", "--load", load]) == 0
        found.append(capsys.readouterr().out)
    assert found[0] != found[1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["KneeWalk-v0", "--controller", "zero", "--load", "2"], "there is no argument 'load'"),
        (["KneeWalk-v0", "--controller", "zero", "--load-disturbance", "1"], "'load_disturbance'"),
        (["KneeWalk-v0", "--controller", "zero", "--reference", "x"], "reference = 'x' is not kn"),
        (["KneeWolk-v0", "--controller", "zero"], "no scenarios for 'PAM/KneeWolk-v0'; there are"),
        (["KneeWalk-v0", "--controller", "pid"], "pid is for PAM/MusclePositioning-v0, not for"),
    ],
)
def test_wrong_argument_is_one_sentence(arguments, said, capsys):
    assert main(["show", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "was raised from" not in error
    assert len(error.splitlines()) == 1


def test_tracks_of_an_environment_share_sensor_gate_and_unit():
    for track in scenarios.available().values():
        other = TRACKS[track.env].content
        for name in ("sensed", "gate", "settle_seconds", "hold_seconds"):
            assert track.content.get(name) == other.get(name)
        assert shown(track.content) == shown(other)
