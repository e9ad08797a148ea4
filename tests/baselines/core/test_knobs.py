"""Knobs: neutral at 1, effect at other values, bounds, and tuned controllers."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import yaml

from baselines.core import informed, tuned
from baselines.core.catalogue import CONTROLLERS, PUBLISHED
from baselines.joint import model as joint_model
from baselines.joint.model import make_model_loop
from baselines.knee import ltr as knee_design
from baselines.linear.pid import simc_rule
from benchmarks.papers.joint_studies import ReducedRig
from pam_envs.identification.frequency import fit_rational
from tests.baselines.conftest import built, make_env
from tests.object_digest import object_digest

FREQUENCIES = np.geomspace(0.5, 60.0, 24)
RIG = fit_rational(FREQUENCIES, 1.2 / (1.0 + 0.05j * FREQUENCIES), 1)
"""A knee's tension over its pressure setpoint, so that nothing has to be identified."""
ENVS = (
    "PAM/MusclePositioning-v0",
    "PAM/KneeStiffness-v0",
    "PAM/KneeWalk-v0",
    "PAM/AntagonisticJoint-v0",
    "PAM/ElbowOrthosis-v0",
)
PAIRS = [
    (name, next(env for env in ENVS if env in entry.envs))
    for name, entry in PUBLISHED.items()
    if entry.knobs
]


@pytest.fixture(autouse=True)
def known(monkeypatch):
    """Replace what is identified on plants by models that are at hand."""
    monkeypatch.setattr(knee_design, "identify", lambda plant, output: RIG)
    monkeypatch.setattr(knee_design, "_DESIGNS", {})
    joint = make_env("PAM/AntagonisticJoint-v0").plant
    monkeypatch.setitem(joint_model._HYSTERESIS_MODELS, joint.digest(), ReducedRig().hysteresis)


@pytest.mark.parametrize(("name", "env"), PAIRS)
def test_knobs_at_1_change_nothing_and_each_alone_changes_the_controller(name, env):
    base, bounds = make_env(env), PUBLISHED[name].knobs
    plain = object_digest(built(name, base))
    assert object_digest(built(name, base, **dict.fromkeys(bounds, 1.0))) == plain
    for knob, (low, high) in bounds.items():
        assert low < 1.0 < high
        ends = [object_digest(built(name, base, **{knob: end})) for end in (low, high)]
        assert len({plain, *ends}) == 3, knob


def test_every_environment_has_a_pid_and_a_papers_controller_to_tune():
    for env in (env for env in gym.registry if env.startswith("PAM/")):
        named = [n for n, e in PUBLISHED.items() if e.knobs and env in e.envs]
        assert any("pid" in name for name in named)
        assert any(PUBLISHED[n].citation and "pid" not in n for n in named)


def test_knobs_scale_the_times_of_the_simc_rule():
    plain = simc_rule(2.0, 0.3, 0.05, 0.02)
    slow, late, keen = (
        simc_rule(2.0, 0.3, 0.05, 0.02, knobs={f"{name}_time": factor})
        for name, factor in (("closed_loop", 3.0), ("integral", 2.0), ("derivative", 2.0))
    )
    assert slow.gain == pytest.approx(0.5 * plain.gain)
    assert slow.integral_time == 0.3
    assert late == plain._replace(integral_time=2.0 * plain.integral_time)
    assert keen == plain._replace(derivative_time=0.1)


def test_knobs_of_the_muscle_scale_their_parameters():
    env = make_env("PAM/MusclePositioning-v0")
    pid, inverse = built("pid", env), built("inverse", env)
    assert built("pid", env, reach=2.0).view.reach == pytest.approx(2.0 * pid.view.reach)
    assert built("pid", env, closed_loop_time=2.0).gains.integral < pid.gains.integral
    assert built("inverse", env, horizon=2.0).horizon == 2.0 * inverse.horizon
    times = np.arange(inverse.aims.shape[1])
    leads = [(built("inverse", env, lead=k).aims[0] @ times) for k in (0.5, 1.0, 2.0)]
    assert leads[0] == pytest.approx(0.5 * leads[1]) and leads[2] == pytest.approx(2.0 * leads[1])
    early = built("inverse", env, early=1.5)
    np.testing.assert_allclose(early.due, 1.5 * inverse.due)
    both = built("inverse_pid", env, closed_loop_time=2.0, horizon=2.0)
    assert both.inverse.horizon == 2.0 * inverse.horizon
    assert both.gains == built("pid", env, closed_loop_time=2.0).gains


def test_knobs_of_the_knee_scale_their_parameters():
    env = make_env("PAM/KneeStiffness-v0")
    plain = knee_design.design(env.plant, "tension").figures
    fast = knee_design.design(env.plant, "tension", knobs={"bandwidth": 2.0}).figures
    tame = knee_design.design(env.plant, "tension", knobs={"recovery": 10.0}).figures
    assert fast.bandwidth > 1.5 * plain.bandwidth
    assert tame.bandwidth < plain.bandwidth
    aheads = [built("knee_inverse_ahead", env, lead=k).forward.weights for k in (1.0, 2.0)]
    times = np.arange(len(aheads[0]))
    assert aheads[1] @ times == pytest.approx(2.0 * (aheads[0] @ times))
    loops = [built("knee_inverse_ltr", env, bandwidth=k).tension for k in (1.0, 2.0)]
    assert np.abs(loops[1].controller.c).max() != np.abs(loops[0].controller.c).max()


def test_knobs_of_the_joint_scale_their_parameters():
    env = make_env("PAM/AntagonisticJoint-v0")
    leads = [built("joint_pid_ahead", env, lead=k).parts.preview[0] for k in (0.5, 1.0)]
    times = np.arange(len(leads[0]))
    assert leads[0] @ times < leads[1] @ times
    plain = built("joint_mfc_mu_ahead", env)
    fast = built("joint_mfc_mu_ahead", env, disturbance=2.0)
    np.testing.assert_array_equal(fast.parts.preview, plain.parts.preview)
    gains = [np.abs(made.disturbance.controller.b).max() for made in (plain, fast)]
    assert gains[1] > gains[0]
    slow = built("joint_mfc_mu_ahead", env, damping=1.4)
    assert slow.parts.preview[0] @ times > plain.parts.preview[0] @ times
    loops = [make_model_loop(plain.parts.model, damping) for damping in (0.5, 1.0)]
    shares = [float(loop.d[0]) for loop in loops]  # of the reference, at once
    assert shares[0] > shares[1]


def test_knobs_of_the_elbow_scale_their_parameters():
    env = make_env("PAM/ElbowOrthosis-v0")
    plain = built("elbow_pid", env)
    assert built("elbow_pid", env, start=2.0).middle == 2.0 * plain.middle
    assert built("elbow_pid", env, integral_time=2.0).gains.integral < plain.gains.integral
    inner = built("elbow_allocation_early", env).loop
    outer = built("elbow_allocation_early", env, pressure_loop=1.5, step=0.5).loop
    view = built("elbow_pid", env).signals.read(env.reset(seed=1)[0])
    view = view._replace(pressure=np.full_like(view.pressure, 2e5))
    near, far = view.pressure + 1e4, np.full_like(view.pressure, env.plant.full_pressure)
    np.testing.assert_allclose(
        outer.commands(view, near) - 2e5, 1.5 * (inner.commands(view, near) - 2e5)
    )
    for narrow, wide in zip(outer.reach(view), inner.reach(view), strict=True):
        np.testing.assert_allclose(narrow - 2e5, 0.5 * (wide - 2e5))
    assert np.all(outer.commands(view, far) == inner.commands(view, far))


@pytest.mark.parametrize(
    ("name", "knobs", "message"),
    [
        ("pid", {"reach": 5.0}, r"pid: knob reach is 5.0, outside 0.67 to 2; give"),
        ("pid", {"reech": 1.0}, r"pid has no knob 'reech'; choose from closed_loop_time"),
        ("pid", {"reach": float("nan")}, r"knob reach is nan"),
        ("table", {"reach": 1.0}, r"table has no knob 'reach'; it has none"),
    ],
)
def test_knob_or_value_outside_the_entry_is_refused(name, knobs, message):
    env = make_env("PAM/MusclePositioning-v0")
    with pytest.raises(ValueError, match=message):
        built(name, env, **knobs)


FOUND = tuned.Tuned(
    controller="pid",
    env="PAM/MusclePositioning-v0",
    knobs={"closed_loop_time": 0.7, "reach": 1.2},
    bounds={"closed_loop_time": (0.25, 4.0), "reach": (0.67, 2.0)},
    trials=20,
    seed=0,
    before=7.1e-4,
    after=6.2e-4,
    command="python -m benchmarks tune pid",
)


def written(folder: Path, entries: Mapping[str, Any]) -> Path:
    file = folder / "tuned.yaml"
    file.write_text(yaml.safe_dump({"schema": 1, "tuned": dict(entries)}))
    return file


def test_entries_of_the_file_are_in_the_catalogue_with_their_budget():
    known = set(PUBLISHED) | set(tuned.read()) | set(informed.entries(PUBLISHED))
    assert set(CONTROLLERS) == known
    for name, found in tuned.read().items():
        entry = CONTROLLERS[name]
        assert (entry.trials, entry.envs) == (found.trials, (found.env,))
        plants = " of drawn plants" if found.plants == "drawn" else ""
        assert entry.tuning == f"Optuna TPE, {found.trials} trials on tuning seeds{plants}"
        assert found.after <= found.before


def test_tuned_entry_is_the_published_controller_with_its_knobs(monkeypatch, tmp_path):
    file = written(tmp_path, {"pid_tuned": dataclasses.asdict(FOUND)})
    read = tuned.read(file)
    assert read == {"pid_tuned": FOUND}
    entry = tuned.entries(PUBLISHED, read)["pid_tuned"]
    assert entry.citation == PUBLISHED["pid"].citation and entry.trials == 20
    assert not entry.knobs and "closed_loop_time, reach" in entry.summary
    monkeypatch.setitem(CONTROLLERS, "pid_tuned", entry)
    env = make_env("PAM/MusclePositioning-v0")
    assert object_digest(built("pid_tuned", env)) == object_digest(built("pid", env, **FOUND.knobs))


def test_tuned_names_differ_by_environment():
    assert tuned.tuned_name("pid", "PAM/MusclePositioning-v0") == "pid_tuned"
    assert tuned.tuned_name("knee_pid", "PAM/KneeWalk-v0") == "knee_pid_tuned_walk"
    pairs = [(n, env) for n, entry in PUBLISHED.items() for env in entry.envs if entry.knobs]
    assert len({tuned.tuned_name(*pair) for pair in pairs}) == len(pairs)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"knobs": {"reach": 9.0}}, "knob reach is 9.0"),
        ({"controller": "pyd"}, "belongs to pyd in PAM/MusclePositioning-v0; name it pyd_tuned"),
        ({"env": "PAM/KneeWalk-v0"}, "name it pid_tuned_walk"),
        ({"bounds": {}}, "no bounds of closed_loop_time, reach; search again"),
        ({"more": 1}, "unexpected keyword argument 'more'; search again"),
    ],
)
def test_invalid_file_of_tuned_controllers_is_refused(tmp_path, change, message):
    file = written(tmp_path, {"pid_tuned": dataclasses.asdict(FOUND) | change})
    with pytest.raises(ValueError, match=message):
        tuned.entries(PUBLISHED, tuned.read(file))


@pytest.mark.parametrize("name", tuned.read())
def test_optimum_is_inside_its_search_space(name):
    assert tuned.read()[name].on_bounds == ()


def test_knob_of_the_knees_pi_is_its_gain():
    env = make_env("PAM/KneeWalk-v0")
    plain, double = built("knee_pid", env), built("knee_pid", env, gain=2.0)
    slow = built("knee_pid", env, integral_time=2.0)
    assert double.gains.proportional == pytest.approx(2.0 * plain.gains.proportional)
    assert double.gains.integral == pytest.approx(2.0 * plain.gains.integral)
    assert slow.gains.integral == pytest.approx(0.5 * plain.gains.integral)
    assert slow.gains.proportional == pytest.approx(plain.gains.proportional)


def test_optimum_on_either_bound_is_noticed():
    def on_bounds(reach: float) -> tuple[str, ...]:
        knobs = {**FOUND.knobs, "reach": reach}
        return dataclasses.replace(FOUND, knobs=knobs).on_bounds

    assert on_bounds(0.68) == on_bounds(2.0) == ("reach",)
    assert on_bounds(1.0) == ()


def test_another_schema_is_refused(tmp_path):
    file = tmp_path / "tuned.yaml"
    file.write_text("schema: 2\n")
    with pytest.raises(ValueError, match="not of schema 1; restore the file of the last commit"):
        tuned.read(file)
