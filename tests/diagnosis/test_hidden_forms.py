"""Mathematical forms of the hidden effects, different from those of the candidates."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from tests.diagnosis import hidden
from tests.diagnosis.conftest import base_of, effect_of, size
from tests.diagnosis.hidden import Campaign, Effect, catalogue
from tests.diagnosis.hidden.catalogue import constants
from tests.diagnosis.hidden.kernel_air import driven, passed, supplied, uncovered, volume
from tests.diagnosis.hidden.kernel_motion import dragged, rub
from tests.diagnosis.hidden.kernel_muscle import hang
from tests.diagnosis.hidden.kernel_tools import ATMOSPHERE, GRAVITY, STEP
from tests.diagnosis.hidden.records import STATE, blank

FORMED = (
    "supply_droop",
    "slew_limit",
    "valve_dead_band",
    "stick_slip",
    "resonance",
    "payload_error",
    "viscous_loss",
)


def _rig(effect: Effect, amplitude: float) -> tuple:
    """Return the constants of a rig with an effect, and its state at rest."""
    record = constants(base_of(), [(effect, amplitude)], 10.0)
    return record.view(np.recarray)[0], blank(STATE).view(np.recarray)[0]


@pytest.mark.parametrize("seed", [1, 2, 5])
@pytest.mark.parametrize("name", FORMED)
def test_size_increases_continuously_with_amplitude(name, seed, short):
    base, effect = base_of(), effect_of(name, seed)
    clean = hidden.simulate(base, [], short)

    shown = (hidden.simulate(base, [(effect, a)], short) for a in (3.0, 3.09, 6.0, 12.0))
    sizes = [size(one, clean) for one in shown]
    assert np.all(np.diff(sizes) > 0.0)
    assert sizes[1] < 1.2 * sizes[0]


def test_both_forms_of_each_effect_are_documented():
    for entry in catalogue.DECLARED["catalogue"].values():
        assert min(map(len, (entry["here"], entry["candidate"]))) >= 8
        assert entry["here"] != entry["candidate"]


def test_flow_of_restriction_is_choked_then_elliptic_then_linear():
    critical = 0.3
    down = np.linspace(0.0, 7.0, 701)
    flow = np.array([passed(critical, 7.0, value) for value in down])
    assert np.all(flow[down <= critical * 7.0] == 7.0)
    assert np.all(np.diff(flow) <= 0.0)
    assert flow[-1] == 0.0
    middle = (1.0 + critical) / 2.0
    assert passed(critical, 7.0, 7.0 * middle) == pytest.approx(7.0 * np.sqrt(0.75))
    near = [passed(critical, 1.0, 1.0 - gap) for gap in (1e-4, 2e-4, 4e-4)]
    assert near[1:] == pytest.approx([2.0 * near[0], 4.0 * near[0]])
    assert passed(critical, 2.0, 3.0) == 0.0


def test_muscle_volume_increases_with_contraction():
    p, _ = _rig(effect_of("supply_droop"), 3.0)
    assert volume(p, 0.0)[0] == pytest.approx(1.0)
    for strain in (0.0, 0.08, 0.16):
        wide, slope = volume(p, strain)
        assert slope == pytest.approx((volume(p, strain + 1e-6)[0] - wide) / 1e-6, rel=1e-4)
        assert slope > 0.0


def test_air_of_the_muscle_leaves_the_reservoir_and_returns_through_the_orifice():
    p, s = _rig(effect_of("supply_droop"), 3.0)
    s.supply, s.pressure, s.strain, s.speed = p.supply - 1.0, 2.0, 0.05, 0.2
    before = s.supply
    wide, slope = volume(p, s.strain)
    taken = wide * 10.0 + (2.0 + ATMOSPHERE) * slope * s.speed
    feed = passed(p.critical, p.supply + ATMOSPHERE, before + ATMOSPHERE) / p.recovery
    assert supplied(p, s, 10.0, False) == pytest.approx(10.0)
    assert s.supply == pytest.approx(before + STEP * (feed - p.draw * taken))
    most = passed(p.critical, s.supply + ATMOSPHERE, 2.0 + ATMOSPHERE) / p.throat
    left = supplied(p, s, 1e6, False)
    assert left * wide + (2.0 + ATMOSPHERE) * slope * s.speed == pytest.approx(most)


def test_reservoir_refill_rate_over_deficit_increases():
    p, s = _rig(effect_of("supply_droop"), 3.0)
    s.supply = p.supply - 2.0
    gaps = []
    for _ in range(40):
        for _ in range(50):
            supplied(p, s, 0.0, False)
        gaps.append(p.supply - s.supply)
    kept = [after / before for before, after in pairwise(gaps) if after > 0.2]
    assert len(kept) > 5
    assert np.all(np.diff(kept) < 0.0)  # an exponential return keeps the same share every time
    assert s.supply <= p.supply


@pytest.mark.parametrize("iron", [0.0, 1.0])
def test_soft_minimum_cannot_imitate_the_coil(iron):
    p, _ = _rig(effect_of("slew_limit", slew_kind=iron), 3.0)
    errors = np.linspace(-5.0, 5.0, 201)
    bent = np.array([driven(p, error) for error in errors])

    def candidate(x: np.ndarray) -> np.ndarray:
        limit, blend, slope = x
        sharp = np.clip(slope * errors, -limit, limit)
        soft = slope * errors / np.sqrt(1.0 + (slope * errors / limit) ** 2)
        return sharp + blend * (soft - sharp) - bent

    best = least_squares(candidate, [1.5, 0.5, 1.0], bounds=([0.1, 0.0, 0.5], [10.0, 1.0, 2.0]))
    assert np.sqrt(np.mean(best.fun**2)) > 0.01 * np.sqrt(np.mean(bent**2))
    assert np.all(np.diff(bent) > 0.0)
    assert driven(p, 1e-3) == pytest.approx(1e-3, rel=1e-3)


def test_spool_opens_continuously_and_leaks_in_overlap():
    p, _ = _rig(effect_of("valve_dead_band"), 3.0)
    errors = np.linspace(-6.0, 6.0, 2401) * p.overlap
    flow = np.array([uncovered(p, error) for error in errors])
    slope = np.diff(flow) / np.diff(errors)
    assert flow == pytest.approx(-flow[::-1], abs=1e-12)
    assert np.all(slope >= 0.9 * p.overlap_leak)
    assert slope.max() < 1.0 + 1e-9
    inside, outside = np.abs(errors[1:]) < 0.3 * p.overlap, np.abs(errors[1:]) > 5.0 * p.overlap
    assert slope[inside].max() < 0.3
    assert slope[outside].min() > 0.95
    assert 4.5 * p.overlap < flow[-1] < 5.5 * p.overlap  # nothing is made up for beyond


def test_guide_deflects_before_slipping_and_partly_recovers():
    p, s = _rig(effect_of("stick_slip"), 3.0)
    mass, damping = p.length * 0.3, p.length * 150.0
    most = 0.5 * p.breakaway
    for push in np.concatenate([np.linspace(0.0, most, 3000), np.full(1000, most)]):
        rub(p, s, push, 0.0, mass, damping)
    bent = 1e3 * p.length * s.strain
    assert bent == pytest.approx(p.bristle * np.log(2.0), rel=0.05)
    for push in np.concatenate([np.linspace(most, 0.0, 3000), np.zeros(1000)]):
        rub(p, s, push, 0.0, mass, damping)
    assert bent - 1e3 * p.length * s.strain == pytest.approx(p.bristle * np.log(1.5), rel=0.05)


def test_guide_friction_decreases_with_speed():
    p, s = _rig(effect_of("stick_slip"), 3.0)
    mass, damping = p.length * 0.3, p.length * 150.0
    for share in (1.2, 2.0, 4.0):
        for _ in range(3000):
            rub(p, s, share * p.breakaway, 0.0, mass, damping)
        pace = 1e3 * p.length * s.speed
        drag = share * p.breakaway - damping * s.speed
        excess = (p.breakaway - p.kinetic) / (1.0 + (pace / p.stribeck) ** 2)
        assert pace > 1.0
        assert drag == pytest.approx(p.kinetic + excess, rel=1e-3)


def _peaks(effect: Effect, channel: str) -> np.ndarray:
    """Return the frequencies [Hz] of what an effect makes of a step, the strongest first."""
    count, base = 4000, dataclasses.replace(base_of(), lag=0.005)
    command, still = np.where(np.arange(count) < 10, 1.0, 4.0), np.zeros(count)
    campaign = Campaign(command, np.full(count, "x_a"), still, still + 20.0, still > 0.0, 2e-3)
    runs = (hidden.simulate(base, hide, campaign) for hide in ([(effect, 3.0)], []))
    with_it, without = (run[channel][50:] for run in runs)
    shown = (with_it - without) * np.hanning(with_it.size)
    power = np.abs(np.fft.rfft(shown, 16 * shown.size)) ** 2
    hertz = np.fft.rfftfreq(16 * shown.size, 1.0 / 500.0)
    found, _ = find_peaks(power, prominence=1e-5 * power.max(), distance=400)
    return hertz[found[np.argsort(-power[found])]]


def test_tube_resonates_at_quarter_wave_and_third_harmonic():
    tube = effect_of("resonance", line=1.0, hertz=6.0, damping=0.03, wall=0.05)
    peaks = _peaks(tube, "pressure_bar")
    assert peaks[0] == pytest.approx(6.0, rel=0.05)
    assert np.min(np.abs(peaks / peaks[0] - 3.0)) < 0.15


def test_bracket_and_foot_resonate_in_two_modes():
    share, ratio = 0.2, 1.6
    mount = effect_of(
        "resonance", line=0.0, hertz=6.0, damping=0.03, foot=ratio, share=share, lever=-4.0
    )
    middle = 0.5 * (1.0 + ratio**2 * (1.0 + share))
    spread = np.sqrt(middle**2 - ratio**2)
    expected = 6.0 * np.sqrt([middle - spread, middle + spread])
    assert np.sort(_peaks(mount, "contraction_mm")[:2]) == pytest.approx(expected, rel=0.05)


def test_tray_and_scale_errors_increase_with_load():
    p, s = _rig(effect_of("payload_error", tray_scale=0.2), 3.0)

    def more(declared: float) -> float:
        hang(p, s, declared)
        assert s.weight == pytest.approx(s.load / GRAVITY)
        return s.load - declared

    assert more(0.0) == 0.0
    assert 0.0 < more(0.05) < 0.02 * p.tray  # no switch
    for load in (15.0, 30.0, 60.0):
        hung = 1.0 - np.exp(-load / p.tray_rest)
        assert more(load) == pytest.approx(p.tray * (hung + 0.2 * load / 30.0))


def test_eyring_drag_is_the_arsinh_of_the_speed():
    effect = effect_of("viscous_loss", pace=0.5)
    p, s = _rig(effect, 3.0)
    pace = np.array([1e-5, 0.2, 1.0, 10.0, 100.0])
    speed = pace / (1e3 * p.length)
    force = np.array([dragged(p, s, value) * value for value in speed])
    expected = effect.strength(3.0) * np.arcsinh(pace / 0.5) / np.arcsinh(2.0)
    assert force == pytest.approx(expected, rel=1e-6)
    assert [dragged(p, s, -value) for value in speed] == pytest.approx(force / speed)
