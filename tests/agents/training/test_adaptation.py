"""Teacher and student: imitation, export, repetition after a kill."""

from typing import Any

import numpy as np
import pytest
from short_runs import QUIET, Killed, tiny

from agents.policies.policy import OnnxPolicy
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training import adaptation, own_policy, train
from agents.training.building import make_env, make_model
from agents.training.record import Run

SETTINGS: dict[str, Any] = {
    "network": {"hidden": [16], "linear": True},
    "history": {"frames": 4, "stride": 2, "signals": ["contraction", "set_point"]},
    "mix": [{}, {"randomize": True}],
    "evaluation": {"interval": 512, "episodes": 4, "settle_seconds": 0.1},
    "adaptation": {"steps": 6144, "n_steps": 64, "batch_size": 64, "n_epochs": 8},
}


def settings(**changes: Any) -> configs.Config:
    return tiny(**{**SETTINGS, **changes})


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    folder = tmp_path_factory.mktemp("student")
    run = Run(settings(), 3, folder)
    return train.train(run, train.start(run), QUIET)


def test_student_approaches_its_teacher(student):
    errors = OnnxPolicy.load(student).card["imitation_error"]
    assert len(errors) == 12
    assert np.mean(errors[-3:]) < 0.3 * errors[0]


def test_student_is_one_file_without_the_parameters_and_is_evaluated(student):
    policy = OnnxPolicy.load(student)
    assert policy.memory == 4 * 2 * 2
    assert [entry["steps"] for entry in policy.card["evaluation"]] == [0, 1024 + 6144]
    assert configs.from_mapping(policy.card["config"]) == settings()
    (_, score), (_, classical) = own_policy.scores([student], ["inverse_pid"], 4)
    assert 0.0 < score.rms < 0.02
    assert 0.0 < classical.rms < 0.02


def test_run_killed_while_the_student_learns_gives_the_same_file(student, tmp_path, monkeypatch):
    run = Run(settings(), 3, tmp_path)
    model = train.start(run)

    def killed(*_: Any) -> None:
        raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(adaptation, "learn", killed)
        with pytest.raises(Killed):
            train.train(run, model, QUIET)
    assert not (tmp_path / "policy.onnx").exists()
    again = train.train_to_the_end(run, QUIET)
    assert again.read_bytes() == student.read_bytes()


def test_teacher_sees_the_parameters_and_not_the_history():
    config = settings()
    env = make_env(config)
    teacher: Any = make_model(config, 0, env)
    features = teacher.policy.pi_features_extractor.matrix.numpy()
    past = 2 * 4
    width = env.observation_space.shape[0]
    parameters = len(env.names) if hasattr(env, "names") else len(env.venv.names)
    states = len(env.states) if hasattr(env, "states") else len(env.venv.states)
    seen = features.any(axis=0)
    assert len(seen) == width - states
    assert not seen[len(seen) - parameters - past : len(seen) - parameters].any()
    assert seen[len(seen) - parameters :].all()
    apprentice: Any = adaptation.untrained(_with_logger(teacher), config, 0)
    own = apprentice.policy.pi_features_extractor.matrix
    assert own.shape[1] == width - states - parameters


def _with_logger(model: Any) -> Any:
    from stable_baselines3.common.logger import Logger

    model.set_logger(Logger(None, []))
    return model


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"history": {}}, "needs algo: ppo and a history"),
        ({"network": {"hidden": [16]}}, "network.linear: true"),
        ({"normalize": {"observation": True}}, "normalize.observation: false"),
    ],
)
def test_settings_that_a_teacher_does_not_fit_are_refused(changes, message):
    with pytest.raises(SettingsError, match=message):
        settings(**changes)
