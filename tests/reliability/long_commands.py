"""Kills, interrupts and full disks at the file operations of every long command.

Each command runs in a forked process whose files are watched. At one of its file operations it is
killed, interrupted, or finds the disk full. Its results must then be those from before or those of
an undisturbed run, never parts of both; an interrupt and a full disk must be one sentence; and the
same command must afterwards end with the results of the undisturbed run and leave no temporary
file.
"""

import errno
import hashlib
import io
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

Results = dict[str, str]
COUNT = "count.txt"
FAULTS = ("kill", "interrupt", "full disk", "file limit", "small disk")
"""A kill or an interrupt at an operation; no room for a new file; none for more bytes in a file; a
real file system with little room, which only root can mount."""
ROOM = (0, 4, 16, 64, 256, 1024)
"""Free kB of a small disk."""
EVENTS = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.listdir")


@dataclass(frozen=True)
class Command:
    """A long command: what it runs in a folder, and the results that a reader finds there."""

    name: str
    run: Callable[[Path], int]
    results: Callable[[Path], Results]
    before: Callable[[Path], None] = lambda folder: None  # earlier results that it replaces
    prepare: Callable[[], object] = lambda: None  # what all runs share


def digest(path: Path) -> str:
    """Return the digest of a file, or of all files of a folder; empty if it is missing."""
    if not path.exists():
        return ""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    state = hashlib.sha256()
    for file in files:
        if file.is_file():
            state.update(str(file.relative_to(path.parent)).encode() + file.read_bytes())
    return state.hexdigest()[:12]


# --- commands ------------------------------------------------------------------------------------


_armed: list[Callable[[], None]] = []
"""What prepares the fault, called when the command itself begins."""


def _cli(module: Any, *arguments: object) -> int:
    while _armed:
        _armed.pop()()
    return int(module.main([str(argument) for argument in arguments]))


@contextmanager
def _tiny_known(folder: Path) -> Iterator[None]:
    """Let the readers of rows find the track and the rounds of a folder."""
    from benchmarks.identity import audit
    from benchmarks.scenarios import scenario as scenarios

    known = scenarios.FOLDER, audit.FILE
    scenarios.FOLDER, audit.FILE = folder, folder / "rounds.json"
    try:
        yield
    finally:
        scenarios.FOLDER, audit.FILE = known


def _rows_of(folder: Path) -> Results:
    """Return the rows of a folder, read as the board reads them, without dates and times."""
    from benchmarks.runs import rows

    found = {}
    for path in rows.files(folder / "out"):
        with _tiny_known(folder):
            row = rows.load(path)
        kept = {k: v for k, v in row.items() if k not in ("volatile", "checksum")}
        found[path.name] = hashlib.sha256(json.dumps(kept).encode()).hexdigest()[:12]
    return found


def _furnished(folder: Path) -> None:
    """Write what the harness needs before a fault can meet it."""
    from tests.benchmarks.row_helpers import furnish

    furnish(folder)


def _run(folder: Path, command: str = "run") -> int:
    from benchmarks import __main__ as benchmarks
    from benchmarks.scenarios import scenario as scenarios
    from tests.benchmarks.row_helpers import place

    places = ("--out", folder / "out", "--cells", folder / "cells", "--jobs", 1)
    with place(folder):
        known, scenarios.available = scenarios.available, _only_tiny(folder)
        try:
            if command == "audit":
                return _cli(benchmarks, "audit", "tiny", *places)
            names = ("--controller", "low", "middle")
            return _cli(benchmarks, "run", "--track", "tiny", *names, *places)
        finally:
            scenarios.available = known


def _only_tiny(folder: Path) -> Callable[[], Any]:
    from tests.benchmarks.row_helpers import tiny

    return lambda: {"tiny": tiny(folder)}


def _audit(folder: Path) -> int:
    from benchmarks.runs import controllers
    from tests.benchmarks import bench_fakes

    every = dict(bench_fakes.CONTROLLERS)
    for name in set(every) - {"low", "middle"}:
        del bench_fakes.CONTROLLERS[name]
    try:
        return _run(folder, "audit")
    finally:
        bench_fakes.CONTROLLERS.update(every)
        assert controllers.available


def _audited(folder: Path) -> Results:
    """Return the rows without salts, and how many rounds there are."""
    from benchmarks.identity import audit
    from benchmarks.runs import rows

    with _tiny_known(folder):
        found = {"rounds": str(len(audit.rounds()))}
        for path in rows.files(folder / "out"):
            row = rows.load(path)
            if row["audit"]:
                found[path.name] = str(len(row["episodes"]))
    return found


def _board(folder: Path) -> int:
    from benchmarks import __main__ as benchmarks
    from tests.benchmarks.row_helpers import place

    with place(folder):
        return _cli(benchmarks, "board", "--results", folder / "out")


def _site(folder: Path) -> int:
    from benchmarks import __main__ as benchmarks
    from tests.benchmarks.row_helpers import place

    with place(folder):
        return _cli(benchmarks, "site", "--results", folder / "out")


def _with_rows(folder: Path) -> None:
    """Make rows, and a board and a page of one of them alone."""
    _quietly(_run, folder)
    spare = folder / "out/tiny/middle.json.xz"
    kept = spare.read_bytes()
    spare.unlink()
    _quietly(_board, folder)
    _quietly(_site, folder)
    spare.write_bytes(kept)


def _quietly(run: Callable[[Path], int], folder: Path) -> None:
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        assert run(folder) == 0


def _boards(folder: Path) -> Results:
    return {name: digest(folder / "out" / name) for name in ("LEADERBOARD.md", "leaderboard")}


def _sites(folder: Path) -> Results:
    return {"site": digest(folder / "out/site")}


def _config(folder: Path) -> Path:
    from tests.agents.short_runs import tiny

    path = folder.parent / "settings.yaml"
    if not path.exists():
        settings = {**tiny().as_dict(), "steps": 512, "num_envs": 4}
        path.write_text(yaml.safe_dump(settings), encoding="utf-8")
    return path


def _train(folder: Path) -> int:
    from agents import __main__ as agents

    more = ["--resume"] if (folder / "run").is_dir() else []
    held = (folder / "run/checkpoint.pt").exists()
    settings = [] if held else ["--config", _config(folder)]
    place = ("--out", folder / "run")
    return _cli(agents, "train", "PAM/MusclePositioning-v0", *settings, *place, *more)


def _policy(folder: Path) -> Results:
    """Return the policy of a run if it is finished, as its readers decide."""
    from agents.policies.policy_file import POLICY, finished

    found = {}
    for path in sorted(folder.rglob(POLICY)):
        if finished(path) is not None:
            found[str(path.relative_to(folder))] = digest(path)
    return found


def _sweep(folder: Path) -> int:
    from agents import __main__ as agents

    changes = ["env_kwargs={episode_seconds: 0.3}", "num_envs=4", "ppo.n_steps=16"]
    changes += ["ppo.batch_size=64", "network.hidden=[16]", "evaluation.episodes=0"]
    given = ("--seeds", 1, "--steps", 256, "--jobs", 1, "--out", folder / "runs", "--set")
    return _cli(agents, "sweep", "PAM/MusclePositioning-v0", *given, *changes)


def _tune(folder: Path) -> int:
    from baselines.core import tuned
    from benchmarks import __main__ as benchmarks
    from benchmarks.runs import tuning

    class Bowl:
        """Fake measurement of a controller, best at one setting."""

        def __init__(self, *_: object) -> None:
            pass

        def measure(self, knobs: Any) -> tuning.Measured:
            off = abs(knobs.get("closed_loop_time", 1.0) - 0.5)
            return tuning.Measured(0.5 + off, 1.0 + off, 0, {})

    file = folder / "tuned.yaml"
    known = tuning.Course, tuning.write, tuned.FILE
    write = tuning.write
    tuning.Course, tuning.write = Bowl, lambda found: write(found, file)  # type: ignore[assignment, misc]
    try:
        given = ("--trials", 3, "--storage", folder / "tuning.db", "--write")
        return _cli(benchmarks, "tune", "pid", *given)
    finally:
        tuning.Course, tuning.write, tuned.FILE = known  # type: ignore[misc]


def _copy_tuned(folder: Path) -> None:
    from baselines.core import tuned

    shutil.copy(tuned.FILE, folder / "tuned.yaml")


def _tuned(folder: Path) -> Results:
    from baselines.core import tuned

    found = tuned.read(folder / "tuned.yaml")
    return {"tuned.yaml": hashlib.sha256(repr(sorted(found)).encode()).hexdigest()[:12]} | {
        name: f"{entry.knobs} {entry.after}" for name, entry in found.items() if name == "pid_tuned"
    }


def _search(folder: Path) -> int:
    from agents import __main__ as agents
    from agents.search import spaces, tune
    from agents.settings import presets

    def sizes(job: Any, trial: Any) -> float:
        """Return a fake value of a trial, from its settings alone."""
        values = spaces.suggest(trial, job.config).values()
        return float(sum(value for value in values if isinstance(value, (int, float))))

    known = tune.objective, presets.preset_path
    tune.objective, presets.preset_path = sizes, lambda *_: folder / "preset.yaml"
    try:
        given = ("--trials", 3, "--steps", 256, "--storage", folder / "search.db", "--write")
        return _cli(agents, "tune", "PAM/MusclePositioning-v0", *given)
    finally:
        tune.objective, presets.preset_path = known


def _copy_preset(folder: Path) -> None:
    from agents.settings import presets

    shutil.copy(presets.preset_path("PAM/MusclePositioning-v0", "ppo"), folder / "preset.yaml")


def _preset(folder: Path) -> Results:
    from agents.settings import presets

    presets.read(folder / "preset.yaml")
    return {"preset.yaml": digest(folder / "preset.yaml")}


@cache
def _readings() -> Any:
    """Return the diagnosis of the shipped readings, computed once."""
    from pam_envs.data.tables import load_contraction_table
    from pam_envs.diagnosis.static.diagnosis import diagnose_readings

    return diagnose_readings(load_contraction_table())


def _diagnose(folder: Path) -> int:
    from pam_envs import __main__ as library
    from pam_envs.diagnosis.static import diagnosis as static

    real, found = static.diagnose_readings, _readings()

    static.diagnose_readings = lambda data, seed=0: found  # type: ignore[assignment, misc]
    table = Path(library.__file__).parent / "data/mas10_contraction.csv"
    try:
        return _cli(library, "diagnose", table, "--out", folder / "diagnosis")
    finally:
        static.diagnose_readings = real


def _older_diagnosis(folder: Path) -> None:
    place = folder / "diagnosis"
    place.mkdir()
    for name in ("report.json", "report.html", "plant.yaml", "notes.txt"):
        (place / name).write_text(f"{name} of an earlier diagnosis", encoding="utf-8")


def _export(folder: Path) -> int:
    from pam_envs import __main__ as library

    return _cli(library, "export", "single_muscle", "--target", "c", "--out", folder / "exported")


def _older_export(folder: Path) -> None:
    place = folder / "exported/single_muscle_c"
    place.mkdir(parents=True)
    for name in ("single_muscle.h", "single_muscle.c"):
        (place / name).write_text("of an earlier export", encoding="utf-8")


COMMANDS = (
    Command("run", _run, _rows_of, _furnished),
    Command("audit", _audit, _audited, _furnished),
    Command("board", _board, _boards, _with_rows),
    Command("site", _site, _sites, _with_rows),
    Command("train", _train, _policy),
    Command("sweep", _sweep, _policy),
    Command("tune", _tune, _tuned, _copy_tuned),
    Command("search", _search, _preset, _copy_preset),  # agents tune
    Command(
        "diagnose", _diagnose, lambda f: {"": digest(f / "diagnosis")}, _older_diagnosis, _readings
    ),
    Command(
        "export", _export, lambda f: {"": digest(f / "exported/single_muscle_c")}, _older_export
    ),
)


# --- faults --------------------------------------------------------------------------------------


def watched(folder: Path, act: Callable[[int, str], None]) -> None:
    """Call ``act`` with the number of each operation on a folder's files, and what it makes."""
    count, inside = 0, str(folder)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        if event not in EVENTS or not arguments or not isinstance(arguments[0], (str, Path)):
            return
        place = str(arguments[0])
        if place.startswith(inside) and not place.endswith((".lock", ".db", "-journal")):
            count += 1
            makes = event in ("os.mkdir", "os.link")
            makes = makes or (event == "open" and bool(int(arguments[2]) & os.O_CREAT))
            act(count, place if makes else "")

    sys.addaudithook(hook)


def forked(command: Command, folder: Path, start: Callable[[], None]) -> tuple[int, str]:
    """Run a command in a fork; return its exit code, or a negative signal, and what it printed."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        status = 70
        try:
            os.dup2(writing, 1)
            os.dup2(writing, 2)
            sys.stdout, sys.stderr = os.fdopen(1, "w", 1), os.fdopen(2, "w", 1)
            _armed.append(start)
            status = command.run(folder)
            sys.stdout.flush()
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    os.close(writing)
    with open(reading, encoding="utf-8", errors="replace") as pipe:
        said = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), said


def injected(folder: Path, fault: str, at: int) -> Callable[[], None]:
    """Return what prepares a fork for a fault at its operation number ``at``."""

    def act(count: int, made: str) -> None:
        if fault == "full disk" and count >= at and made:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), made)
        if count != at:
            return
        if fault == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if fault == "interrupt":
            raise KeyboardInterrupt

    def start() -> None:
        if fault == "file limit":
            most = (0, 100, 1000, 3000, 10_000, 30_000)[at % 6]
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
        watched(folder, act)

    return start


def counting(folder: Path) -> Callable[[], None]:
    """Return what lets a fork count its operations."""
    path = folder.parent / COUNT

    def start() -> None:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)

        def act(count: int, made: str) -> None:
            os.pwrite(file, str(count).encode(), 0)

        watched(folder, act)

    return start


def mounted(folder: Path) -> bool:
    """Mount a file system of its own, in memory, on an empty folder; False if that is refused."""
    command = ["mount", "-t", "tmpfs", "-o", "size=256m", "tmpfs", str(folder)]
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def leave_room(folder: Path, free: int) -> None:
    """Change the size of a mounted file system to what it holds and ``free`` kB."""
    of = os.statvfs(folder)
    size = max(4, free + (of.f_blocks - of.f_bfree) * of.f_frsize // 1024)  # 0: no limit
    subprocess.run(["mount", "-o", f"remount,size={size}k", str(folder)], check=True)


def unmount(folder: Path) -> None:
    """Unmount a file system."""
    subprocess.run(["umount", str(folder)], check=True)


@cache
def faults() -> tuple[str, ...]:
    """Return the faults that this machine can have."""
    with tempfile.TemporaryDirectory() as place:
        if not mounted(Path(place)):
            return FAULTS[:-1]
        unmount(Path(place))
        return FAULTS


@dataclass
class Tried:
    """Outcome of a fault: what was wrong, if anything."""

    command: str
    fault: str
    at: int
    wrong: list[str]


class Trials:
    """Trials of one command, with copies of one folder of earlier results."""

    def __init__(self, command: Command, place: Path) -> None:
        self.command, self.place = command, place
        place.mkdir(parents=True)
        self.first = place / "first"
        self.first.mkdir()
        command.before(self.first)
        command.prepare()
        scratch = self._copy("scratch")
        _quietly(command.run, scratch)  # compiles and imports, once for all forks
        shutil.rmtree(scratch)
        self.old = command.results(self.first)
        whole = self._copy("work")
        code, said = forked(command, whole, counting(whole))
        assert code == 0, said
        self.operations = int((place / COUNT).read_text())
        self.new = command.results(whole)
        shutil.rmtree(whole)

    def _copy(self, name: str, small: bool = False) -> Path:
        # each in a folder of one name, since results may contain the path
        folder = self.place / name
        folder.mkdir()
        assert not small or mounted(folder)
        shutil.copytree(self.first, folder, dirs_exist_ok=True)
        return folder

    def tried(self, fault: str, at: int) -> Tried:
        """Run the command with a fault, and once more without."""
        small = fault == "small disk"
        folder = self._copy("work", small)
        try:
            if small:
                leave_room(folder, ROOM[at % len(ROOM)])
            wrong = self._wrong(fault, at, folder)
        finally:
            if small:
                unmount(folder)
        shutil.rmtree(folder)
        return Tried(self.command.name, fault, at, wrong)

    def _wrong(self, fault: str, at: int, folder: Path) -> list[str]:
        """Return what is wrong with a command under a fault, and with the same one after it."""
        wrong = list[str]()
        code, said = forked(self.command, folder, injected(folder, fault, at))
        try:
            found = self.command.results(folder)
        except Exception as error:
            wrong.append(f"results cannot be read: {type(error).__name__}: {error}")
            found = {}
        for name, content in found.items():
            if content not in (self.old.get(name, ""), self.new.get(name)):
                wrong.append(f"{name} is neither that of before nor the whole one")
        wrong += [f"{name} is lost" for name in self.old if name not in found]
        if "Traceback" in said:
            wrong.append(f"traceback: {said[-600:]}")
        expected = {"kill": (-9, 0), "interrupt": (130, 0)}.get(fault, (0, 1, 2))
        if code not in expected:
            wrong.append(f"exit code {code}: {said[-300:]}")
        if fault in ("full disk", "file limit", "small disk") and code and str(folder) not in said:
            wrong.append(f"no path in the message: {said[-300:]}")
        if fault == "small disk":
            leave_room(folder, 2**18)
        code, said = forked(self.command, folder, lambda: None)
        if code != 0:
            wrong.append(f"the same command ended with {code}: {said[-300:]}")
        elif self.command.results(folder) != self.new:
            wrong.append("the same command gives other results")
        return wrong + [f"left: {path.name}" for path in folder.rglob("*.tmp")]


@contextmanager
def prepared() -> Iterator[Path]:
    """Provide a folder, kernels in plain Python and the fakes of the tests."""
    tests = Path(__file__).parents[1]
    known, at = list(sys.path), os.getcwd()
    sys.path[:0] = [str(tests / "benchmarks"), str(tests / "agents")]
    with tempfile.TemporaryDirectory() as place:
        os.chdir(tests.parent)
        try:
            yield Path(place)
        finally:
            os.chdir(at)
            sys.path[:] = known


def trials(number: int, only: tuple[str, ...] = ()) -> Iterator[Tried]:
    """Yield ``number`` trials, spread over commands, faults and the operations of each."""
    chosen = [command for command in COMMANDS if not only or command.name in only]
    with prepared() as place:
        for k, command in enumerate(chosen):
            made = Trials(command, place / command.name)
            mine = range(k, number, len(chosen))
            for i in range(len(mine)):
                fault = faults()[i % len(faults())]
                yield made.tried(fault, 1 + made.operations * i // len(mine))
            shutil.rmtree(made.place)
