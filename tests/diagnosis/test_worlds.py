"""Simulated worlds: physics of clean rigs, visibility of effects, independence of the plants."""

from functools import cache

import numpy as np
import pytest

from tests.diagnosis.hidden import campaign as plans
from tests.diagnosis.worlds import (
    EFFECTS,
    OUTSIDE,
    WORLDS,
    Effect,
    Rig,
    draw_effect,
    draw_rig,
    make_recording,
    simulate,
    truth_of,
)
from tests.diagnosis.worlds.names import POSITION_NOISE, PRESSURE_NOISE
from tests.diagnosis.worlds.scaling import PLAN, TRIAL_STEP, trace

CAMPAIGNS = {
    "standard": plans.campaign_standard(1),
    "short": plans.campaign_short(1),
    "long": plans.campaign_long(1),
    "idle": plans.campaign_idle(1),
    "idle_high": plans.campaign_idle(1, 3.0),
}
READINGS = ("contraction_mm", "pressure_bar")
LATER, NEWEST = WORLDS[10:15], WORLDS[15:]
NO_GROWTH = ("hysteresis_shape", "hysteresis_drive")  # bounded by a loop that is fully replaced


@cache
def rig_of(world: str, seed: int = 0, nuisance: bool = True) -> Rig:
    return draw_rig(world, np.random.default_rng(seed), nuisance)


@cache
def effect_of(name: str, world: str) -> Effect:
    return draw_effect(name, rig_of(world), np.random.default_rng(3))


@pytest.mark.parametrize(
    ("name", "world"),
    [(name, WORLDS[k % 10]) for k, name in enumerate(EFFECTS)]
    + [(name, LATER[k % 5]) for k, name in enumerate(EFFECTS)]
    + [(name, NEWEST[k % 6]) for k, name in enumerate(EFFECTS)],
)
def test_effects_are_finite_visible_and_grow(name: str, world: str) -> None:
    check(name, world)


@pytest.mark.parametrize(
    ("name", "world"),
    [(name, WORLDS[14 - k]) for k, name in enumerate(OUTSIDE)]
    + [(name, NEWEST[k % 6]) for k, name in enumerate(OUTSIDE)],
)
def test_effects_outside_the_list(name: str, world: str) -> None:
    check(name, world)


def check(name: str, world: str) -> None:
    rig, effect = rig_of(world), effect_of(name, world)
    small, large = trace(rig, effect, 3.0), trace(rig, effect, 40.0)
    assert np.isfinite(large)
    if name == "sensor_drift":  # takes minutes
        assert 0.2 < small < 6.0
    else:
        assert 1.0 < small < 6.0
    assert large > (1.5 if name in NO_GROWTH else 3.0) * small
    assert large < 250.0


@pytest.mark.parametrize("name", EFFECTS + OUTSIDE)
def test_amplitude_zero_is_the_clean_rig(name: str) -> None:
    rig = rig_of(WORLDS[(EFFECTS + OUTSIDE).index(name) % len(WORLDS)])
    effect = effect_of(name, rig.world)
    clean = simulate(rig, [], PLAN, TRIAL_STEP)
    hidden = simulate(rig, [(effect, 0.0)], PLAN, TRIAL_STEP)
    assert effect.strength(0.0) == 0.0
    for key in READINGS:
        assert np.array_equal(clean[key], hidden[key])


@pytest.mark.parametrize("name", ("creep", "leak", "threshold_pressure", "viscous_loss"))
def test_trace_is_about_proportional(name: str) -> None:
    rig = rig_of(WORLDS[4])
    traces = [trace(rig, effect_of(name, rig.world), a) for a in (1.0, 4.0, 16.0)]
    assert traces[1] / traces[0] == pytest.approx(4.0, rel=0.3)
    assert traces[2] / traces[1] == pytest.approx(4.0, rel=0.3)


@pytest.mark.parametrize("world", WORLDS)
def test_clean_rigs_are_plausible(world: str) -> None:
    for seed in range(3):
        rig = rig_of(world, seed, False)
        assert 0.08 < rig.stroke_mm / rig.length_mm < 0.25
        assert 8.0 <= rig.diameter_mm <= 20.0 and 100.0 <= rig.length_mm <= 250.0
        columns = simulate(rig, [], CAMPAIGNS["standard"], TRIAL_STEP)
        part = columns["segment"] == "triangle_a"
        x, p = columns["contraction_mm"][part], columns["pressure_bar"][part]
        top, middle = int(np.argmax(x)), 0.5 * (x.min() + x.max())
        rising = np.interp(middle, x[:top], p[:top])
        falling = np.interp(-middle, -x[top:], p[top:])
        assert 0.35 < rising - falling < 1.1
        assert np.abs(columns["contraction_mm"][:200]).max() < 1e-3  # rest
        assert abs(columns["contraction_mm"][-1]) < 0.12 * rig.stroke_mm
        hold = np.flatnonzero(columns["segment"] == "staircase_a")[110:148]
        assert np.abs(np.diff(columns["contraction_mm"][hold])).max() < 0.02  # no chatter


@pytest.mark.parametrize("plan", CAMPAIGNS)
@pytest.mark.parametrize("world", WORLDS)
def test_clean_rigs_are_finite_on_every_campaign(world: str, plan: str) -> None:
    columns = simulate(rig_of(world), [], CAMPAIGNS[plan], TRIAL_STEP)
    for key in (*READINGS, "position_mm"):
        assert columns[key].shape == CAMPAIGNS[plan].time.shape
        assert np.isfinite(columns[key]).all()
    assert np.abs(columns["contraction_mm"]).max() < 80.0
    assert columns["pressure_bar"].min() > -0.3 and columns["pressure_bar"].max() < 7.0


def test_nuisance_acts() -> None:
    rigs = [rig_of(WORLDS[0], seed) for seed in range(24)]
    offsets = np.array([rig.clock_offset_s for rig in rigs]) / 0.02
    moving = np.array([abs(r.nuisance.start_strain) + r.nuisance.start_pressure_bar for r in rigs])
    assert np.abs(offsets).max() <= 2.0 and offsets.std() > 0.7
    assert 4 < np.count_nonzero(moving) < 20
    assert 4 < np.count_nonzero([rig.nuisance.zero_mm for rig in rigs]) < 20
    ideal = rig_of(WORLDS[0], 0, False)
    assert ideal.clock_offset_s == ideal.nuisance.zero_mm == ideal.nuisance.loop_memory == 0.0
    assert ideal.law == rigs[0].law
    late, on_time = (simulate(rig, [], PLAN, TRIAL_STEP) for rig in (rigs[0], ideal))
    assert np.abs(late["pressure_bar"] - on_time["pressure_bar"]).max() > 10 * PRESSURE_NOISE
    first = [simulate(r, [], PLAN, TRIAL_STEP)["contraction_mm"][0] for r in rigs]
    assert np.count_nonzero(np.abs(first) > POSITION_NOISE) > 4


def test_readings_are_shifted_by_the_clock() -> None:
    from dataclasses import replace

    ideal = rig_of(WORLDS[2], 0, False)
    late = replace(ideal, nuisance=replace(ideal.nuisance, clock_offset_s=0.03))
    a, b = (simulate(rig, [], PLAN)["pressure_bar"] for rig in (ideal, late))
    middle = 0.5 * (a[1:-1] + a[2:])
    assert np.abs(b[:-2] - middle).max() < 0.12
    assert np.abs(b - a).max() > 0.1


def test_noise_has_its_size_and_can_be_scaled() -> None:
    rig, plan = rig_of(WORLDS[1]), CAMPAIGNS["short"]
    silent = make_recording(rig, [], plan, 1, 0.0)
    noisy = make_recording(rig, [], plan, 1)
    clean = simulate(rig, [], plan)
    for key, size in zip(READINGS, (POSITION_NOISE, PRESSURE_NOISE), strict=True):
        assert np.array_equal(silent[key], clean[key])
        assert 0.75 * size < (noisy[key] - clean[key]).std() < 1.35 * size
    assert list(noisy) == [
        "time_s",
        "segment",
        "pressure_command_bar",
        "pressure_bar",
        "contraction_mm",
        "load_N",
        "temperature_C",
    ]


def test_everything_is_deterministic() -> None:
    world = WORLDS[7]
    rig = draw_rig(world, np.random.default_rng(0))
    assert rig == rig_of(world)
    effect = draw_effect("gain_random_walk", rig, np.random.default_rng(3))
    assert effect == effect_of("gain_random_walk", world)
    first, second = (make_recording(rig, [(effect, 4.0)], PLAN, 9) for _ in range(2))
    assert all(np.array_equal(first[key], second[key]) for key in first)
    other = make_recording(rig, [(effect, 4.0)], PLAN, 10)
    assert not np.array_equal(first["pressure_bar"], other["pressure_bar"])


def test_closed_valve_ignores_the_command_and_leaks_only_with_a_leak() -> None:
    for world in WORLDS:
        rig = rig_of(world, 0, False)
        shut = np.flatnonzero(PLAN.valve_closed)[5:-5]
        clean = simulate(rig, [], PLAN, TRIAL_STEP)["pressure_bar"][shut]
        leaking = simulate(rig, [(effect_of("leak", world), 5.0)], PLAN, TRIAL_STEP)
        lost = np.ptp(leaking["pressure_bar"][shut])
        assert np.ptp(clean) < 2 * PRESSURE_NOISE
        assert lost > np.ptp(clean) + 2 * PRESSURE_NOISE


def test_several_effects_at_once_and_one_given_twice() -> None:
    rig = rig_of(WORLDS[5])
    names = ("creep", "stick_slip", "payload_error", "dead_time", "slip_step")
    pairs = [(effect_of(name, rig.world), 10.0) for name in names]
    columns = simulate(rig, pairs, PLAN, TRIAL_STEP)
    assert np.isfinite(columns["contraction_mm"]).all()
    with pytest.raises(ValueError, match="twice"):
        simulate(rig, [pairs[0], pairs[0]], PLAN, TRIAL_STEP)


def test_truth_of_the_normal_physics() -> None:
    truths = [truth_of(rig_of(world)) for world in WORLDS]
    for cause in truths[0]:
        found = [truth[cause] for truth in truths]
        assert any(found) and not all(found)
