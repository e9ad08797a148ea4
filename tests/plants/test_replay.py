"""Replay of a recording: bits independent of the other lanes."""

import numpy as np
import pytest

from pam_envs.kernels.build import COMPILED
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import TILE, Inputs, alike, replay, replay_rows
from tests.envs.positioning.variants import EVERY_EFFECT

SAMPLES = 200 if COMPILED else 60
PERIOD = 0.02
PLANT = SingleMuscle.mas10("maxwell_slip").replace(
    {"regulator.dead_time": 0.0, "regulator.slew_rate": 1e9}
)


def inputs(samples: int = SAMPLES) -> Inputs:
    random = np.random.default_rng(4)
    command = np.repeat(random.uniform(0.0, 6e5, samples // 10), 10)
    command[40:50] = -1.0  # the valve is shut
    fresh = np.arange(samples) == 0
    return Inputs(
        PERIOD,
        command,
        np.repeat([1.5, 3.0], samples // 2),
        np.linspace(293.15, 300.0, samples),
        fresh,
        np.zeros(samples),
        np.zeros(samples, bool),
    )


def test_replay_does_not_depend_on_the_plants_beside_it() -> None:
    plants = [PLANT] + [PLANT.replace({name: value}) for name, value in EVERY_EFFECT.items()]
    plants.append(PLANT.replace(EVERY_EFFECT))
    columns = np.stack([p.parameter_rows() for p in plants])
    assert len(columns) > 2 * TILE
    together = replay_rows(PLANT, columns, inputs())
    alone = [replay(p, inputs()) for p in plants]
    for lane, shown in enumerate(alone):
        assert np.array_equal(together[0, :, lane], shown["contraction"]), plants[lane]
        assert np.array_equal(together[1, :, lane], shown["pressure"])
    moved = [float(np.abs(together[:, :, k] - together[:, :, 0]).max()) for k in range(len(plants))]
    assert np.isfinite(together).all() and sum(m > 0.0 for m in moved) > 30


def test_every_column_is_replayed_once() -> None:
    columns = np.stack(
        [PLANT.replace({"mass.stick": s}).parameter_rows() for s in (0.0, 2.0, 0.0, 1.0)]
    )
    assert [group.tolist() for group in alike(columns)] == [[0, 2], [1, 3]]


@pytest.mark.parametrize("name", ["regulator.slew_bend", "hysteresis.pressure_slope", "mass.slack"])
def test_effect_that_is_off_changes_no_bit(name: str) -> None:
    off = PLANT.replace({"mass.ring_share": 0.0, name: 0.0})
    a, b = replay(PLANT, inputs()), replay(off, inputs())
    assert all(np.array_equal(a[k], b[k]) for k in a)


def test_closed_valve_keeps_the_pressure() -> None:
    shown = replay(PLANT, inputs())["pressure"]
    assert len(set(shown[41:51].tolist())) == 1
    assert shown[51] != shown[50]
    leaky = replay(PLANT.replace({"regulator.leak": 0.5}), inputs())["pressure"]
    assert leaky[50] == pytest.approx(leaky[41] * np.exp(-0.5 * 9 * PERIOD), rel=1e-9)
