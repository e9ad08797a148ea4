"""The measured table: contents, scatter, and the cells that its reader refuses."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pam_envs.data import tables
from pam_envs.data.tables import load_contraction_table

HEADER = "load_kg,direction,pressure_bar,repeat,contraction_mm"
CYCLE = ("0,inflation,0,1,0", "0,inflation,1,1,0.9", "0,deflation,0,1,0.2")


@pytest.fixture(scope="module")
def table():
    return load_contraction_table()


def _file(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder / "rig.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_table_has_375_readings_of_three_loads_and_five_cycles(table):
    assert table.loads == (0.0, 2.55, 4.55)
    assert all(table.repeats(load) == (1, 2, 3, 4, 5) for load in table.loads)
    assert all(len(getattr(table, field.name)) == 375 for field in dataclasses.fields(table))
    assert np.sum(table.inflating) == 3 * 13 * 5
    assert tables.one_path(table)


def test_table_values_are_in_si(table):
    assert table.pressure_pa.max() == 6e5
    assert table.contraction_m.max() == pytest.approx(15.3e-3)


def test_cycle_rises_to_6_bar_and_returns_in_half_bar_steps(table):
    up = np.arange(0.0, 6.01, 0.5) * 1e5
    for load in table.loads:
        pressure, contraction = table.cycle(load, 3)
        np.testing.assert_array_equal(pressure, np.r_[up, up[-2::-1]])
        assert contraction[0] == 0.0


def test_branches_share_the_turning_point_and_run_in_path_order(table):
    for load in table.loads:
        rising, inflated = table.branch(load, True)
        falling, deflated = table.branch(load, False)
        assert np.all(np.diff(rising) > 0.0)
        assert np.all(np.diff(falling) < 0.0)
        assert inflated.shape == deflated.shape == (13, 5)
        np.testing.assert_array_equal(inflated[-1], deflated[0])


def test_means_average_the_cycles(table):
    pressure, mean = table.means(2.55)
    cycles = [table.cycle(2.55, repeat)[1] for repeat in range(1, 6)]
    np.testing.assert_allclose(mean, np.mean(cycles, axis=0), rtol=1e-14)
    assert mean[pressure.argmax()] == pytest.approx(14.78e-3)


def test_only_the_unloaded_muscle_drifts_over_the_repeats(table):
    rates = []
    for load in table.loads:
        contraction = table.cycles(load)[1][1:]
        rates.append(np.polyfit(np.arange(5), contraction.mean(axis=0), 1)[0])
    assert rates[0] == pytest.approx(0.033e-3, abs=0.001e-3)
    assert max(map(abs, rates[1:])) < 0.01e-3


def test_heavier_load_contracts_less(table):
    """Averaged over a branch; single cells at 5.5 bar say otherwise by 0.3 mm, see PROVENANCE."""
    for inflating in (True, False):
        lifted = [table.branch(load, inflating)[1].mean() for load in table.loads]
        assert lifted[0] > lifted[1] + 0.2e-3 > lifted[2] + 0.4e-3


def test_leaving_out_a_repeat_keeps_the_others(table):
    rest = table.without_repeat(2)
    assert rest.repeats(4.55) == (1, 3, 4, 5)
    np.testing.assert_array_equal(rest.cycle(4.55, 5)[1], table.cycle(4.55, 5)[1])
    with pytest.raises(ValueError, match="leaving out repeat 9"):
        table.without_repeat(9)


def test_readings_cannot_be_changed(table):
    with pytest.raises(ValueError, match="read-only"):
        table.contraction_m[0] = 1.0


def test_unknown_load_or_cycle_is_refused_with_the_known_ones(table):
    with pytest.raises(ValueError, match=r"no readings at 3\.0 kg.* 0, 2\.55, 4\.55 kg"):
        table.branch(3.0, True)
    with pytest.raises(ValueError, match="no repeat 6 at 0 kg"):
        table.cycle(0.0, 6)


def test_users_file_is_read_with_cycles_in_any_order(tmp_path):
    second = ["0,inflation,0,2,0", "0,inflation,1,2,1.1", "0,deflation,0,2,0.4"]
    mixed = [row for pair in zip(second, CYCLE, strict=True) for row in pair]
    table = load_contraction_table(_file(tmp_path, *mixed))
    np.testing.assert_allclose(table.cycles(0.0)[1].T, [[0, 0.9e-3, 0.2e-3], [0, 1.1e-3, 0.4e-3]])


def test_byte_order_mark_and_blank_lines_are_accepted(tmp_path):
    path = _file(tmp_path, CYCLE[0], "", *CYCLE[1:], header="\ufeff" + HEADER)
    assert load_contraction_table(path).pressure_pa.tolist() == [0.0, 1e5, 0.0]


@pytest.mark.parametrize(
    ("row", "column", "value", "fault"),
    [
        ("0,inflation,1,1,nought", "contraction_mm", "nought", "no number"),
        ("0,inflation,1,1,nan", "contraction_mm", "nan", "no number"),
        ("0,inflation,1,1,", "contraction_mm", "", "is empty"),
        ("0,inflation,100000,1,1", "pressure_bar", "100000", "unit"),
        ("0,inflation,inf,1,1", "pressure_bar", "inf", "no number"),
        ("-2,inflation,1,1,1", "load_kg", "-2", "0 to 1000 is needed"),
        ("0,inflation,1,1.5,1", "repeat", "1.5", "a whole number"),
        ("0,rising,1,1,1", "direction", "rising", "write inflating or deflating"),
    ],
)
def test_bad_cell_is_refused_with_its_location(tmp_path, row, column, value, fault):
    path = _file(tmp_path, CYCLE[0], row, CYCLE[2])
    with pytest.raises(ValueError) as caught:
        load_contraction_table(path)
    message = str(caught.value)
    assert all(p in message for p in ("rig.csv", "row 3", f"column {column}", value, fault))


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        ((), "no rows below the header"),
        ((*CYCLE[:2], "0,up,0.5,1,3"), "the pressure moves against the direction in row 4"),
        ((*CYCLE[:2], "0,down,2,1,3"), "the pressure moves against the direction in row 4"),
        (("0,inflation,0,1",), "5 cells a row are needed, got 4 in row 2"),
        ((CYCLE[0], CYCLE[0], CYCLE[2]), "load 0 kg, repeat 1: the pressures must rise"),
        ((CYCLE[0], CYCLE[2], CYCLE[1]), "load 0 kg, repeat 1: the pressures must rise"),
        ((*CYCLE, "0,inflation,0,2,0", "0,inflation,2,2,3"), "repeat 2: its pressures differ"),
    ],
)
def test_table_without_full_cycles_is_refused(tmp_path, rows, fault):
    with pytest.raises(ValueError, match=fault):
        load_contraction_table(_file(tmp_path, *rows))


def test_shipped_table_names_its_source():
    text = (Path(tables.__file__).parent / "PROVENANCE.md").read_text(encoding="utf-8")
    assert "Precise Positioning Systems" in text
    for path in Path(tables.__file__).parent.iterdir():
        if path.suffix in {".csv", ".yaml", ".json", ".npz"}:
            assert path.name in text, f"{path.name} has no entry in PROVENANCE.md"
