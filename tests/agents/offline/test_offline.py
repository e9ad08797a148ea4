"""Offline learning: transitions of a data set, behaviour cloning, implicit Q-learning, export."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("minari")
pytest.importorskip("h5py")
import torch

from agents.__main__ import main
from agents.offline.data import DataSet, Transitions
from agents.offline.learners import Settings, learn
from agents.offline.train import train
from agents.policies.policy import OnnxPolicy
from agents.settings.schema import SettingsError
from sweeps.progress import unnoticed

SAMPLE = Path(__file__).parents[3] / "benchmarks/datasets/sample/PAM/MusclePositioning"
QUICK = Settings(steps=300, batch=64, hidden=(32, 32))


def one_step(rewarded: float) -> Transitions:
    """Return episodes of one step with uniform actions, and rewards for actions near a value."""
    random = np.random.default_rng(0)
    seen = random.uniform(-1.0, 1.0, (4000, 2)).astype(np.float32)
    given = random.uniform(-1.0, 1.0, (4000, 1)).astype(np.float32)
    rewards = -np.square(given[:, 0] - rewarded).astype(np.float32)
    return Transitions(seen, given, rewards, seen, np.ones(4000, np.float32), rewards)


@pytest.fixture(scope="module")
def cloned(tmp_path_factory) -> OnnxPolicy:
    folder = tmp_path_factory.mktemp("cloned")
    return OnnxPolicy.load(train(SAMPLE / "classical-v0", QUICK, folder, unnoticed))


def test_transitions_are_normalised_and_stay_within_episodes():
    data = DataSet(SAMPLE / "classical-v0")
    made = [data.transitions(split) for split in ("train", "test") if has(data, split)]
    steps = sum(len(part.rewards) for part in made)
    assert steps == data.metadata["total_steps"]
    for part in made:
        for values in (part.observations, part.actions, part.next_observations):
            assert values.dtype == np.float32 and np.abs(values).max() <= 1.0
        length = len(part.rewards) // len(part.returns)
        chained = np.array_equal(part.next_observations[: length - 1], part.observations[1:length])
        assert chained
        assert not part.terminations.any()  # the regular end of an episode is no termination
        assert part.returns.sum() == pytest.approx(part.rewards.sum(), rel=1e-5)


def has(data: DataSet, split: str) -> bool:
    """Return whether a split has an episode."""
    return any(True for _ in data.episodes(split))


def test_behaviour_cloning_reproduces_the_actions(cloned):
    data = DataSet(SAMPLE / "classical-v0").transitions("train")
    action, _ = cloned.predict(data.observations)
    error = np.mean(np.square(action - data.actions))
    assert error < 0.2 * np.var(data.actions)


def test_exported_policy_equals_the_network():
    data = DataSet(SAMPLE / "classical-v0").transitions("train")
    matrix = tuple(tuple(row) for row in np.eye(data.observations.shape[1]).tolist())
    network = learn(data, matrix, QUICK)
    from agents.offline.train import policy_bytes

    card = {**OnnxPolicyCard.made(), "algo": "bc"}
    policy = OnnxPolicy(policy_bytes(network, card), card)
    action, _ = policy.predict(data.observations)
    with torch.no_grad():
        expected = network(torch.from_numpy(data.observations)).clamp(-1.0, 1.0).numpy()
    assert np.abs(action - expected).max() < 1e-5


class OnnxPolicyCard:
    """Card with the signals of the sample, normalised."""

    @staticmethod
    def made() -> dict:
        data = DataSet(SAMPLE / "classical-v0")
        described = [
            [dataclasses.asdict(dataclasses.replace(s, normalized=True)) for s in signals]
            for signals in (data.signals, data.action_signals)
        ]
        return {"signals": described[0], "action_signals": described[1]}


@pytest.mark.parametrize("rewarded", [-0.6, 0.6])
def test_implicit_q_learning_prefers_rewarded_actions(rewarded):
    data, matrix = one_step(rewarded), ((1.0, 0.0), (0.0, 1.0))
    chosen = {}
    for algo in ("bc", "iql"):
        network = learn(data, matrix, dataclasses.replace(QUICK, algo=algo, steps=1000))
        with torch.no_grad():
            chosen[algo] = network(torch.from_numpy(data.observations)).numpy().mean()
    assert abs(chosen["bc"]) < 0.1  # the mean of the data
    assert chosen["iql"] * np.sign(rewarded) > 0.3


def test_same_data_and_seed_give_the_same_file(cloned, tmp_path):
    again = train(SAMPLE / "classical-v0", QUICK, tmp_path / "again", unnoticed)
    assert OnnxPolicy.load(again).digest() == cloned.digest()
    other = train(
        SAMPLE / "classical-v0", dataclasses.replace(QUICK, seed=1), tmp_path / "other", unnoticed
    )
    assert OnnxPolicy.load(other).digest() != cloned.digest()


def test_card_names_data_and_evaluation(cloned):
    assert cloned.card["data"]["id"] == "PAM/MusclePositioning/classical-v0"
    assert cloned.card["algo"] == "bc"
    assert cloned.card["config"]["plants"]["randomize"] is True


def test_command_learns_and_evaluates(tmp_path, capsys):
    folder = str(SAMPLE / "expert-v0")
    arguments = ["offline", folder, "--algo", "iql", "--steps", "20", "--out", str(tmp_path)]
    assert main(arguments) == 0
    policy = tmp_path / "policy.onnx"
    assert capsys.readouterr().out.strip() == str(policy)
    assert main(["evaluate", str(policy), "--episodes", "2"]) == 0
    assert str(policy) in capsys.readouterr().out


def test_folder_without_data_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="python -m benchmarks dataset"):
        DataSet(tmp_path)
    with pytest.raises(SettingsError, match="no split named 'trian'; did you mean 'train'"):
        list(DataSet(SAMPLE / "random-v0").episodes("trian"))


def test_unknown_algorithm_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="no algorithm named 'cql'"):
        train(SAMPLE / "random-v0", dataclasses.replace(QUICK, algo="cql"), tmp_path, unnoticed)
