"""The board: a pure function of the rows, the same to the last byte whenever it is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import plots, rows, statistics
from benchmarks.metrics import headline_of
from benchmarks.rows import Row, shown
from benchmarks.statistics import Interval
from benchmarks.store import write_text

BOARD = Path(__file__).parent / "LEADERBOARD.md"

Column = tuple[str, str, float]
EFFORT: tuple[Column, ...] = (
    ("pressure_travel", "pressure travel [bar/s]", 1e-5),
    ("air_use", "air [mg/s]", 1e6),
)
SATURATED: Column = ("saturated_time", "true pressure at capacity [%]", 100.0)
GAIT: tuple[Column, ...] = (
    ("rms_percent", "RMS [% of half-range]", 1.0),
    ("angle_rms", "swing: angle RMS [deg]", float(np.degrees(1.0))),
    ("switch_error", "error at the switch [N]", 1.0),
    ("switch_excess", "excess after it [N]", 1.0),
    ("pressure_jump", "jump of pressure [bar]", 1e-5),
    ("torque_rms", "assistance RMS, as wanted [N m]", 1.0),
    ("torque_ideal_rms", "of the true demand [N m]", 1.0),
    ("emg_ratio", "EMG ratio", 1.0),
    ("emg_extensors_ratio", "of extensors", 1.0),
    ("emg_flexors_ratio", "of flexors", 1.0),
    ("emg_ratio_fitted_a", "fitted, A", 1.0),
    ("emg_ratio_fitted_b", "fitted, B", 1.0),
    *EFFORT,
    SATURATED,
)
"""Metric, heading and factor from SI of the columns after the headline, of a gait."""

DEGREES = float(np.degrees(1.0))
MODEL: Column = ("model_rms_error", "error to its own model, RMS [deg]", DEGREES)
OUT_OF_REACH: Column = ("saturated_time", "out of reach [%]", 100.0)

ELBOW: tuple[Column, ...] = (
    ("rms_error", "torque RMS [N m]", 1.0),
    ("stiffness_rms", "stiffness RMS [N m/rad]", 1.0),
    ("p95_error", "p95 [N m]", 1.0),
    ("max_error", "max [N m]", 1.0),
    ("sensed_rms_error", "estimated RMS [N m]", 1.0),
    ("felt_rms", "felt beside the object, RMS [N m]", 1.0),
    ("free_felt_rms", "felt in free motion, RMS [N m]", 1.0),
    *EFFORT,
    ("switchings", "switchings [1/s]", 1.0),
    OUT_OF_REACH,
)
"""Of the elbow orthosis."""

CHAIN: tuple[Column, ...] = (
    ("rms_error", "tip RMS [mm]", 1e3),
    ("pointing_rms", "pointing RMS [deg]", DEGREES),
    ("p95_error", "p95 [mm]", 1e3),
    ("max_error", "max [mm]", 1e3),
    ("steady_state_error", "steady [mm]", 1e3),
    ("sensed_rms_error", "sensed RMS [mm]", 1e3),
    ("joint_rms", "joints RMS [deg]", DEGREES),
    ("largest_angle", "largest joint angle [deg]", DEGREES),
    MODEL,
    *EFFORT,
    OUT_OF_REACH,
)
"""Of a chain of joints whose tool follows a path."""


def columns_of(content: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns after the headline of a track, from the content of its file."""
    groups = content.get("metrics") or ()
    if "gait" in groups:
        return GAIT
    if "elbow" in groups:
        return ELBOW
    if "chain" in groups:
        return CHAIN
    unit, factor = shown(content)
    errors: tuple[Column, ...] = (
        ("p95_error", f"p95 [{unit}]", factor),
        ("max_error", f"max [{unit}]", factor),
        ("steady_state_error", f"steady [{unit}]", factor),
        ("sensed_rms_error", f"sensed RMS [{unit}]", factor),
    )
    if "range" in groups:
        errors = (("rms_percent", "RMS [% of half-range]", 1.0), *errors[:2], errors[3])
        return (*errors, *EFFORT, SATURATED)
    if "joint" in groups:
        errors = (("rms_percent", "RMS [% of half-range]", 1.0), *errors, MODEL)
        return (*errors, *EFFORT, OUT_OF_REACH)
    return (*errors, *EFFORT, ("constraint_cost", "constraint cost", 1.0))


PREFACE = """\
# Leaderboard

Written by `python -m benchmarks board` from `benchmarks/results/*.json`; do not edit. Every row
holds what runs it again: `python -m benchmarks verify ROW`.

- **RMS** is the headline: true output minus the external reference, without noise, after the
  settling window; the mean over episodes with its 95 % interval (stratified bootstrap over
  scenarios and seeds). Everything but the sensed error is noise-free.
- A run that a limit ended counts at the worst-case value and shows under *failures*; none is left
  out.
- Rows whose intervals overlap that of the first of their group share its rank (`=`).
- *knows* is what the controller was built from; *preview* is how far ahead it reads the reference,
  measured on what it does.
- Steady-state errors are of references that rest. Constraint cost 1 is one millimetre (or one bar)
  over a soft limit all the time.
- Of the elbow, the headline is of torque and stiffness together: the error of the torque, RMS over
  two angles, 0.2 rad on either side of the present one, from the torque here and the stiffness.
  *Torque* is the error at the present angle alone, against what the pressures can give there (as
  are p95 and max); *estimated* is the torque as computed from the sensors, without friction. *Felt
  beside the object* is the torque that the orthosis puts on the wearer less that of the object he
  is to feel, whether it can be given or not; *felt in free motion* is the same of the episodes in
  which he is to feel nothing: what the orthosis fails to be transparent by. *Out of reach*:
  more torque or stiffness was asked for than there is.
- Of a gait, the tension is scored while the heel bears weight and the angle while it does not, and
  neither in the few periods in which the sensed phase is not the true one. *Error at the switch* is
  what swing leaves of the tension's error in the first period of stance; *excess* is by how much it
  is exceeded in the next 0.5 s; *jump of pressure* is the largest change in the 0.1 s after it.
- *Assistance* is the torque as delivered less the one wanted, which follows the late and incomplete
  estimate of Eq. (1); beside it, less 20 % of the *true demand*. By the latter a constant pressure
  that knows nothing can do better than a controller that follows the estimate well.
- *EMG ratio* is the RMS of the wearer's knee extensors with the orthosis over that without, from
  the full balance of the knee, *predicted*; what the flexors do more than without is added, since
  assistance beyond the demand has to be held by them. *Of extensors* leaves that out, as electrodes
  on the thigh would. The two *fitted* ones follow the paper's own estimate of the torque, with one
  constant an activity that was chosen to give its published reductions. Below 1 the wearer is
  helped. *Fitted, B* is no score: it takes activity to grow as the square of torque, so that a
  valve that is simply open has 0.77 in walking, where the EMG ratio is 1.14 and A 1.66.
- *True pressure at capacity* is time above 4.45 bar in the muscle, of whatever the valve was told.
- Of a chain, the headline is of the whole tool, which has a place and a direction: RMS over the tip
  and the point one link behind it along the tool. *Tip* is how far the tip alone is off its path
  (as are p95, max, steady and sensed), and *pointing* is of the direction; *joints* are compared
  with the planned angles, of which the tool knows nothing. *Error to its own model* is of
  controllers that follow a model: the true angle less the model's.
- A controller's name leads to its row, where every metric of every episode stands.
- Times per step are in [results/TIMES.md](results/TIMES.md), since no two runs give the same.
"""


def interval(row: Mapping[str, Any], metric: str = "") -> Interval:
    """Return a metric's mean with its interval, the headline's where none is named."""
    entry = row["aggregate"][metric or headline_of(row["scenarios"]["content"])]
    return Interval(entry["mean"], entry["low"], entry["high"])


def tracks(all_rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows of each track, best first; tracks by environment, the nominal one first."""
    grouped: dict[str, list[Row]] = {}
    for row in all_rows:
        grouped.setdefault(row["scenarios"]["name"], []).append(row)
    names = sorted(grouped, key=lambda n: (_family(grouped[n][0]), "nominal" not in n, n))
    order = lambda row: (interval(row).value, row["controller"]["name"])  # noqa: E731
    return {name: sorted(grouped[name], key=order) for name in names}


def _family(row: Row) -> str:
    """Return what tracks of one environment sort by: positioning first."""
    env = str(row["env"]["id"])
    return "" if "Positioning" in env else env


def ranks(ordered: Sequence[Row]) -> list[str]:
    """Return the rank of each row, best first; rows that overlap the group's first share it."""
    groups: list[list[int]] = []
    for i, row in enumerate(ordered):
        if groups and interval(row).overlaps(interval(ordered[groups[-1][0]])):
            groups[-1].append(i)
        else:
            groups.append([i])
    return [f"{group[0] + 1}{'=' if len(group) > 1 else ''}" for group in groups for _ in group]


def number(value: float | None) -> str:
    """Return a number with three significant digits, or a dash."""
    if value is None or not np.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    digits = int(np.floor(np.log10(abs(value))))
    return f"{value:.{max(0, 2 - digits)}f}" if digits >= -3 else f"{value:.2g}"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _table(heading: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    rule = [":--" if name == "controller" else "--:" for name in heading]
    return [_line(heading), _line(rule), *(_line(line) for line in lines)]


def _score_line(rank: str, row: Row) -> list[str]:
    controller, head = row["controller"], interval(row)
    content = row["scenarios"]["content"]
    _, factor = shown(content)
    preview = controller["preview_seconds"]
    bounds = f"[{number(factor * head.low)}, {number(factor * head.high)}]"
    measured = [
        number(None if row["aggregate"][m]["mean"] is None else f * row["aggregate"][m]["mean"])
        for m, _, f in columns_of(content)
    ]
    return [
        rank,
        f"[`{controller['name']}`](results/{row['row']}.json)",
        controller["knowledge"],
        f"{preview:g} s" if preview else "none",
        f"**{number(factor * head.value)}** {bounds}",
        *measured,
        f"{row['failures']} of {len(row['episodes'])}",
    ]


def _matching(first: Row, second: Row) -> bool:
    keys = [[(e["scenario"], e["seed"]) for e in row["episodes"]] for row in (first, second)]
    return keys[0] == keys[1]


def _pair_line(row: Row, above: Row | None) -> list[str]:
    content = row["scenarios"]["content"]
    headline, (_, factor) = headline_of(content), shown(content)
    inner = row["aggregate"][headline]
    middle = f"{number(factor * inner['iqm'])}"
    bounds = f"[{number(factor * inner['iqm_low'])}, {number(factor * inner['iqm_high'])}]"
    line = [f"`{row['controller']['name']}`", f"{middle} {bounds}"]
    if above is None or not _matching(row, above):
        return [*line, "-", "-"]
    ours, theirs = (rows.scores_of(r["episodes"], headline) for r in (row, above))
    gap = statistics.paired_difference(
        ours, theirs, [episode["scenario"] for episode in row["episodes"]]
    )
    value, low, high = (factor * number for number in (gap.value, gap.low, gap.high))
    words = f"{value:+.3f} [{low:+.3f}, {high:+.3f}]"
    return [*line, words, f"{100.0 * statistics.share_better(ours, theirs):.0f} %"]


def _by_line(row: Row, columns: Sequence[tuple[str, str]]) -> list[str]:
    _, factor = shown(row["scenarios"]["content"])
    values = [number(factor * row["by"][axis][point]) for axis, point in columns]
    return [f"`{row['controller']['name']}`", *values]


def _track_page(name: str, ordered: Sequence[Row], figure: str | None) -> list[str]:
    first = ordered[0]
    content = first["scenarios"]["content"]
    digests = {row["scenarios"]["digest"] for row in ordered}
    unit, factor = shown(content)
    heading = ["rank", "controller", "knows", "preview", f"RMS [{unit}] [95 %]"]
    heading += [title for _, title, _ in columns_of(content)] + ["failures"]
    pairs = zip(ordered, [None, *ordered[:-1]], strict=True)
    columns = [(axis, str(point)) for axis in first["by"] for point in first["by"][axis]]
    lines = [
        f"## {content['title']}",
        "",
        f"`{first['env']['id']}`, scenarios `{name}` version {content['version']} "
        f"(`{first['scenarios']['digest'][:12]}`), {len(first['plants'])} scenarios x "
        f"{len(first['seeds'])} seeds, settling window {content['settle_seconds']:g} s, "
        f"worst case {factor * content['worst_case'][headline_of(content)]:g} {unit}.",
        "",
    ]
    if len(digests) > 1:
        lines += ["**These rows are not of one scenario file: run the track again.**", ""]
    scored = zip(ranks(ordered), ordered, strict=True)
    lines += [*_table(heading, [_score_line(rank, row) for rank, row in scored]), ""]
    if figure:
        lines += [f"![error and effort of {name}]({figure})", ""]
    heading = ["controller", f"IQM of RMS [{unit}] [95 %]"]
    heading += [f"RMS minus the row above [{unit}] [95 %]"]
    heading += ["better than the row above in"]
    lines += ["Paired with the row above, episode by episode:", ""]
    lines += [*_table(heading, [_pair_line(*pair) for pair in pairs]), ""]
    if columns:
        lines += [f"RMS [{unit}] by setting:", ""]
        heading = ["controller", *(f"{axis} {point}" for axis, point in columns)]
        lines += [*_table(heading, [_by_line(row, columns) for row in ordered]), ""]
    return lines


def _legend(all_rows: Sequence[Row]) -> list[str]:
    entries = {row["controller"]["name"]: row["controller"] for row in all_rows}
    lines = ["## Controllers", ""]
    for name in sorted(entries):
        about = entries[name]
        cited = f" *{about['citation']}*" if about["citation"] else ""
        lines.append(f"- `{name}`: {about['summary']}{cited}")
    return lines


def board_text(all_rows: Sequence[Row], figures: Mapping[str, str] | None = None) -> str:
    """Return LEADERBOARD.md.

    Parameters
    ----------
    all_rows : sequence of rows
        In any order.
    figures : mapping from track to path, optional
        Pictures to show, relative to the board.
    """
    lines = [*PREFACE.splitlines(), ""]
    for name, ordered in tracks(all_rows).items():
        lines += _track_page(name, ordered, (figures or {}).get(name))
    return "\n".join(lines + _legend(all_rows)).rstrip() + "\n"


def times_text(all_rows: Sequence[Row]) -> str:
    """Return TIMES.md: what is never compared."""
    lines = [
        "# Compute time per step",
        "",
        "Of `predict` alone, Python included, as measured when the row was run: median over the",
        "scenarios of the median and of the 99th percentile. Machines and their load differ.",
        "",
    ]
    for name, ordered in tracks(all_rows).items():
        table = [
            [
                f"`{row['controller']['name']}`",
                number(row["volatile"]["predict_us"]["median"]),
                number(row["volatile"]["predict_us"]["p99"]),
                row["volatile"]["machine"],
                row["volatile"]["date"],
            ]
            for row in ordered
        ]
        heading = ["controller", "median [us]", "p99 [us]", "machine", "date"]
        lines += [f"## {name}", "", *_table(heading, table), ""]
    return "\n".join(lines).rstrip() + "\n"


def write(folder: Path = rows.RESULTS, board: Path = BOARD) -> list[Path]:
    """Write the board, its figures and the times, and return the paths."""
    all_rows = rows.load_all(folder)
    if not all_rows:
        raise ValueError(f"no rows in {folder}; run `python -m benchmarks run` first")
    written, figures = [], {}
    for name, ordered in tracks(all_rows).items():
        path = folder / f"{name}.svg"
        write_text(path, plots.error_against_effort(ordered))
        inside = path.resolve().is_relative_to(board.parent.resolve())
        relative = path.resolve().relative_to(board.parent.resolve()) if inside else path
        figures[name] = relative.as_posix()
        written.append(path)
    write_text(board, board_text(all_rows, figures))
    write_text(folder / "TIMES.md", times_text(all_rows))
    return [board, folder / "TIMES.md", *written]
