"""Design of the next experiment of rigs with several channels."""

import dataclasses

import numpy as np
import pytest

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.experiment.channel_plans import ChannelMeans, channel_plans
from pam_envs.diagnosis.experiment.experiment import ENOUGH, Rival, propose
from pam_envs.diagnosis.experiment.plans import PERIOD
from pam_envs.diagnosis.families.kinds import kind_named
from pam_envs.diagnosis.report.page_parts import experiment
from pam_envs.plants.core.replay import replay_plant
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.families import family_rigs, joint_rig

CREEP = {"hysteresis.creep_1": 0.01, "hysteresis.creep_2": 0.01}
DELAY = {"regulator.dead_time": 0.03}
JOINT = "antagonistic_joint"
FAMILIES = (JOINT, "elbow_orthosis", "knee_orthosis", "redundant_manipulator")
SHUT = Rig(plant=JOINT, valve_closed=("steps",))


class Case:
    """A rig, its recorded inputs, and the plant that its diagnosis begins with."""

    def __init__(self, name: str, sheet: Rig | None = None, **changes: Array) -> None:
        setpoints, labels = joint_rig.campaign(share=0.5)
        setpoints |= changes
        self.kind, start = kind_named(name), None
        if name == JOINT:
            inputs, outputs = setpoints, tuple(joint_rig.NOISE)
            self.sheet = sheet or joint_rig.SHEET
        else:
            word = {"elbow": "ELBOW", "knee": "KNEE", "redundant": "ARM"}[name.partition("_")[0]]
            rig = getattr(family_rigs, word)
            inputs, _ = rig.inputs(setpoints["set_point_a"], setpoints["set_point_b"])
            outputs, start, self.sheet = rig.outputs, rig.start, rig.sheet
        time = joint_rig.PERIOD * np.arange(len(labels))
        read = {n: np.zeros(len(time)) for n in outputs}
        shut = self.sheet.valve_closed
        self.recording = Recording.of_channels(
            time, inputs, read, plant=name, segment=labels, valve_closed=shut
        )
        self.plant = self.kind.start(self.sheet) if start is None else start
        self.family = self.kind.bind(self.plant, self.recording, self.sheet)
        self.noise = np.full(len(self.family.channels), np.inf)
        for k, channel in enumerate(self.family.channels):
            if channel in outputs:
                self.noise[k] = 400.0 if channel.startswith("pressure") else 5e-4

    def experiments(self):
        return self.kind.plans(self.recording, self.sheet, self.family)

    def rival(self, name: str, **values: float) -> Rival:
        """Return a rival whose own amount cannot be refitted."""
        named = {key.replace("__", "."): value for key, value in values.items()}
        column = np.append(self.plant.replace(named).parameter_rows(), 0.0)
        return Rival((name,), column[None])

    def proposed(self, *rivals: Rival) -> dict:
        first, *others = rivals
        return propose(self.experiments(), first, others, self.noise, catalogue())


def setpoints(segments: list[dict]) -> dict[str, Array]:
    """Return the setpoints [bar] at the ends of the pieces, by channel."""
    names = segments[0]["from_bar"]
    return {
        n: np.array([s[end][n] for s in segments for end in ("from_bar", "to_bar")]) for n in names
    }


@needs_kernels
@pytest.mark.parametrize("name", FAMILIES)
def test_separation_is_that_of_a_separate_simulation(name):
    case = Case(name)
    creep, late = (case.plant.replace(values) for values in (CREEP, DELAY))
    found = case.proposed(case.rival("creep", **CREEP), case.rival("dead_time", **DELAY))
    assert found["enough"]
    assert found["separation"] > ENOUGH
    bound = next(e.bound for e in case.experiments() if e.name == found["name"])
    names = list(case.plant.module("rollout").channels_of(case.plant))
    inputs = {n: v[:, 0] for n, v in zip(names, bound.drives, strict=True)}
    first, second = (replay_plant(p, inputs, period=PERIOD, substeps=4) for p in (creep, late))
    apart = 0.0
    for channel, noise in zip(case.family.channels, case.noise, strict=True):
        if np.isfinite(noise):
            left = first[channel] - second[channel]
            apart += float(np.var(left)) / noise**2
    assert found["separation"] == pytest.approx(apart, rel=1e-6)


@pytest.mark.parametrize("name", FAMILIES)
def test_pressures_are_within_the_recorded_ones(name):
    case = Case(name)
    used = dict(zip(case.family.pairs, case.family.setpoints(case.recording), strict=True))
    for plan in case.experiments():
        for channel, values in setpoints(plan.segments).items():
            assert values.min() >= used[channel].min() / BAR - 1e-4
            assert values.max() <= used[channel].max() / BAR + 1e-4
        assert sum(s["seconds"] for s in plan.segments) == pytest.approx(
            plan.bound.drives.shape[1] * PERIOD
        )


@needs_kernels
@pytest.mark.parametrize("name", ["elbow_orthosis", "knee_orthosis"])
def test_plans_have_the_fitted_plant_and_clock(name):
    """The friction of the fitted plant may have the other drive."""
    case = Case(name)
    case.family = dataclasses.replace(case.family, plant=case.kind.rival(case.plant), clock=0.07)
    for plan in case.experiments():
        assert plan.bound.plant == case.family.plant
        assert plan.bound.clock == 0.07
    early = np.array([case.family.column])
    early[0, -1] = -0.05
    late, soon = plan.bound.simulate(np.array([case.family.column, early[0]])).transpose(2, 0, 1)
    assert np.isfinite(late).all()
    assert np.abs(late - soon).max() > 0.0


def test_measured_pressures_limit_experiments_of_a_recording_without_commands():
    case = Case(JOINT)
    inputs = dict(case.recording.inputs)
    read = {"angle": np.zeros(len(case.recording.time))}
    read |= {f"pressure_{s}": inputs.pop(f"set_point_{s}") - 0.6 * BAR for s in "ab"}
    case.recording = Recording.of_channels(
        case.recording.time, inputs, read, plant=JOINT, segment=["all"] * len(read["angle"])
    )
    case.family = case.kind.bind(case.plant, case.recording, case.sheet)
    assert case.family.measured_drive
    for plan in case.experiments():
        values = np.array(list(setpoints(plan.segments).values()))
        assert values.min() >= 0.0
        assert values.max() <= max(v.max() for n, v in read.items() if n != "angle") / BAR + 1e-4
        assert plan.bound.plant == case.family.plant


def test_payloads_are_recorded_ones():
    case = Case(JOINT)
    payload = {plan.name: {s["payload_kg"] for s in plan.segments} for plan in case.experiments()}
    assert payload.pop("several_payloads") == {0.0, 0.3}
    assert set(map(tuple, payload.values())) == {(0.0,)}
    alone = Case(JOINT, payload=np.zeros(len(case.recording.time)))
    assert "several_payloads" not in {plan.name for plan in alone.experiments()}


def test_difference_of_pressures_is_within_the_recorded_one():
    n = 500
    swing = 1e5 * np.sin(np.linspace(0.0, 9.0, n))
    means = ChannelMeans(({"a": 3e5 + swing, "b": 3e5 - 0.2 * swing},))
    recorded = swing * 1.2
    for plan in channel_plans(means):
        apart = plan.inputs["a"] - plan.inputs["b"]
        assert apart.min() >= recorded.min() - 1e-6
        assert apart.max() <= recorded.max() + 1e-6


def test_experiment_that_moves_nothing_is_not_proposed():
    n = 100
    rising, held = np.linspace(1e5, 3e5, n), np.full(n, 2e5)
    names = {p.name for p in channel_plans(ChannelMeans(({"a": rising, "b": rising},)))}
    assert names
    assert all(name.endswith("_equal") for name in names)
    assert channel_plans(ChannelMeans(({"a": held, "b": held},))) == ()


def test_valves_are_closed_only_if_the_rig_can():
    assert not any("valve_shut" in plan.name for plan in Case(JOINT).experiments())
    shut = [p for p in Case(JOINT, SHUT).experiments() if "valve_shut" in p.name]
    assert [p.name for p in shut] == ["valve_shut", "valve_shut_equal"]
    for plan in shut:
        closed = sum(s["seconds"] for s in plan.segments if s["valve"] == "closed")
        assert np.sum(plan.bound.drives[4:6] < 0.0, axis=1).tolist() == [[closed / PERIOD]] * 2


def test_one_joint_of_an_arm_moves_alone():
    plans = {plan.name: plan for plan in Case("redundant_manipulator").experiments()}
    alone = setpoints(plans["slow_triangle_joint_1"].segments)
    assert [np.ptp(values) > 0.0 for values in alone.values()] == [False, False, True, True]
    assert all(np.ptp(v) > 0.0 for v in setpoints(plans["slow_triangle"].segments).values())


@needs_kernels
def test_cocontraction_changes_to_separate_unequal_muscles_from_a_bias():
    case = Case(JOINT)
    found = case.proposed(
        case.rival("unequal_muscles", muscle__imbalance=0.05),
        case.rival("sensor_bias", angle__bias=0.01),
    )
    a, b = setpoints(found["segments"]).values()
    assert np.ptp(a + b) > 1.0
    assert found["enough"]


def test_page_shows_setpoints_and_payload_of_an_experiment():
    plan = next(p for p in Case(JOINT).experiments() if p.name == "several_payloads")
    found = {"name": plan.name, "description": plan.description, "segments": plan.segments}
    html = experiment({"experiment": {**found, "between": ["x", "y"], "separation": 2.0}})
    for head in ("duration [s]", "setpoint a [bar]", "setpoint b [bar]", "payload [kg]"):
        assert f">{head}</th>" in html
    assert html.count("<td>0.3</td>") == 3
    equal = next(p for p in Case(JOINT).experiments() if p.name == "full_pressure_equal")
    folded = experiment({"experiment": {**found, "segments": equal.segments}})
    assert "setpoint a, b [bar]" in folded
    assert "the last 2 rows 16 times" in folded
