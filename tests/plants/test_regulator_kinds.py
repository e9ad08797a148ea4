"""Regulators with a characteristic, a lag of the rate, an integral part or a bent opening."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate
from pam_envs.pneumatics.flow import valve_opening

LAG, RATE, FULL = 0.05, 3e6, 6e5
PLAIN = SingleMuscle.mas10("none").replace(
    {"regulator.dead_time": 0.0, "regulator.slew_rate": 1e9, "regulator.time_constant": LAG}
)
SPEEDS = {2: 0.8, 6: 0.6, 20: 0.4, 60: 0.25}


def pressures(changes: dict[str, float], command: Any) -> Any:
    """Return the pressures [Pa] after each period of a command [Pa], shape (T,)."""
    return simulate(PLAIN.replace(changes), command)["pressure"]


def steps(*levels: float) -> Any:
    """Return a command [Pa] with a second at each level."""
    return np.repeat(levels, round(1.0 / PLAIN.control_period))


def solved(rates: Any, command: Any, state: Any) -> Any:
    """Return the pressures [Pa] of equations written out beside the kernels, shape (T,)."""
    period, made = PLAIN.control_period, []
    for target in command:
        found = solve_ivp(rates, (0.0, period), state, "LSODA", rtol=1e-8, atol=1.0, args=(target,))
        state = found.y[:, -1]
        state[0] = max(0.0, state[0])
        made.append(state[0])
    return np.array(made)


def test_rate_follows_the_characteristic() -> None:
    command = steps(4e5, 1e5, 1.1e5, 5.5e5)
    shares, speeds = [0.0, *(k / 100 for k in SPEEDS)], [1.0, *SPEEDS.values()]

    def rates(_: float, p: Any, target: float) -> Any:
        error = target - p[0]
        return [error / LAG * np.interp(abs(error) / FULL, shares, speeds)]

    made = pressures({f"regulator.speed_{k}": v for k, v in SPEEDS.items()}, command)
    expected = solved(rates, command, np.zeros(1))
    assert np.abs(made - pressures({}, command)).max() > 2e4
    np.testing.assert_allclose(made, expected, atol=1.5e3)


@pytest.mark.parametrize("slower", [1.0, 0.4])
@pytest.mark.parametrize("late", [0.02, 0.1])
def test_rate_lags_within_its_limits(late: float, slower: float) -> None:
    command, most = steps(4e5, 1e5, 1.1e5, 5.5e5), 1e6

    def rates(_: float, state: Any, target: float) -> Any:
        p, rate = state[0], np.clip(state[1], -slower * most, most)
        more = ((target - p) / LAG - rate) / late
        held = state[1] != rate and more * rate > 0.0
        return [rate, 0.0 if held else more]

    limit = {"regulator.slew_rate": most, "regulator.slew_ratio": slower}
    made = pressures(limit | {"regulator.rate_lag": late}, command)
    expected = solved(rates, command, np.zeros(2))
    assert np.abs(made - pressures(limit, command)).max() > 7e3
    np.testing.assert_allclose(made, expected, atol=300.0)


@pytest.mark.parametrize("band", [5e3, 2e4])
def test_a_valve_that_closes_ends_the_lagged_rate(band: float) -> None:
    made = pressures(
        {"regulator.rate_lag": 0.05, "regulator.dead_band": band}, steps(4e5, 1e5, 4e5)
    )
    second = len(made) // 3
    for k, (side, target) in enumerate(((-1.0, 4e5), (1.0, 1e5), (-1.0, 4e5))):
        rest = made[(k + 1) * second - 20 : (k + 1) * second]
        np.testing.assert_allclose(rest, target + side * band, rtol=1e-9)


@pytest.mark.parametrize(
    "hardly", [{"slew_bend": 1e-9}, {"supply_pressure": 1.9e7}, {"exhaust_rate": 99.0}]
)
def test_further_limits_change_the_lagged_rate_gradually(hardly: dict[str, float]) -> None:
    command = steps(4e5, 1e5)
    late = {"regulator.rate_lag": 0.05, "regulator.slew_rate": 2e6}
    more = {f"regulator.{name}": value for name, value in hardly.items()}
    np.testing.assert_allclose(pressures(late | more, command), pressures(late, command), atol=20.0)


@pytest.mark.parametrize("slow", [{"integral": 50.0}, {"rate_lag": 0.2}])
def test_tapered_exhaust_above_full_pressure_stays_an_exhaust(slow: dict[str, float]) -> None:
    changes = {"exhaust_ratio": 20.0, "exhaust_taper": 1.0} | slow
    made = pressures({f"regulator.{n}": v for n, v in changes.items()}, steps(FULL, FULL))
    assert made.max() > 1.02 * FULL  # it overshoots
    assert np.abs(np.diff(made)).max() < 1.3e5


def test_a_shut_valve_ends_the_lagged_rate() -> None:
    shut = np.concatenate([np.full(4, 4e5), np.full(30, -1.0)])
    made = pressures({"regulator.rate_lag": 0.1}, shut)
    np.testing.assert_allclose(made[4:], made[4], rtol=1e-12)


@pytest.mark.parametrize("slower", [1.0, 1.6])
def test_integral_part_overshoots_and_settles_on_the_setpoint(slower: float) -> None:
    command, gain, release = steps(4e5, 1e5, 1.1e5, 5.5e5), 50.0, 2.0

    def rates(_: float, state: Any, target: float) -> Any:
        error = target - state[0]
        wanted = error / LAG + state[1]
        wanted = wanted if wanted > 0.0 else wanted / slower
        rate = np.clip(wanted, -RATE, RATE)
        return [rate, gain * error + (rate - wanted) / release]

    changes = {"regulator.integral": gain, "regulator.integral_release": release}
    changes |= {"regulator.exhaust_ratio": slower, "regulator.slew_rate": RATE}
    made = pressures(changes, command)
    expected = solved(rates, command, np.zeros(2))
    second = len(command) // 4
    assert made[:second].max() > 4.05e5 and made[second : 2 * second].min() < 0.95e5
    np.testing.assert_allclose(made, expected, atol=2.5e3)


def test_integral_part_starts_again_behind_a_shut_valve() -> None:
    gain, n = {"regulator.integral": 50.0}, len(steps(0.0))
    shut = np.concatenate([np.full(10, 4e5), np.full(30, -1.0), steps(4e5)])
    made = pressures(gain, shut)
    held = made[10:40]
    np.testing.assert_allclose(held, held[0], rtol=1e-12)
    plain = pressures({}, np.concatenate([np.full(40, made[39]), steps(4e5)]))
    assert made[-n] == pytest.approx(plain[-n], rel=0.02)  # the integral is 0 when it opens


@pytest.mark.parametrize("bend", [-0.5, 0.0, 1.0])
def test_opening_bends_between_shut_and_fully_open(bend: float) -> None:
    shut, half, full = (valve_opening(1e5, 1e5 + e, 0.0, 1e-4, bend) for e in (0.0, 5e3, 2e4))
    assert (shut, full) == (0.0, 1.0)
    assert half == pytest.approx(0.5 * (1.0 - 0.5 * bend))
    assert valve_opening(1e5, 9.5e4, 0.0, 1e-4, bend) == pytest.approx(-half)
