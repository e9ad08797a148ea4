"""Log files of other tools: each reader on a file that the test writes with the same library."""

import builtins
import itertools
from pathlib import Path

import numpy as np
import pytest
import yaml

from pam_envs.data.channel_sources import ChannelSource
from pam_envs.data.recording.formats import matlab, signals
from pam_envs.data.recording.formats.units import UNITS, conversion, unit_of
from pam_envs.data.recording.recording import Recording, RecordingError, load_recording, read_input
from pam_envs.data.rig_file import Rig

N, PERIOD = 200, 0.02
TIME = PERIOD * np.arange(N)
COMMAND = 1e5 * (2.0 + np.sign(np.sin(2.0 * TIME)))
PRESSURE = 1e5 * (2.0 + np.sin(2.0 * TIME - 0.2))
CONTRACTION = 1e-3 * (5.0 + 2.0 * np.sin(2.0 * TIME - 0.4))
LABELS = ["a"] * (N // 2) + ["b"] * (N - N // 2)


def rig(**channels: object) -> Rig:
    """Return a rig with a mapping of channels, as RIG.yaml gives it."""
    from pam_envs.data.channel_sources import sources_of

    return Rig(channels=sources_of(channels))


def refusal(path: Path, sheet: Rig | None) -> str:
    with pytest.raises(RecordingError) as caught:
        load_recording(path, sheet)
    assert path.name in str(caught.value)
    return str(caught.value)


def check(got: Recording, rows: slice = slice(None), rest: float = 1e-9) -> None:
    """Assert that a recording holds the signals of this module."""
    assert got.period == pytest.approx(PERIOD)
    np.testing.assert_allclose(got.command, COMMAND[rows])
    np.testing.assert_allclose(got.pressure, PRESSURE[rows], rtol=0, atol=rest * 1e5)
    np.testing.assert_allclose(got.contraction, CONTRACTION[rows], rtol=0, atol=rest * 1e-3)
    np.testing.assert_allclose(got.load, 2.5 * 9.80665)


LOAD = {"value": 2.5, "unit": "kg"}


# MATLAB


def test_matlab_structs_and_columns_of_arrays(tmp_path):
    from scipy.io import savemat

    values = np.column_stack([1e-3 * PRESSURE, 1e3 * CONTRACTION])
    log = {"time": TIME[:, None], "signals": [{"values": COMMAND}, {"values": values}]}
    savemat(tmp_path / "log.mat", {"log": log, "other": np.ones(3)}, do_compression=True)
    sheet = rig(
        time_s="log.time",
        pressure_command_bar={"from": "log.signals(1).values", "unit": "Pa"},
        pressure_bar={"from": "log.signals(2).values(:,1)", "unit": "kPa"},
        contraction_mm="log.signals(2).values(:,2)",
        load_N=LOAD,
    )
    check(load_recording(tmp_path / "log.mat", sheet))
    text = refusal(tmp_path / "log.mat", rig(time_s="log.tim", pressure_bar="lgo"))
    assert "channels.time_s: no field 'tim' in 'log.tim'; did you mean 'time'?" in text
    assert "channels.pressure_bar: no channel 'lgo'; did you mean" in text
    for name, said in {
        "log": "select one of its fields: time, signals",
        "log.signals": "select an element: log.signals(1)",
        "log.signals(3).values": "no element (3)",
        "log.signals(2).values": r"is of size 200 x 2; select a column: log.signals(2).values(:,1)",
        "log.signals(2).values(:,3)": "has 2 columns",
        "log.signals(0)": "indices of MATLAB start at 1",
        "log[0]": "write log.signals(2).values(:,1)",
    }.items():
        assert said in refusal(tmp_path / "log.mat", rig(time_s=name))


def test_matlab_object_is_named_with_a_remedy(tmp_path, monkeypatch):
    from scipy.io import matlab as scipy_matlab
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {"ts": np.ones(3)})
    opaque = scipy_matlab.MatlabOpaque(np.zeros(1, [("s0", "O")]))
    monkeypatch.setattr("scipy.io.loadmat", lambda *_, **__: {"ts": opaque})
    text = refusal(tmp_path / "log.mat", rig(time_s="ts"))
    assert "is an object (timeseries" in text
    assert "t = ts.Time" in text


def test_matlab_version_7_3(tmp_path):
    import h5py

    path = tmp_path / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        log = file.create_group("log")  # MATLAB stores columns as rows
        log["time"] = TIME[None]
        for k, values in enumerate((COMMAND[None], np.vstack([1e-5 * PRESSURE, CONTRACTION]))):
            file[f"#refs#/{k}"] = values
        refs = np.array([[file["#refs#/0"].ref], [file["#refs#/1"].ref]], h5py.ref_dtype)
        log.create_dataset("signals/values", data=refs, dtype=h5py.ref_dtype)
        file["ts"] = np.zeros((1, 6), np.uint32)
        file["ts"].attrs["MATLAB_object_decode"] = np.int32(3)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head + path.read_bytes()[len(head) :])
    sheet = rig(
        time_s="log.time",
        pressure_command_bar={"from": "log.signals(1).values", "unit": "Pa"},
        pressure_bar="log.signals(2).values(:,1)",
        contraction_mm={"from": "log.signals(2).values(:,2)", "unit": "m"},
        load_N=LOAD,
    )
    check(load_recording(path, sheet))
    assert "select one of its fields" in refusal(path, rig(time_s="log"))
    assert "no element (3)" in refusal(path, rig(time_s="log.signals(3).values"))
    assert "is an object (timeseries" in refusal(path, rig(time_s="ts"))
    assert "did you mean 'time'" in refusal(path, rig(time_s="log.tme"))


def test_inflated_matlab_variables_are_bounded(tmp_path, monkeypatch):
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {"x": np.zeros(1_000_000)}, do_compression=True)
    assert (tmp_path / "log.mat").stat().st_size < 20_000
    monkeypatch.setattr(matlab, "MOST_BYTES", 7_000_000)
    text = refusal(tmp_path / "log.mat", rig(time_s="x"))
    assert "has more than 7,000,000 bytes of variables; leave some out" in text
    monkeypatch.setattr(matlab, "MOST_BYTES", 9_000_000)
    monkeypatch.setattr(signals, "MOST_SAMPLES", 999_999)
    assert "has 1,000,000 values, more than 999,999" in refusal(
        tmp_path / "log.mat", rig(time_s="x")
    )


# TDMS


def write_tdms(path: Path, waveform: bool) -> None:
    from nptdms import ChannelObject, TdmsWriter

    shape = {"wf_increment": PERIOD, "wf_start_offset": 0.0, "wf_samples": N} if waveform else {}
    columns = {
        "command": (1e-3 * COMMAND, {"unit_string": "kPa"}),
        "pressure": (1e-5 * PRESSURE, {}),
        "pos": (4.0 * CONTRACTION / 1e-3 + 1.0, {"unit_string": "V"}),
        "label": (LABELS, {}),
    }
    if not waveform:
        columns["time"] = (1e3 * TIME, {"unit_string": "ms"})
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [ChannelObject("AI", n, v, {**shape, **more}) for n, (v, more) in columns.items()]
        )


@pytest.mark.parametrize("waveform", [False, True])
def test_tdms_channels_with_scale_and_units(tmp_path, waveform):
    path = tmp_path / "log.tdms"
    write_tdms(path, waveform)
    given = dict(
        pressure_command_bar="AI/command",
        pressure_bar="/'AI'/'pressure'",
        contraction_mm={"from": "AI/pos", "scale": 0.25, "offset": -0.25, "unit": "mm"},
        segment="AI/label",
        load_N=LOAD,
    )
    sheet = rig(**given) if waveform else rig(time_s="AI/time", **given)
    got = load_recording(path, sheet)
    check(got)
    assert got.segments == ("a", "b")
    assert (got.segment == np.repeat([0, 1], N // 2)).all()


def test_units_of_file_and_rig_must_agree(tmp_path):
    path = tmp_path / "log.tdms"
    write_tdms(path, waveform=True)
    text = refusal(path, rig(pressure_command_bar={"from": "AI/command", "unit": "bar"}))
    assert "the file states the unit 'kPa' for 'AI/command', RIG.yaml 'bar'" in text
    text = refusal(path, rig(contraction_mm="AI/pos"))
    assert "the file states the unit 'V' for 'AI/pos', which is no length; give its unit" in text
    text = refusal(path, rig(contraction_mm={"from": "AI/pos", "unit": "bar"}))
    assert "unit 'bar' is no length; give one of m, meter" in text


# HDF5


def test_hdf5_datasets_columns_and_tables(tmp_path):
    import h5py

    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["rig/time"] = TIME
        file["rig/pressures"] = np.column_stack([COMMAND, PRESSURE])
        file["rig/pressures"].attrs["units"] = "Pa"
        table = np.zeros(N, [("position", "f4"), ("phase", "i4")])
        table["position"], table["phase"] = CONTRACTION, np.repeat([1, 2], N // 2)
        file["rig/table"] = table
        file["words"] = LABELS
    given = dict(
        time_s="rig/time",
        pressure_command_bar="rig/pressures[0]",
        pressure_bar="/rig/pressures[1]",
        contraction_mm={"from": "rig/table/position", "unit": "m"},
        load_N=LOAD,
    )
    got = load_recording(path, rig(**given, segment="rig/table/phase"))
    check(got, rest=1e-6)
    assert got.segments == ("1", "2")
    assert load_recording(path, rig(**given, segment="words")).segments == ("a", "b")
    text = refusal(path, rig(time_s="rig/tme", pressure_bar="rig/pressures", load_N="words"))
    assert "no channel 'rig/tme'; did you mean 'rig/time'?" in text
    assert "is of size 200 x 2; select a column: rig/pressures[0]" in text
    assert "holds words, not numbers" in text
    assert "rig/pressures', 'rig/table/position'" in refusal(path, None)


def test_hdf5_data_in_another_file_is_refused(tmp_path):
    import h5py

    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = TIME
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["x"] = h5py.ExternalLink("other.h5", "/x")
    text = refusal(tmp_path / "log.h5", rig(time_s="x"))
    assert "is stored in another file; copy its values into this one" in text


# ROS 2


def write_bag(folder: Path, plugin: str, stamped: bool) -> Path:
    """Write a bag with a command at 10 Hz, joint states at 50 Hz and a pressure at 100 Hz."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    kinds = store.types
    number, joints = kinds["std_msgs/msg/Float64"], kinds["sensor_msgs/msg/JointState"]
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    start, late = 1_700_000_000_000_000_000, 3_000_000
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        topics = {
            "/valve/command": writer.add_connection(
                "/valve/command", number.__msgtype__, typestore=store
            ),
            "/joints": writer.add_connection("/joints", joints.__msgtype__, typestore=store),
            "/pressure": writer.add_connection("/pressure", number.__msgtype__, typestore=store),
        }
        empty = np.zeros(0)
        events = []
        for k in range(2 * N):
            at = start + k * 10_000_000
            value = 1e5 * (2.0 + np.sin(2.0 * (k / 2 * PERIOD) - 0.2))
            events.append((at, "/pressure", number(value)))
            if k % 2 == 0:
                sec, nano = divmod(at if stamped else 0, 1_000_000_000)
                position = np.array([0.0, CONTRACTION[k // 2]])
                made = joints(
                    header(stamp(int(sec), int(nano)), ""), ["x", "y"], position, empty, empty
                )
                events.append((at + (late if stamped else 0), "/joints", made))
            if k % 10 == 0:
                events.append((at, "/valve/command", number(COMMAND[k // 2])))
        for at, topic, message in sorted(events, key=lambda e: e[0]):
            raw = store.serialize_cdr(message, message.__msgtype__)
            writer.write(topics[topic], at, raw)
    return folder / "bag"


BAG = dict(
    contraction_mm={"from": "/joints/position[1]", "unit": "m"},
    pressure_command_bar={"from": "/valve/command/data", "unit": "Pa"},
    pressure_bar={"from": "/pressure/data", "unit": "Pa"},
    load_N=LOAD,
)


@pytest.mark.parametrize(
    ("plugin", "stamped"), [("MCAP", True), ("MCAP", False), ("SQLITE3", True)]
)
def test_ros_bag_on_the_clock_of_its_first_column(tmp_path, plugin, stamped):
    folder = write_bag(tmp_path, plugin, stamped)
    got = load_recording(folder, rig(**BAG))
    held = 5 * (np.arange(N) // 5)  # the command is held between its messages at 10 Hz
    np.testing.assert_allclose(got.command, COMMAND[held])
    np.testing.assert_allclose(got.contraction, CONTRACTION)
    np.testing.assert_allclose(got.pressure, PRESSURE, atol=10.0)
    assert got.period == pytest.approx(PERIOD)
    file = next(folder.glob("*.mcap" if plugin == "MCAP" else "*.db3"))
    assert load_recording(file, rig(**BAG)).digest == got.digest


def test_wrong_topics_and_fields_are_named(tmp_path):
    folder = write_bag(tmp_path, "MCAP", stamped=True)
    text = refusal(
        folder,
        rig(
            contraction_mm="/joints/positon[1]",
            pressure_command_bar="/valve/comand/data",
            pressure_bar="/joints/position",
            load_N="/joints/position[7]",
        ),
    )
    assert "no field 'positon[1]' in '/joints/positon[1]'; did you mean 'position'?" in text
    assert "no channel '/valve/comand/data'; did you mean '/valve/command'?" in text
    assert "channel '/joints/position' is no number; select an element: [0]" in text
    assert "no element [7] in '/joints/position[7]'" in text


# clocks, units and mapping


def table(path: Path, **columns: object) -> Path:
    names = list(columns)
    rows = itertools.zip_longest(*columns.values(), fillvalue="")
    lines = [",".join(names), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_columns_of_a_csv_file_are_mapped(tmp_path):
    path = table(
        tmp_path / "log.csv",
        t=1e3 * TIME,
        setpoint=COMMAND / 6894.757293168361,
        p=PRESSURE,
        length=0.2 - CONTRACTION,
        phase=LABELS,
        comment=["x"] * N,
    )
    sheet = rig(
        time_s={"from": "t", "unit": "ms"},
        pressure_command_bar={"from": "setpoint", "unit": "psi"},
        pressure_bar={"from": "p", "unit": "Pa"},
        contraction_mm={"from": "length", "scale": -1, "offset": 0.2, "unit": "m"},
        segment="phase",
        load_N=LOAD,
    )
    got = read_input(path, sheet)
    check(got)
    assert got.segments == ("a", "b")


def test_gap_of_a_measured_channel_is_not_interpolated(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    def waves(**more: np.ndarray) -> list:
        shape = {"wf_increment": PERIOD, "wf_start_offset": 0.0}
        made = {"c": 1e-5 * COMMAND, "x": 1e3 * CONTRACTION, **more}
        return [ChannelObject("AI", name, values, shape) for name, values in made.items()]

    with TdmsWriter(tmp_path / "log.tdms") as writer:
        pressure = 1e-5 * PRESSURE
        pressure[50:60] = np.nan
        writer.write_segment(waves(p=pressure))
    sheet = rig(pressure_command_bar="AI/c", contraction_mm="AI/x", pressure_bar="AI/p")
    text = refusal(tmp_path / "log.tdms", sheet)
    assert "column pressure_bar is empty in rows 52, 53, 54, 55, 56 and 5 more" in text


def test_lost_messages_leave_empty_cells(tmp_path):
    from pam_envs.data.recording.formats.mapped import on_one_clock

    late = np.delete(TIME, slice(50, 60))
    columns = on_one_clock(
        {
            "contraction_mm": signals.Signal(CONTRACTION, "", TIME),
            "pressure_bar": signals.Signal(np.delete(PRESSURE, slice(50, 60)), "", late),
            "pressure_command_bar": signals.Signal(np.delete(COMMAND, slice(50, 60)), "", late),
        }
    )
    assert np.flatnonzero(np.isnan(columns["pressure_bar"])).tolist() == list(range(50, 60))
    assert (columns["pressure_command_bar"][50:60] == COMMAND[49]).all()
    np.testing.assert_allclose(columns["time_s"], TIME)


def test_clocks_must_overlap_and_increase():
    from pam_envs.data.recording.formats.mapped import on_one_clock

    def two(clock: np.ndarray | None, **more: object) -> str:
        first = signals.Signal(CONTRACTION, "", TIME)
        with pytest.raises(signals.ChannelError) as caught:
            on_one_clock(
                {"contraction_mm": first, "pressure_bar": signals.Signal(PRESSURE, "", clock)}
            )
        return str(caught.value)

    assert "do not overlap (contraction_mm from 0 to 3.98 s" in two(TIME + 100.0)
    assert "the clock of pressure_bar runs backwards" in two(TIME[::-1])
    assert "pressure_bar has no clock of its own; map time_s" in two(None)


def test_different_lengths_and_missing_columns_are_named(tmp_path):
    import h5py

    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["p"], file["c"] = TIME, PRESSURE[:50], COMMAND
        file["none"] = np.zeros(0)
    text = refusal(path, rig(time_s="t", pressure_bar="p", pressure_command_bar="c"))
    assert "pressure_bar has 50 values, time_s has 200" in text
    assert "needs the column pressure_command_bar; map it" in refusal(path, rig(time_s="t"))
    text = refusal(path, rig(time_s="t", contraction_cm="c", pressure_bar="none"))
    assert "channels.contraction_cm: unknown column; give contraction_mm instead" in text
    assert "channel 'none' is empty" in refusal(path, rig(time_s="none"))


@pytest.mark.parametrize(
    ("unit", "value", "target", "expected"),
    [
        ("psi", 14.503773773020923, "bar", 1.0),
        ("MPa", 0.6, "bar", 6.0),
        ("mbar", 500.0, "bar", 0.5),
        ("inch", 1.0, "mm", 25.4),
        ("kg", 1.0, "N", 9.80665),
        ("°F", 212.0, "C", 100.0),
        ("K", 273.15, "C", 0.0),
        ("rad", np.pi, "deg", 180.0),
        ("N·m", 2.0, "Nm", 2.0),
        ("µs", 2.0, "s", 2e-6),
        ("BAR", 2.0, "bar", 2.0),
    ],
)
def test_units_are_converted(unit, value, target, expected):
    factor, shift = conversion(unit_of(unit), unit_of(target))
    assert factor * value + shift == pytest.approx(expected, abs=1e-12)


def test_case_tells_millinewton_from_meganewton_and_unknown_units_are_none():
    assert unit_of("mN").factor == 1e-3
    assert unit_of("MN") is None
    assert [unit_of(name).factor for name in ("mPa", "MPa", "mpa")] == [1e-3, 1e6, 1e6]
    assert unit_of("V") is None and unit_of("") is None
    assert {u.quantity for u in UNITS.values()} >= {"time", "pressure", "length", "force", "torque"}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([1], "channels must be a mapping"),
        ({"a": 3}, "channels.a must be the name of a channel or a mapping"),
        ({"a": {"form": "x"}}, "unknown key 'channels.a.form'; did you mean 'from'?"),
        ({"a": {}}, "needs either from"),
        ({"a": {"from": "x", "value": 1}}, "needs either from"),
        ({"a": {"from": 3}}, "channels.a.from must be text, got 3; put it in quotes"),
        ({"a": {"from": "x", "scale": 0}}, "channels.a.scale is 0"),
        ({"a": {"from": "x", "scale": ".nan"}}, "scale must be a finite number"),
        ({"a": {"value": 1, "scale": 2}}, "give value alone"),
        ({f"c{k}": "x" for k in range(101)}, "give at most 100"),
    ],
)
def test_wrong_channels_are_refused_by_key(tmp_path, given, said):
    path = tmp_path / "RIG.yaml"
    path.write_text(yaml.safe_dump({"plant": "single_muscle", "channels": given}))
    with pytest.raises(ValueError) as caught:
        Rig.from_yaml(path)
    assert said in str(caught.value)


def test_channels_of_a_rig_file_are_read(tmp_path):
    path = tmp_path / "RIG.yaml"
    path.write_text(
        "plant: single_muscle\n"
        "channels:\n"
        "  pressure_bar: AI/p\n"
        "  contraction_mm: {from: AI/x, unit: m, scale: -2e-3, offset: 1}\n"
        "  load_N: {value: 2.5, unit: kg}\n"
    )
    got = Rig.from_yaml(path)
    assert got.channels == {
        "pressure_bar": ChannelSource("AI/p"),
        "contraction_mm": ChannelSource("AI/x", "m", -2e-3, 1.0),
        "load_N": ChannelSource("", "kg", value=2.5),
    }
    assert got.digest == Rig().digest  # where columns are read is no property of the rig


# files from strangers, and missing packages


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".tdms", ".mcap", ".db3"])
@pytest.mark.parametrize(
    "content",
    [b"", b"no log", b"\x00" * 300, b"MATLAB 5.0 MAT-file".ljust(126) + b"IM" + b"\x0f" * 90],
)
def test_broken_files_are_refused_by_name(tmp_path, suffix, content):
    path = tmp_path / f"log{suffix}"
    path.write_bytes(content)
    text = refusal(path, rig(time_s="a"))
    assert len(text) < 1000
    assert "save it again" in text or "is empty" in text or "no channel" in text


@pytest.mark.parametrize("suffix", [".mat", ".tdms", ".mcap"])
def test_cut_files_are_read_or_refused_by_name(tmp_path, suffix):
    from scipy.io import savemat

    path = tmp_path / f"log{suffix}"
    if suffix == ".mat":
        savemat(path, {"log": {"time": TIME, "x": CONTRACTION}}, do_compression=True)
    elif suffix == ".tdms":
        write_tdms(path, waveform=True)
    else:
        path.write_bytes(next(write_bag(tmp_path, "MCAP", True).glob("*.mcap")).read_bytes())
    whole, draws = path.read_bytes(), np.random.default_rng(0)
    for _ in range(40):
        data = bytearray(whole[: draws.integers(1, len(whole))])
        for place in draws.integers(0, len(data), 3):
            data[place] = draws.integers(0, 256)
        path.write_bytes(data)
        try:
            load_recording(path, rig(pressure_bar="log.x", contraction_mm="/joints/position[1]"))
        except RecordingError as error:
            assert path.name in str(error)
            assert len(str(error)) < 2000


def test_large_files_are_refused_before_they_are_read(tmp_path, monkeypatch):
    path = tmp_path / "log.h5"
    path.write_bytes(b"x" * 100)
    monkeypatch.setattr(signals, "MOST_BYTES", 99)
    assert "has 100 bytes, more than 99; leave channels out, or split it" in refusal(
        path, rig(time_s="a")
    )
    assert "cannot be read" in refusal(tmp_path / "none.mat", rig(time_s="a"))
    odd = tmp_path / "log.xlsx"
    odd.write_bytes(b"x")
    assert "unknown format '.xlsx'; known: .mat" in refusal(odd, rig(time_s="a"))


@pytest.mark.parametrize(
    ("suffix", "module", "package"),
    [(".h5", "h5py", "h5py"), (".tdms", "nptdms", "npTDMS"), (".mcap", "rosbags", "rosbags")],
)
def test_missing_package_is_named_in_one_sentence(tmp_path, monkeypatch, suffix, module, package):
    path, imported = tmp_path / f"log{suffix}", builtins.__import__

    def refusing(name: str, *args: object, **kwargs: object) -> object:
        if name.partition(".")[0] == module:
            raise ImportError(name)
        return imported(name, *args, **kwargs)

    path.write_bytes(b"MATLAB 7.3")
    monkeypatch.setattr(builtins, "__import__", refusing)
    text = refusal(path, rig(time_s="a"))
    assert text.endswith(f'needs the package {package}: pip install "pam-envs[formats]"')
