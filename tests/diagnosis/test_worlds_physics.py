"""Simulated worlds: laws, loops and regulators each have the property that names them."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnosis.worlds import WORLDS, Rig, draw_effect, draw_rig, simulate, truth_of
from tests.diagnosis.worlds.laws import LAWS, balance, force
from tests.diagnosis.worlds.loop_draws import DRAWS, Operator
from tests.diagnosis.worlds.loops import SIZE, loop_step, start_loop
from tests.diagnosis.worlds.rig import law_arrays
from tests.diagnosis.worlds.scaling import PLAN, TRIAL_STEP
from tests.diagnosis.worlds.valve import KEYS

LOCKING, RUBBER, CAPPED, DRAWN, HYPERBOLIC = WORLDS[10:15]
FIRST_SEED = 20


def rigs_of(world: str, count: int = 3) -> list[Rig]:
    seeds = range(FIRST_SEED, FIRST_SEED + count)
    return [draw_rig(world, np.random.default_rng(seed), False) for seed in seeds]


def force_of(rig: Rig) -> Callable[[float, float], float]:
    """Return the force [N] as a function of pressure [bar] and strain."""
    q, knots = law_arrays(rig.law, rig.table)
    work = np.zeros((2, 4))
    return lambda p, e: force(rig.law_kind, q, knots, p, e, 25.0, work)


def rest_of(rig: Rig, pressure: float, load: float = 25.0) -> float:
    return balance(rig.law_kind, *law_arrays(rig.law, rig.table), pressure, load)


def steps(levels: list[float], seconds: float = 1.5) -> SimpleNamespace:
    """Plan of held pressures [bar] under 25 N."""
    command = np.repeat(np.array(levels), round(seconds / 0.02))
    return SimpleNamespace(
        command_bar=command,
        segment=np.full(command.size, "steps_a"),
        load_N=np.full(command.size, 25.0),
        temperature_C=np.full(command.size, 20.0),
        valve_closed=np.zeros(command.size, bool),
        period=0.02,
    )


def response(operator: Operator, path: np.ndarray, dt: float = 0.002) -> np.ndarray:
    kind, op = operator[0], np.array(operator[1]).reshape(3, SIZE)
    state, out = np.zeros(SIZE), np.empty(path.size)
    start_loop(kind, op, state, path[0], 0.0)
    for i, u in enumerate(path):
        du = u - path[max(i - 1, 0)]
        out[i] = loop_step(kind, op, state, u, du, du / dt, 1.0)
    return out


@pytest.mark.parametrize("world", WORLDS[10:])
def test_force_falls_with_strain_and_rises_with_pressure(world: str) -> None:
    for rig in rigs_of(world, 8):
        pull = force_of(rig)
        for pressure in np.linspace(0.5, 6.0, 6):
            curve = [pull(pressure, e) for e in np.linspace(-0.02, rest_of(rig, pressure, 0.0), 40)]
            assert np.diff(curve).max() < 0.0
        for strain in (0.0, 0.05, 0.1):
            assert np.diff([pull(p, strain) for p in np.linspace(0.0, 6.0, 30)]).min() > 0.0


def test_braid_stiffens_at_a_kink_within_the_stroke() -> None:
    for rig in rigs_of(LOCKING):
        pull, kink = force_of(rig), rig.law[3]
        before, after = (pull(4.0, e) - pull(4.0, e + 0.005) for e in (kink - 0.02, kink + 0.015))
        assert after > 1.15 * before
        assert rest_of(rig, 0.0) + 0.03 < kink < rest_of(rig, 6.0)


def rubber_energy(q: np.ndarray, pressure: float, strain: float) -> float:
    """Energy of gas and Mooney-Rivlin wall over the length [N]."""
    area, cos2, first, second, thread, share = q[:6]
    long2, pull = (1.0 - share * strain) ** 2, 1.0 + pressure / thread
    hoop2 = (pull * pull - long2 * cos2) / (1.0 - cos2)
    thick2 = 1.0 / (long2 * hoop2)
    wall = first * (long2 + hoop2 + thick2 - 3.0)
    wall += second * (1.0 / long2 + 1.0 / hoop2 + 1.0 / thick2 - 3.0)
    return wall - area * pressure * np.sqrt(long2) * hoop2


def test_rubber_force_is_the_slope_of_its_energy() -> None:
    kind, table, work = LAWS.index("rubber"), np.zeros((14, 16)), np.zeros((2, 4))
    for rig in rigs_of(RUBBER):
        q = np.array(rig.law)
        q[6] = 0.0  # no lock
        for pressure in (0.0, 3.0, 6.0):
            for strain in (0.02, 0.1, 0.18):
                ends = [rubber_energy(q, pressure, strain + h) for h in (-1e-6, 1e-6)]
                slope = (ends[0] - ends[1]) / (2e-6 * q[5])
                got = force(kind, q, table, pressure, strain, 0.0, work)
                assert got == pytest.approx(slope, rel=1e-5, abs=1e-3)


def test_slack_bladder_gains_little_force_from_the_first_pressure() -> None:
    for rig in rigs_of(CAPPED):
        pull = force_of(rig)
        per_bar = [(pull(p + 0.02, 0.0) - pull(p, 0.0)) / 0.02 for p in (0.0, 1.0, 3.0)]
        assert per_bar[0] < 0.4 * per_bar[1]
        assert per_bar[1] == pytest.approx(per_bar[2], rel=0.03)


def test_drawn_isotonic_curve_is_convex_then_concave() -> None:
    for rig in rigs_of(DRAWN):
        rise = np.diff([rest_of(rig, p) for p in np.linspace(0.5, 6.0, 12)])
        top = int(np.argmax(rise))
        assert 3 <= top <= 9
        assert rise[0] < 0.6 * rise[top] and rise[-1] < 0.9 * rise[top]


def test_tendon_adds_its_compliance() -> None:
    for rig in rigs_of(HYPERBOLIC):
        stiff = replace(rig, law=(*rig.law[:4], 1e-9, *rig.law[5:]))
        soft, hard = force_of(rig), force_of(stiff)
        compliance = [0.002 / (f(4.0, 0.05) - f(4.0, 0.052)) for f in (soft, hard)]
        assert compliance[0] > compliance[1] + 0.3 * rig.law[4]


@pytest.mark.parametrize(
    ("name", "n", "error", "most"),
    [
        *((name, 800, 1e-9, 1.1) for name in ("tanh_play", "dead_zone_play")),
        *((name, 1600, 1e-3, 1.15) for name in ("duhem", "ridge_play", "back_stress")),
    ],
)
def test_loops_in_pressure_close_and_never_move_against_their_input(
    name: str, n: int, error: float, most: float
) -> None:
    half = 0.35
    cycle = 3.0 - 3.0 * np.cos(np.linspace(0.0, 2 * np.pi, n + 1))
    for seed in range(6):
        operator = DRAWS[name](np.random.default_rng(seed), half, 0.0)
        path = np.r_[cycle, cycle[1:], cycle[1:]]
        out = response(operator, path)
        assert out[n + 1 : 2 * n + 1] == pytest.approx(out[2 * n + 1 :], abs=error)
        felt = path - half * out
        moves = np.diff(path) * np.diff(felt)
        assert moves.min() > -1e-12
        rises, falling = slice(n + 1, n + n // 2 + 1), out[n + 3 * n // 4 + 1]
        rising = np.interp(3.0, path[rises], out[rises])
        assert 0.6 < 0.5 * (rising - falling) < most


def test_iwan_sliders_follow_masing() -> None:
    length = 200.0
    operator = DRAWS["iwan"](np.random.default_rng(1), 0.3, length)
    up = np.linspace(0.0, 0.1 * length, 4001)
    down = up[::-1]
    out = response(operator, np.r_[up, down[1:]])
    first, back = out[: up.size], out[up.size - 1 :]
    assert first[-1] == pytest.approx(1.0)
    assert first[-1] - back[::2] == pytest.approx(2.0 * first[: back[::2].size], abs=1e-3)


def test_friction_changes_weakly_with_rate() -> None:
    signs = set()
    for seed in range(8):
        operator = DRAWS["rate_weak"](np.random.default_rng(seed), 0.3, 200.0)
        path = np.linspace(0.0, 60.0, 6001)
        slow, fast = (response(operator, path, 0.01 / v)[-1] for v in (1.0, 100.0))
        assert 0.02 < abs(fast - slow) < 0.09
        signs.add(fast > slow)
    assert signs == {True, False}


def test_friction_grows_as_a_root_of_pressure() -> None:
    for rig in rigs_of(RUBBER):
        constant = replace(rig, squeeze_bar=0.0, growth=0.0)
        widths = []
        for chosen in (rig, constant):
            columns = simulate(chosen, [], PLAN, TRIAL_STEP)
            part = np.char.startswith(columns["segment"], "triangle")
            x, p = columns["contraction_mm"][part], columns["pressure_bar"][part]
            top = int(np.argmax(x))
            levels = x.min() + np.array([0.12, 0.9]) * np.ptp(x)
            widths.append(
                np.interp(levels, x[:top], p[:top]) - np.interp(-levels, -x[top:], p[top:])
            )
        assert widths[0][0] < 0.95 * widths[1][0]
        assert widths[0][1] > 1.05 * widths[1][1]


def test_controlled_valve_overshoots_slightly_and_has_no_steady_error() -> None:
    for rig in rigs_of(LOCKING):
        pressure = simulate(rig, [], steps([0.0, 4.0, 1.0], 3.0))["pressure_bar"]
        gain, offset = (rig.valve_value(key) for key in ("gain", "offset_bar"))
        assert pressure[299] == pytest.approx(4.0 * gain + offset, abs=0.005)
        assert 0.005 < pressure[150:300].max() - pressure[299] < 0.12
        assert 0.005 < pressure[449] - pressure[300:].min() < 0.12


def test_pulsed_valve_limits_the_rate_of_large_steps() -> None:
    for rig in rigs_of(RUBBER):
        columns = simulate(rig, [], steps([0.5, 1.0, 0.5, 5.5]))
        pressure = columns["pressure_bar"]
        small, large = (np.diff(pressure[k : k + 60]).max() for k in (75, 225))
        assert large < 5.0 * small  # ten times the step
        assert truth_of(rig)["slew_limit"]


def test_fall_arrives_later_than_rise_through_a_long_tube() -> None:
    for rig in rigs_of(CAPPED):
        values = dict(zip(KEYS, rig.valve, strict=True)) | {"vent_delay_s": 0.06}
        slow = replace(rig, valve=tuple(values.values()))
        plan = steps([1.0, 4.0, 1.0])
        normal, late = (simulate(chosen, [], plan)["pressure_bar"] for chosen in (rig, slow))
        assert np.array_equal(normal[:150], late[:150])
        shift = 0.06 - rig.valve_value("vent_delay_s")
        grid = 0.02 * np.arange(normal.size)
        moved = np.interp(grid - shift, grid, normal)
        assert late[155:200] == pytest.approx(moved[155:200], abs=0.05)
        assert np.abs(late - normal)[150:170].max() > 0.2


def test_steady_offset_of_the_regulator_bends_over_pressure() -> None:
    for rig in rigs_of(DRAWN):
        levels = [0.5, 1.5, 3.0, 4.5, 5.5]
        plan = steps(levels)
        settled = simulate(rig, [], plan)["pressure_bar"][74::75]
        error = settled - np.polyval(np.polyfit(levels, settled, 1), levels)
        assert 0.002 < np.abs(error).max() < 0.03


def test_cascade_starts_without_slope_and_does_not_overshoot() -> None:
    for rig in rigs_of(HYPERBOLIC):
        plan = steps([0.0, 4.0], 2.0)
        pressure = simulate(rig, [], plan)["pressure_bar"][100:]
        rates = np.diff(pressure)
        assert int(np.argmax(rates)) >= 2
        assert rates.min() > -1e-6


@pytest.mark.parametrize("number", [1, 6, 7])
def test_slower_exhaust_of_second_order_regulator_is_independent_of_integration_step(number):
    world, rng = WORLDS[number], np.random.default_rng(FIRST_SEED)
    rig = draw_rig(world, rng, False)
    effect = draw_effect("exhaust_asymmetry", rig, rng)
    fall = steps([5.0, 1.0])

    def delayed(step: float) -> np.ndarray:
        """Pressure that the effect leaves too high [bar]."""
        normal, slower = (
            simulate(rig, pairs, fall, step=step)["pressure_bar"] for pairs in ([], [(effect, 8.0)])
        )
        return slower - normal

    usual, finer = delayed(1e-3), delayed(2.5e-4)
    assert usual.max() > 0.1
    assert np.abs(usual - finer).max() < 0.15 * usual.max()
