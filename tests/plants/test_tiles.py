"""Plants in one batch: compatibility and memory layout."""

from types import SimpleNamespace as Plant

import numpy as np
import pytest

from pam_envs.plants.core.rollout import drives_of, first_of, in_tiles, run
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import loop_of


def plant(kind: str, substeps: int = 4) -> Plant:
    return Plant(
        hysteresis=Plant(kind=kind), substeps=substeps, load=np.random.default_rng(0).random()
    )


def test_first_of_plants_with_equal_options_is_returned() -> None:
    several = [plant("preisach"), plant("preisach")]
    assert first_of(several, "hysteresis.kind", "substeps") is several[0]


def test_plants_with_differing_options_and_empty_lists_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"one variant \(hysteresis.kind, substeps\), got .*'preisach', 5"
    ):
        first_of([plant("preisach"), plant("preisach", 5)], "hysteresis.kind", "substeps")
    with pytest.raises(ValueError, match="no plants are given"):
        first_of([], "substeps")


def test_tiles_arrange_sets_by_lane_and_repeat_the_last() -> None:
    sets = np.arange(15.0).reshape(5, 3)
    tiles = in_tiles(sets, 5, 4)
    assert tiles.shape == (2, 3, 4)
    assert tiles.flags.c_contiguous
    np.testing.assert_array_equal(tiles[0].T, sets[:4])
    np.testing.assert_array_equal(tiles[1].T, sets[[4, 4, 4, 4]])


@pytest.mark.parametrize(
    "effect",
    [
        {"regulator.dead_band": 2e4, "regulator.dead_close": 0.3},
        {"regulator.supply_pressure": 4e5, "regulator.supply_droop": 0.3, "regulator.leak": 0.5},
        {"regulator.ring_share": 0.4},
        {"hysteresis.creep_1": 0.1, "hysteresis.creep_2": 0.2},
    ],
)
@pytest.mark.parametrize("kind", ["maxwell_slip", "maxwell_slip_length"])
def test_plant_has_the_same_bits_beside_plants_with_other_dead_times(
    kind: str, effect: dict[str, float]
) -> None:
    plants = [
        SingleMuscle.mas10(kind).replace({**effect, "regulator.dead_time": time})
        for time in (0.02, 0.0413, 0.0552, 0.0287)
    ]
    setpoints = np.repeat(np.random.default_rng(0).uniform(0.0, 4e5, 40), 3)
    drives, loop = drives_of([setpoints, 1.0, 293.15, 0.0, 0.0]), loop_of(plants[0], True)
    sets = [plant.parameter_rows() for plant in plants]
    together = run(loop, plants[0], sets, drives, plants=4, lanes=4, compiled=False)
    for k, own in enumerate(sets):
        alone = run(loop, plants[0], [own], drives, lanes=1, compiled=False)
        assert np.array_equal(together[:, :, k], alone[:, :, 0])


def test_pressure_behind_a_regulator_does_not_depend_on_the_hysteresis() -> None:
    day = {"regulator.leak": 0.3, "regulator.supply_pressure": 5e5, "regulator.supply_droop": 0.1}
    setpoints = np.repeat(np.random.default_rng(1).uniform(-1e5, 4e5, 30), 4)
    drives = drives_of([setpoints, 1.0, 293.15, 0.0, 0.0])
    pressures = []
    for kind in ("maxwell_slip", "maxwell_slip_length", "none"):
        plants = [
            SingleMuscle.mas10(kind).replace({**day, "regulator.dead_time": time})
            for time in (0.0, 0.02, 0.0413, 0.0552, 0.08)
        ]
        sets = [plant.parameter_rows() for plant in plants]
        made = run(
            loop_of(plants[0], True), plants[0], sets, drives, plants=5, lanes=5, compiled=False
        )
        pressures.append(made[2])
    assert np.ptp(pressures[0]) > 1e5
    assert np.array_equal(pressures[0], pressures[1]) and np.array_equal(pressures[0], pressures[2])
