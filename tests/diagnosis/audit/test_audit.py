"""Audit of recordings and tables, and noise floor, on synthetic data."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from pam_envs.data.recording.recording import Recording, Rig
from pam_envs.data.tables import ContractionTable, load_contraction_table, load_readings
from pam_envs.diagnosis.audit.audit import audit, undecidable
from pam_envs.diagnosis.audit.noise import hold_ends, noise_floor, resolution
from pam_envs.diagnosis.audit.tables import repeat_trend, scatter, scatter_homogeneity
from pam_envs.diagnosis.cause import NEEDS, Cause
from pam_envs.diagnosis.causes import catalogue

PERIOD = 0.02
NOISE = {"contraction": 3e-5, "pressure": 800.0}
RIG = Rig(
    rest_length=0.2,
    max_pressure=6e5,
    contraction_noise=3e-5,
    pressure_noise=800.0,
    repeats=(("holds_a", "holds_b"),),
    valve_closed=("shut",),
    tolerance={"mass.load": 0.02},
)


def lagged(command: np.ndarray, time_constant: float) -> np.ndarray:
    keep = np.exp(-PERIOD / time_constant)
    return lfilter([0.0, 1.0 - keep], [1.0, -keep], command, zi=[command[0]])[0]


def first_order(rng: np.random.Generator, n: int, rms: float, time: float) -> np.ndarray:
    """Return noise with an exponential autocorrelation, shape (n,)."""
    keep = np.exp(-PERIOD / time)
    drive = rms * np.sqrt(1.0 - keep**2) * rng.standard_normal(n)
    drive[0] /= np.sqrt(1.0 - keep**2)
    return lfilter([1.0], [1.0, -keep], drive)


def arrays(seed: int = 0, white: float = 1.0, slow: float = 0.0, correlation: float = 1.0) -> dict:
    """Return a sound campaign: rest, holds twice, a sine, a shut valve, three loads.

    ``white`` and ``slow`` are the parts of the noise, in units of NOISE.
    """
    rng = np.random.default_rng(seed)
    holds = np.repeat([1.0, 3.0, 5.0, 2.0, 4.0, 1.5, 5.5, 3.5], 200)
    sine = 2.8 - 2.2 * np.cos(2 * np.pi * 0.5 * PERIOD * np.arange(600))
    pieces = [
        ("rest", np.zeros(200), 0.0),
        ("condition_a", holds, 0.0),
        ("holds_a", holds, 0.0),
        ("condition_b", holds[::-1], 25.0),
        ("back", holds, 0.0),
        ("holds_b", holds, 0.0),
        ("sine", sine, 45.0),
        ("shut", np.full(250, 3.0), 45.0),
    ]
    command = 1e5 * np.concatenate([piece[1] for piece in pieces])
    n = len(command)
    pressure = lagged(command, 0.08)
    contraction = 3e-8 * lagged(pressure, 0.05)
    noise = {
        name: white * rms * rng.standard_normal(n) + first_order(rng, n, slow * rms, correlation)
        for name, rms in NOISE.items()
    }
    return {
        "time": PERIOD * np.arange(n),
        "command": command,
        "pressure": pressure + noise["pressure"],
        "contraction": contraction + noise["contraction"],
        "load": np.concatenate([np.full(len(p), load) for _, p, load in pieces]),
        "segment": [label for label, p, _ in pieces for _ in p],
        "temperature": 20.0 + 2.0 * np.linspace(0.0, 1.0, n),
        "valve_closed": ("shut",),
    }


def made(**changes) -> Recording:
    columns = {**arrays(), **changes}
    return Recording.from_arrays(columns.pop("time"), columns.pop("command"), **columns)


SOUND = made()


def warnings(rig: Rig = RIG, **changes) -> str:
    """Return the warnings of the changed campaign; there must be no problems."""
    found = audit(made(**changes), rig)
    assert found.problems == ()
    return "\n".join(found.warnings)


def problem(rig: Rig = RIG, **changes) -> str:
    return "\n".join(audit(made(**changes), rig).problems)


def test_sound_recording_has_no_warning():
    for seed in range(5):
        columns = arrays(seed, white=0.8, slow=0.6)
        assert warnings(**columns) == ""
        assert undecidable(made(**columns), RIG) == {}


def test_rounded_readings_have_no_warning():
    columns = arrays()
    columns["contraction"] = 5e-5 * np.round(columns["contraction"] / 5e-5)
    columns["pressure"] = 450.0 * np.round(columns["pressure"] / 450.0)
    assert warnings(**columns) == ""


# one channel


def test_constant_reading_under_moving_command_is_a_problem():
    pressure = arrays()["pressure"].copy()
    pressure[1000:1500] = 2.5e5
    words = "pressure_bar is constant at 2.5 bar in rows 1002 to 1501 while the command moves by"
    assert words in problem(pressure=pressure)
    still = np.full_like(pressure, 1e-3)
    assert "contraction_mm holds one value in all rows" in problem(contraction=still)


def test_muscle_at_rest_below_threshold_is_a_warning():
    columns = arrays()
    low = SOUND.rows_of("condition_a")
    columns["contraction"][low[:200]] = columns["contraction"].min() - 1e-4
    columns["command"][low[:200]] = np.linspace(0.0, 2.4e5, 200)
    text = warnings(**columns)
    first = low[0] + 2
    assert f"in rows {first} to {first + 199} while the command moves by 1.8 bar" in text
    assert "friction, a threshold or the end of its range holds it" in text
    columns["command"][low[:200]] = np.linspace(0.0, 5.5e5, 200)
    assert "the sensor was stuck" in problem(**columns)


def test_constant_reading_with_valve_closed_is_accepted():
    shut = SOUND.rows_of("shut")
    columns = arrays()
    columns["command"][shut] = np.linspace(1e5, 4e5, len(shut))
    columns["contraction"][shut] = 9e-3
    assert "is constant at" not in warnings(**columns)


def test_clipped_channel_is_reported_with_rows():
    contraction = np.minimum(arrays()["contraction"], 14e-3)
    text = warnings(contraction=contraction)
    assert f"contraction_mm reads exactly 14 mm in {np.sum(contraction == 14e-3)} rows" in text
    assert "upper end of its range" in text
    pressure = np.maximum(arrays()["pressure"], 1.2e5)
    text = warnings(pressure=pressure)
    start = SOUND.rows_of("condition_a")[0]
    assert f"pressure_bar reads exactly 1.2 bar in {np.sum(pressure == 1.2e5)} rows" in text
    assert f"rows 2 to {start + 200 + 2}" in text
    assert "lower end of its range" in text


def test_resolution_coarser_than_noise_is_reported():
    contraction = 2e-4 * np.round(arrays()["contraction"] / 2e-4)
    text = warnings(contraction=contraction)
    assert "recorded in steps of 0.2 mm, coarser than its noise of 0.03 mm" in text
    assert "digit by digit" not in text  # coarse readings repeat themselves rightly


def test_resolution_is_the_common_step_of_readings():
    rng = np.random.default_rng(0)
    values = rng.normal(size=2000)
    assert resolution(values) == 0.0
    assert resolution(0.05 * np.round(values / 0.05)) == pytest.approx(0.05)
    assert resolution(np.ones(5)) == 0.0
    assert resolution(np.array([0.0, 2.0, 0.0])) == 2.0


def test_single_spikes_are_reported_with_rows():
    contraction = arrays()["contraction"].copy()
    contraction[[700, 2100]] += [2e-3, -2e-3]
    text = warnings(contraction=contraction)
    assert "contraction_mm jumps for a single sample" in text
    assert "in rows 702 and 2102; correct these readings" in text


def test_copied_stretch_is_reported_with_both_places():
    columns = arrays()
    one, two = SOUND.rows_of("holds_a"), SOUND.rows_of("holds_b")
    for name in ("contraction", "pressure"):
        columns[name][two] = columns[name][one]
    text = warnings(**columns)
    assert (
        f"the readings of rows {one[0] + 2} to {one[-1] + 2} occur again in "
        f"rows {two[0] + 2} to {two[-1] + 2}, digit by digit"
    ) in text
    columns = arrays()
    for name in ("contraction", "pressure"):
        columns[name][3000:3049] = columns[name][1000:1049]
    assert "digit by digit" not in warnings(**columns)  # 49 rows are too few
    for name in ("contraction", "pressure"):
        columns[name][3000:3063] = columns[name][1000:1063]
    assert "rows 1002 to 1064 occur again in rows 3002 to 3064" in warnings(**columns)


def test_fast_recording_is_checked_before_averaging():
    n = 4000
    rng = np.random.default_rng(1)
    command = 1e5 * (2.0 + np.sin(np.arange(n) / 200.0))
    pressure = command + 800.0 * rng.standard_normal(n)
    pressure[1501] += 1e5
    fast = Recording.from_arrays(np.arange(n) / 500.0, command, pressure=pressure)
    assert "in row 1503;" in "".join(audit(fast).warnings)


def test_declared_noise_is_compared_with_single_readings():
    rng = np.random.default_rng(1)
    command = np.repeat(1e5 * rng.uniform(0.0, 5.0, 20), 2000)
    pressure = command + 800.0 * rng.standard_normal(40_000)
    fast = Recording.from_arrays(np.arange(40_000) / 500.0, command, pressure=pressure)
    floor = noise_floor(fast, Rig(pressure_noise=800.0))
    assert floor["pressure"].value == pytest.approx(800.0 / np.sqrt(5.0), rel=0.06)
    assert floor["pressure"].reading == pytest.approx(800.0, rel=0.06)
    assert floor.warnings == ()
    assert "declared" in noise_floor(fast, Rig(pressure_noise=400.0)).warnings[0]
    assert noise_floor(SOUND, RIG)["pressure"].reading == pytest.approx(800.0, rel=0.06)


# units


def scaled(**factors: float) -> dict:
    return {name: factor * arrays()[name] for name, factor in factors.items()}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (scaled(pressure=100.0), "pressure_bar goes up to 551.3; it looks like kPa: divide by 100"),
        (scaled(pressure=14.5), "goes up to 79.94; it looks like psi: divide by 14.504"),
        (scaled(pressure=0.1), "command goes to 5.5 bar; it looks like MPa: multiply by 10"),
        (scaled(pressure=1e-3), "the command goes to 5.5 bar; no muscle runs at this pressure"),
        (
            scaled(command=100.0, pressure=100.0),
            "command_bar goes up to 550; it looks like kPa",
        ),
        (
            scaled(command=14.5, pressure=14.5),
            "command_bar goes up to 79.75; it looks like psi",
        ),
        (
            scaled(command=0.1),
            "pressure goes to 5.52 bar; it looks like MPa: multiply by 10",
        ),
        (scaled(contraction=10.0), "more than 40% of the rest length of 200 mm; check its unit"),
        ({"contraction": 0.2 - arrays()["contraction"]}, "looks like the muscle's length"),
        (
            {"load": arrays()["load"] / 9.80665, "force": arrays()["load"] + 0.1},
            "load_N looks like kilograms: multiply by 9.80665",
        ),
        (scaled(load=-1.0), "load_N goes down to -45 N"),
    ],
)
def test_wrong_unit_or_sign_is_a_problem(changes, text):
    assert text in problem(**changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (scaled(command=0.0, pressure=1e-3), "never exceeds 0 bar: nothing is excited"),
        (scaled(command=0.1, pressure=0.1), "if the pressures are in MPa, multiply by 10"),
        ({"pressure": arrays()["pressure"] + 1.013e5}, "if it is absolute, subtract 1.013"),
        (scaled(contraction=-1.0), "contraction_mm falls as the pressure rises"),
        (scaled(load=1.0 / 9.80665), "if load_N is in kilograms"),
        ({"supply": np.full(len(arrays()["time"]), 7e5)}, "supply_pressure_bar is not used"),
    ],
)
def test_suspicious_values_are_warnings(changes, text):
    assert text in warnings(**changes)


def test_stroke_in_metres_is_detected():
    for rig in (RIG, Rig(), Rig(rest_length=0.2)):
        text = problem(rig, **scaled(contraction=1e-3))
        assert "contraction_mm spans only 0.0" in text
        assert "over 5.5 bar; it looks like metres: multiply by 1000" in text
    assert "looks like metres" in problem(Rig(rest_length=2.0), **scaled(contraction=0.2))
    assert "looks like metres" not in warnings(Rig(), **scaled(contraction=0.2))


def test_small_stroke_at_low_pressure_is_accepted():
    narrow = scaled(command=0.2, pressure=0.2, contraction=1e-3)
    assert "if it is in metres, multiply by 1000" in warnings(Rig(), **narrow)
    jig = np.random.default_rng(0).normal(0.0, 3e-5, len(SOUND.time))
    assert audit(made(contraction=jig), RIG).problems == ()


def test_unused_declarations_are_reported():
    text = warnings(dataclasses.replace(RIG, cycles_since_rest=3))
    assert "history.cycles_since_rest = 3 is not used: the replay starts" in text
    known = {"mass.load": 0.02, "muscle.area": 0.1, "muscle.rest_length": 0.01}
    text = warnings(dataclasses.replace(RIG, tolerance=known))
    assert text == "tolerance of muscle.rest_length is not used: no refit moves it"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("mass.laod", "tolerance names 'mass.laod'; did you mean 'mass.load'?"),
        ("engine.oil", "'engine.oil', which is not a parameter of the plant"),
    ],
)
def test_tolerance_of_unknown_parameter_is_a_problem(name, text):
    assert text in problem(dataclasses.replace(RIG, tolerance={name: 0.02}))


def test_command_above_regulator_range_is_reported():
    text = warnings(dataclasses.replace(RIG, max_pressure=5e5))
    assert "the command goes to 5.5 bar, above the regulator's 5 bar" in text


# what is missing


def test_missing_experiments_are_reported():
    text = warnings(
        Rig(),
        load=25.0,
        temperature=None,
        pressure=None,
        command=arrays()["command"] + 5e4,
        segment=None,
        valve_closed=(),
    )
    for sentence in (
        "the load was 25 N throughout: causes that act with the load cannot be decided",
        "no segments repeat one another",
        "there is no column temperature_C",
        "there is no column pressure_bar",
        "is never near 0 bar",
    ):
        assert sentence in text
    assert "there is no column contraction_mm" in warnings(contraction=None)


def test_notes_of_reading_are_warnings():
    recording = dataclasses.replace(SOUND, notes=("row 7 was mended",))
    assert audit(recording, RIG).warnings[0] == "row 7 was mended"


def test_unknown_segments_in_rig_file_are_a_problem():
    assert "'holds_c'" in problem(Rig(repeats=(("holds_a", "holds_c"),)))


def test_repeats_with_different_commands_are_reported():
    rig = dataclasses.replace(RIG, repeats=(("holds_a", "condition_b"),))
    assert "'holds_a' and 'condition_b' should repeat one another" in warnings(rig)


def test_missing_columns_make_causes_undecidable():
    found = undecidable(made(temperature=None, load=25.0, pressure=None, valve_closed=()), RIG)
    assert set(found) == {
        *("temperature", "payload_error", "load_dependent_hysteresis"),
        *("load_dependent_compliance", "wire_slack", "leak"),
    }
    reasons = undecidable(made(contraction=None))
    assert set(reasons) == {c.name for c in catalogue() if "contraction" in c.needs}
    assert set(reasons.values()) == {"the contraction was not recorded"}
    assert {"creep", "slip_step", "sensor_delay", "stick_slip", "wire_slack"} <= set(reasons)
    assert not {"valve_dead_band", "dead_time"} & set(reasons)


def unrested(cycles: int) -> Rig:
    return dataclasses.replace(RIG, cycles_since_rest=cycles)


NEEDY = [
    ("contraction", made(contraction=None), RIG, "the contraction was not recorded"),
    ("pressure", made(pressure=None), RIG, "the pressure was not recorded"),
    ("loads", made(load=25.0), RIG, "the load was 25 N throughout"),
    ("weighed", SOUND, Rig(), "is declared; add tolerance: {mass.load: 0.02} to RIG.yaml"),
    ("temperature", made(temperature=None), RIG, "the temperature was not recorded"),
    ("temperature", made(temperature=np.full(len(SOUND.time), 20.0)), RIG, "varied by only 0 K"),
    ("valve_closed", made(valve_closed=()), RIG, "the valve was never shut"),
    ("rest", SOUND, unrested(6), "6 cycles since it rested"),
    ("exhaust", made(command=np.sort(arrays()["command"])), RIG, "never falls by more than"),
]


@pytest.mark.parametrize(("word", "poor", "rig", "reason"), NEEDY)
def test_requirements_of_a_users_cause_are_checked(word, poor, rig, reason):
    always = {"command"}  # in every recording of a single muscle
    assert {row[0] for row in NEEDY} == set(NEEDS) - always
    cause = Cause("gremlins", "gremlins", (), needs=(word,))
    assert undecidable(SOUND, unrested(5), [cause]) == {}
    found = undecidable(poor, rig, [cause, Cause("modest", "a modest one", ())])
    assert set(found) == {"gremlins"}
    assert reason in found["gremlins"]


def test_unknown_requirement_is_refused():
    with pytest.raises(ValueError, match="'load', which no recording has; did you mean 'loads'"):
        Cause("gremlins", "gremlins", (), needs=("contraction", "load"))
    with pytest.raises(ValueError, match="known: contraction"):
        Cause("gremlins", "gremlins", (), needs=("magic",))
    with pytest.raises(ValueError, match="give a tuple"):
        Cause("gremlins", "gremlins", (), needs="loads")


def test_leak_needs_more_than_two_seconds_of_closed_valve():
    columns = arrays()
    shut = SOUND.rows_of("shut")
    columns["segment"][shut[100] :] = ["after"] * (len(shut) - 100)
    assert "leak" in undecidable(made(**columns))
    columns["segment"][shut[100] : shut[100] + 50] = ["shut"] * 50
    assert "leak" not in undecidable(made(**columns))


# the noise floor


@pytest.mark.parametrize(
    ("white", "slow", "correlation"), [(1.0, 0.0, 1.0), (0.8, 0.6, 0.3), (0.7, 0.7, 1.0)]
)
def test_noise_floor_estimates_white_and_coloured_noise(white, slow, correlation):
    true = np.hypot(white, slow)
    found = {"repeats": [], "holds": [], "innovations": []}
    for seed in range(4):
        floor = noise_floor(made(**arrays(seed, white, slow, correlation)), RIG)
        for channel, rms in NOISE.items():
            assert floor[channel].source == "repeats"
            for name, value in floor[channel].estimates.items():
                found[name].append(value / rms)
    assert np.mean(found["repeats"]) == pytest.approx(true, rel=0.06)
    assert np.mean(found["holds"]) == pytest.approx(true, rel=0.12)
    assert np.mean(found["innovations"]) == pytest.approx(white, rel=0.06)


def test_noise_source_falls_back_to_holds_then_innovations():
    assert noise_floor(SOUND, Rig())["pressure"].source == "holds"
    n = 3000
    rng = np.random.default_rng(0)
    command = 1e5 * (2.5 + 2.0 * np.sin(0.01 * np.arange(n)))
    moving = Recording.from_arrays(
        PERIOD * np.arange(n), command, pressure=command + 800.0 * rng.standard_normal(n)
    )
    floor = noise_floor(moving)
    assert floor["pressure"].source == "innovations"
    assert floor["pressure"].value == pytest.approx(800.0, rel=0.06)
    with pytest.raises(KeyError, match="contraction was not recorded"):
        floor["contraction"]


def test_offset_between_repeats_is_not_noise():
    contraction = arrays()["contraction"].copy()
    contraction[SOUND.rows_of("holds_b")] += 1e-3
    floor = noise_floor(made(contraction=contraction), RIG)["contraction"]
    assert floor.source == "repeats"
    assert floor.value == pytest.approx(3e-5, rel=0.06)


def test_outliers_and_copies_do_not_change_noise_floor():
    contraction = arrays()["contraction"].copy()
    second = SOUND.rows_of("holds_b")
    contraction[second[::97]] += 5e-3
    floor = noise_floor(made(contraction=contraction), RIG)["contraction"]
    assert floor.estimates["repeats"] == pytest.approx(3e-5, rel=0.06)
    contraction[second] = contraction[SOUND.rows_of("holds_a")]
    floor = noise_floor(made(contraction=contraction), RIG)["contraction"]
    assert "repeats" not in floor.estimates
    assert floor.value == pytest.approx(3e-5, rel=0.1)


@pytest.mark.parametrize(
    ("factor", "warned"), [(0.5, True), (0.8, False), (1.25, False), (2.0, True)]
)
def test_wrong_declared_noise_is_reported(factor, warned):
    rig = dataclasses.replace(RIG, contraction_noise=factor * 3e-5)
    floor = noise_floor(SOUND, rig)
    assert floor["contraction"].declared == factor * 3e-5
    assert floor["contraction"].value == pytest.approx(3e-5, rel=0.06)
    text = f"contraction: the declared noise is {factor * 0.03:.3g} mm, the repeats say 0.0"
    assert any(warning.startswith(text) for warning in floor.warnings) is warned
    assert (text in warnings(rig)) is warned


def test_noise_below_the_resolution_is_replaced_by_the_rounding_error():
    """A reading that never moves within a hold has the error of its rounding."""
    columns = arrays(white=0.0)
    contraction = 1e-4 * np.round(columns["contraction"] / 1e-4)
    pressure = np.zeros_like(contraction)
    floor = noise_floor(made(contraction=contraction, pressure=pressure))
    assert floor["contraction"].value == pytest.approx(1e-4 / np.sqrt(12.0))
    assert floor["pressure"].source == "declared"
    assert floor["pressure"].value == 0.0
    assert "no noise can be seen in the recording; declare the sensor's" in floor.warnings[-1]
    floor = noise_floor(made(pressure=pressure), RIG)
    assert floor["pressure"].value == 800.0


def test_hold_ends_are_settled_and_within_one_experiment():
    recording = SOUND
    for end in hold_ends(recording):
        assert np.ptp(recording.command[end]) == 0.0
        assert np.ptp(recording.load[end]) == 0.0
        before = recording.command[end[0] - 75 : end[0]]
        assert np.ptp(before) == 0.0
        assert len(end) * PERIOD >= 1.0
    assert len(hold_ends(recording)) > 20


# tables


def test_published_table_is_audited():
    """The figures of the tables' own analysis: only the unloaded muscle drifts."""
    table = load_contraction_table()
    trend = repeat_trend(table, 0.0)
    assert trend.slope == pytest.approx(0.033e-3, abs=0.0005e-3)
    assert trend.t == pytest.approx(3.0, abs=0.1)
    assert trend.t_means == pytest.approx(2.7, abs=0.1)
    assert abs(repeat_trend(table, 2.55).t) < 1.0
    assert scatter(table, 0.0) == pytest.approx(0.177e-3, abs=0.0005e-3)
    assert scatter_homogeneity(table) == pytest.approx(0.006, abs=0.0005)
    text = "\n".join(audit(table).warnings)
    assert audit(table).problems == ()
    assert "the readings at 0 kg drift by +0.033 mm a repeat (t = 3.0, 2.7 from" in text
    assert "at 2.55 kg drift" not in text
    assert "Levene p = 0.0062): 0.177 mm at 0 kg, 0.133 mm at 2.55 kg, 0.136 mm" in text
    assert "a quadratic load law cannot be separated from a dead zone" in text


def test_even_table_of_five_loads_has_no_warning():
    assert audit(_table(np.random.default_rng(3), loads=5)).warnings == ()


def test_identical_repeats_are_reported():
    table = _table(np.random.default_rng(3), loads=5)
    contraction = table.contraction_m.copy()
    at = table.load_kg == 2.0
    contraction[at & (table.repeat == 3)] = contraction[at & (table.repeat == 1)]
    text = "\n".join(audit(dataclasses.replace(table, contraction_m=contraction)).warnings)
    assert "repeats 1 and 3 at 2 kg are equal digit by digit" in text


def test_few_loads_and_single_repeats_are_reported(tmp_path):
    table = _table(np.random.default_rng(0), loads=1, repeats=1)
    text = "\n".join(audit(table).warnings)
    assert "there is one load" in text
    assert "the noise floor is not known" in text
    with pytest.raises(ValueError, match="one repeat at 0 kg shows no trend"):
        repeat_trend(table, 0.0)
    assert "two loads" in audit(_table(np.random.default_rng(0), loads=2)).warnings[0]
    path = tmp_path / "table.csv"
    path.write_text(
        "load_kg,pressure_bar,direction,repeat,contraction_mm\n0,0,up,1,0\n0,2,up,1,3\n0,1,up,2,2\n"
    )
    assert "follow different paths" in audit(load_readings(path)).warnings[-1]


def _table(rng: np.random.Generator, loads: int, repeats: int = 4) -> ContractionTable:
    path = np.r_[np.arange(0.0, 6.0), np.arange(6.0, -1.0, -1.0)]
    n = len(path)
    shape = (loads, repeats, n)
    base = np.broadcast_to(2.0 * path, shape) + 0.1 * rng.standard_normal(shape)
    base[:, :, 0] = 0.0
    return ContractionTable(
        load_kg=np.repeat(np.arange(float(loads)), repeats * n),
        inflating=np.tile(np.arange(n) <= np.argmax(path), loads * repeats),
        pressure_pa=np.tile(1e5 * path, loads * repeats),
        repeat=np.tile(np.repeat(np.arange(1, repeats + 1), n), loads),
        contraction_m=1e-3 * base.ravel(),
    )
