"""FMUs: validity, equal bits, parameters, states, refusals."""

import itertools
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.exported import FmuModel, differing, expected, run_fmu
from pam_envs.export.fmu import export_fmu

pytestmark = pytest.mark.xdist_group("exported_fmu")  # each unit is built once

fmpy = pytest.importorskip("fmpy")

NAMES = ("{}.fmu", "{}_fmi2.fmu")


@pytest.fixture(scope="module")
def exported(case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the FMUs of an environment."""
    folder = tmp_path_factory.mktemp("fmu")
    export_fmu(case.model, folder)
    return folder


@pytest.fixture(scope="module", params=NAMES)
def muscle(small, request, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the muscle's FMU, loaded, of each version of FMI."""
    folder = tmp_path_factory.mktemp("muscle")
    export_fmu(small.model, folder)
    numbers = itertools.count()  # a folder for each, whose library stays mapped
    return lambda: FmuModel(
        small.model, folder / request.param.format(small.model.name), folder / str(next(numbers))
    )


@pytest.mark.parametrize("name", NAMES)
def test_fmu_is_valid_and_has_the_bits_of_python(case, exported: Path, name: str) -> None:
    from fmpy.validation import validate_fmu

    path = exported / name.format(case.model.name)
    assert validate_fmu(str(path)) == []
    assert differing(run_fmu(case.model, path, case.actions), case.reference) == 0


def test_simulation_with_fmpy_runs(small, tmp_path: Path) -> None:
    export_fmu(small.model, tmp_path)
    found = fmpy.simulate_fmu(
        str(tmp_path / f"{small.model.name}.fmu"),
        stop_time=0.5,
        output_interval=small.model.period,
        output=["observation.contraction", "info.state.pressure"],
        start_values={"seed": 5},
    )
    assert len(found) == 51
    assert np.ptp(found["info.state.pressure"]) > 0.0


def test_parameters_change_the_plant_as_in_python(small, muscle) -> None:
    env: Any = gym.make("PAM/MusclePositioning-v0").unwrapped
    plant = env.plant.replace({"mass.damping": 300.0, "muscle.stiffness": 1.2e4})
    other = gym.make("PAM/MusclePositioning-v0", plant=plant)
    made, actions = muscle(), small.actions[:40]
    made.start(3, mass__damping=300.0, muscle__stiffness=1.2e4)
    rows = [made.outputs()]
    for action in actions:
        made.step(action)
        rows.append(made.outputs())
    made.close()
    assert differing(np.array(rows), expected(other, actions, 3)) == 0
    assert differing(np.array(rows), expected(env, actions, 3)) > 0


def test_restored_state_repeats_the_steps(small, muscle) -> None:
    made = muscle()
    made.start(3)
    for action in small.actions[:20]:
        made.step(action)
    save = made.slave.getFMUState if made.three else made.slave.getFMUstate
    restore = made.slave.setFMUState if made.three else made.slave.setFMUstate
    state = save()

    def run() -> list[list[float]]:
        rows = []
        for action in small.actions[20:40]:
            made.step(action)
            rows.append(made.outputs())
        return rows

    first = run()
    restore(state)
    assert run() == first
    made.close()


def test_value_out_of_bounds_is_refused(muscle) -> None:
    made = muscle()
    with pytest.raises(Exception, match=r"Set(Float64|Real) failed"):
        made.start(3, mass__damping=-1.0)


def test_step_that_is_no_multiple_of_the_period_is_refused(small, muscle) -> None:
    made = muscle()
    made.start(3)
    with pytest.raises(Exception, match="DoStep failed"):
        made.slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.0123)
