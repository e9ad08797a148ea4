"""The policy that comes with the project is the recorded one, and tracks well on unseen seeds."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from short_runs import ID

from agents import catalogue, configs
from agents.policy import OnnxPolicy
from agents.residual import ResidualPolicy, with_controller
from baselines import catalogue as baselines
from benchmarks import rows

FILES = [path for entry in catalogue.CONTROLLERS.values() for path in entry.files().values()]
RECORDED = {
    *("steps", "seconds", "cpu_seconds", "frames_per_second", "hardware", "seed"),
    *("first_env_seed", "tuning_seeds", "tuning_trials", "command"),
}


def rms(controller: object, reference: str, hysteresis: str, load: float) -> float:
    """Return the RMS error [m] after two seconds, over 16 seeds that training never saw."""
    env = gym.make_vec(
        ID,
        16,
        vectorization_mode="vector_entry_point",
        reference=reference,
        hysteresis=hysteresis,
        load=load,
    )
    observation, infos = env.reset(seed=101)
    errors = []
    for _ in range(999):
        action, _ = controller.predict(observation)  # type: ignore[attr-defined]
        observation, _, terminated, _, infos = env.step(action)
        assert not terminated.any()
        errors.append(infos["output"] - infos["reference"])
    return float(np.sqrt(np.mean(np.square(errors[200:]))))


class FeedForward:
    """Sets the pressure that the static law without memory asks for."""

    def __init__(self, load: float) -> None:
        env = gym.make(ID, load=load).unwrapped
        self.signals, self.action = env.signals, env.action_signals[0]
        self.grid = np.linspace(-0.01, 0.02, 301)
        self.pressures = np.clip(env.plant.drive_for(self.grid, load), 0.0, 6e5)

    def predict(self, observation: np.ndarray) -> tuple[np.ndarray, None]:
        reference = self.signals.decode(observation, "reference")
        pressure = np.interp(reference, self.grid, self.pressures)
        return self.action.encode(pressure)[:, None], None


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_file_is_small_and_its_training_is_recorded(path: Path) -> None:
    assert path.stat().st_size < 100_000
    card = json.loads(path.with_suffix(".json").read_text())
    occasion = card.pop("training", {})
    assert set(occasion) <= RECORDED
    assert OnnxPolicy.load(path).card == card
    assert f"--steps {card['config']['steps']} --seed {card['seed']}" in card["command"]
    assert configs.from_mapping(card["config"]).as_dict() == card["config"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_recorded_preset_is_the_one_that_ships(path: Path) -> None:
    card = OnnxPolicy.load(path).card
    variant = "residual" if "baseline" in card else ""
    preset = configs.preset(card["env"], card["algo"], variant)
    assert preset.decisive() == configs.from_mapping(card["config"]).decisive()
    assert "--config" not in card["command"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_was_trained_on_the_plant_that_ships(path: Path) -> None:
    policy = OnnxPolicy.load(path)
    env = gym.make(policy.card["env"], **policy.card["env_kwargs"]).unwrapped
    policy.check(env.signals, env.action_signals)
    with_controller(policy, env.plant)
    assert env.plant.digest() == policy.card["plant"], "the plant has changed: train it anew"


def test_several_trainings_of_one_policy_are_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = Path(catalogue.PRETRAINED["ppo"])
    for name in ("X.s2.onnx", "X.s11.onnx", "X.s1.json", "X.sx.onnx", "X.onnx"):
        (tmp_path / name).write_bytes(source.read_bytes())
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    entry = dataclasses.replace(catalogue.CONTROLLERS["ppo"], file="X.s{seed}.onnx")
    assert {seed: path.name for seed, path in entry.files().items()} == {
        0: "X.onnx",
        2: "X.s2.onnx",
        11: "X.s11.onnx",
    }
    (tmp_path / "X.s0.onnx").write_bytes(source.read_bytes())
    assert entry.files()[0].name == "X.s0.onnx"
    monkeypatch.setitem(catalogue.CONTROLLERS, "x", entry)
    assert catalogue.load_pretrained("x", training_seed=11).name == "X.s11.onnx"
    assert catalogue.load_pretrained("x").name == "X.s0.onnx"
    with pytest.raises(ValueError, match=r"no training seed 5; there are: \[0, 2, 11\]"):
        catalogue.load_pretrained("x", training_seed=5)


def test_a_residual_is_told_what_its_controller_is_told() -> None:
    for entry in catalogue.OFFERED.values():
        if entry.baseline:
            corrected = baselines.CONTROLLERS[entry.baseline]
            assert entry.knowledge == corrected.knowledge
            assert set(entry.envs) <= set(corrected.envs)
            variant = configs.preset(entry.envs[0], "ppo", "residual").residual
            assert variant.controller == entry.baseline


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
@pytest.mark.parametrize(("reference", "most"), [("sines", 0.15e-3), ("staircase", 0.5e-3)])
def test_it_tracks_where_a_law_without_memory_cannot(
    hysteresis: str, reference: str, most: float
) -> None:
    policy = catalogue.load_pretrained("ppo")
    for load in (0.0, 2.55, 4.55):
        error = rms(policy, reference, hysteresis, load)
        assert error < most
        assert error < 0.4 * rms(FeedForward(load), reference, hysteresis, load)


def test_benchmarks_find_it_among_the_controllers() -> None:
    for name, entry in catalogue.CONTROLLERS.items():
        env = gym.make(*entry.envs).unwrapped
        made = catalogue.make_controller(name, env.plant, env.signals, env.action_signals, seed=0)
        assert entry.envs == (made.card["env"],)
        policy = catalogue.load_pretrained(name)
        inside = made.policy if isinstance(made, ResidualPolicy) else made
        assert inside.digest() == policy.digest()
        assert policy.corrects == entry.baseline
        assert (entry.kind == "residual") == bool(entry.baseline)
    with pytest.raises(ValueError, match="no policy named 'pppo'; did you mean 'ppo'"):
        catalogue.load_pretrained("pppo")


@pytest.mark.parametrize(
    ("row", "other", "share"),
    [
        ("knee_walk_nominal--ppo_knee_walk", "knee_walk_nominal--knee_inverse_ltr", 0.4),
        ("knee_walk_wrong_model--ppo_knee_walk", "knee_walk_wrong_model--knee_pid", 0.6),
        ("knee_tension_nominal--ppo_knee_tension", "knee_tension_nominal--knee_pid", 0.7),
    ],
)
def test_the_knees_policies_do_better_than_classical_ones(
    row: str, other: str, share: float
) -> None:
    ours, theirs = (rows.load(rows.RESULTS / f"{name}.json") for name in (row, other))
    assert ours["failures"] == 0
    errors = [r["aggregate"]["rms_error"]["mean"] for r in (ours, theirs)]
    assert errors[0] < share * errors[1]
    policy = catalogue.load_pretrained(ours["controller"]["name"])
    assert policy.card["env"] == ours["env"]["id"]
