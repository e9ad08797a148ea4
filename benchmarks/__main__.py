"""Command line of the benchmarks."""

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from threadpoolctl import threadpool_limits
from tyro.conf import Positional, arg

from benchmarks.runs import controllers, rows, runner
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scoring.metrics import shown
from pam_envs.envs.registration import full_id
from sweeps.command_line import run_cli
from sweeps.files import database_named
from sweeps.progress import progress

Computing = Annotated[runner.Computing, arg(name="")]
Options = Annotated[runner.Options, arg(name="")]
COMPUTING, OPTIONS = runner.Computing(), runner.Options()


def _choose(names: tuple[str, ...], known: dict[str, Any], what: str) -> list[Any]:
    for name in names:
        if name not in known:
            raise ValueError(f"no {what} named {name!r}; there are: {', '.join(sorted(known))}")
    return [known[name] for name in names or known]


def _tracks(env: str, track: tuple[str, ...]) -> list[scenarios.ScenarioSet]:
    named = tuple(scenarios.add(Path(n)).name if n.endswith(".yaml") else n for n in track)
    chosen = _choose(named, scenarios.available(), "track")
    found = [made for made in chosen if not env or made.env == full_id(env)]
    if not found:
        ids = sorted({made.env for made in scenarios.available().values()})
        raise ValueError(f"no scenarios for {env!r}; there are some for: {', '.join(ids)}")
    return found


def run(
    env: str = "",
    controller: tuple[str, ...] = (),
    track: tuple[str, ...] = (),
    dry_run: bool = False,
    pages: bool = False,
    options: Options = OPTIONS,
) -> int:
    """Run controllers in the scenarios, one file per row; an interrupted run resumes.

    Args:
        env: Id of an environment; all by default.
        controller: Names of controllers; all by default.
        track: Names of scenario files, or paths of such files; all files by default.
        dry_run: Only list the cells and whether they are stored.
        pages: If all rows could be computed, also write the leaderboard, and the model cards from
            rows in benchmarks/results.
    """
    from benchmarks import console

    chosen = _choose(controller, controllers.available(), "controller")
    pairs = runner.pairs_of(chosen, _tracks(env, track))
    if not pairs:
        names = ", ".join(entrant.name for entrant in chosen)
        raise ValueError(
            f"none of {names} runs in {env or 'these tracks'}; the controllers of an environment "
            "are listed in benchmarks/LEADERBOARD.md"
        )
    if dry_run:
        planned = list(runner.planned(pairs, options))
        for cell, there in planned:
            print(f"{'there ' if there else 'to run'}  {runner.title(cell)}")
        print(f"{len(planned)} cells, {sum(not there for _, there in planned)} to run")
        return 0
    print(f"checking the cells of {len(pairs)} rows", file=sys.stderr)
    with progress("cells") as start:
        report = runner.run(pairs, options, start)
    incomplete = console.run(report)
    if pages and not incomplete:
        board(options.out)
        if options.out == rows.RESULTS:
            cards()
    return incomplete


def audit(
    track: Positional[tuple[str, ...]] = (),
    all: bool = False,
    options: Options = OPTIONS,
) -> int:
    """Draw a round of audit seeds for a track and run all its controllers on it.

    No round is drawn if nothing has changed since the last one.

    Args:
        track: Names of scenario files.
        all: Every track.
    """
    from benchmarks import console
    from benchmarks.identity import audit as auditing

    if bool(track) == all:
        raise ValueError("name tracks, or give --all")
    tracks = _choose(track, scenarios.available(), "track")
    pairs = runner.pairs_of(controllers.available().values(), tracks)
    for chosen in tracks:
        drawn = auditing.draw(chosen, [entrant for entrant, other in pairs if other is chosen])
        count, salt = len(drawn.entrants), f"salt {drawn.salt} of {drawn.drawn}"
        print(f"{chosen.name}: round {drawn.number}, {count} controllers, {salt}", flush=True)
    with progress("cells") as start:
        report = runner.run(pairs, options, start)
    return console.run(report)


def cite(row: Positional[tuple[str, ...]]) -> int:
    """Print BibTeX of rows, of this package and of the methods used.

    Args:
        row: Files or names of rows.
    """
    from benchmarks.board.cite import bibtex

    for path in _row_paths(row):
        print(bibtex(rows.load(path)))
    return 0


def show_row(row: Positional[tuple[str, ...]], json: bool = False) -> int:
    """Print rows: origin, public and audit scores, all metrics and settings.

    Args:
        row: Files or names of rows.
        json: Print the complete row as JSON, at full precision.
    """
    from json import dumps

    from benchmarks.board.words import row_text

    for held in map(rows.load, _row_paths(row)):
        print(dumps(held, indent=1, sort_keys=True) if json else row_text(held))
    return 0


def board(results: Path = rows.RESULTS, out: Path | None = None) -> int:
    """Write LEADERBOARD.md and a page with figures for each environment.

    Args:
        results: Folder of the rows.
        out: File of the board; the pages go to the folder leaderboard beside it. Default:
            benchmarks/LEADERBOARD.md, or LEADERBOARD.md in another folder of rows.
    """
    from benchmarks.board import leaderboard

    own = leaderboard.BOARD if results == rows.RESULTS else results / leaderboard.BOARD.name
    for path in leaderboard.write(results, own if out is None else out):
        print(path)
    return 0


def cards(results: Path = rows.RESULTS) -> int:
    """Write the model cards of the policies in agents/pretrained.

    Args:
        results: Folder of the rows.
    """
    from benchmarks.board import model_cards

    for path in model_cards.write(results):
        print(path)
    return 0


def gap(results: Path = rows.RESULTS) -> int:
    """Print the distance of the best classical controllers from the oracle (leaderboard/gap.md).

    Args:
        results: Folder of the rows and of the oracle's bounds.
    """
    from benchmarks.board import gap as gaps
    from benchmarks.board import leaderboard, standings
    from benchmarks.bounds import run as bounding

    tracks = standings.tracks(leaderboard.load(results))
    print(gaps.page_text(tracks, bounding.read(results)), end="")
    return 0


def site(results: Path = rows.RESULTS, out: Path | None = None) -> int:
    """Write the interactive page of all rows: one folder of static files.

    Args:
        results: Folder of the rows.
        out: Folder of the page. Default: benchmarks/site, or site in another folder of rows.
    """
    from benchmarks.board import site as pages

    own = pages.OUT if results == rows.RESULTS else results / pages.OUT.name
    with progress("tracks") as start:
        written = pages.build(results, own if out is None else out, start)
    print(f"{len(written)} files; open {written[0]}")
    return 0


def film(
    track: Positional[str],
    scenario: str = "",
    seed: int | None = None,
    out: Path = Path("film.mp4"),
    oracle: bool = True,
    results: Path = rows.RESULTS,
) -> int:
    """Film the best controllers of a track side by side: published, classical, learned, oracle.

    Args:
        track: Name of a track.
        scenario: Name of one of its scenarios. Default: the first.
        seed: Seed of the episode. Default: the first public one.
        out: File to write, .mp4 or .gif.
        oracle: Run the oracle too, which takes a minute or more.
        results: Folder of the rows.
    """
    from benchmarks.board import film as films
    from benchmarks.board import leaderboard, standings, summary

    (chosen,) = _tracks("", (track,))
    known = {one.name: one for one in chosen.scenarios()}
    if scenario and scenario not in known:
        raise ValueError(f"scenario = {scenario!r} is none of {track}: {', '.join(known)}")
    one = known[scenario or next(iter(known))]
    held = standings.tracks(leaderboard.load(results)).get(track, [])
    if not held:
        raise ValueError(f"{track} has no rows in {results}; run `python -m benchmarks run` first")
    best = summary.best_of(track, held, {})
    first = chosen.seeds[one.name][0]
    print(films.write(out, chosen, best, one, first if seed is None else seed, oracle))
    return 0


def verify(
    row: Positional[tuple[str, ...]] = (),
    all: bool = False,
    options: Computing = COMPUTING,
) -> int:
    """Compute rows again and compare; exit code 1 if one is not reproduced.

    First the audit rounds are compared with those of all earlier commits, which may not change.
    A row must be reproduced to the last bit, or within rounding if it was made with other packages
    or on another processor. The result is stored in verified.json beside the rows of this
    checkout; for other rows nothing is written.

    Args:
        row: Files or names of rows.
        all: Every row of benchmarks/results.
    """
    from benchmarks import console
    from benchmarks.identity import audit as auditing
    from benchmarks.runs import verified
    from benchmarks.runs import verify as checking

    if altered := auditing.altered():
        raise ValueError("; ".join(altered))
    verdicts = []
    for path, found in checking.verify_all(_row_paths(row, all), options.cluster):
        if path.resolve().parents[1] == rows.RESULTS.resolve():
            verified.note(path, found.checksum if found.holds else "", found.mode)
        console.verdict(found)
        verdicts.append(found)
    if len(verdicts) > 1:
        print(console.counted(verdicts))
    return 1 if any(not found.holds for found in verdicts) else 0


def void(row: Positional[tuple[str, ...]] = (), all: bool = False) -> int:
    """List rows whose task or controller has changed behaviour; exit code 1 if there are any.

    Every environment runs one short episode and every controller acts on stored observations; no
    row is computed again.

    Args:
        row: Files or names of rows.
        all: Every row of benchmarks/results.
    """
    from benchmarks.runs import verify as checking

    paths, count = _row_paths(row, all), 0
    for path in paths:
        why = checking.void(rows.load(path))
        count += bool(why)
        if why:
            print(f"{rows.name_of(path)}: {'; '.join(why)}", flush=True)
    print(f"{count} of {len(paths)} rows are void")
    return 1 if count else 0


def _row_paths(names: tuple[str, ...], all: bool | None = None) -> list[Path]:
    """Return the files of rows; ``all`` is None for a command without that option."""
    paths = [_row_path(name) for name in names] + (rows.files() if all else [])
    if not paths:
        other = "" if all is None else ", or give --all"
        raise ValueError(f"name a row, for example positioning_nominal--inverse{other}")
    return paths


def _row_path(name: str) -> Path:
    given = Path(name)
    if given.is_file() and name.endswith(rows.SUFFIX):
        return given
    if not rows.is_name(name):
        raise ValueError(
            f"{name!r} is neither a file TRACK/CONTROLLER{rows.SUFFIX} nor a name "
            "TRACK--CONTROLLER of letters, digits and _"
        )
    path = rows.path_of(name)
    if not path.is_file():
        raise ValueError(f"there is no row {name!r}; its file would be {path}")
    return path


def tune(
    controller: Positional[str],
    env: str = "",
    trials: int = 20,
    seed: int = 0,
    episodes: int = 30,
    plants: Literal["nominal", "drawn"] = "nominal",
    write: bool = False,
    storage: Path | None = None,
) -> int:
    """Tune the free parameters of a classical controller; an interrupted search resumes.

    Args:
        controller: Name of a controller with free parameters (knobs).
        env: Id of the environment, if the controller runs in several.
        trials: Number of settings to try, including those of earlier calls.
        seed: Seed of the sampler.
        episodes: Minimum number of episodes per trial.
        plants: Episodes of the nominal track, or of the one whose plants are drawn.
        write: Write the result into baselines/core/tuned.yaml, which the catalogue reads.
        storage: SQLite file of the trials, runs/tuning.db by default.
    """
    from baselines.core import tuned
    from benchmarks.runs import tuning

    more = {} if storage is None else {"storage": storage}
    how = {"trials": trials, "seed": seed, "episodes": episodes, "plants": plants, **more}
    job = tuning.job_of(controller, env, **how)
    course = tuning.Course(controller, tuning.track_of(job.env, plants), episodes)
    with database_named(job.storage), progress("trials") as start:
        found = tuning.search(job, course.measure, start)
    print(tuning.sentence(found))
    if write:
        tuning.write(found)
        print(tuned.FILE)
    return 0


def papers(
    paper: tuple[str, ...] = (), place: tuple[str, ...] = (), json: Path | None = None
) -> int:
    """Compare published figures with this package; exit code 1 if a difference has no reason.

    Args:
        paper: Only these papers, for example yeh2010. All by default.
        place: Only these places, for example 'Eq. (10)' or 'Fig. 7'. All by default.
        json: Also write the comparison to this file.
    """
    from benchmarks.papers.figures import all_figures
    from benchmarks.papers.inventory import summary
    from benchmarks.papers.published import table
    from benchmarks.runs.store import write_record

    with progress("groups of figures") as start:
        figures = all_figures(paper, place, start)
    print(table(figures))
    if not paper and not place:
        print(f"\n{summary(figures)}")
    if json:
        write_record(json, {"figures": [figure.record() for figure in figures]})
    return 1 if any(figure.unexplained for figure in figures) else 0


def bound(
    track: Positional[tuple[str, ...]],
    episodes: int = 2,
    horizon: int = 100,
    start: str = "",
    write: bool = False,
) -> int:
    """Estimate the smallest error of tracks: a controller that knows plant, state and future.

    Args:
        track: Names of scenario files.
        episodes: Number of episodes of each scenario, its first public ones.
        horizon: Control periods that are predicted.
        start: Name of a controller; its actions in the same episodes are a candidate of every
            search. Default: none.
        write: Write the result into benchmarks/results/oracle.json.xz, which the board reads.
    """
    from benchmarks.bounds import run as bounding

    for chosen in _choose(track, scenarios.available(), "track"):
        with progress("scenarios") as begin:
            advance = begin(len(chosen.scenarios()))
            found = bounding.bounds_of(chosen, episodes, horizon, start, advance)
        print(bounding.table(chosen, found), flush=True)
        if write:
            bounding.write({chosen.name: found})
    return 0


def effort(seeds: int = 10, wearer: Literal["prescribed", "adaptive"] = "prescribed") -> int:
    """Print the EMG-proxy effort of gaits: no, perfect and random assistance.

    Args:
        seeds: Number of episodes (seeds) of each controller.
        wearer: Wearer of the orthosis.
    """
    from benchmarks.effort import efforts

    print(efforts(seeds, wearer))
    return 0


def energy(cycles: int = 2000, seed: int = 0) -> int:
    """Print the net work of plants on random closed cycles of pressure and position.

    Args:
        cycles: Number of cycles for each plant and hysteresis.
        seed: Seed of the cycles.
    """
    from benchmarks.energy import net_work

    print(net_work(cycles, seed))
    return 0


def speed(only: tuple[str, ...] = (), rounds: int = 7, json: Path | None = None) -> int:
    """Measure speed, interleaved with other environments, and compare with the targets.

    Args:
        only: Groups to measure: single, batch, air, planning, controllers, plain, start, learning,
            diagnosis, gpu. All by default.
        rounds: Number of interleaved rounds; the median counts.
        json: Also write the figures to this file.
    """
    from benchmarks.runs.store import write_record
    from benchmarks.speed import groups, rates

    with progress("groups") as start:
        results = groups.measure(only, rounds, start)
    print(rates.table(results))
    if json:
        write_record(json, rates.record(results))
    return 0


def export(steps: int = 1000) -> int:
    """Export every environment, compare C, WebAssembly and FMUs with Python, and print a table.

    Args:
        steps: Control periods that are compared.
    """
    from benchmarks import exported

    rows = []
    with progress("environments") as start:
        advance = start(9)
        for row in exported.measure(steps):
            rows.append(row)
            advance()
    print(exported.table(rows))
    return int(any(row.c_bits + row.wasm_bits + row.fmu_bits + row.fmu2_bits for row in rows))


def playground(out: Path = Path("exported/playground")) -> int:
    """Write the playground: environments and controllers in one web page (docs/playground.md).

    Args:
        out: Folder of index.html.
    """
    from benchmarks.playground import page

    path = page.write(out)
    print(f"wrote {path}, {path.stat().st_size / 1e3:.0f} kB")
    return 0


def export_controller(
    name: Positional[str],
    env: str,
    target: Literal["c", "wasm", "fmu", "st"] = "c",
    out: Path = Path("exported"),
    plant: Path | None = None,
    si: bool = False,
    training_seed: int | None = None,
) -> int:
    """Export a controller or a policy for use without Python (docs/export.md).

    Args:
        name: Name of the controller, as on the board.
        env: Id of the environment whose signals it reads.
        target: "c", "wasm", "fmu", or "st" (Structured Text of IEC 61131-3, for pid and plc_*).
        out: Folder; the artefact gets a folder in it, by name and target.
        plant: Plant file of the nominal plant; default: that of the environment.
        si: Observation and action in SI, not scaled to [-1, 1].
        training_seed: Training seed of a policy; default: the lowest.
    """
    from benchmarks import exported_controller
    from pam_envs.export import command

    folder = out / f"{name}_{target}"
    digest = exported_controller.write(
        name, command.registered(env), target, folder, plant, si, training_seed
    )
    print(f"wrote {folder}, digest {digest[:16]}")
    return 0


@dataclass(frozen=True)
class Arguments:
    """Arguments of an environment; those that are not given have its defaults."""

    hysteresis: str | None = None
    """Hysteresis model of the plant."""
    reference: str | None = None
    """Family of the reference."""
    load: float | None = None
    """Load [kg]."""
    episode_seconds: float | None = None
    """Duration [s]."""
    load_disturbance: float | None = None
    """Unmeasured step of the load [kg]."""
    randomize: bool = False
    """Draw the assumed parameters of the plant."""


def show(
    env: Positional[str],
    controller: str,
    seed: int = 101,
    plot: Path | None = None,
    title: str = "",
    video: Path | None = None,
    arguments: Annotated[Arguments, arg(name="")] = Arguments(),
) -> int:
    """Run one episode and plot reference, output, setpoints, pressure and hysteresis loop.

    Args:
        env: Id of the environment.
        controller: Name of a controller.
        seed: Seed of the reset.
        plot: Image file to write.
        title: Title of the image; default: controller, environment, arguments and seed.
        video: Video file to write.
    """
    from benchmarks.runs import show as showing

    given = vars(arguments).items()
    kwargs = {name: v for name, v in given if v is not None and v is not False}
    env_id = full_id(env)
    content = _tracks(env_id, ())[0].content
    episode, set_points = showing.play(env_id, controller, kwargs, seed, video)
    if episode.failed:
        print(f"ended early: {episode.failure}")
    else:
        for line in showing.score_lines(showing.summary(episode, content), content):
            print(line)
    if plot:
        said = "".join(f", {name} {value}" for name, value in kwargs.items())
        words = title or f"{controller} in {env_id}{said}, seed {seed}"
        figure = showing.episode_figure(episode.signals, set_points, words, shown(content))
        plot.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(plot, dpi=150)
        print(plot)
    if video:
        print(video)
    return 1 if episode.failed else 0


def diagnosis(
    chosen: Literal["small", "tune", "final", "worlds", "families", "mutilated"] = "small",
    offset: int = 0,
    kind: tuple[str, ...] = (),
    name: tuple[str, ...] = (),
    world: tuple[str, ...] = (),
    each: dict[str, int] | None = None,
    loops: int = 0,
    next: bool = False,
    force: bool = False,
    timed: bool = False,
    cells: Path | None = None,
    out: Path | None = None,
    computing: Computing = COMPUTING,
) -> int:
    """Benchmark the diagnosis on simulated rigs with hidden effects; an interrupted run resumes.

    Args:
        chosen: Set of cases; "worlds" are rigs of twenty-one other simulations, "families" those of
            joints, orthoses and arms, "mutilated" are spoiled recordings.
        offset: Number of the random draw of cases; development on worlds and families uses one
            above 0.
        kind: Only cases of these kinds.
        name: Only cases with one of these hidden effects.
        world: Only rigs of these worlds, of families as in "antagonistic_joint.braid".
        each: Only these kinds, and so many cases of each in each world (of single effects: of each
            effect), as in "--each single 1 clean 6".
        loops: Number of cases per cause that are run in closed loop on the hidden rig.
        next: Run the proposed experiments.
        force: Compute stored cases again.
        timed: Also time complete reports of ten minutes at 50 Hz, on two cores.
        cells: Folder of the records, which are the checkpoint.
        out: Folder of the page with numbers and figure; default: benchmarks/results for the
            complete final set, otherwise beside the records.
    """
    from benchmarks.diagnosis import mutilated
    from benchmarks.diagnosis import report as telling
    from benchmarks.diagnosis import run as running
    from benchmarks.diagnosis.families import page as families_page
    from benchmarks.diagnosis.families.study import study as study_of_family
    from benchmarks.diagnosis.study import study
    from benchmarks.diagnosis.worlds import page as worlds_page
    from benchmarks.speed.diagnosis import timed as reports_timed
    from pam_envs.data.tables import load_contraction_table
    from pam_envs.diagnosis.static.diagnosis import diagnose_readings

    folder = running.FOLDER if cells is None else cells
    options = running.Options(
        *(chosen, offset, kind, name, loops, next, force, folder, computing, world, each or {})
    )
    with progress("cases") as start:
        acts = {"mutilated": mutilated.study, "families": study_of_family}
        report = running.run(options, start, acts.get(chosen, study))
    print(f"{report.computed} computed, {report.found} were there already")
    for line in report.quarantined:
        print(f"corrupt, set aside and computed again: {line}")
    for line in report.unmade:
        print(f"not made, counted apart: {line}")
    for line in report.failed:
        print(f"FAILED, counted as wrong: {line}", file=sys.stderr)
    frozen = chosen in ("worlds", "families", "mutilated") and offset == 0
    official = options.whole and (chosen == "final" or frozen)
    place = out or (rows.RESULTS if official else folder / "pages" / chosen)
    pages = {
        "worlds": worlds_page.write,
        "families": families_page.write,
        "mutilated": mutilated.write,
    }
    if chosen in pages:
        for path in pages[chosen](report.records, place, options.arguments):
            print(path)
        return 0
    beside = {
        "tables": diagnose_readings(load_contraction_table()),
        "whole_report_s": reports_timed()[1] if timed else (),
    }
    arguments = options.arguments + " --timed" * timed
    for path in telling.write(report.records, place, arguments, **beside):
        print(path)
    return 0


def example(folder: Path | None = None) -> int:
    """Make the recording with a hidden effect that ships with the package.

    Args:
        folder: Folder of recording, rig file and sealed truth; default: pam_envs/data.
    """
    from benchmarks.diagnosis import example as making

    for path in making.write() if folder is None else making.write(folder):
        print(path)
    return 0


def dataset(
    env: Positional[str],
    kind: tuple[str, ...] = (),
    steps: int = 1_000_000,
    noise: float = 0.05,
    controller: str = "",
    medium: Path | None = None,
    expert: Path | None = None,
    training_steps: int | None = None,
    episode_seconds: float | None = None,
    out: Path = Path("datasets"),
) -> int:
    """Write data sets of an environment for offline learning (Minari, with Croissant metadata).

    Every episode draws its own plant. Existing data sets are kept. See docs/datasets.md.

    Args:
        env: Id of the environment.
        kind: random, classical, medium, expert, excitation; all by default.
        steps: Control periods of each data set, at least.
        noise: Standard deviation of the noise that every second episode of a controller or policy
            adds to its action, in units of half the action's range.
        controller: Classical controller; that of the environment's paper by default.
        medium: Policy of the medium data; by default one is trained with a tenth of the steps.
        expert: Policy of the expert data; by default one is trained by the PPO preset.
        training_steps: Steps of that training, the preset's by default.
        episode_seconds: Length of an episode [s], the environment's by default.
        out: Folder of the data sets.
    """
    from benchmarks.datasets import generate
    from benchmarks.datasets.behaviours import KINDS

    policies = {name: path for name, path in (("medium", medium), ("expert", expert)) if path}
    order = generate.Order(
        full_id(env),
        kind or KINDS,
        steps,
        noise,
        controller,
        policies,
        training_steps,
        episode_seconds,
    )
    with progress("episodes") as start:
        for folder in generate.generate(order, out, start):
            print(folder, flush=True)
    return 0


COMMANDS: dict[str, Callable[..., int]] = {
    "run": run,
    "board": board,
    "cards": cards,
    "gap": gap,
    "site": site,
    "film": film,
    "verify": verify,
    "void": void,
    "audit": audit,
    "cite": cite,
    "show-row": show_row,
    "tune": tune,
    "papers": papers,
    "bound": bound,
    "effort": effort,
    "energy": energy,
    "speed": speed,
    "export": export,
    "export-controller": export_controller,
    "playground": playground,
    "show": show,
    "diagnosis": diagnosis,
    "example": example,
    "dataset": dataset,
}


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return the exit code; a wrong argument is one sentence, no traceback."""
    ask = tyro.extras.subcommand_cli_from_dict
    os.environ.setdefault("PAM_ENVS_COMPILE", "wait")  # rates are of machine code
    # designs round alike on every number of cores: libraries loaded later, and those loaded now
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with threadpool_limits(1, "blas"):
        return run_cli(
            lambda: ask(COMMANDS, prog="python -m benchmarks", args=arguments),
            "interrupted; no file is half-written; completed cells, cases and trials are kept, and "
            "the same command resumes",
        )


if __name__ == "__main__":
    sys.exit(main())
