"""Knee feedback by loop transfer recovery: margins, identification, bumpless transfer."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.knee import identification as knee_identification
from baselines.knee.design import BANDWIDTHS, design, make_loop
from baselines.knee.identification import FREQUENCIES, frequency_response, identify
from baselines.linear.bumpless import BumplessGains, certificate
from baselines.linear.ltr import plant_system
from benchmarks.scoring.groups.knee import landings
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built
from tests.baselines.knee.knee_runs import make_knee, quiet, run, walked

CASES = [
    (mounting, hysteresis, output)
    for mounting, output in (("no_load", "tension"), ("rig", "tension"), ("on_leg", "angle"))
    for hysteresis in ("maxwell_slip", "preisach", "none")
]


@pytest.mark.parametrize(("mounting", "hysteresis", "output"), CASES)
def test_margins_on_the_identified_plant(mounting, hysteresis, output):
    made = design(getattr(KneeOrthosis, mounting)(hysteresis=hysteresis), output)
    figures = made.sampled_figures(0.01)
    assert figures.phase_margin > np.radians(60.0)
    assert figures.gain_margin > 2.5
    assert figures.peak_sensitivity < 1.7
    assert 0.9 * BANDWIDTHS[output] < figures.bandwidth < 1.25 * BANDWIDTHS[output]


def test_published_dynamics_give_the_published_bandwidth():
    made = design(KneeOrthosis.rig(dynamics="measured"), "tension")
    assert made.sampled_figures(0.01).bandwidth == pytest.approx(26.2, abs=1.0)


def test_rig_without_hysteresis_is_identified_as_its_lag():
    plant = KneeOrthosis.rig(hysteresis="none")
    fit = identify(plant, "tension")
    assert fit.static_gain == pytest.approx(0.79, abs=0.01)  # 158 N / 200 kPa
    assert -1.0 / fit.poles[0].real == pytest.approx(plant.regulator.time_constant, rel=0.02)


def test_hysteresis_lets_less_through_and_later():
    there, gone = (
        frequency_response(
            knee_identification.tested(KneeOrthosis.rig(hysteresis=h), "tension"), "tension"
        )
        for h in ("maxwell_slip", "none")
    )
    slow = FREQUENCIES < 5.0
    assert np.all(np.abs(there[slow]) < 0.8 * np.abs(gone[slow]))
    assert np.all(np.angle(there[slow]) < np.angle(gone[slow]) - np.radians(2.0))


def test_gains_of_zero_satisfy_the_compensators_inequality():
    pytest.importorskip("cvxpy")
    for mounting, output in (("rig", "tension"), ("on_leg", "angle")):
        plant = plant_system(identify(getattr(KneeOrthosis, mounting)(), output))
        assert certificate(plant, BumplessGains(np.zeros(plant.nstates))) > 0.0


def test_loop_started_from_a_command_holds_it():
    loop = make_loop(KneeOrthosis.rig(), "tension")
    command, full = np.array([-5e4, 2e4]), np.full(2, 4.5e5)
    state = loop.holding_state(command)
    for _ in range(50):
        given = loop.output(np.full(2, 158.0), np.full(2, 158.0), state, -full, full)
        np.testing.assert_allclose(given, command, rtol=1e-6)
        state = loop.advance(np.full(2, 158.0), np.full(2, 158.0), given, state)


def test_unreachable_reference_causes_no_windup():
    plant = quiet("rig")
    wanted = np.where(np.arange(700) < 400, 390.0, 158.0)  # 4.5 bar give 355 N
    env = make_knee("KneeTension", plant=plant, reference=wanted, episode_seconds=7.0)
    record = run(env, built("knee_ltr", env))
    assert record["set_point"][100:390].min() == pytest.approx(4.5e5)
    assert np.abs(record["output"][430:] - 158.0).max() < 15.0  # 0.3 s after


def jump(name: str, mismatch: float) -> tuple[float, float]:
    """Return the tension's largest error after a switch [N], and the set-point's jump [Pa]."""
    record = walked(name, mismatch)
    starts = landings(record["sensor/stance"], 0.01)
    assert len(starts) == 1
    k = starts[0]
    error = np.abs(record["output"] - record["reference"])[k : k + 50].max()
    return float(error), float(abs(record["set_point"][k + 1] - record["set_point"][k]))


@pytest.mark.parametrize("mismatch", [0.0, 10.0, 20.0])
def test_bumpless_transfer_reduces_the_jump(mismatch):
    tension, command = jump("knee_inverse_ltr", mismatch)
    without, bump = jump("knee_inverse_ltr_bumpy", mismatch)
    assert tension < 20.0
    assert without > 3.0 * tension
    assert command < 0.4e5
    if mismatch != 10.0:  # this one happens to act against what has run away
        assert without > 40.0
        assert bump > 0.8e5


def test_mismatch_adds_little_to_the_transient_of_bumpless_transfer():
    assert jump("knee_inverse_ltr", 10.0)[0] < jump("knee_inverse_ltr", 0.0)[0] + 2.0


def test_a_look_ahead_takes_the_lag_out_of_the_transient():
    assert jump("knee_inverse_ahead_ltr", 10.0)[0] < 12.0


def test_feedback_tracks_tension_in_stance_and_angle_in_swing():
    record, free = walked("knee_inverse_ltr", 0.0), walked("knee_inverse", 0.0)
    for made, key, reference, stance in (
        ("output", "output", "reference", 1.0),
        ("angle", "state/angle", "state/angle_reference", 0.0),
    ):
        kept = (record["state/stance"] == stance) & (record["time"] > 1.0)
        errors = [np.sqrt(np.mean((r[key] - r[reference])[kept] ** 2)) for r in (record, free)]
        assert errors[0] < 0.7 * errors[1], made
