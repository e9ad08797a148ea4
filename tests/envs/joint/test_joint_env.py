"""Antagonistic joint: actions, disturbances, references, end."""

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.statics import UnbearableLoad
from tests.envs.cases import record

NAME = "PAM/AntagonisticJoint-v0"
STILL: dict[str, Any] = {
    "normalize": False,
    "reference": [0.0],
    "start": "straight",
    "episode_seconds": 60.0,
}
IDEAL = AntagonisticJoint.paper(hysteresis__width=0.0, link__gravity=0.0)
"""Without hysteresis and weight: the inverse of the static laws is exact."""


def make(**arguments: Any) -> Any:
    return gym.make(NAME, **{**STILL, **arguments}).unwrapped


def run(env: Any, action: list[float], seconds: float) -> dict[str, np.ndarray]:
    """Return ``info`` as arrays under a held action, from the reset on."""
    info = record(env, [action] * round(100 * seconds))
    assert len(info["time"]) == round(100 * seconds) + 1
    return info


def test_angle_at_rest_equals_set_point_without_hysteresis_and_weight() -> None:
    for angle in (-0.45, -0.1, 0.3):
        info = run(make(plant=IDEAL), [angle], 2.0)
        assert info["output"][-1] == pytest.approx(angle, abs=1e-4)
        assert info["state/prestress"][-1] == IDEAL.prestress
        assert np.mean([info["state/force_a"][-1], info["state/force_b"][-1]]) == pytest.approx(
            IDEAL.prestress, rel=1e-3
        )


def test_hysteresis_makes_the_angle_depend_on_its_history() -> None:
    env = make()
    targets = np.repeat([0.25, 0.0, -0.25, 0.0], 200)[:, None]
    rests = record(env, targets)["output"][200::200]
    assert rests[1] > 0.005
    assert rests[3] < -0.005
    assert rests[3] == pytest.approx(-rests[1], abs=2e-3)  # the joint's loop is symmetric


def test_prestress_as_action_changes_the_stiffness() -> None:
    stiff = {}
    for prestress in (20.0, 120.0):
        info = run(make(plant=IDEAL, action="angle_stiffness"), [0.1, prestress], 2.0)
        assert info["output"][-1] == pytest.approx(0.1, abs=1e-4)
        stiff[prestress] = info["state/stiffness"][-1]
        expected = IDEAL.stiffness_at(0.1, prestress)
        assert stiff[prestress] == pytest.approx(float(expected), rel=1e-3)
    assert stiff[20.0] / stiff[120.0] > 1.2  # the lever buckles under co-contraction


def test_pressures_as_actions() -> None:
    info = run(make(plant=IDEAL, action="pressures"), [4e5, 2e5], 2.0)
    assert info["state/pressure_a"][-1] == pytest.approx(4e5, rel=1e-6)
    assert info["state/pressure_b"][-1] == pytest.approx(2e5, rel=1e-6)
    angle = info["output"][-1]
    assert angle > 0.05
    assert float(IDEAL.torque(angle, 4e5, 2e5)) == pytest.approx(0.0, abs=1e-3)


def test_reduced_plant_refuses_pressures_as_actions() -> None:
    with pytest.raises(ValueError, match="needs the muscles"):
        make(plant=AntagonisticJoint.reduced(), action="pressures")


def test_measured_plant_has_a_smaller_range() -> None:
    paper, measured = make(), make(plant=AntagonisticJoint.measured())
    spans = [env.action_signals["angle_set_point"].high for env in (paper, measured)]
    assert spans[0] == pytest.approx(math.radians(30.0))
    assert math.radians(15.0) < spans[1] < math.radians(25.0)
    with pytest.raises(ValueError, match=r"reference reaches 0\.5 rad; at most 0\.38"):
        make(plant=AntagonisticJoint.measured(), reference=[0.5])


def test_prestress_is_reduced_where_pressure_is_not_sufficient() -> None:
    info = run(make(plant=IDEAL, action="angle_stiffness"), [0.49, 120.0], 2.0)
    assert info["output"][-1] == pytest.approx(0.49, abs=2e-3)
    assert info["saturated"][-1] == 0.0
    mean = 0.5 * (info["state/force_a"][-1] + info["state/force_b"][-1])
    assert mean < 80.0


def test_unreachable_set_point_is_reported() -> None:
    far = make(plant=AntagonisticJoint.paper(link__limit=0.58))
    held, short = run(far, [0.4], 0.1), run(far, [0.575], 0.1)
    assert not held["saturated"].any()
    assert short["saturated"][1:].all()
    assert not short["saturated"][0]


def test_one_disturbance_pulse_in_five_seconds() -> None:
    env = make(plant=IDEAL, disturbance=1.0)
    info = run(env, [0.0], 20.0)
    pushed = info["state/disturbance"][1:].reshape(4, 500)
    assert (np.count_nonzero(pushed, axis=1) == 100).all()
    sizes = np.abs(pushed).max(axis=1)
    assert ((sizes >= 0.5) & (sizes <= 1.0)).all()
    assert len(set(sizes)) == 4
    stiffness = float(IDEAL.stiffness_at(0.0))
    for window, at in enumerate(np.argmax(np.abs(pushed) > 0.0, axis=1)):
        last = 1 + 500 * window + at + 99
        torque = info["state/disturbance"][last]
        assert info["output"][last] == pytest.approx(torque / stiffness, rel=0.05)


def test_payload_is_observed_and_its_change_is_not() -> None:
    env = make(payload=0.5, payload_change=0.25, episode_seconds=4.0)
    info = record(env, [[0.2]] * 400, 3)
    true = info["state/payload"]
    assert set(env.signals.decode(info["seen"], "payload")) == {0.5}
    assert true[0] == 0.5
    assert abs(true[-1] - 0.5) == 0.25
    at = int(np.argmax(true != 0.5))
    assert 120 <= at <= 281


@pytest.mark.parametrize(("payload", "ends"), [(0.0, {0.25}), (0.1, {0.35}), (0.5, {0.25, 0.75})])
def test_payload_smaller_than_its_change_only_increases(payload: float, ends: set[float]) -> None:
    env = make(payload=payload, payload_change=0.25, episode_seconds=1.0)
    found = set()
    for seed in range(12):
        info = record(env, np.zeros((100, 1)), seed)
        found.add(round(info["state/payload"][-1], 12))
    assert found == ends


def test_payload_reduces_the_angle() -> None:
    bare, loaded = (run(make(payload=p), [0.3], 2.0)["output"][-1] for p in (0.0, 1.0))
    assert 0.0 < loaded < bare - 0.01


def test_mechanical_stop_ends_the_episode() -> None:
    info = record(make(disturbance=80.0), [[0.0]] * 600)
    broken = np.abs(info["output"]) > math.radians(35.0)
    assert len(broken) < 600
    assert broken.tolist() == [False] * (len(broken) - 1) + [True]
    assert np.array_equal(broken, info["margin/angle"] < 0.0)


def test_angles_beyond_the_capacity_are_refused_at_construction() -> None:
    with pytest.raises(UnbearableLoad, match=r"needs 0.184 N m at -30.0 degrees .* exert 0 N m"):
        make(reference="sine", amplitude=math.radians(30.0))
    make(reference="sine", amplitude=math.radians(29.0))
    with pytest.raises(UnbearableLoad, match=r"with 2 kg of payload .* payload of 1.01 kg or"):
        make(reference=[math.radians(28.0)], payload=[0.0, 1.0], payload_change=1.0)
    make(reference=[math.radians(28.0)], payload=0.5)


def test_sine_and_step_references() -> None:
    sine = run(make(reference="sine", amplitude=0.2, frequency=0.5), [0.0], 2.0)
    expected = 0.2 * np.sin(np.pi * sine["time"])
    assert np.allclose(sine["reference"], expected, atol=1e-12)
    step = run(make(reference="step", amplitude=0.1), [0.0], 2.0)
    assert np.array_equal(step["reference"], np.where(step["time"] < 1.0, 0.0, 0.1))
    assert run(make(reference="steps"), [0.0], 6.0)["reference"].max() <= math.radians(20.0)


def test_output_is_the_true_angle() -> None:
    info = run(make(reference="sine"), [0.1], 3.0)
    assert np.array_equal(info["output"], info["state/angle"])
    assert not np.array_equal(info["output"], info["sensor/angle"])
    error = np.abs(info["output"] - info["reference"])
    assert np.allclose(info["reward/tracking"], -error / 0.01745)
    assert np.std(info["sensor/angle"] - info["output"]) < 2e-3


def test_command_gives_the_set_points_of_pressure() -> None:
    info = run(make(), [0.2], 0.5)
    a, b, short = AntagonisticJoint.paper().pressures_for(np.float32(0.2))
    assert not short
    assert info["state/set_point_a"][-1] == pytest.approx(float(a), rel=1e-9)
    assert info["state/set_point_b"][-1] == pytest.approx(float(b), rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"action": "torque"}, "action = 'torque' is not known"),
        ({"start": "middle"}, "start = 'middle'"),
        ({"amplitude": 1.0}, "amplitude = 1.0 must be a number from 0 to 0.523599 rad"),
        ({"frequency": 0.0}, "frequency = 0.0"),
        ({"payload": "heavy"}, "payload = 'heavy'"),
        ({"payload": 3.0}, "from 0 to 2 kg"),
        ({"payload_change": -1.0}, "payload_change"),
        ({"disturbance": float("inf")}, "disturbance"),
        ({"randomize": {"link.limit": (0.4, 0.5)}}, "can be drawn"),
        (
            {
                "randomize": {
                    "link.mass": (0.02, 0.3),
                    "link.gyration": (0.03, 0.14),
                    "link.damping": (0.05, 5.0),
                }
            },
            "too fast",
        ),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        gym.make(NAME, **arguments)
