"""Page, statistics and figure of the diagnosis benchmark."""

from typing import Any

from diagnosis_fakes import counted, loop, record, sample, trace

from benchmarks.diagnosis.report import figures, page, targets, write
from benchmarks.runs.store import read_record
from tests.diagnosis.hidden import EFFECTS


def test_targets_are_compared_with_their_statistics():
    good = [record(names=["creep"], traces={"creep": trace(0.1)}, seed=k) for k in range(3)]
    rows = {row[0]: row for row in targets(figures(good))}
    assert rows["correct name first, sizes above 1"][2:] == ("100.0 % [29.2, 100.0]", 3, True)
    assert rows["wrong name, any size"][4] is False  # three cases bound nothing
    assert rows["error of the effect's trace, median"][4] is True
    assert rows["two effects: both"][2:] == ("not run", 0, None)
    bad = [*good, record(names=["leak"])]
    rows = {row[0]: row for row in targets(figures(bad))}
    assert rows["correct name first, sizes above 1"][3:] == (4, False)
    assert rows["the same, for the worst cause"][2].endswith("(`creep`)")
    many = [record("clean", {}, "adequate", seed=k) for k in range(300)]
    rows = {row[0]: row for row in targets(figures(many))}
    assert rows["false alarm, clean rigs and decoys"][4] is True
    rows = {row[0]: row for row in targets(figures([*many, record("decoy", {}, "unexplained")]))}
    assert rows["false alarm, clean rigs and decoys"][4] is False


def test_page_shows_figure_target_and_number():
    text = page(figures(sample()), "--chosen tune")
    assert "`python -m benchmarks diagnosis --chosen tune`" in text
    assert "| correct name first, sizes above 1 | at least 98 % | 60.0 % [14.7, 94.7] | 5 |" in text
    assert "`leak` as `creep`: 2" in text
    assert "| `stick_slip` |  |  |  | A1 |" in text
    assert "`temperature` 1" in text
    assert "Failed runs" not in text


def test_same_records_give_same_files(tmp_path):
    first = write(sample(), tmp_path / "a", "--chosen tune")
    second = write(sample(), tmp_path / "b", "--chosen tune")
    assert [path.name for path in first] == ["diagnosis.md", "diagnosis.json.xz", "diagnosis.png"]
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()
    content = read_record(first[1])
    assert len(content["cases"]) == len(sample())
    assert content["cases"][0] == "single 1 creep@2.00: named creep (trace 0.10, held out 1.05)"
    assert counted(content["figures"]["right_first"]) == (3, 5)


def tables(cut_percent: float, post_hoc: float) -> dict[str, Any]:
    """Return, of a report on measured tables, what the page reads."""
    error = {"before": {"value": 0.63}, "after": {"value": 0.63 * (1.0 - 0.01 * cut_percent)}}
    cut = {"value": cut_percent, "interval": [cut_percent - 8.0, cut_percent + 8.0]}
    laws = [{"load_left_out_mm": post_hoc + more} for more in (0.1, 0.0)]
    return {
        "noise_floor": {"contraction": {"value": 0.168}},
        "readings": {
            "loads_left_out": {**error, "cut_percent": cut},
            "load_laws": laws,
            "curves": {"readings_mm": [[0.0] * 75] * 5},
        },
    }


def test_measured_tables_and_the_whole_report_have_their_targets():
    linear = "measured tables, held-out load, linear law: error decrease"
    late = "the same, exponent post hoc, not held out"
    whole = "10 minutes at 50 Hz on 2 cores: whole report"
    rows = {row[0]: row[1:] for row in targets(figures([], tables(40.0, 0.22), [4.0, 9.5, 7.0]))}
    assert rows[linear] == ("at least 30 %", "40.0 % [32.0, 48.0], 0.63 to 0.38 mm", 375, True)
    assert rows[late] == ("about 0.23 mm", "0.22 mm; noise floor 0.168 mm", 375, True)
    assert rows[whole] == ("at most 10 s", "9.5 s", 3, True)
    rows = {row[0]: row[1:] for row in targets(figures([], tables(25.0, 0.26), [4.0, 10.5]))}
    assert [rows[label][3] for label in (linear, late, whole)] == [False, False, False]
    rows = {row[0]: row[1:] for row in targets(figures(sample()))}
    assert {rows[label][1:] for label in (linear, late, whole)} == {("not run", 0, None)}


def test_targets_need_enough_cases():
    label = "cases of the rarest cause, sizes above 1"
    of_all = [
        record(truth={name: 2.0}, names=[name], seed=k) for name in EFFECTS for k in range(40)
    ]
    rows = {row[0]: row[1:] for row in targets(figures(of_all))}
    assert rows[label][2:] == (40 * len(EFFECTS), True)
    rows = {row[0]: row[1:] for row in targets(figures(of_all[1:]))}
    assert rows[label] == ("at least 40", f"39 (`{EFFECTS[0]}`)", 40 * len(EFFECTS) - 1, False)
    few = [record("clean", {}, "adequate", seed=k) for k in range(299)]
    rows = {row[0]: row[1:] for row in targets(figures(few))}
    assert rows["false alarm, clean rigs and decoys"][3] is False
    assert "bound 1.0 %" in rows["false alarm, clean rigs and decoys"][1]


def test_closed_loops_have_targets():
    records = [record(names=["creep"], loop=loop(1.0, after, 0.5)) for after in (0.6, 0.9, 1.2)]
    rows = {row[0]: row[1:] for row in targets(figures(records))}
    part = rows["closed loop, gap of at least 15 %: part recovered, median"]
    assert part == ("at least 70 %", "20.0 %", 3, False)
    worse = rows["closed loop, gap of at least 15 %: over 5 % worse"]
    assert worse[0] == "at most 5 %" and worse[2:] == (3, False)


def test_raw_size_is_shown_beside_size():
    truths = [{"name": "creep", "size": 2.0, "raw": 6.5}]
    made = figures([record(names=["creep"], truths=truths)])
    assert made["by_cause"]["creep"]["raw"]["median"] == 3.25
    head, row = (
        next(line for line in page(made, "").splitlines() if line.startswith(begins)).split(" | ")
        for begins in ("| cause", "| `creep`")
    )
    assert row[head.index("raw / size")] == "3.25"
