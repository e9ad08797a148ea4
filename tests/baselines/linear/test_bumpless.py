"""Bumpless transfer: matrix inequality, exactness on its model, transfer, windup."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from baselines.knee.published import printed_bumpless, printed_controller, printed_plant
from baselines.linear.bumpless import (
    SMALLEST,
    Bumpless,
    BumplessGains,
    BumplessState,
    certificate,
    design_bumpless,
    make_bumpless,
)
from baselines.linear.systems import discrete, from_polynomials

pytest.importorskip("cvxpy")
PLANT, GAINS = printed_bumpless()
PERIOD = 0.01
NONE = BumplessGains(np.zeros(7))


def compensated(low: float = -200.0, high: float = 250.0, gains: BumplessGains = GAINS) -> Bumpless:
    return make_bumpless(PLANT, printed_controller(), PERIOD, low, high, gains)


def simulated(
    loop: Bumpless, reference: Callable[[int], float], steps: int, charged_from: int = 0
) -> tuple[np.ndarray, np.ndarray, BumplessState]:
    """Return commands, outputs and last state of a loop on the plant; before charge, commands 0."""
    rig = discrete(PLANT, PERIOD, "zoh")
    inside, state, commands, outputs = rig.initial_state(), loop.initial_state(), [], []
    for k in range(steps):
        measured = float(inside @ rig.c)
        own = float(loop.output(reference(k), measured, state))
        command = own if k >= charged_from else 0.0
        state = loop.advance(reference(k), measured, command, state)
        inside = rig.advance(command, inside)
        commands.append(command)
        outputs.append(measured)
    return np.array(commands), np.array(outputs), state


def switched(loop: Bumpless, offset: float) -> tuple[float, float]:
    """Swing with a reference that is off by ``offset`` [N], then stance on the true one, from 2 s.

    Returns the largest tension error [N] and jump of the pressure [kPa] after the switch.
    """
    commands, outputs, _ = simulated(loop, lambda k: offset if k < 200 else 0.0, 600, 200)
    return np.abs(outputs[200:]).max(), abs(commands[200] - commands[199])


def test_transient_of_a_switch_with_a_mismatch_of_10_newton():
    with_error, with_jump = switched(compensated(), 10.0)
    plain_error, plain_jump = switched(compensated().without(), 10.0)
    assert with_error < 15.0
    assert plain_error > 40.0
    assert with_jump < 10.0 < 150.0 < plain_jump


def test_switch_without_mismatch_has_no_transient():
    assert switched(compensated(), 0.0) == (0.0, 0.0)
    assert switched(compensated().without(), 0.0) == (0.0, 0.0)


def test_active_unlimited_compensator_equals_the_plain_controller():
    loop = compensated(-1e9, 1e9, NONE)
    (ours, _, state), (plain, _, _) = (
        simulated(one, lambda k: 20.0 * np.sin(0.03 * k), 300) for one in (loop, loop.without())
    )
    np.testing.assert_allclose(ours, plain, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(state.model, np.zeros(7))


def test_off_line_controller_sees_its_fictitious_loop():
    """On its own model the fictitious loop is the real one, whatever another controller does."""
    loop, rig = compensated(gains=NONE), discrete(PLANT, PERIOD, "zoh")
    idle, real = loop.initial_state(), loop.initial_state()
    foreign, own = rig.initial_state(), rig.initial_state()
    pressures = np.random.default_rng(0).uniform(-100.0, 100.0, 300)
    for k, pressure in enumerate(pressures):
        reference = 10.0 * np.cos(0.02 * k)
        idle_sees = float(foreign @ rig.c) - float(idle.model @ rig.c)
        assert idle_sees == pytest.approx(float(own @ rig.c), abs=1e-6)
        command = float(loop.output(reference, float(own @ rig.c), real))
        real = loop.advance(reference, float(own @ rig.c), command, real)
        idle = loop.advance(reference, float(foreign @ rig.c), pressure, idle)
        own, foreign = rig.advance(command, own), rig.advance(pressure, foreign)


def test_limits_cause_no_windup_of_the_controller():
    def time_back(loop: Bumpless) -> int:
        # 100 N needs 135 kPa, the limit is 50
        commands, outputs, _ = simulated(loop, lambda k: 100.0 if k < 300 else 0.0, 800)
        assert np.abs(commands).max() <= 50.0
        return int(np.sum(np.abs(outputs[300:]) > 5.0))

    limited = compensated(-50.0, 50.0)
    assert time_back(limited) < 150 < 300 < time_back(limited.without())


def test_rows_are_independent():
    loop = compensated()
    rows, one = loop.initial_state(3), loop.initial_state()
    rng = np.random.default_rng(1)
    for _ in range(40):
        reference, measured, applied = rng.normal(0.0, 20.0, (3, 3))
        many = loop.output(reference, measured, rows)
        single = loop.output(reference[1], measured[1], one)
        assert many[1] == pytest.approx(float(single), rel=1e-9, abs=1e-9)
        rows = loop.advance(reference, measured, applied, rows)
        one = loop.advance(reference[1], measured[1], applied[1], one)


def test_direct_gain_acts_only_as_a_factor_of_the_state_gain():
    half = BumplessGains(GAINS.state_gain / (1.0 - GAINS.direct_gain), 0.0)
    one, other = compensated(), compensated(gains=half)
    state = one.initial_state()._replace(model=np.linspace(1.0, 1e6, 7))
    assert one.output(5.0, 0.0, state) == other.output(5.0, 0.0, state)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: replace(compensated(), model=discrete(PLANT, 0.02, "zoh")), "period is 0.01"),
        (lambda: replace(compensated(), low=300.0), "low is 300.0"),
        (lambda: BumplessGains(np.zeros(7), 1.0), "direct_gain is 1"),
        (lambda: design_bumpless(from_polynomials([1.0], [1.0, -1.0])), "must be stable"),
    ],
)
def test_inconsistent_parts_and_unstable_plants_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("decay", [0.0, 1.0, 3.0, 4.05])
def test_printed_gains_satisfy_the_inequality(decay):
    assert certificate(PLANT, GAINS, decay) > SMALLEST


def test_no_gains_satisfy_the_inequality_beyond_the_slowest_pole():
    assert certificate(PLANT, GAINS, 4.06) < SMALLEST
    with pytest.raises(ValueError, match=r"below 4\.055"):
        design_bumpless(printed_plant(), 4.06)


def test_destabilising_gains_violate_the_inequality():
    plant = printed_plant()
    gains = BumplessGains(5.0 * plant.C[0] / plant.dcgain())
    assert np.max(np.linalg.eigvals(plant.A + plant.B * gains.feedback).real) > 0.0
    assert certificate(plant, gains) < SMALLEST


@pytest.mark.parametrize("decay", [0.0, 3.0, 4.05])
def test_design_satisfies_its_own_inequality(decay):
    plant = printed_plant()
    gains = design_bumpless(plant, decay)
    assert certificate(plant, gains, decay) > SMALLEST
    poles = np.linalg.eigvals(plant.A + plant.B * gains.feedback)
    assert np.max(poles.real) < -decay


def test_designed_gains_act_like_the_printed_ones():
    plant = printed_plant()
    ours = make_bumpless(plant, printed_controller(), PERIOD, -200.0, 250.0)
    assert switched(ours, 10.0) == pytest.approx(switched(compensated(), 10.0), rel=0.02)
