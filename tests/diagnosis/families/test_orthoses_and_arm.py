"""Diagnosis of elbow orthosis, knee orthosis and redundant manipulator."""

import dataclasses
import json

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.data.recording.channels import WIRINGS, wiring_of
from pam_envs.data.recording.recording import Recording, RecordingError, load_recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import diagnose
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.families.kinds import KINDS, kind_named
from pam_envs.plants.core.replay import replay_plant
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.families import family_rigs
from tests.diagnosis.families.joint_rig import PERIOD, campaign

CREEP = {"hysteresis__creep_1": 0.01, "hysteresis__creep_2": 0.01}
HIDDEN = {
    "ELBOW": ("creep", CREEP),
    "KNEE": ("valve_dead_band", {"regulator__dead_band": 6e3}),
    "ARM": ("unequal_muscles", {"muscle__imbalance": 0.06}),
}
ENVIRONMENTS = {
    "ELBOW": "PAM/ElbowOrthosis-v0",
    "KNEE": "PAM/KneeStiffness-v0",
}
"""Environments of the rigs; those of the arm need five joints, and the rig has two."""
UNITS = {"ELBOW": "N m", "KNEE": "N"}
"""Units of the tracking errors of the families' controllers."""


@needs_kernels
@pytest.mark.parametrize("family", HIDDEN)
def test_hidden_effect_is_named_and_its_plant_goes_into_an_environment(family, tmp_path):
    rig, (name, hidden) = getattr(family_rigs, family), HIDDEN[family]
    found = diagnose(rig.recorded(**hidden), rig.start, rig=rig.sheet, progress=False)
    assert (found.verdict, found.causes) == ("named", (name,))
    explained = found.report["explained"]
    worst = max(explained, key=lambda c: explained[c]["before"] / explained[c]["floor"])
    assert explained[worst]["share"] > 0.8
    assert_controllers_are_compared(found, family)
    found.write(tmp_path)
    assert "<svg" in (tmp_path / "report.html").read_text()
    report = json.loads((tmp_path / "report.json").read_text())
    path, digest = tmp_path / "plant.yaml", report["provenance"]["plant_after"]
    assert type(found.plant).from_yaml(path).digest() == digest
    if family in ENVIRONMENTS:
        env = gym.make(ENVIRONMENTS[family], plant=str(path))
        assert env.unwrapped.plant.digest() == digest
        env.close()


VISCOUS = {"muscle__viscosity": 600.0, "muscle__viscosity_speed": 2e-3}


@needs_kernels
@pytest.mark.parametrize("family", ["ELBOW", "KNEE"])
def test_hidden_viscous_loss_of_an_orthosis_is_named_alone(family, tmp_path):
    rig = getattr(family_rigs, family)
    recording = rig.recorded(**VISCOUS)
    found = diagnose(recording, rig.start, rig=rig.sheet, closed_loop=False, progress=False)
    assert (found.verdict, found.causes) == ("named", ("viscous_loss",))
    found.write(tmp_path)
    env = gym.make(ENVIRONMENTS[family], plant=str(tmp_path / "plant.yaml"))
    assert env.unwrapped.plant.value("muscle.viscosity") > 100.0
    env.close()


def assert_controllers_are_compared(found, family):
    """Assert that the paper's controller was compared, unless the environment takes no such arm."""
    loop, reason = found.report["closed_loop"], found.report["closed_loop_reason"]
    if family not in ENVIRONMENTS:
        assert loop is None
        assert "a chain of 2 joints" in reason
        return
    assert reason is None
    assert loop["unit"] == UNITS[family]
    assert loop["better_percent"]["interval"][0] > 0.0
    assert f"{loop['after']['value']:.3g} instead of" in found.text


@needs_kernels
@pytest.mark.parametrize("family", HIDDEN)
def test_rig_without_a_hidden_effect_is_adequate(family):
    rig = getattr(family_rigs, family)
    found = diagnose(rig.recorded(), rig.start, rig=rig.sheet, progress=False)
    assert (found.verdict, found.causes) == ("adequate", ())
    truth, plant = rig.truth(), found.plant
    for name in ("muscle.gain", "bundle_b.pressure_each"):
        if name in rig.spread:
            assert plant.value(name) == pytest.approx(truth.value(name), rel=0.03)
    if family == "ARM":  # without a payload forces are known over the masses
        ratios = [p.value("muscle.area") / p.value("arm.mass_factor") for p in (plant, truth)]
        assert ratios[0] == pytest.approx(ratios[1], rel=0.03)


@pytest.mark.parametrize("name", [name for name in KINDS if name != "single_muscle"])
def test_every_cause_moves_a_parameter_of_the_plant(name):
    kind = kind_named(name)
    plant = kind.start(Rig(plant=name))
    causes = kind.causes(kind.catalogue)
    for cause in causes:
        for term in (t for form in cause.forms for t in form.terms):
            assert term.name in plant.names, (cause.name, term.name)
    assert {"creep", "leak", "valve_dead_band", "sensor_delay"} <= {c.name for c in causes}
    assert len({c.name for c in causes}) == len(causes)


def test_only_muscles_in_pairs_have_a_fault_among_their_common_differences():
    """It may be named beside structure that remains; every other kind of plant is left alone."""
    found = {}
    for name in KINDS:
        kind = kind_named(name)
        common = [cause for cause in kind.causes(kind.catalogue) if cause.common]
        found[name] = {c.name for c in common if not (c.by_nature or c.lawlike)}
    pairs = {"antagonistic_joint", "redundant_manipulator"}
    assert {name for name, faults in found.items() if faults} == pairs
    assert set.union(*found.values()) == {"unequal_muscles"}


@needs_kernels
@pytest.mark.parametrize(
    "values",
    [
        {},
        {"regulator__flow": 1.0},
        {
            **{"regulator__flow": 1.0, "regulator__opening_integral": 3.0},
            **{"regulator__opening_windup": 0.2, "regulator__opening_lag": 0.02},
        },
    ],
)
def test_regulator_of_the_base_is_of_the_kind_that_the_pressure_shows(values):
    rig, kind = family_rigs.KNEE, kind_named("knee_orthosis")
    recording, sheet = rig.recorded(**values), rig.sheet
    floor = noise_floor(recording, sheet)
    study = Study.begin(recording, sheet, kind.start(sheet), floor, kind)
    assert study.family.plant.air == ("flow" if values else "regulator")
    left = study.blocks.means(study.base.errors)
    assert left[study.family.channels.index("pressure")] < 1.1
    plants = study.plant_of(study.base), rig.truth(**values)
    found, true = (dataclasses.asdict(plant.regulator) for plant in plants)
    names = {0: ["time_constant"], 1: ["exhaust_share", "source_pressure"]}
    for name in names.get(len(values), ["opening_integral", "opening_windup", "opening_lag"]):
        assert found[name] == pytest.approx(true[name], rel=0.05), name


@pytest.mark.parametrize("name", KINDS)
def test_nonlinear_pressure_is_that_of_its_sensor_or_of_the_regulator(name):
    kind = kind_named(name)
    cause = next(c for c in kind.causes(kind.catalogue) if c.name == "sensor_nonlinearity")
    titles = {form.terms[0].name: cause.title_of(form) for form in cause.forms}
    of_pressure = {"regulator" in title for term, title in titles.items() if "pressure" in term}
    assert of_pressure == {True}
    assert any("regulator" not in title for title in titles.values())


def test_sensor_causes_of_a_knee_have_forms_of_angle_and_tension():
    kind = kind_named("knee_orthosis")
    delay = next(c for c in kind.causes(kind.catalogue) if c.name == "sensor_delay")
    amounts = {t.name for form in delay.forms for t in form.terms if t.amount}
    assert {"angle.delay", "tension.delay"} <= amounts


@pytest.mark.parametrize("name", [name for name in KINDS if name != "single_muscle"])
def test_every_output_of_a_recording_is_simulated(name):
    kind = kind_named(name)
    plant = kind.start(Rig(plant=name))
    n, period = 12, 0.02
    wiring = WIRINGS[name]
    known = {c.name for c in wiring.inputs} & set(kind.pairs_of(plant))
    inputs = {c: np.full(n, 1.5e5) for c in known}
    outputs = {c: np.zeros(n) for c in kind.pairs_of(plant).values()}
    made = Recording.of_channels(period * np.arange(n), inputs, outputs, plant=name)
    bound = kind.bind(plant, made, Rig(plant=name))
    assert set(bound.channels) <= {c.name for c in wiring.outputs}
    assert {o.name for o in kind.outputs} >= set(bound.channels)
    assert len(bound.loop.outputs) == len(bound.channels)
    assert len(set(bound.loop.outputs)) == len(bound.channels)


def bound_arm(plant, **outputs):
    time = PERIOD * np.arange(12)
    inputs = {f"set_point_{m}": np.full(12, 1.5e5) for m in range(2 * plant.stages)}
    made = Recording.of_channels(time, inputs, outputs, plant=plant.family)
    return kind_named(plant.family).bind(plant, made, Rig(plant=plant.family))


def test_area_of_an_arm_is_fitted_if_torques_or_forces_show_more_than_its_masses():
    plant, angle = family_rigs.ARM.start, np.zeros(12)
    names = {free.name for free in bound_arm(plant, angle_0=angle).base()}
    assert {"arm.mass_factor", "link.damping"} <= names
    assert not {"muscle.area", "arm.damping_factor"} & names  # the joints have no damping of theirs
    for more in ("torque_1", "force_0"):
        loaded = bound_arm(plant, angle_0=angle, **{more: np.ones(12)})
        assert "muscle.area" in {free.name for free in loaded.base()}
    damped = dataclasses.replace(plant, joint_damping=(0.1, 0.1))
    assert "arm.damping_factor" in {f.name for f in bound_arm(damped, angle_0=angle).base()}


@needs_kernels
def test_balance_of_torques_of_an_arm_starts_its_flexible_base_near_the_imbalance():
    rig, kind = family_rigs.ARM, kind_named("redundant_manipulator")
    recording, truth = rig.recorded(muscle__imbalance=0.06), rig.truth()
    family = kind.bind(rig.start, recording, rig.sheet)
    missing = np.full(len(recording.time), np.nan)
    measured = np.array([recording.outputs.get(name, missing) for name in family.channels])
    family, column = family.spanning(measured), family.column
    for name in ("regulator.time_constant", "regulator.dead_time"):
        column[family.free(name).place] = truth.value(name)
    noise = np.array([rig.noise.get(name, 1.0) for name in family.channels])
    of_base, found = family.guesses(measured, noise, column)
    assert not of_base
    assert found["muscle.imbalance"] == pytest.approx(0.06, abs=0.02)


@pytest.mark.parametrize("family", ["ELBOW", "HELD", "ARM"])
def test_replay_of_a_recording_is_that_of_the_plant(family):
    rig = getattr(family_rigs, family)
    plant = rig.truth(**CREEP)
    part = slice(650, 690)  # of the first triangle, in motion
    setpoints, _ = campaign()
    a, b = setpoints["set_point_a"][part], setpoints["set_point_b"][part]
    inputs, driving = rig.inputs(a, b)
    outputs = {name: np.zeros(len(a)) for name in rig.outputs}
    made = Recording.of_channels(PERIOD * np.arange(len(a)), inputs, outputs, plant=plant.family)
    bound = kind_named(plant.family).bind(plant, made, rig.sheet)
    found = dict(zip(bound.channels, bound.simulate(bound.column[None])[:, :, 0], strict=True))
    substeps = int(np.ceil(PERIOD / bound.longest_step))
    expected = replay_plant(plant, driving, period=PERIOD, substeps=substeps)
    for name in rig.outputs:
        assert np.array_equal(found[name], expected[name])
    assert np.ptp(found[rig.outputs[0]]) > 0.0


def test_largest_lag_of_the_elbow_follows_the_weights_of_its_friction():
    kind = kind_named("elbow_orthosis")
    plant = kind.start(Rig(plant="elbow_orthosis"))
    n = 12
    inputs = {"set_point_a": np.full(n, 1e5), "set_point_b": np.full(n, 1e5)}
    made = Recording.of_channels(
        0.02 * np.arange(n), inputs, {"angle": np.zeros(n)}, plant=plant.family
    )
    bound = kind.bind(plant, made, Rig())
    columns = np.tile(bound.column, (1, 1))
    columns[0, bound.free("hysteresis.weight[0]").place] = 0.3
    bound.tie(columns)
    found = bound.plant_of(columns[0])
    assert columns[0, :-1] == pytest.approx(found.parameter_rows(), rel=1e-12)


def test_elbow_with_friction_of_the_pressure_is_found_for_any_sum_of_weights():
    kind = kind_named("elbow_orthosis")
    plant = kind.rival(kind.start(Rig(plant="elbow_orthosis")))
    ramp = np.linspace(0.5e5, 2e5, 40)
    inputs = {"set_point_a": ramp[::-1].copy(), "set_point_b": ramp}
    made = Recording.of_channels(
        0.02 * np.arange(len(ramp)), inputs, {"angle": np.zeros(len(ramp))}, plant=plant.family
    )
    bound = kind.bind(plant, made, Rig())
    columns = np.tile(bound.column, (2, 1))
    columns[0, bound.free("hysteresis.weight[0]").place] = 0.9
    bound.tie(columns)
    columns[1, :-1] = bound.plant_of(columns[0]).parameter_rows()
    given, found = np.moveaxis(bound.simulate(columns), 2, 0)
    assert np.ptp(given[0]) > 0.01
    assert found == pytest.approx(given, rel=1e-9)


def test_variants_that_cannot_be_replayed_are_refused_with_a_remedy():
    n = 12
    made = Recording.of_channels(
        0.02 * np.arange(n),
        {"set_point": np.full(n, 1e5)},
        {"angle": np.linspace(1.0, 1.1, n)},
        plant="knee_orthosis",
    )
    kind = kind_named("knee_orthosis")
    with pytest.raises(ValueError, match="record the brace alone"):
        kind.bind(KneeOrthosis.on_leg(), made, Rig())
    with pytest.raises(ValueError, match=r"variant\.mount is no choice of the plant knee_orthosis"):
        kind.start(Rig(plant="knee_orthosis", variant={"mount": "rig"}))
    with pytest.raises(ValueError, match="choose one of rig, no_load, leg"):
        kind.start(Rig(plant="knee_orthosis", variant={"mounting": "wall"}))
    with pytest.raises(ValueError, match="take pulses"):
        kind_named("elbow_orthosis").bind(ElbowOrthosis.paper(valves="on_off"), made, Rig())


def test_columns_of_an_arm_are_those_of_its_joints(tmp_path):
    assert len(wiring_of("redundant_manipulator", ["angle_2_deg"]).measured) == 6
    assert len(wiring_of("redundant_manipulator", ["pressure_3_bar"]).measured) == 4
    columns = ["time_s", *(f"pressure_command_{m}_bar" for m in range(4)), "angle_0_deg"]
    rows = [",".join([f"{0.02 * k:.2f}", *["1.0"] * 4, f"{k}"]) for k in range(20)]
    path = tmp_path / "arm.csv"
    path.write_text("\n".join([",".join(columns), *rows]))
    sheet = Rig(plant="redundant_manipulator")
    read = load_recording(path, sheet)
    assert set(read.inputs) == {f"set_point_{m}" for m in range(4)}
    assert read.outputs["angle_0"][1] == pytest.approx(np.radians(1.0))
    kind = kind_named("redundant_manipulator")
    with pytest.raises(ValueError, match="neither every setpoint nor pressure_0"):
        kind.bind(kind.start(sheet), read, sheet)  # six joints
    short = [",".join([c for k, c in enumerate(row.split(",")) if k != 4]) for row in rows]
    path.write_text("\n".join([",".join(columns[:4] + columns[5:]), *short]))
    with pytest.raises(RecordingError, match="needs the column pressure_command_3_bar"):
        load_recording(path, sheet)


def test_a_rig_file_selects_the_variant_and_its_digest(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text("plant: knee_orthosis\nvariant: {mounting: rig}\n")
    sheet = Rig.from_yaml(path)
    assert kind_named(sheet.plant).start(sheet).mounting == "rig"
    assert sheet.digest != dataclasses.replace(sheet, variant={}).digest
    path.write_text("plant: knee_orthosis\nvariant: rig\n")
    with pytest.raises(ValueError, match=r"for example \{mounting: rig\}, got 'rig'"):
        Rig.from_yaml(path)
