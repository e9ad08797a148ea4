"""Recordings, tables of readings and rig files: reading, repair and refusal."""

import dataclasses
import gzip
import pickle
from pathlib import Path

import numpy as np
import pytest
import yaml

from pam_envs.data.recording.recording import (
    COLUMNS,
    Recording,
    RecordingError,
    Rig,
    load_readings,
    load_recording,
    read_input,
    repeat_rows,
)
from pam_envs.data.rig_file import KEYS
from pam_envs.data.tables import one_path

HEAD = "time_s,pressure_command_bar,pressure_bar"


def sheet(n: int = 100, period: float = 0.02, **changes) -> dict[str, list]:
    """Return the columns of a sound recording of two segments, in the file's units."""
    k = np.arange(n)
    columns = {
        "time_s": np.round(period * k, 6).tolist(),
        "segment": ["a"] * (n // 2) + ["b"] * (n - n // 2),
        "pressure_command_bar": np.round(2.0 + np.sin(k / 10), 4).tolist(),
        "pressure_bar": np.round(2.0 + np.sin(k / 10 - 0.2), 4).tolist(),
        "contraction_mm": np.round(5.0 + 2.0 * np.sin(k / 10 - 0.4), 4).tolist(),
        "load_N": [25.0] * n,
    }
    columns.update(changes)
    return {name: list(values) for name, values in columns.items() if values is not None}


def write(folder: Path, columns: dict[str, list]) -> Path:
    rows = [columns, *zip(*columns.values(), strict=True)]
    return file_of(folder, *(",".join(map(str, row)) for row in rows))


def file_of(folder: Path, *lines: str, name: str = "rig.csv") -> Path:
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def refusal(path: Path, rig: Rig | None = None) -> str:
    with pytest.raises(RecordingError) as caught:
        load_recording(path, rig)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_compressed_recording_equals_the_plain_one(tmp_path):
    plain = write(tmp_path, sheet())
    packed = tmp_path / "rig.csv.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    one, two = load_recording(plain), load_recording(packed)
    assert one.digest == two.digest
    assert one.contraction.tolist() == two.contraction.tolist()
    packed.write_bytes(packed.read_bytes()[:-200])
    assert "is not a complete gzip file" in refusal(packed)
    packed.write_bytes(plain.read_bytes())
    assert "compress the CSV again" in refusal(packed)


def test_columns_become_si_arrays(tmp_path):
    columns = sheet(temperature_C=[21.5] * 100, supply_pressure_bar=[7.0] * 100, force_N=[30] * 100)
    got = load_recording(write(tmp_path, columns))
    assert got.period == pytest.approx(0.02)
    np.testing.assert_allclose(got.time, columns["time_s"], atol=1e-12)
    np.testing.assert_allclose(got.command, 1e5 * np.array(columns["pressure_command_bar"]))
    np.testing.assert_allclose(got.pressure, 1e5 * np.array(columns["pressure_bar"]))
    np.testing.assert_allclose(got.contraction, 1e-3 * np.array(columns["contraction_mm"]))
    constant = {"load": 25.0, "temperature": 21.5, "supply": 7e5, "force": 30.0}
    constant |= {"valve_closed": False, "filled": False}
    assert all((getattr(got, name) == value).all() for name, value in constant.items())
    assert got.segments == ("a", "b")
    assert (got.segment == np.repeat([0, 1], 50)).all()
    assert got.restart.tolist() == [True] + [False] * 99
    assert got.row.tolist() == list(range(2, 102))
    assert (got.notes, got.raw) == ((), None)


def test_columns_may_be_in_any_order_and_blank_rows_count(tmp_path):
    columns = sheet()
    path = write(tmp_path, dict(reversed(columns.items())))
    lines = path.read_text().splitlines()
    path.write_text("\ufeff" + "\n".join([*lines[:3], "", *lines[3:]]), encoding="utf-8")
    got = load_recording(path)
    np.testing.assert_allclose(got.contraction, 1e-3 * np.array(columns["contraction_mm"]))
    assert got.row.tolist()[:4] == [2, 3, 5, 6]


def test_arrays_and_file_agree(tmp_path):
    columns = sheet()
    from_file = load_recording(write(tmp_path, columns))
    made = Recording.from_arrays(
        columns["time_s"],
        1e5 * np.array(columns["pressure_command_bar"]),
        pressure=1e5 * np.array(columns["pressure_bar"]),
        contraction=1e-3 * np.array(columns["contraction_mm"]),
        load=25.0,
        segment=columns["segment"],
    )
    assert made.digest == from_file.digest
    assert made.source == "arrays"
    assert len(pickle.loads(pickle.dumps(made)).time) == 100
    with pytest.raises(ValueError, match="read-only"):
        made.command[0] = 1.0
    other = Recording.from_arrays(made.time, made.command + 1.0, pressure=made.pressure)
    assert other.digest != made.digest


BAD = 0.02 * np.arange(50)
BAD[[3, 7]] = np.nan


@pytest.mark.parametrize(
    ("columns", "problem"),
    [
        ({"pressure": np.ones(49)}, r"pressure has the shape \(49,\), time has \(50,\)"),
        ({"contraction": BAD}, "contraction is not finite in rows 5 and 9"),
        ({"contraction": np.ones(50), "segment": ["a"] * 3}, "3 labels for 50 samples"),
        ({}, "at least one of pressure and contraction"),
    ],
)
def test_arrays_are_checked(columns, problem):
    time = 0.02 * np.arange(50)
    with pytest.raises(RecordingError, match=problem):
        Recording.from_arrays(time, time, **columns)


def test_without_segment_and_load(tmp_path):
    got = load_recording(write(tmp_path, sheet(segment=None, load_N=None, contraction_mm=None)))
    assert got.segments == ("all",)
    assert got.contraction is None
    assert (got.load == 0.0).all()
    assert got.notes == ("there is no column load_N; the load is taken as 0 N throughout",)


# columns


@pytest.mark.parametrize(
    ("wrong", "hint"),
    [
        ("contraction_cm", "give contraction_mm instead: multiply by 10"),
        ("time_ms", "give time_s instead: divide by 1000"),
        ("pressure_kPa", "give pressure_bar instead: divide by 100"),
        ("load_kg", "give load_N instead: multiply by 9.80665"),
        ("temperature", "give temperature_C, with the unit in the name"),
        ("presure_bar", "did you mean 'pressure_bar'?"),
        ("Contraction_mm", "did you mean 'contraction_mm'?"),
        ("colour", "known: time_s, segment"),
        ("", "name it or take it out"),
    ],
)
def test_unknown_columns_are_refused_with_a_hint(tmp_path, wrong, hint):
    text = refusal(write(tmp_path, {**sheet(), wrong: [1.0] * 100}))
    assert f"unknown column {wrong!r}" in text
    assert hint in text


def test_every_missing_column_is_named(tmp_path):
    text = refusal(write(tmp_path, sheet(time_s=None, pressure_command_bar=None)))
    assert "needs the column time_s" in text
    assert "needs the column pressure_command_bar" in text
    text = refusal(write(tmp_path, sheet(pressure_bar=None, contraction_mm=None)))
    assert "at least one of the columns pressure_bar and contraction_mm" in text
    only_force = sheet(pressure_bar=None, contraction_mm=None, force_N=[1.0] * 100)
    assert "force_N is not supported as the only output" in refusal(write(tmp_path, only_force))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "is empty"),
        ("time_s,\xff", "UTF-8"),
        ("time_s;pressure_command_bar\n0;1\n", "separated by ';'"),
        (f"{HEAD}\n", "no rows below the header"),
        ("time_s,pressure_bar,pressure_bar\n0,1,1\n", "column pressure_bar appears twice"),
        (
            "time_s,pressure_command_bar,pressure_bar\n0,1,1\n0.02,1\n0.04,1,1,1\n",
            "got 2 in rows 3",
        ),
    ],
)
def test_malformed_files_are_refused(tmp_path, text, problem):
    path = tmp_path / "odd.csv"
    path.write_bytes(text.encode("latin-1"))
    assert problem in refusal(path)
    assert "cannot be read" in refusal(tmp_path / "none.csv")
    assert "5 rows are too few" in refusal(write(tmp_path, sheet(5)))


# cells


def test_empty_cells_are_named_and_counted(tmp_path):
    columns = sheet()
    for i in range(10, 18):
        columns["contraction_mm"][i] = ""
    columns["load_N"][3] = ""
    columns["segment"][0] = ""
    assert "column segment is empty in row 2" in refusal(write(tmp_path, columns))
    columns["segment"][0] = "a"
    text = refusal(write(tmp_path, columns))
    assert "column contraction_mm is empty in rows 12, 13, 14, 15, 16 and 3 more" in text
    assert "column load_N is empty in row 5" in text


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf", "n/a", "1.2.3"])
def test_cell_that_is_no_number_is_named(tmp_path, bad):
    columns = sheet()
    columns["pressure_bar"][7] = columns["pressure_bar"][20] = bad
    columns["time_s"][50] = "later"
    text = refusal(write(tmp_path, columns))
    assert f"column pressure_bar holds no number in rows 9 and 22 (the first is {bad!r})" in text
    assert "column time_s holds no number in row 52" in text
    columns["pressure_bar"][7] = '"2,5"'
    assert "write decimals with a point" in refusal(write(tmp_path, columns))


def test_a_few_missing_temperatures_are_interpolated(tmp_path):
    columns = sheet(temperature_C=(20.0 + 0.01 * np.arange(100)).tolist())
    columns["temperature_C"][40] = columns["temperature_C"][41] = ""
    got = load_recording(write(tmp_path, columns))
    np.testing.assert_allclose(got.temperature, 20.0 + 0.01 * np.arange(100))
    assert got.notes == ("column temperature_C is empty in rows 42 and 43; interpolated",)
    columns["temperature_C"][:5] = [""] * 5
    text = refusal(write(tmp_path, columns))
    assert "column temperature_C is empty in rows 2, 3, 4, 5, 6 and 2 more" in text
    assert "fewer than 5% may be" in text


# time


def test_time_must_increase_inside_a_segment(tmp_path):
    columns = sheet()
    columns["time_s"][20] = columns["time_s"][19]
    columns["time_s"][80] = 0.3
    text = refusal(write(tmp_path, columns))
    assert "does not increase inside a segment at rows 22 and 82" in text
    assert "from 0.38 s to 0.38 s" in text


def test_time_restart_with_a_segment_restarts_the_muscle(tmp_path):
    columns = sheet()
    columns["time_s"][50:] = columns["time_s"][:50]
    got = load_recording(write(tmp_path, columns))
    assert np.flatnonzero(got.restart).tolist() == [0, 50]
    np.testing.assert_allclose(got.time[50:], columns["time_s"][:50], atol=1e-12)


def test_gaps_inside_a_segment_are_refused(tmp_path):
    columns = sheet()
    columns["time_s"][20:] = [t + 0.1 for t in columns["time_s"][20:]]
    text = refusal(write(tmp_path, columns))
    assert "nothing was recorded for 0.12 s (6 periods) between rows 21 and 22" in text
    assert "inside segment 'a'" in text


def test_a_gap_between_segments_needs_a_held_command(tmp_path):
    columns = sheet()
    columns["time_s"][50:] = [t + 5.0 for t in columns["time_s"][50:]]
    text = refusal(write(tmp_path, columns))
    assert "the command changes in the 5.02 s between rows 51 and 52, before segment 'b'" in text
    columns["pressure_command_bar"][50] = columns["pressure_command_bar"][49]
    got = load_recording(write(tmp_path, columns))
    assert len(got.time) == 350
    np.testing.assert_allclose(np.diff(got.time), 0.02, atol=1e-9)
    assert np.flatnonzero(got.filled).tolist() == list(range(50, 300))
    assert (got.command[50:300] == got.command[49]).all()
    assert (got.segment[50:300] == 0).all()
    after = 1e-3 * np.array(columns["contraction_mm"][50:])
    np.testing.assert_allclose(got.contraction[300:], after)
    assert len(got.rows_of("a")) == 50
    assert got.notes == ("nothing was recorded after row 51; the command is taken as held",)
    columns["time_s"][50:] = [t + 700.0 for t in columns["time_s"][50:]]
    assert "more than 600 s" in refusal(write(tmp_path, columns))


def test_slow_recordings_are_refused(tmp_path):
    text = refusal(write(tmp_path, sheet(period=0.5)))
    assert "one sample every 0.5 s" in text
    assert "quasi-static table (load_kg" in text
    assert "milliseconds" not in text
    assert "then divide time_s by 1000" in refusal(write(tmp_path, sheet(period=20.0)))
    assert load_recording(write(tmp_path, sheet(period=0.2))).period == pytest.approx(0.2)


def test_segments_need_one_rate(tmp_path):
    columns = sheet(1000)
    columns["time_s"][500:] = (10.0 + 0.05 * np.arange(500)).round(3).tolist()
    assert "record all segments at one rate" in refusal(write(tmp_path, columns))


def test_rounded_times_leave_the_values_unchanged(tmp_path):
    """60 Hz in whole milliseconds: 17, 16, 17 ms; each sample stays what it was."""
    time = np.round(np.arange(600) / 60.0, 3)
    columns = sheet(600, time_s=time.tolist())
    got = load_recording(write(tmp_path, columns))
    assert got.period == pytest.approx(1 / 60, rel=1e-5)
    np.testing.assert_allclose(got.contraction, 1e-3 * np.array(columns["contraction_mm"]))
    assert got.notes == ()


def test_uneven_samples_are_interpolated_and_the_command_held(tmp_path):
    rng = np.random.default_rng(3)
    time = 0.02 * np.arange(500) + rng.uniform(-0.005, 0.005, 500)
    time[0] = 0.0
    smooth = 5.0 + np.sin(time)
    command = np.where(time < 3.0, 1.0, 2.0)
    columns = sheet(500, time_s=time, contraction_mm=smooth, pressure_command_bar=command)
    got = load_recording(write(tmp_path, columns))
    np.testing.assert_allclose(got.contraction, 1e-3 * (5.0 + np.sin(got.time)), atol=1e-7)
    assert set(got.command) == {1e5, 2e5}
    risen = got.time[np.argmax(got.command > 1.5e5)]
    assert risen == pytest.approx(3.0, abs=0.5 * got.period + 5e-3)
    assert "not evenly spaced" in got.notes[0]


def test_single_lost_samples_are_interpolated(tmp_path):
    columns = sheet()
    for values in columns.values():
        del values[30]
    got = load_recording(write(tmp_path, columns))
    assert len(got.time) == 100
    assert got.contraction[30] == pytest.approx(got.contraction[[29, 31]].mean())
    assert got.command[30] == got.command[29]
    assert got.notes == ("samples are missing after row 31; interpolated",)


@pytest.mark.parametrize(("rate", "kept"), [(200.0, 100.0), (250.0, 250 / 3), (1000.0, 100.0)])
def test_fast_recordings_are_averaged_without_a_shift_in_time(tmp_path, rate, kept):
    n = int(10 * rate)
    time = np.arange(n) / rate
    stairs = {"contraction_mm": 5.0 + time, "pressure_command_bar": np.floor(time) / 2}
    columns = sheet(n, time_s=np.round(time, 6), **stairs)
    got = load_recording(write(tmp_path, columns))
    assert 1 / got.period == pytest.approx(kept)
    inner = slice(2, -2)
    np.testing.assert_allclose(got.contraction[inner], 1e-3 * (5.0 + got.time[inner]), atol=1e-9)
    steps = got.time[1:][np.diff(got.command) > 0.0]
    np.testing.assert_allclose(steps, np.arange(1, 10), atol=0.51 * got.period)
    assert len(got.raw.time) == n
    assert "samples were averaged" in got.notes[-1]
    assert got.row[1] == 2 + round(got.period * rate)


def test_averaging_lowers_white_noise(tmp_path):
    noise = np.random.default_rng(0).normal(0.0, 1.0, 10_000)
    columns = sheet(10_000, 0.001, contraction_mm=noise.tolist())
    got = load_recording(write(tmp_path, columns))
    assert got.contraction[1:-1].std() == pytest.approx(1e-3 / np.sqrt(10.0), rel=0.1)


def test_runs_are_averaged_separately():
    time = np.r_[np.arange(400), np.arange(400)] / 200.0
    value = np.repeat([1.0, 3.0], 400)
    got = Recording.from_arrays(time, value, contraction=value, segment=["a"] * 400 + ["b"] * 400)
    assert np.flatnonzero(got.restart).tolist() == [0, 200]
    assert (got.contraction == np.repeat([1.0, 3.0], 200)).all()


# segments and load


def test_label_names_one_continuous_segment(tmp_path):
    columns = sheet()
    columns["segment"][80:] = ["a"] * 20
    text = refusal(write(tmp_path, columns))
    assert "segment 'a' starts again in row 82" in text
    assert "'a_2'" in text


def test_load_change_inside_a_segment_is_reported(tmp_path):
    columns = sheet(load_N=[25.0] * 20 + [30.0] * 30 + [40.0] * 50)
    got = load_recording(write(tmp_path, columns))
    assert len(got.notes) == 1
    assert "changes inside segment 'a' at row 22;" in got.notes[0]
    assert got.load[[19, 20, 50]].tolist() == [25.0, 30.0, 40.0]


def test_rig_file_must_name_existing_segments(tmp_path):
    path = write(tmp_path, sheet(101))
    assert load_recording(path, Rig(valve_closed=("b",))).valve_closed.sum() == 51
    text = refusal(path, Rig(repeats=(("a", "bb"),), valve_closed=("shut",)))
    assert "names the segment 'bb', which the recording lacks" in text
    assert "'shut'" in text
    rig = Rig(repeats=(("a", "b"),))
    groups = repeat_rows(load_recording(path, rig), rig)
    assert [len(rows) for rows in groups[0]] == [50, 50]
    assert groups[0][1][0] == 50
    uneven = sheet(103, segment=["a"] * 50 + ["b"] * 53)
    text = refusal(write(tmp_path, uneven), rig)
    assert "'a' has 50, 'b' has 53 samples" in text


# rig files

SHOWN = Rig(
    plant="single_muscle",
    rest_length=0.2,
    diameter=0.01,
    max_pressure=6e5,
    contraction_noise=3e-5,
    pressure_noise=800.0,
    settled=True,
    clock_tolerance=0.0,
    repeats=(("holds_a", "holds_b"),),
    valve_closed=("shut",),
    tolerance={"mass.load": 0.02},
    parameters={"mass.moving_mass": 0.4},
)
"""That of the page."""
FULL = """
plant: single_muscle
muscle: {rest_length_mm: 200, diameter_mm: 10}
regulator: {max_pressure_bar: 6}
load: constant_force
sensors: {contraction_noise_mm: 0.03, pressure_noise_bar: 0.008}
history: {cycles_since_rest: 3, rezeroed: true}
repeats: [[holds_a, holds_b], [1, 2]]
valve_closed: [shut]
tolerance: {mass.load: 0.02}
parameters: {mass.moving_mass: 0.4}
"""


def rig_file(folder: Path, text: str) -> Path:
    return file_of(folder, text, name="rig.yaml")


def test_rig_file_is_converted_to_si(tmp_path):
    rig = Rig.from_yaml(rig_file(tmp_path, FULL))
    assert rig == dataclasses.replace(
        SHOWN,
        load="constant_force",
        cycles_since_rest=3,
        rezeroed=True,
        settled=False,
        clock_tolerance=None,
        repeats=(("holds_a", "holds_b"), ("1", "2")),
    )
    assert pickle.loads(pickle.dumps(rig)) == rig


def test_every_rig_file_key_except_the_plant_is_optional(tmp_path):
    assert Rig.from_yaml(rig_file(tmp_path, "plant: single_muscle\nmuscle:\n")) == Rig()
    with pytest.raises(ValueError, match="name the plant's family"):
        Rig.from_yaml(rig_file(tmp_path, "load: hanging_mass"))


WRONG = yaml.safe_load(Path(__file__).with_name("wrong_rig_lines.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("line", "problem"), WRONG)
def test_wrong_rig_file_is_refused_with_a_remedy(tmp_path, line, problem):
    path = rig_file(tmp_path, f"plant: single_muscle\n{line}\n")
    with pytest.raises(ValueError) as caught:
        Rig.from_yaml(path)
    assert problem in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("plant: [", "is not YAML"),
        ("single_muscle", "must hold a mapping"),
        (None, "cannot be read"),
    ],
)
def test_file_that_is_not_a_rig_file_is_refused(tmp_path, text, problem):
    path = tmp_path / "none.yaml" if text is None else rig_file(tmp_path, text)
    with pytest.raises(ValueError, match=problem):
        Rig.from_yaml(path)
    with pytest.raises(ValueError, match="rest_length_mm = 200000 mm is outside"):
        Rig(rest_length=200.0)


# tables of readings

READINGS = ("load_kg,direction,pressure_bar,repeat,contraction_mm", "2.5,up,0,1,0", "2.5,up,1,1,2")


def test_tables_of_other_rigs_are_read(tmp_path):
    """Minor loops, other pressures in the second repeat, no column of repeats."""
    rows = ["2.5,up,3,1,5", "2.5,down,2,1,4", "2.5,inflating,6,1,14", "2.5,up,0,2,0.1"]
    table = load_readings(file_of(tmp_path, *READINGS, *rows, "2.5,up,4,2,8"))
    assert table.repeats(2.5) == (1, 2)
    assert table.cycle(2.5, 1)[0].tolist() == [0.0, 1e5, 3e5, 2e5, 6e5]
    assert not one_path(table)
    single = file_of(tmp_path, "pressure_bar,load_kg,contraction_mm,direction", "1,0,2.5,UP")
    assert read_input(single).repeats(0.0) == (1,)


def test_columns_determine_the_kind_of_file(tmp_path):
    assert isinstance(read_input(write(tmp_path, sheet())), Recording)
    with pytest.raises(RecordingError, match="unknown column 'time_ms'"):
        read_input(file_of(tmp_path, "time_ms,pressure_command_bar,pressure_bar", "0,1,1"))
    with pytest.raises(RecordingError, match="needs the column direction"):
        read_input(file_of(tmp_path, "load_kg,pressure_bar,contraction_mm", "0,1,1"))


# the page for owners of rigs

PAGE = Path(__file__).parents[2] / "docs" / "recording.md"


def block(language: str, place: int = 0) -> str:
    return PAGE.read_text(encoding="utf-8").split(f"```{language}\n")[1 + place].split("```")[0]


def test_examples_of_the_page_are_readable(tmp_path):
    assert Rig.from_yaml(rig_file(tmp_path, block("yaml"))) == SHOWN
    lines = block("text").splitlines()
    more = [f"{0.06 + 0.02 * i:.2f},staircase,1.5,1.4,3.0,25.0" for i in range(20)]
    recording = read_input(file_of(tmp_path, *lines, *more))
    assert isinstance(recording, Recording)
    assert recording.segments == ("rest", "staircase")
    readings = read_input(file_of(tmp_path, *block("text", 1).splitlines()))
    assert readings.cycle(2.55, 1)[0].tolist() == [0.0, 5e4, 0.0]


def test_page_names_every_column_and_key():
    page = PAGE.read_text(encoding="utf-8")
    assert all(f"| `{name}` |" in page for name in COLUMNS)
    assert all(f"{key}:" in block("yaml") for key in KEYS)
