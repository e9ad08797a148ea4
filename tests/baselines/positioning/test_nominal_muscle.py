"""The nominal muscle by rows agrees with the plant's own operators."""

import numpy as np
import pytest

from baselines.positioning.nominal import Nominal
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.pneumatics.regulator import regulator_step


@pytest.fixture(
    params=["maxwell_slip", "preisach", "maxwell_slip_length", "preisach_length", "none"]
)
def plant(request):
    return SingleMuscle.mas10(request.param)


PATH = np.concatenate([np.linspace(0, 5.5e5, 9), np.linspace(5e5, 1e5, 7), [3e5, 2e5, 4e5, 3.5e5]])


def test_nominal_hysteresis_equals_that_of_the_plant(plant):
    muscle, own = Nominal(plant).at(2.55), plant.hysteresis_inverse(2.55)
    state, theirs = muscle.hysteresis.initial(1), own.initial_state((1,))
    for pressure in PATH:
        drive, state = muscle.advance(np.array([pressure]), state)
        expected, theirs = own.drive(np.array([pressure]), theirs)
        np.testing.assert_allclose(drive, expected, rtol=1e-12, atol=1e-6)
        desired = drive + np.array([2e4])
        np.testing.assert_allclose(
            muscle.pressure_for(desired, state), own.pressure(desired, theirs)[0], rtol=1e-9
        )


def test_inverse_cancels_the_hysteresis_at_any_history(plant):
    muscle = Nominal(plant).at(4.55)
    state = muscle.hysteresis.initial(1)
    for pressure in PATH:
        _, state = muscle.advance(np.array([pressure]), state)
        for target in (1e5, 2.7e5, 4e5):
            found = muscle.pressure_for(np.array([target]), state)
            assert muscle.advance(found, state)[0] == pytest.approx(target, abs=1e-3)


def test_nominal_static_curve_equals_that_of_the_plant(plant):
    muscle, drive = Nominal(plant).at(4.55), np.linspace(1e3, 5.9e5, 77)
    np.testing.assert_allclose(
        muscle.contraction_at(drive), plant.contraction_at(drive, 4.55), atol=1e-7
    )
    np.testing.assert_allclose(
        muscle.drive_for(muscle.contraction_at(drive)), drive, rtol=0, atol=10.0
    )


def test_first_measurement_explains_the_history(plant):
    muscle = Nominal(plant).at(2.55)
    peak, now = np.array([5e5, 3e5, 2e5]), np.array([2e5, 2.5e5, 2e5])
    _, truth = muscle.advance(peak, muscle.hysteresis.initial(3))
    drive, truth = muscle.advance(now, truth)
    state = muscle.explain(muscle.contraction_at(drive), now)
    for target in (1.2e5, 2.8e5):
        desired = np.full(3, target)
        np.testing.assert_allclose(
            muscle.pressure_for(desired, state), muscle.pressure_for(desired, truth), atol=200.0
        )


def test_nominal_regulator_equals_that_of_the_plant(plant):
    nominal, law = Nominal(plant), plant.regulator
    pressure = np.array([1e5, 1e5, 4e5, 2e5, 5e5])
    target = np.array([1.05e5, 5e5, 0.0, 2e5, 4.65e5])
    lag, slew = law.time_constant, law.slew_rate
    expected = [
        regulator_step(p, u, lag, 1.0 / lag, slew, 1.0 / slew, plant.control_period)
        for p, u in zip(pressure, target, strict=True)
    ]
    np.testing.assert_allclose(nominal.next_pressure(pressure, target), expected, rtol=1e-12)
