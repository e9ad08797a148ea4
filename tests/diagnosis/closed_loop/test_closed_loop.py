"""Closed-loop comparison: stepped plants, plant inverse, scores."""

import numpy as np
import pytest

from pam_envs.diagnosis.closed_loop.gain import (
    COMPENSABLE,
    HIGH,
    LOW,
    ReplayedRig,
    Residuals,
    closed_loop,
    fixed_references,
    run,
    scores,
    segment_squares,
    sentence,
)
from pam_envs.diagnosis.closed_loop.plant_inverse import (
    AUTHORITY,
    PREVIEW,
    InversePi,
    PlantInverse,
    correction,
    crossing,
    dead_periods,
    design,
    feed_forward,
    stroke,
)
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.core.stepper import PlantBatch, PlantStepper
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, replay
from tests.diagnosis.conftest import needs_kernels

LOAD = 2.0
KELVIN = 305.0
HIDDEN = {
    "creep": {"hysteresis.creep_2": 0.08, "hysteresis.creep_3": 0.12},
    "dead_time": {"regulator.dead_time": 0.06},
    "load_dependent_hysteresis": {"hysteresis.width_per_load": -0.2},
    "exhaust_asymmetry": {"regulator.exhaust_ratio": 2.0},
}
SLOW = {
    "valve_dead_band": {"regulator.dead_band": 1.5e4},
    "temperature": {"muscle.temperature_gain": 0.006},
    "threshold_pressure": {"hysteresis.threshold": 3e4},
    "payload_error": {"mass.load_error": 0.5},
}
"""Further hidden effects, most of which feedback corrects."""


def muscle(**changes: float) -> SingleMuscle:
    values = {"mass.load": LOAD, "regulator.dead_time": 0.01, "hysteresis.width_per_load": 0.0}
    return SingleMuscle.mas10("maxwell_slip").replace(values | changes)


def short(top: float, seconds: float = 10.0) -> dict[str, np.ndarray]:
    """Return the beginnings of two references."""
    whole = fixed_references(top)
    return {k: whole[k][: round(100 * seconds) + PREVIEW] for k in ("sines", "staircase")}


def random_holds(periods: int, seed: int = 0) -> np.ndarray:
    levels = np.random.default_rng(seed).uniform(0.0, 6e5, -(-periods // 20))
    levels[0] = 0.0
    return np.repeat(levels, 20)[:periods]


# --- stepped plants -----------------------------------------------------------------------------


def test_stepper_equals_replay():
    plant = muscle(**HIDDEN["creep"], **{"position.delay": 0.015, "regulator.leak": 0.1})
    periods = 400 if COMPILED else 40
    commands = random_holds(periods)
    stepper = PlantStepper(plant, LOAD)
    stepped = np.array([stepper.step(u) for u in commands])
    fresh, never = np.arange(periods) == 0, np.zeros(periods, bool)
    steady = [np.full(periods, v) for v in (LOAD, 293.15, 0.0)]
    inputs = Inputs(0.01, commands, steady[0], steady[1], fresh, steady[2], never)
    shown = replay(plant, inputs)
    assert np.array_equal(shown["contraction"][1:], stepped[:-1, 0])
    assert np.array_equal(shown["pressure"][1:], stepped[:-1, 1])
    assert np.ptp(stepped[:, 0]) > 5e-4


def test_trial_rollouts_leave_state_and_predict_future():
    stepper = PlantStepper(muscle(**HIDDEN["creep"]), LOAD)
    for u in random_holds(60):
        stepper.step(u)
    tries = np.linspace(0.0, 6e5, 32)
    before = stepper.position
    ahead = stepper.try_ahead(tries, 7)
    assert stepper.position == before
    assert np.array_equal(ahead, stepper.try_ahead(np.tile(tries, (7, 1)), 7))
    for _ in range(7):
        stepper.step(tries[20])
    assert stepper.position == ahead[-1, 20]
    assert np.all(np.diff(ahead[-1]) > -1e-12)
    assert ahead[-1, -1] - ahead[-1, 0] > 1e-4


def test_batch_equals_single_plants():
    plants = [muscle(), muscle(**HIDDEN["creep"]), muscle(**HIDDEN["dead_time"])] * 12
    together = PlantBatch(plants, LOAD)
    commands = np.stack([random_holds(60, i) for i in range(len(plants))], axis=1)
    positions = together.run(commands)[2]
    for lane in (0, 1, 2, 35):
        alone = PlantBatch([plants[lane]], LOAD)
        assert np.array_equal(alone.run(commands[:, lane : lane + 1])[2, :, 0], positions[:, lane])


def test_reset_repeats_motion_and_noise():
    stepper = PlantStepper(muscle(), LOAD, noise_seed=3)
    first = [stepper.step(3e5) for _ in range(50)]
    stepper.reset(3)
    assert [stepper.step(3e5) for _ in range(50)] == first
    stepper.reset(4)
    other = [stepper.step(3e5) for _ in range(50)]
    apart = np.std(np.array(other)[:, 0] - np.array(first)[:, 0])
    assert apart == pytest.approx(np.sqrt(2.0) * stepper.noise, rel=0.35)


def test_unsupported_plants_are_refused():
    with pytest.raises(ValueError, match=r"period = 0\.02"):
        PlantStepper(muscle(), LOAD, period=0.02)
    with pytest.raises(ValueError, match="one hysteresis"):
        PlantBatch([muscle(), SingleMuscle.mas10("none")], LOAD)


# --- the controller -----------------------------------------------------------------------------


def test_crossing_is_the_zero_nearest_the_middle():
    slopes = np.arange(-3.0, 4.0)
    assert crossing(slopes, slopes - 0.5, 3) == pytest.approx(0.5)
    twice = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    assert crossing(slopes, twice, 3) == pytest.approx(0.5)


def test_without_zero_crossing_the_gentlest_best_slope_is_used():
    slopes = np.arange(-3.0, 4.0)
    assert crossing(slopes, np.ones(7), 3) == 0.0
    assert crossing(slopes, np.maximum(slopes, 1.0), 3) == 0.0
    assert crossing(slopes, 5.0 - slopes, 3) == 3.0


@needs_kernels
def test_dead_time_is_measured_from_the_response():
    late = PlantStepper(muscle(**{"regulator.dead_time": 0.06}), LOAD)
    assert dead_periods(late) == dead_periods(PlantStepper(muscle(), LOAD)) + 5


@needs_kernels
@pytest.mark.parametrize("cause", HIDDEN | SLOW)
def test_plant_inverse_tracks_reference(cause):
    plant = muscle(**(HIDDEN | SLOW)[cause], **{"muscle.temperature": KELVIN})
    model = PlantStepper(plant, LOAD)
    reference = short(stroke(model), 6.0)["sines"]
    commands, _, position = feed_forward(PlantInverse(model, dead_periods(model) + 3), reference)
    own = position - reference[1 : len(position) + 1]
    plain = PlantStepper(muscle(), LOAD)
    other = np.empty(len(commands))
    for k, u in enumerate(commands):
        plain.step(u)
        other[k] = plain.position - reference[k + 1]
    rms = [1e3 * np.sqrt(np.mean(e[200:] ** 2)) for e in (own, other)]
    assert rms[0] < 0.02
    assert rms[1] > 4.0 * rms[0]


@needs_kernels
def test_feedback_corrects_model_error():
    plant, rig = muscle(), PlantStepper(muscle(**{"regulator.gain": 0.9}), LOAD)
    controller = design(plant)
    silent = InversePi(controller.inverse, 0.0, 0.0)
    reference = short(stroke(rig))["sines"]
    errors = [run(c, rig, reference, LOAD, 0)[200:] for c in (silent, controller)]
    assert np.mean(errors[1] ** 2) < 0.1**2 * np.mean(errors[0] ** 2)
    assert controller.integral > 0.0


def test_integral_stops_at_setpoint_limit():
    full, error = 6e5, np.array([1e-3, -1e-3, 1e-3])
    total, forward = np.array([1e4, 1e4, 1e4]), np.array([5.95e5, 6e5, 3e5])
    output, after = correction(error, total, forward, 1e7, 1e6, full)
    assert output == pytest.approx([6e5, 5.99e5, 3.21e5])
    assert after == pytest.approx([1e4, 9e3, 1.1e4])
    for lane in range(3):
        alone = correction(error[lane], total[lane], forward[lane], 1e7, 1e6, full)
        assert alone == pytest.approx((output[lane], after[lane]))
    assert correction(1.0, 0.0, 0.0, 0.0, 1e9, full)[0] == pytest.approx(AUTHORITY * full)


@needs_kernels
def test_unreachable_reference_causes_no_windup():
    plant = muscle()
    stepper, controller = PlantStepper(plant, LOAD), design(plant)
    top = stroke(stepper)
    reference = np.where(np.arange(500 + PREVIEW) < 300, 1.3 * top, 0.5 * top)
    errors = run(controller, stepper, reference, LOAD, 0)
    assert -errors[:250].min() > 0.2 * top
    assert np.abs(errors[380:]).max() < 0.02 * top


# --- the comparison -----------------------------------------------------------------------------


@needs_kernels
@pytest.mark.parametrize("cause", HIDDEN)
def test_knowledge_of_the_cause_reduces_tracking_error(cause):
    true = muscle(**HIDDEN[cause])
    rig = PlantStepper(true, LOAD, 0, kelvin=KELVIN)
    found = closed_loop(
        muscle(), true, rig=rig, references=short(stroke(rig)), load=LOAD, kelvin=KELVIN
    )
    better = found["better_percent"]
    assert better["value"] > 40.0
    assert 0.0 < better["interval"][0] <= better["value"] <= better["interval"][1]
    assert cause in COMPENSABLE


@needs_kernels
def test_equal_plants_have_equal_errors():
    found = closed_loop(muscle(), muscle(), references=short(0.01), load=LOAD)
    assert found["better_percent"] == {"value": 0.0, "interval": [0.0, 0.0]}
    assert found["recovered"] is None and found["oracle"] is None
    assert "no significant difference" in found["text"]


@needs_kernels
def test_same_arguments_give_the_same_report():
    true = muscle(**HIDDEN["dead_time"])
    one, two = (closed_loop(muscle(), true, references=short(0.01, 6.0), load=LOAD) for _ in "ab")
    assert one == two


@needs_kernels
def test_oracle_equal_to_extended_plant_has_no_gap():
    true = muscle(**HIDDEN["dead_time"])
    found = closed_loop(muscle(), true, oracle=true, references=short(0.01, 6.0), load=LOAD)
    assert found["recovered"] == pytest.approx(1.0)
    assert found["oracle"]["value"] == found["after"]["value"]
    assert "Designed on the rig itself" in found["text"]


@needs_kernels
def test_plant_without_stroke_gives_no_comparison():
    weak = muscle(**{"regulator.supply_pressure": 5e4, "hysteresis.threshold": 1e5})
    assert closed_loop(muscle(), weak, load=LOAD) is None


class Holding:
    """Holds the middle of the range and records its plant and observations."""

    def __init__(self, plant: SingleMuscle) -> None:
        self.plant, self.seen = plant, []

    def reset(self) -> None:
        self.seen.clear()

    def act(self, reference: np.ndarray, reading: float, pressure: float, load: float) -> float:
        self.seen.append((len(reference), reading, pressure, load))
        return 0.5 * self.plant.regulator.max_pressure


def test_design_routine_receives_plants_of_the_runs():
    made: list[Holding] = []

    def hold_the_middle(plant: SingleMuscle) -> Holding:
        made.append(Holding(plant))
        return made[-1]

    slipped = muscle(**{"position.slip": 1e-3})
    rest = {"rest": np.zeros(400 + PREVIEW)}
    found = closed_loop(
        muscle(**{"mass.load": 0.0}),
        slipped,
        hold_the_middle,
        references=rest,
        load=LOAD,
        kelvin=KELVIN,
    )
    assert found["controller"] == "hold the middle"
    for controller in made:
        plant = controller.plant
        assert plant.value("mass.load") == LOAD
        assert plant.value("muscle.temperature") == KELVIN
        assert plant.value("position.slip") == 0.0
        assert controller.seen[0] == (PREVIEW, 0.0, 0.0, LOAD)
        assert controller.seen[-1][2] == pytest.approx(3e5, rel=0.02)
    assert found["better_percent"]["value"] == 0.0


@needs_kernels
def test_residual_seed_and_default_references():
    residuals = Residuals(np.random.default_rng(1).normal(0.0, 5e-5, 500), 0.02)
    reports = [
        closed_loop(muscle(), muscle(), Holding, residuals=residuals, load=LOAD, seed=seed)
        for seed in (5, 5, 6)
    ]
    assert reports[0] == reports[1] != reports[2]
    assert reports[0]["where"].endswith("held-out residuals added")
    assert [r["name"] for r in reports[0]["references"]] == ["sines", "staircase", "ramps"]
    squares = [r["before"] ** 2 for r in reports[0]["references"]]
    assert reports[0]["before"]["value"] == pytest.approx(np.sqrt(np.mean(squares)))


def test_residuals_are_added_to_reading_and_position():
    trace = np.linspace(1e-4, 2e-4, 200)
    plain, moved = ReplayedRig(muscle(), None), ReplayedRig(muscle(), Residuals(trace, 0.02))
    still = PlantStepper(muscle(), LOAD)
    plain.reset(0)
    moved.reset(0)
    for u in random_holds(40):
        x, _ = still.step(u)
        reading, _ = moved.step(u)
        plain.step(u)
        extra = moved.position - still.position
        assert 1e-4 <= extra <= 2e-4
        assert reading - x == pytest.approx(extra)
    assert plain.position == still.position


def test_resampled_residuals_are_pieces_of_the_series():
    residuals = Residuals(np.arange(500.0), 0.02)
    drawn = residuals.resampled(7, 0.01, 1000)
    assert np.array_equal(drawn, residuals.resampled(7, 0.01, 1000))
    assert np.allclose(np.diff(drawn[:200]), 0.5)
    assert np.any(np.abs(np.diff(drawn)) > 1.0)
    assert drawn.min() >= 0.0 and drawn.max() <= 499.0
    assert len(Residuals(np.ones(10), 0.02).resampled(0, 0.01, 300)) == 300


def test_references_start_at_rest_and_are_within_reach():
    for name, path in fixed_references(0.02).items():
        settled = path[200:]
        assert path[0] == 0.0
        assert settled.min() >= 0.02 * LOW - 1e-12, name
        assert settled.max() <= 0.02 * HIGH + 1e-12, name
        assert np.ptp(settled) > 0.5 * 0.02 * (HIGH - LOW), name
        assert np.abs(np.diff(path)).max() < 0.02 * 1.4 * 0.01, name


def test_scores_of_known_errors():
    errors = np.concatenate([np.full(200, 9.0), np.full(400, 2e-3)])
    squares = segment_squares(errors, 0.01)
    assert squares == pytest.approx([4e-6, 4e-6])
    table = np.array([squares, squares / 4.0, squares / 16.0])[:, None, :]
    found = scores(table, ["one"], 0)
    assert found["before"]["value"] == pytest.approx(2.0)
    assert found["better_percent"]["value"] == pytest.approx(50.0)
    assert found["recovered"] == pytest.approx(1.0 / 1.5)
    assert scores(table[[1, 1, 1]], ["one"], 0)["recovered"] is None


def test_bootstrap_of_segments_is_paired():
    rng = np.random.default_rng(0)
    squares = rng.lognormal(0.0, 2.0, (1, 30)) * 1e-8
    found = scores(np.array([squares, 0.81 * squares]), ["one"], 0)
    assert found["better_percent"]["interval"] == pytest.approx([10.0, 10.0])
    low, high = found["before"]["interval"]
    assert low < 0.8 * found["before"]["value"] < found["before"]["value"] < high


def test_sentence_matches_the_numbers():
    squares = np.array([[[4e-8] * 5], [[1e-8] * 5], [[0.64e-8] * 5]])
    found = {**scores(squares, ["one"], 0), "where": "the rig"}
    text = sentence(found)
    assert "0.1 instead of 0.2 mm" in text and "50 % less" in text and "83 %" in text
    worse = sentence({**scores(squares[[1, 0]], ["one"], 0), "where": "the rig"})
    assert "100 % more" in worse and "Designed on the rig itself" not in worse


def test_position_sensor_errors_are_not_compensable():
    assert "payload_error" in COMPENSABLE
    never = {"sensor_bias", "sensor_drift", "sensor_nonlinearity", "slip_step", "stick_slip"}
    assert not never & set(COMPENSABLE)
