"""Design of the next experiment: capabilities of a rig, separation of rivals."""

import numpy as np
import pytest

from pam_envs.data.recording.recording import Recording, Rig
from pam_envs.diagnosis.causes import by_name, catalogue
from pam_envs.diagnosis.experiment.experiment import (
    ENOUGH,
    Rival,
    propose,
    rival_of,
    separations,
)
from pam_envs.diagnosis.experiment.plans import PERIOD, Means, plans
from pam_envs.diagnosis.families.single_muscle import PlannedMuscle, experiments, planned_inputs
from pam_envs.diagnosis.fit.least_squares import Fit
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily, start_plant
from tests.diagnosis.conftest import needs_kernels

PLANT = start_plant(Rig(rest_length=0.2))
NOISE = np.array([5e-5, 1e3])
ABLE = Means(6e5, (0.0, 15.0, 30.0, 45.0, 60.0), shut=True, warm=True)
POOR = Means(3e5, (20.0,), shut=False, warm=False)


def recording(**changes) -> Recording:
    n = 2000
    columns = {
        "time": PERIOD * np.arange(n),
        "command": 1e5 * (2.0 + 2.0 * np.sin(0.01 * np.arange(n))),
        "pressure": 1e5 * (2.0 + 2.0 * np.sin(0.01 * np.arange(n))),
        "load": np.repeat([10.0, 40.0], n // 2),
        "segment": ["one"] * (n // 2) + ["shut"] * (n // 2),
        **changes,
    }
    return Recording.from_arrays(columns.pop("time"), columns.pop("command"), **columns)


def rival(name: str, *nearby: dict, **values: float) -> Rival:
    """Return a rival with some parameters, and its own ones perturbed."""
    here = {key.replace("__", "."): value for key, value in values.items()}
    plants = [PLANT.replace({**here, **more}) for more in ({}, *nearby)]
    return Rival((name,), np.array([p.parameter_rows() for p in plants]))


def proposed(first: Rival, *others: Rival, noise=NOISE, means=ABLE):
    return propose(experiments(PLANT, means), first, others, noise, catalogue())


def bound(name: str) -> PlannedMuscle:
    """Return the muscle with the inputs of an experiment."""
    return next(e.bound for e in experiments(PLANT, ABLE) if e.name == name)


def test_capabilities_are_read_from_the_recording():
    plain = Means.of(recording(), Rig())
    assert plain == Means(pytest.approx(4e5, rel=1e-3), (10.0, 40.0), shut=False, warm=False)
    assert Means.of(recording(valve_closed=("shut",)), Rig()).shut
    assert Means.of(recording(), Rig(valve_closed=("shut",))).shut
    assert Means.of(recording(temperature=np.full(2000, 20.0)), Rig()).warm


def test_plans_have_different_names():
    names = [p.name for p in plans(ABLE)]
    assert len(set(names)) == len(names)


def test_plans_respect_capabilities_of_the_rig():
    offered = plans(POOR)
    assert {p.name for p in plans(ABLE)} - {p.name for p in offered} == {
        "valve_shut",
        "warm_muscle",
        "heavy_load",
        "light_load",
        "several_loads",
    }
    for plan in offered:
        assert set(plan.loads) == {20.0}
        assert plan.command.min() >= 0.0
        assert not plan.kelvin.any()


@pytest.mark.parametrize("means", [ABLE, POOR, Means(2e5, (5.0, 8.0), shut=True, warm=False)])
def test_plans_are_within_recorded_range(means):
    for plan in plans(means):
        assert set(plan.loads) <= set(means.loads)
        assert plan.command.max() <= means.full
        assert plan.command[plan.command < 0.0].tolist() == [-1.0] * int(np.sum(plan.command < 0))
        assert len(plan.command) == len(plan.load) == len(plan.kelvin)
        assert 30.0 < len(plan.command) * PERIOD <= 125.0


def test_segments_describe_the_commands():
    for plan in plans(ABLE):
        assert sum(s["seconds"] for s in plan.segments) == pytest.approx(
            len(plan.command) * PERIOD, abs=0.05
        )
        at = 0
        for piece in plan.segments:
            n = round(piece["seconds"] / PERIOD)
            command, load = plan.command[at : at + n], plan.load[at : at + n]
            assert set(load) == {piece["load_N"]}
            if piece["valve"] == "closed":
                assert set(command) == {-1.0}
            elif "swing_hz" in piece:
                assert command.min() == pytest.approx(1e5 * piece["from_bar"], abs=100.0)
                assert command.max() == pytest.approx(1e5 * piece["to_bar"], abs=3e3)
            else:
                assert command[0] == pytest.approx(1e5 * piece["from_bar"], abs=100.0)
                assert command[-1] == pytest.approx(1e5 * piece["to_bar"], abs=100.0)
            assert piece["warmer_by_K"] == pytest.approx(plan.kelvin[at + n - 1], abs=0.01)
            at += n


@needs_kernels
def test_missing_sensor_gives_no_separation():
    plain, bowed = rival("plain"), rival("sensor_nonlinearity", pressure__bow=0.05)
    muscle = bound("long_hold")
    (both,) = separations(muscle, (plain, bowed), NOISE)
    (blind,) = separations(muscle, (plain, bowed), np.array([5e-5, np.inf]))
    assert both > ENOUGH
    assert blind == 0.0
    assert not proposed(plain, bowed, noise=np.array([5e-5, np.inf]))["enough"]


@needs_kernels
def test_refittable_difference_is_no_separation():
    """More of the same cause is no other cause, however large the difference."""
    little = rival("leak", {"regulator.leak": 0.0101}, regulator__leak=0.01)
    more = rival("leak", {"regulator.leak": 0.0102}, regulator__leak=0.0101)
    fixed = rival("leak", regulator__leak=0.0101)
    shut, loud = bound("valve_shut"), 1e-3 * NOISE
    (stiff,) = separations(shut, (rival("leak", regulator__leak=0.01), fixed), loud)
    (free,) = separations(shut, (little, more), loud)
    assert stiff > 10.0
    assert free < 1e-3 * stiff


@needs_kernels
def test_closing_the_valve_is_proposed_for_a_leak_if_possible():
    leak = rival("leak", {"regulator.leak": 0.011}, regulator__leak=0.01)
    creep = rival("creep", {"hysteresis.creep_2": 0.011}, hysteresis__creep_2=0.01)
    able = proposed(leak, creep)
    assert able["name"] == "valve_shut"
    assert able["enough"]
    assert {s["valve"] for s in able["segments"]} == {"open", "closed"}
    poor = proposed(leak, creep, means=POOR)
    assert poor["name"] != "valve_shut"
    assert poor["separation"] < able["separation"]
    assert able["between"] == ["leak", "creep"]
    assert by_name("leak").sensor in able["sensor"]
    assert by_name("creep").sensor in able["sensor"]


@needs_kernels
def test_nearest_rival_decides():
    """Each rival alone has its best experiment; for all of them the least one counts."""
    leak = rival("leak", regulator__leak=0.01)
    creep = rival("creep", hysteresis__creep_2=0.01)
    late = rival("dead_time", regulator__dead_time=0.03)
    both = proposed(leak, creep, late)
    alone = [proposed(leak, other)["separation"] for other in (creep, late)]
    assert both["separation"] <= min(alone)
    assert both["between"] == ["leak", "creep", "dead_time"]
    assert both["separation"] == pytest.approx(
        min(separations(bound(both["name"]), (leak, creep, late), NOISE))
    )


@needs_kernels
def test_inseparable_rivals_are_reported():
    one = rival("sensor_bias", position__bias=1e-3)
    other = rival("sensor_drift", position__bias=2e-3)
    found = proposed(one, other)
    assert not found["enough"]
    assert found["separation"] == pytest.approx(0.0, abs=1e-9)
    assert (
        "no experiment of the list separates sensor_bias from sensor_drift" in found["description"]
    )
    assert by_name("sensor_bias").sensor in found["sensor"]


def test_rival_has_perturbed_own_parameters():
    family = MuscleFamily(PLANT, planned_inputs(plans(POOR)[0]))
    base = family.free("regulator.gain")
    own = (
        family.free("regulator.leak", start=0.01, scale=0.005),
        family.free("mass.slack", start=float(family.free("mass.slack").high), scale=1e-4),
    )
    fit = Fit.at_start((base, *own), family.column)
    found = rival_of(("leak", "wire_slack"), fit, 1, family.tie)
    assert found.label == "leak+wire_slack"
    moved = found.columns[1:] - found.columns[0]
    assert [np.flatnonzero(row).tolist() for row in moved] == [[f.place] for f in own]
    assert moved[0, own[0].place] == pytest.approx(0.02 * 0.005)
    assert moved[1, own[1].place] == pytest.approx(-0.02 * 1e-4)


def test_plans_start_at_rest():
    inputs = planned_inputs(plans(ABLE)[0], 0.005)
    assert inputs.longest_step == 0.005
    assert inputs.fresh.tolist()[:2] == [True, False]
    assert inputs.command[0] == 0.0
