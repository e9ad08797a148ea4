"""The board: a pure function of the rows, the same to the last byte whenever it is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import plots, standings
from benchmarks.board import summary as board_summary
from benchmarks.board.format import number, table
from benchmarks.board.tables import Column, track_page, with_costs
from benchmarks.identity import audit, verified
from benchmarks.runs import controllers, rows
from benchmarks.runs.rows import Row, shown
from benchmarks.runs.store import write_text

BOARD = Path(__file__).parents[1] / "LEADERBOARD.md"

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


INTRODUCTION = """\
# Leaderboard

Written by `python -m benchmarks board` from `benchmarks/results/*.json`; do not edit. Every row
holds what runs it again: `python -m benchmarks verify ROW`. `python -m benchmarks site` makes a
page of the same rows, with trajectories; `python -m benchmarks cite ROW` prints BibTeX. What the
columns mean stands [at the end](#how-to-read-this).
"""

NO_ROWS = "There are no rows yet: run `python -m benchmarks run`."

PREFACE = """\
- **RMS** is the headline: true output minus the external reference, without noise, after the
  settling window; the mean over episodes with its 95 % interval (stratified bootstrap over training
  seeds and, within scenarios, over seeds). *IQM* is the mean of the middle half of all episodes:
  it leaves out failures, so it never leads. Everything but the sensed error is noise-free.
- **Audit round**: scores, ranks, P(improvement), costs, failures and claims are of episodes whose
  seeds come from the task, all artefacts of the round and a salt that was drawn after they were
  committed. All rows of a round have the same episodes. *audit - public* is the gap to the public
  seeds, paired by training seed, bold where the row does worse on episodes that it could not be
  tuned to. *artefact 2* says that another artefact of this name was in an earlier round.
- A track without a round is **self-reported**: all of it is of the public episodes, which a maker
  can try as often as he likes, and nothing is claimed. Rows outside of the round of a track that
  has one are listed apart with their public scores.
- **Ranks**: a row shares the place of the first of its group (`=`) where the 95 % interval of their
  paired difference holds zero. A learned row needs five training seeds to be ranked.
- **Best paper controller**: the lowest mean among classical controllers with a source, that is, a
  paper's method or a textbook rule.
- **P(improvement)**: how likely a training seed's error is below the best paper controller's in
  the same episode, ties half, with its interval over training seeds, scenarios and seeds. *Better*
  needs more than 0.95 with a lower bound above 0.5, a mean whose paired difference lies below zero
  with its whole interval (*lower by* is its share), no plant from training of which the other is
  told another, ten training seeds, an audit of both in one round, no more failures, and pressure
  travel, air, constraint cost and (of a gait) EMG ratio of at most 1.1 times the paper
  controller's, each; with a higher cost it is called *better error, higher cost*. A constraint cost
  below a thousandth counts as none.
- **state**: the day on which `verify` ran the row again and found every number; *elsewhere*: on
  another machine, and nearly, since last digits differ; *at an older code*: code, data or
  policies have changed since, and it was not verified with them.
- *Smooth references*: RMS without steps and staircases, whose edges no controller can follow.
- A run that a limit ended counts at the worst-case value and shows under *failures*; none is left
  out.
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
- Times per step are in [results/TIMES.md](results/TIMES.md): as stated by who ran the row, not
  verified, since no two runs give the same.
"""


def board_text(all_rows: Sequence[Row], figures: Mapping[str, str] | None = None) -> str:
    """Return LEADERBOARD.md.

    Parameters
    ----------
    all_rows : sequence of rows
        In any order.
    figures : mapping from track to path, optional
        Pictures to show, relative to the board.
    """
    tracks = standings.tracks(all_rows)
    if not tracks:
        return f"{INTRODUCTION}\n{NO_ROWS}\n"
    lines = [*INTRODUCTION.splitlines(), "", verified_of(all_rows), "", "## Nominal tracks", ""]
    lines += [*board_summary.winners(tracks), "", "## Rank changes between tracks", ""]
    lines += [*RANK_CHANGES.splitlines(), "", *board_summary.rank_changes(tracks)]
    lines += ["## Tracks", ""]
    for name, ordered in tracks.items():
        columns = with_costs(columns_of(ordered[0]["scenarios"]["content"]))
        lines += track_page(ordered, columns, (figures or {}).get(name))
    lines += ["## What they cost to make", "", *board_summary.costs(all_rows), ""]
    lines += ["## Controllers", "", *board_summary.legend(all_rows), ""]
    lines += ["## How to read this", "", *PREFACE.splitlines()]
    return "\n".join(lines).rstrip() + "\n"


def verified_of(all_rows: Sequence[Row]) -> str:
    """Return how many rows were run again and held, nearly or to the last bit, and when."""
    said = [row[views.VERIFIED] for row in all_rows if views.is_verified(row)]
    when = f", last on {max(entry['date'] for entry in said)}" if said else ""
    nearly = sum(entry["mode"] == verified.ELSEWHERE for entry in said)
    how = f", {nearly} of them elsewhere and nearly" if nearly else ""
    return f"{len(said)} of {len(all_rows)} rows are verified with the code as it is{when}{how}."


RANK_CHANGES = """\
Each track against the nominal one of its environment, among the controllers that have run in all of
them: does what wins on the plant it was designed for still win on another? ▼ and ▲: places lost and
gained. *Episodes*: which ones the places are of, of both tracks where they differ.
"""


def times_text(all_rows: Sequence[Row]) -> str:
    """Return TIMES.md: what is never compared."""
    lines = [
        "# Compute time per step",
        "",
        "Of `predict` alone for one observation, Python included, as stated by who ran the row,",
        "not verified: median over the scenarios of the median and of the 99th percentile of the",
        "first 100 answers in two episodes. Machines and loads differ.",
        "",
    ]
    heading = ["controller", "median [us]", "p99 [us]", "machine", "date"]
    for name, ordered in standings.tracks(all_rows).items():
        lines += [f"## {name}", "", *table(heading, [_time_line(row) for row in ordered]), ""]
    return "\n".join(lines).rstrip() + "\n"


def _time_line(row: Row) -> list[str]:
    volatile = row["volatile"]
    return [
        f"`{row['controller']['name']}`",
        number(volatile["predict_us"]["median"]),
        number(volatile["predict_us"]["p99"]),
        volatile["machine"],
        volatile["date"],
    ]


def load(folder: Path) -> list[Row]:
    """Return the rows of a folder as they stand: with their verifications, and in a round or not.

    Raises
    ------
    ValueError
        If there is no such folder, or a row of it is refused.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder of rows; run `python -m benchmarks run` first")
    found, entrants = verified.read(folder), controllers.available()
    return [_standing(row, verified.of(row, found, entrants)) for row in rows.load_all(folder)]


def _standing(row: Row, verification: Mapping[str, Any] | None) -> Row:
    """Return a row with its verification; the audit of another than the last round is none."""
    last = audit.last(views.track_of(row)) if audit.in_last_round(row) else None
    held = {**row["audit"], "entrants": last.entrants} if last else None
    return {**row, "audit": held, views.VERIFIED: verification}


def write(folder: Path = rows.RESULTS, board: Path = BOARD) -> list[Path]:
    """Write the board, its figures and the times, and return the paths."""
    all_rows = load(folder)
    written, figures = [], {}
    for name, ordered in standings.tracks(all_rows).items():
        path = folder / f"{name}.svg"
        write_text(path, plots.track_figure(ordered))
        inside = path.resolve().is_relative_to(board.parent.resolve())
        relative = path.resolve().relative_to(board.parent.resolve()) if inside else path
        figures[name] = relative.as_posix()
        written.append(path)
    write_text(board, board_text(all_rows, figures))
    write_text(folder / "TIMES.md", times_text(all_rows))
    return [board, folder / "TIMES.md", *written]
