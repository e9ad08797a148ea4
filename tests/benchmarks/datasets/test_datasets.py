"""Data sets: the committed sample is what the command writes, and its environment replays it."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("minari")
pytest.importorskip("h5py")

from agents.offline.data import DataSet
from agents.settings import seeds
from benchmarks.datasets import behaviours, generate, recording
from benchmarks.datasets.behaviours import CLASSICAL, KINDS
from benchmarks.scenarios import scenario as scenarios
from sweeps.progress import unnoticed

SAMPLE = Path(recording.__file__).parent / "sample/PAM/MusclePositioning"
ENV = "PAM/MusclePositioning-v0"
SETTINGS = {"steps": 400, "noise": 0.05, "episode_seconds": 2.0}


@pytest.fixture(params=KINDS)
def sample(request) -> DataSet:
    return DataSet(SAMPLE / f"{request.param}-v0")


@pytest.mark.parametrize("kind", ["random", "classical", "excitation"])
def test_command_writes_the_committed_sample(kind, tmp_path):
    order = generate.Order(ENV, (kind,), **SETTINGS)
    (made,) = generate.generate(order, tmp_path, unnoticed)
    committed = DataSet(SAMPLE / f"{kind}-v0")
    pairs = zip(DataSet(made).episodes(), committed.episodes(), strict=True)
    for new, old in pairs:
        assert (new.seed, new.split, new.parameters) == (old.seed, old.split, old.parameters)
        for part in ("observations", "actions", "infos"):
            one, other = getattr(new, part), getattr(old, part)
            assert one.keys() == other.keys()
            assert all(np.array_equal(one[name], other[name]) for name in one)
        assert np.array_equal(new.rewards, old.rewards)


def test_recovered_environment_replays_the_recorded_actions(sample):
    env = sample.minari.recover_environment()
    for episode in sample.minari.iterate_episodes():
        label = next(iter(sample.minari.storage.get_episode_metadata([episode.id])))
        observation, _ = env.reset(seed=int(label["seed"]))
        seen, rewards = [observation], []
        for action in episode.actions:
            observation, reward, terminated, truncated, _ = env.step(action)
            seen.append(observation)
            rewards.append(reward)
        assert np.array_equal(seen, episode.observations)
        assert np.array_equal(rewards, episode.rewards)
        assert (terminated, truncated) == (episode.terminations[-1], episode.truncations[-1])


def test_columns_are_si_and_within_the_ranges_of_their_signals(sample):
    for episode in sample.episodes():
        for signals, columns in (
            (sample.signals, episode.observations),
            (sample.action_signals, episode.actions),
        ):
            for signal in signals:
                values, slack = columns[signal.name], 1e-6 * (signal.high - signal.low)
                assert not signal.normalized
                assert values.min() >= signal.low - slack and values.max() <= signal.high + slack
        true, read = episode.infos["output"], episode.observations["contraction"]
        assert np.abs(true - read).max() < 1e-3  # m: noise and bias of the sensor


def test_drawn_parameters_are_within_their_ranges_and_give_the_split(sample):
    ranges = sample.metadata["parameter_ranges"]
    assert "regulator.time_constant" in ranges
    for number, episode in enumerate(sample.episodes()):
        assert episode.parameters.keys() == ranges.keys()
        assert all(ranges[n][0] <= v <= ranges[n][1] for n, v in episode.parameters.items())
        drawn = recording.Drawn(episode.parameters, ranges)
        assert drawn.split(number) == episode.split


def test_box_of_training_holds_its_share_of_the_plants():
    random = np.random.default_rng(0)
    ranges = {name: (1.0, 3.0) for name in "abcde"}
    drawn = [
        recording.Drawn(dict(zip(ranges, v, strict=True)), ranges)
        for v in random.uniform(1.0, 3.0, (4000, 5))
    ]
    splits = [one.split(k) for k, one in enumerate(drawn)]
    assert splits.count("test") / 4000 == pytest.approx(1.0 - recording.INSIDE, abs=0.02)
    assert splits.count("validation") / 4000 == pytest.approx(0.1 * recording.INSIDE, abs=0.015)
    inside = [one for one, split in zip(drawn, splits, strict=True) if split != "test"]
    assert max(abs(v - 2.0) for one in inside for v in one.values.values()) < 1.0


def test_controller_tracks_better_than_random_actions(tmp_path):
    order = generate.Order(ENV, ("random", "classical"), **{**SETTINGS, "steps": 6400})
    folders = generate.generate(order, tmp_path, unnoticed)
    random, classical = (DataSet(folder).metadata["scores"] for folder in folders)
    assert classical["rms"] < 0.7 * random["rms"]
    assert classical["return"] > random["return"]


def test_croissant_describes_files_and_columns(sample):
    made = json.loads((sample.folder / "croissant.json").read_text())
    assert made["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    for file in made["distribution"]:
        content = (sample.folder / file["contentUrl"]).read_bytes()
        assert file["sha256"] == hashlib.sha256(content).hexdigest()
    steps, drawn = made["recordSet"]
    names = [field["name"] for field in steps["field"]]
    assert names[: len(sample.signals)] == [f"observations/{s.name}" for s in sample.signals]
    units = {field["name"]: field["description"] for field in steps["field"]}
    assert units["observations/pressure"].startswith("pressure [Pa], 0 to 6")
    assert set(sample.metadata["parameter_ranges"]) < {field["name"] for field in drawn["field"]}


def test_croissant_is_valid():
    croissant = pytest.importorskip("mlcroissant")  # pip install mlcroissant
    made = croissant.Dataset(jsonld=SAMPLE / "expert-v0/croissant.json")
    assert made.metadata.name == "PAM-MusclePositioning-expert-v0"


def test_seeds_of_data_sets_are_apart_from_all_others():
    last = len(KINDS) - 1
    first, *_, most = [
        *seeds.dataset(0, 0, 1),
        *seeds.dataset(last, seeds.MOST_DATA - 1, 1),
    ]
    assert seeds.TUNING + seeds.MOST_TUNING <= first < most < seeds.TRAINING
    with pytest.raises(ValueError, match="at most 10000 episodes"):
        seeds.dataset(0, seeds.MOST_DATA, 1)


def test_other_settings_in_the_folder_are_refused(tmp_path):
    list(generate.generate(generate.Order(ENV, ("random",), **SETTINGS), tmp_path, unnoticed))
    again = list(
        generate.generate(generate.Order(ENV, ("random",), **SETTINGS), tmp_path, unnoticed)
    )
    assert again == [tmp_path / "PAM/MusclePositioning/random-v0"]
    longer = generate.Order(ENV, ("random",), **{**SETTINGS, "steps": 600})
    with pytest.raises(ValueError, match="data of other settings"):
        list(generate.generate(longer, tmp_path, unnoticed))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"kinds": ("expret",)}, "did you mean 'expert'"),
        ({"steps": 0}, "steps = 0 is below 1"),
        ({"noise": 2.0}, "noise = 2 must be from 0 to 1"),
    ],
)
def test_wrong_orders_are_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        generate.Order(**{"env": ENV, "kinds": KINDS, **SETTINGS, **wrong})


def test_every_environment_has_a_classical_behaviour():
    assert {made.env for made in scenarios.available().values()} <= CLASSICAL.keys()


def test_excitation_covers_range_and_frequencies():
    plan = behaviours.excitation(0.01)
    signals = plan(np.random.default_rng(0), 4000, 60).T
    assert np.abs(signals).max() <= behaviours.RANGE + 1e-12
    assert np.mean(np.ptp(signals, axis=1)) > 1.2
    power = np.mean(np.abs(np.fft.rfft(signals - signals.mean(1, keepdims=True))) ** 2, axis=0)
    frequency = np.fft.rfftfreq(4000, 0.01)
    share = power[(frequency > 0.05) & (frequency < 6.0)].sum() / power.sum()
    assert share > 0.8


def test_noise_is_added_to_half_of_the_episodes():
    plan = behaviours.noise(0.1)
    drawn = [plan(np.random.default_rng(k), 500, 1) for k in range(200)]
    noisy = [one for one in drawn if one.any()]
    assert 70 < len(noisy) < 130
    assert np.std(noisy) == pytest.approx(0.1, rel=0.05)
