"""Residual policies: recorded actions of the controller, its state, the catalogue."""

import dataclasses
import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from short_runs import ID, kind, tiny

from agents.export import recording
from agents.export.export import facts
from agents.policies import catalogue
from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import PolicyFileError
from agents.policies.residual import ResidualPolicy, ResidualState, with_controller
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training import checkpoint
from agents.training.building import make_env, signals_of
from agents.vec_envs.residual import ResidualVecEnv, parts_of
from baselines.core import catalogue as baselines
from baselines.core.catalogue import make_controller
from baselines.core.recorded_answers import RecordedAnswers

LAWS = ("maxwell_slip", "preisach")
BOTH_LAWS = ("PAM/MusclePositioning-v0", "PAM/KneeTension-v0")
RESIDUALS = sorted(key for key in configs.presets() if "residual" in key[2])

MAKE = "agents.policies.residual.make_controller"


@pytest.fixture
def file(short_run):
    """Return a policy that corrects inverse_pid on plants with either hysteresis model."""
    return OnnxPolicy.load(short_run("residual")[1] / "policy.onnx")


def plant_with(law: str) -> Any:
    """Return the nominal plant with a hysteresis model."""
    return gym.make(ID, hysteresis=law).unwrapped.plant


def test_card_names_plants_and_common_arguments(file):
    assert file.card["plants"] == [plant_with(law).digest() for law in LAWS]
    assert file.card["env_kwargs"] == {**kind("residual").env_kwargs, "randomize": True}


def test_card_holds_the_controllers_answers_on_every_plant(file):
    known = file.card["baseline"]
    assert (known["name"], known["scale"]) == ("inverse_pid", pytest.approx(0.3))
    assert [entry["plant"] for entry in known["recorded"]] == file.card["plants"]
    for law, entry in zip(LAWS, known["recorded"], strict=True):
        env = gym.make(ID, hysteresis=law).unwrapped
        controller = make_controller("inverse_pid", env.plant, env.signals, env.action_signals)
        seen = RecordedAnswers.from_dict(entry, len(file.signals), len(file.action_signals))
        assert np.ptp(seen.observations, axis=0).max() > 1e-3
        assert seen.travel > 1e-2
        assert seen.deviation(controller) < 1e-6


class Shifted:
    """A controller with an offset."""

    def __init__(self, controller: Any, shift: float) -> None:
        self.controller, self.shift = controller, np.float32(shift)

    def predict(self, observation: Any, state: Any = None, start: Any = None) -> Any:
        action, state = self.controller.predict(observation, state, start)
        return action + self.shift, state


@pytest.mark.parametrize("law", LAWS)
def test_controller_with_other_answers_is_refused(law, file, monkeypatch):
    plant, make = plant_with(law), make_controller
    assert isinstance(with_controller(file, plant), ResidualPolicy)

    def later(*parts: Any) -> Any:
        made = make(*parts)
        return dataclasses.replace(made, inverse=_with_horizon(made.inverse))

    monkeypatch.setattr(MAKE, later)
    with pytest.raises(PolicyFileError, match=r"recorded actions by 0.*, more than 0.0003"):
        with_controller(file, plant)
    monkeypatch.setattr(MAKE, lambda *parts: Shifted(make(*parts), 1e-3))
    with pytest.raises(PolicyFileError, match="deviates from its recorded actions"):
        with_controller(file, plant)
    monkeypatch.setattr(MAKE, lambda *parts: Shifted(make(*parts), 1e-7))
    assert isinstance(with_controller(file, plant), ResidualPolicy)


def _with_horizon(inverse: Any) -> Any:
    return dataclasses.replace(inverse, horizon=1.5 * inverse.horizon)


def test_controller_of_another_plant_may_answer_differently(file):
    plant = plant_with("preisach")
    changed = plant.replace({"mass.damping": 1.2 * plant.mass.damping})
    assert isinstance(with_controller(file, changed), ResidualPolicy)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda known: known.pop("recorded"),
        lambda known: known.pop("scale"),
        lambda known: known.update(recorded=3),
        lambda known: known["recorded"][0].pop("plant"),
        lambda known: known["recorded"][0].pop("answers"),
        lambda known: known["recorded"][0].update(observations="?"),
        lambda known: known["recorded"][0].update(observations="", answers=""),
        lambda known: known["recorded"][0].update(answers=""),
        lambda known: known["recorded"][0].update(answers=[["x"]]),
    ],
)
def test_card_without_sound_recorded_answers_is_refused(spoil, file, short_run):
    card = json.loads(json.dumps(file.card))
    spoil(card["baseline"])
    data = (short_run("residual")[1] / "policy.onnx").read_bytes()
    with pytest.raises(PolicyFileError, match="export it with this version"):
        with_controller(OnnxPolicy(data, card), plant_with("maxwell_slip"))


def test_controller_at_a_limit_cannot_be_recorded():
    class Stuck:
        def predict(self, observation: Any, state: Any = None, start: Any = None) -> Any:
            return np.ones((len(observation), 1), np.float32), None

    with pytest.raises(SettingsError, match="'stuck' is saturated in more than 10%"):
        recording.record(ID, [{}], Stuck(), "stuck")


# --- the presets' own controllers -------------------------------------------------------------


@pytest.fixture(params=RESIDUALS, ids=lambda key: f"{key[0]}-{key[2]}".removeprefix("PAM/"))
def residual(request):
    """Return the environment of a residual preset, with few rows."""
    config = configs.preset(*request.param)
    laws = LAWS if config.env in BOTH_LAWS else LAWS[:1]
    plain = config.as_dict() | {"history": {}, "share": {}, "per_reference": {}}
    plain |= {"plants": {"hysteresis": laws}}
    plain |= {"num_envs": 6, "normalize": {"reward": False}, config.algo: {"batch_size": 6}}
    env: Any = make_env(configs.from_mapping(plain))
    while not isinstance(env, ResidualVecEnv):
        env = env.venv
    return env


def test_controllers_states_survive_a_checkpoint(residual, tmp_path):
    """Answers after a restore are equal bit for bit; every preset's controller is recorded."""
    rng = np.random.default_rng(0)
    residual.seed(900_000)
    residual.reset()
    width = residual.action_space.shape
    pushes = rng.uniform(-1, 1, (10, residual.num_envs, *(width or ()))).astype(np.float32)
    for push in pushes[:5]:
        residual.step(push)
    base: Any = residual.unwrapped
    content = {"layer": residual.snapshot(), "env": base.get_state()}
    checkpoint.save(tmp_path / "x", content)
    then = [residual.step(push)[0] for push in pushes[5:]]
    residual.reset()
    saved = checkpoint.load(tmp_path / "x")
    residual.restore(saved["layer"])
    base.set_state({name: value.numpy().copy() for name, value in saved["env"].items()})
    again = [residual.step(push)[0] for push in pushes[5:]]
    assert np.array_equal(then, again)
    signals = residual.get_attr("signals")[0]
    read = [signal.index for signal in signals if "reference" in signal.name]
    plants = dict.fromkeys(plant.digest() for _, plant in parts_of(residual))
    for digest, entry in zip(plants, _recorded(residual), strict=True):
        assert entry["plant"] == digest
        found = RecordedAnswers.from_dict(entry, len(signals), (width or (1,))[0])
        assert (np.abs(found.answers) < 1.0).mean() >= 1.0 - recording.MOST_AT_LIMIT
        rests = not np.ptp(found.observations[:, read], axis=0).any()
        # an arm's path begins after the probe, and a feedforward waits for it
        assert rests or np.ptp(found.answers, axis=0).max() > 1e-2


def _recorded(env: ResidualVecEnv) -> list[dict[str, Any]]:
    class Model:
        num_timesteps, seed = 0, 0

        def get_env(self) -> ResidualVecEnv:
            return env

    recorded: list[dict[str, Any]] = facts(Model())["baseline"]["recorded"]
    return recorded


def test_residual_has_the_controllers_model_output():
    class Following:
        def predict(self, observation: Any, state: Any = None, start: Any = None) -> Any:
            return np.zeros(1, np.float32), 7

        def model_output(self, state: int) -> int:
            return 2 * state

    class Adds:
        card = ()

        def answer(self, observation: Any, state: Any, start: Any, given: Any) -> Any:
            return given, None

    made = ResidualPolicy(Adds(), Following())
    _, state = made.predict(np.zeros(3))
    assert isinstance(state, ResidualState)
    assert made.model_output(state) == 14
    env = make_env(tiny())
    plain = make_controller("inverse", parts_of(env)[0][1], *signals_of(env))
    assert not hasattr(ResidualPolicy(Adds(), plain), "model_output")


def test_catalogue_has_an_entry_for_every_preset():
    known = {key for key in configs.presets() if "residual" not in key[2]}
    files = {
        (f"PAM/{entry.file.split('.')[0]}", entry.file.split(".")[1]): entry
        for entry in catalogue.OFFERED.values()
    }
    assert set(files) == {
        (env, f"{algo}-{variant}" if variant else algo) for env, algo, variant in configs.presets()
    }
    assert len(files) == len(catalogue.OFFERED) == len(known) + len(RESIDUALS)
    for env, algo, variant in RESIDUALS:
        entry = files[env, f"{algo}-{variant}"]
        corrected = baselines.CONTROLLERS[entry.baseline]
        assert entry.baseline == configs.preset(env, algo, variant).residual.controller
        assert entry.knowledge == corrected.knowledge
        assert set(entry.envs) <= set(corrected.envs)
        assert entry.kind == "residual"
    assert {entry.author for entry in files.values()} == {""}
