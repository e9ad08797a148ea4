"""Knee controllers: inverse, preview, zero torque, identification, margins, bumpless transfer."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from baselines.knee import identification as knee_identification
from baselines.knee.identification import FREQUENCIES, frequency_response, identify
from baselines.knee.ltr import BANDWIDTHS, design, make_loop
from baselines.linear.bumpless import BumplessGains, certificate
from baselines.linear.systems import response, state_space
from benchmarks.scoring.groups.knee import landings
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built, make_env, rms, rollout

PROMPT = {"regulator.time_constant": 2e-3}
CASES = [
    (mounting, hysteresis, output)
    for mounting, output in (("no_load", "tension"), ("rig", "tension"), ("on_leg", "angle"))
    for hysteresis in ("maxwell_slip", "preisach", "none")
]


def quiet(mounting: str, hysteresis: str = "maxwell_slip", prompt: bool = False) -> KneeOrthosis:
    """Return a plant without noise; ``prompt``: whose regulator hardly lags."""
    made = getattr(KneeOrthosis, mounting)(hysteresis=hysteresis).without_noise()
    return made.with_lag_alone().replace(PROMPT) if prompt else made


def make_knee(name: str, **arguments: Any) -> Any:
    return make_env(f"PAM/{name}-v0", **arguments)


def error_of(env: Any, name: str, plant: Any = None) -> np.ndarray:
    """Return the tracking error of an episode after 2 s."""
    record = rollout(env, built(name, env, plant))
    return (record["output"] - record["reference"])[200:]


@cache
def walked(name: str, mismatch: float) -> dict[str, np.ndarray]:
    """Return two strides and a bit from heel contact, without noise, with the paper's regulator."""
    plant = quiet("on_leg").with_lag_alone()
    env = make_knee("KneeWalk", plant=plant, mismatch=mismatch, start="heel_contact",
                    episode_seconds=6.0)  # fmt: skip
    return rollout(env, built(name, env))


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach", "none"])
@pytest.mark.parametrize("family", ["KneeTension", "KneeStiffness"])
def test_inverse_is_exact_without_lag(family, hysteresis):
    plant = quiet("no_load" if family == "KneeTension" else "rig", hysteresis, prompt=True)
    env = make_knee(family, plant=plant, reference="sine", frequency=0.02, start="paper",
                    episode_seconds=40.0)  # fmt: skip
    record = rollout(env, built("knee_inverse", env))
    error = (record["output"] - record["reference"])[200:]
    assert np.abs(error).max() < 2e-3 * np.ptp(record["reference"])


def test_straight_line_errs_by_the_loop_and_is_the_inverse_without_hysteresis():
    errors = {}
    for hysteresis in ("maxwell_slip", "none"):
        env = make_knee("KneeStiffness", plant=quiet("rig", hysteresis, prompt=True),
                        reference="sine", frequency=0.05, episode_seconds=20.0)  # fmt: skip
        record = rollout(env, built("knee_line", env))
        error = rms((record["output"] - record["reference"])[200:])
        errors[hysteresis] = error / (0.5 * np.ptp(record["reference"]))
    assert errors["none"] < 3e-3  # 2 pi 0.05 Hz times 7 ms of lag and hold
    assert 0.09 < errors["maxwell_slip"] < 0.14


def test_one_lag_of_preview_removes_the_lag():
    env = make_knee("KneeTension", plant=quiet("no_load"), start="paper", episode_seconds=12.0)
    now, ahead = (rms(error_of(env, name)) for name in ("knee_inverse", "knee_inverse_ahead"))
    assert ahead < 0.25 * now


def test_feedback_corrects_another_muscle_than_the_nominal_one():
    plant = quiet("no_load")
    other = plant.replace({"muscle.gain": 1.1, "hysteresis.width": 0.6, "lever.stiffness": 33.0})
    env = make_knee("KneeTension", plant=other, start="paper", episode_seconds=12.0)
    forward, feedback = (
        rms(error_of(env, n, plant)) for n in ("knee_inverse_ahead", "knee_inverse_ltr")
    )
    assert feedback < 0.25 * forward


def test_zero_torque_controller_leaves_little_torque_on_the_knee():
    plant = quiet("on_leg", prompt=True)
    env = make_knee("KneeWalk", plant=plant, start="heel_contact", episode_seconds=5.0)
    pulls, torque = {}, {}
    for name in ("knee_free", "zero"):
        record = rollout(env, built(name, env))
        pulls[name] = (record["state/angle"] < plant.lever.relaxed_angle - 0.1)[50:]
        torque[name] = rms(record["state/torque"][50:][pulls[name]])
    assert pulls["knee_free"].mean() > 0.3
    assert torque["knee_free"] < 0.15 * torque["zero"]  # what is left: the brace's own friction


@pytest.mark.parametrize(("mounting", "hysteresis", "output"), CASES)
def test_margins_on_the_identified_plant(mounting, hysteresis, output):
    plant = getattr(KneeOrthosis, mounting)(hysteresis=hysteresis).with_lag_alone()
    made = design(plant, output)
    figures = made.sampled_figures(0.01)
    assert figures.phase_margin > np.radians(60.0)
    assert figures.gain_margin > 2.5
    assert figures.peak_sensitivity < 1.7
    assert 0.9 * BANDWIDTHS[output] < figures.bandwidth < 1.25 * BANDWIDTHS[output]


@pytest.mark.parametrize(("mounting", "output"), [("rig", "tension"), ("on_leg", "angle")])
def test_dead_time_limits_the_bandwidth_and_leaves_a_margin(mounting, output):
    plant = getattr(KneeOrthosis, mounting)()
    made, late = design(plant, output), plant.regulator.dead_time
    assert late > 0.04
    w = np.geomspace(0.1, 300.0, 4000)
    loop = response(made.plant * made.controller, w) * np.exp(-1j * w * (late + 0.005))
    crossing = np.flatnonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))
    assert w[crossing[-1]] * late < 0.6
    assert min(180.0 + np.degrees(np.unwrap(np.angle(loop)))[crossing]) > 40.0
    assert np.max(1.0 / np.abs(1.0 + loop)) < 2.0


def test_setpoint_of_a_loop_changes_no_faster_than_the_pressure():
    env = make_knee("KneeWalk", plant=quiet("on_leg"), start="heel_contact", episode_seconds=6.0)
    record = rollout(env, built("knee_inverse_ltr", env))
    step = quiet("on_leg").regulator.slew_rate * 0.01
    assert np.abs(np.diff(record["command"])).max() < 1.001 * step


def test_published_dynamics_give_the_published_bandwidth():
    made = design(KneeOrthosis.rig(dynamics="measured"), "tension")
    assert made.sampled_figures(0.01).bandwidth == pytest.approx(26.2, abs=1.0)


def test_rig_without_hysteresis_is_identified_as_its_lag():
    plant = KneeOrthosis.rig(hysteresis="none")
    fit = identify(plant, "tension")
    assert fit.static_gain == pytest.approx(0.79, abs=0.01)  # 158 N / 200 kPa
    assert -1.0 / fit.poles[0].real == pytest.approx(plant.regulator.time_constant, rel=0.02)


def test_hysteresis_lowers_gain_and_phase_of_slow_responses():
    tested = (
        knee_identification.tested(KneeOrthosis.rig(hysteresis=h), "tension")
        for h in ("maxwell_slip", "none")
    )
    there, gone = (frequency_response(plant, "tension") for plant in tested)
    slow = FREQUENCIES < 5.0
    assert np.all(np.abs(there[slow]) < 0.8 * np.abs(gone[slow]))
    assert np.all(np.angle(there[slow]) < np.angle(gone[slow]) - np.radians(2.0))


def test_gains_of_zero_satisfy_the_compensators_inequality():
    pytest.importorskip("cvxpy")
    for mounting, output in (("rig", "tension"), ("on_leg", "angle")):
        plant = state_space(*identify(getattr(KneeOrthosis, mounting)(), output).state_space())
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
    plant = quiet("rig").with_lag_alone()
    reference = np.where(np.arange(700) < 400, 390.0, 158.0)  # 4.5 bar give 355 N
    env = make_knee("KneeTension", plant=plant, reference=reference, episode_seconds=7.0)
    record = rollout(env, built("knee_ltr", env))
    assert record["command"][100:390].min() == pytest.approx(4.5e5)
    assert np.abs(record["output"][430:] - 158.0).max() < 15.0  # 0.3 s after


def jump(name: str, mismatch: float) -> tuple[float, float]:
    """Return the tension's largest error after a switch [N], and the setpoint's jump [Pa]."""
    record = walked(name, mismatch)
    starts = landings(record["sensor/stance"], 0.01)
    assert len(starts) == 1
    k = starts[0]
    error = np.abs(record["output"] - record["reference"])[k : k + 50].max()
    return float(error), float(abs(record["command"][k + 1] - record["command"][k]))


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


def test_preview_reduces_the_transient():
    assert jump("knee_inverse_ahead_ltr", 10.0)[0] < 12.0


def test_feedback_tracks_tension_in_stance_and_angle_in_swing():
    record, free = walked("knee_inverse_ltr", 0.0), walked("knee_inverse", 0.0)
    for made, key, reference, stance in (
        ("output", "output", "reference", 1.0),
        ("angle", "state/angle", "state/angle_reference", 0.0),
    ):
        kept = (record["state/stance"] == stance) & (record["time"] > 1.0)
        errors = [rms((r[key] - r[reference])[kept]) for r in (record, free)]
        assert errors[0] < 0.7 * errors[1], made
