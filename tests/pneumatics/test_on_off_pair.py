"""On/off valves: opening times, mass flow, pressures of the chamber."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY, REFERENCE_DENSITY
from pam_envs.pneumatics.flow import mass_flow
from pam_envs.pneumatics.on_off_pair import OnOffValve, coil_window, emptied, filled

VALVE = OnOffValve()
SUPPLY = VALVE.supply_pressure + ATMOSPHERE


def opened(widths: list[float], h: float, gap: float = 0.05) -> list[tuple[float, float]]:
    """Return starts and ends [s] of an open valve, pulses of ``widths`` every ``gap`` s."""
    left, lift, state, spans = 0.0, 0.0, 0.0, list[tuple[float, float]]()
    steps = round(gap / h)
    for k in range(len(widths) * steps):
        if k % steps == 0:
            left = widths[k // steps]
        was = state
        duration, left, lift, state = coil_window(
            left, lift, state, VALVE.opening_time, VALVE.closing_time, h
        )
        if state > 0.5 and was < 0.5:
            spans.append(((k + 1) * h - duration, (k + 1) * h))
        elif was > 0.5:
            spans[-1] = (spans[-1][0], k * h + duration)
        else:
            assert duration == 0.0, "opened and closed within a step: use a shorter one"
    return spans


@pytest.mark.parametrize("h", [2.5e-3, 1e-3, 3.3e-4])
@pytest.mark.parametrize("width", [0.0071, 0.012, 0.03])
def test_valve_opens_5_ms_late_and_closes_4_ms_late(width: float, h: float) -> None:
    spans = opened([width], h)
    assert len(spans) == 1
    assert spans[0] == pytest.approx((5e-3, width + 4e-3), abs=1e-9)


@pytest.mark.parametrize("h", [5e-3, 2.5e-3, 1e-3])
def test_pulse_shorter_than_the_opening_time_does_not_open_the_valve(h: float) -> None:
    assert opened([4.9e-3, 4.9e-3], h) == []


@pytest.mark.parametrize("h", [2.5e-3, 1e-3])
def test_contiguous_pulses_keep_the_valve_open(h: float) -> None:
    assert opened([0.05, 0.05, 0.02], h) == [pytest.approx((5e-3, 0.124), abs=1e-9)]
    two = opened([0.048, 0.02], h)
    assert two == [pytest.approx((5e-3, 0.074), abs=1e-9)]


def test_open_time_does_not_depend_on_the_step() -> None:
    def total(h: float) -> float:
        state, time = (0.0231, 0.0, 0.0), 0.0
        for _ in range(round(0.05 / h)):
            duration, *state = coil_window(*state, 5e-3, 4e-3, h)
            time += duration
        return time

    for h in (0.05, 0.025, 5e-3, 2.5e-3, 1e-4):
        assert total(h) == pytest.approx(0.0231 - 1e-3, abs=1e-12)


def test_flow_follows_iso_6358() -> None:
    c, b = VALVE.conductance, VALVE.critical_ratio
    choked = c * REFERENCE_DENSITY * SUPPLY
    for ratio in (0.0, 0.05, b):
        assert mass_flow(SUPPLY, ratio * SUPPLY, c, b) == pytest.approx(choked, rel=1e-12)
    assert mass_flow(SUPPLY, SUPPLY, c, b) == 0.0
    assert mass_flow(SUPPLY, 1.2 * SUPPLY, c, b) == 0.0
    middle = b + 0.6 * (1.0 - b)
    assert mass_flow(SUPPLY, middle * SUPPLY, c, b) == pytest.approx(0.8 * choked, rel=1e-12)


def test_flow_equals_the_catalogue_figure() -> None:
    """8.4 l/min (ANR) from 0.6 to 0.5 MPa gauge: both printed beside C and b."""
    passed = mass_flow(7e5, 6e5, VALVE.conductance, VALVE.critical_ratio)
    assert 6e4 * passed / REFERENCE_DENSITY == pytest.approx(8.4, abs=0.1)


@pytest.mark.parametrize("muscles", [1, 7])
@pytest.mark.parametrize("fills", [True, False])
def test_long_opening_follows_a_fine_solution(muscles: int, fills: bool) -> None:
    """Steps of 2.5 ms through choked and sub-sonic flow, up to the end of the flow."""
    volume, h = 3e-5 * muscles, 2.5e-3
    per_volume, c, b = PRESSURE_PER_DENSITY / volume, VALVE.conductance, VALVE.critical_ratio

    def rate(_: float, mass: list[float]) -> list[float]:
        pressure = mass[0] * per_volume
        if fills:
            return [mass_flow(SUPPLY, pressure, c, b)]
        return [-mass_flow(pressure, ATMOSPHERE, c, b)]

    start = (ATMOSPHERE if fills else SUPPLY) / per_volume
    end = (1.3 if fills else 2.3) * muscles
    times = np.linspace(0.0, end, 25)
    # the flow ends in finite time, where its slope has no bound
    fine = solve_ivp(rate, (0.0, end), [start], t_eval=times, rtol=1e-8, max_step=1e-3).y[0]
    mass, made = start, [start]
    for _ in range(round(end / h)):
        if fills:
            mass += filled(mass, per_volume, SUPPLY, c, b, h)
        else:
            mass -= emptied(mass, per_volume, c, b, h)
        made.append(mass)
    sampled = np.interp(times, h * np.arange(len(made)), made)
    assert np.max(np.abs(sampled - fine)) * per_volume < 60.0
    assert mass * per_volume == pytest.approx(SUPPLY if fills else ATMOSPHERE, abs=1e-6)


def test_pressure_stays_between_atmosphere_and_supply() -> None:
    per_volume = PRESSURE_PER_DENSITY / 3e-5
    for duration in (1e-3, 1.0, 50.0):
        full = SUPPLY / per_volume
        assert 0.999 * full + filled(0.999 * full, per_volume, SUPPLY, 1e-8, 0.1, duration) <= full
        empty = ATMOSPHERE / per_volume
        assert 1.001 * empty - emptied(1.001 * empty, per_volume, 1e-8, 0.1, duration) >= empty
    assert filled(1.1 * SUPPLY / per_volume, per_volume, SUPPLY, 1e-8, 0.1, 1.0) == 0.0


def test_choked_chamber_empties_exponentially() -> None:
    per_volume, h = PRESSURE_PER_DENSITY / 2e-4, 2.5e-3
    mass = start = 12e5 / per_volume
    for _ in range(80):
        mass -= emptied(mass, per_volume, VALVE.conductance, 0.11, h)
    rate = VALVE.conductance * REFERENCE_DENSITY * per_volume
    expected = start * math.exp(-rate * 0.2)
    assert 0.11 * mass * per_volume > ATMOSPHERE
    assert mass == pytest.approx(expected, rel=1e-6)
