"""Runs whose workers or driver are killed give the rows of an undisturbed run."""

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest
import yaml

from benchmarks.__main__ import main
from benchmarks.runs import cells, rows
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, run
from benchmarks.runs.store import read_json
from benchmarks.scenarios import scenario as scenarios
from sweeps import engine
from sweeps.worker import Done
from tests.benchmarks.conftest import CONTENT
from tests.sweeps.dask_processes import DaskProcesses
from tests.sweeps.processes_of import alive, new_family, start, wait_until

pytestmark = pytest.mark.xdist_group("row_sweep")  # one cluster
HERE = Path(__file__).parents[1]
NAMES = ("low", "middle", "integral")

PROGRAM = """
import sys
from pathlib import Path
from benchmarks.runs import controllers
from benchmarks.scenarios import scenario as scenarios
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, run
controllers.SOURCES = ("bench_fakes",)
folder, jobs, address, *names = sys.argv[1:]
folder = Path(folder)
track = scenarios.load(folder / "short.yaml")
options = Options(
    jobs=int(jobs), out=folder / "out", cells=folder / "cells",
    backend="dask" if address else "loky", address=address,
)
report = run([(find(name), track) for name in names], options)
print(report)
sys.exit(bool(report.missing))
"""


@pytest.fixture(scope="module", autouse=True)
def gate(tmp_path_factory):
    """File that ``integral`` waits for while it exists, in all processes of these tests.

    Their programs run so little that compiling it would take longer.
    """
    path = tmp_path_factory.mktemp("gate") / "closed"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAM_ENVS_COMPILE", "0")
        patch.setenv("BENCH_FAKES_GATE", str(path))
        yield path
        path.unlink(missing_ok=True)


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """A scheduler and two workers that can import the fake controllers."""
    pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with DaskProcesses(tmp_path_factory.mktemp("dask"), HERE) as made:
        yield made


class Driver:
    """Runs of one folder, each in a process of its own."""

    def __init__(self, folder: Path, address: str = "") -> None:
        folder.mkdir(exist_ok=True)
        content = {**CONTENT, "seeds": 2, "kwargs": {"episode_seconds": 1.0}}
        (folder / "short.yaml").write_text(yaml.safe_dump(content))
        self.folder, self.address, self.family = folder, address, new_family()
        self.log = folder / "log.txt"

    def start(self, *names: str, jobs: int = 2) -> subprocess.Popen[bytes]:
        """Start a run."""
        given = (str(self.folder), str(jobs), self.address, *(names or NAMES))
        return start(self.family, "-c", PROGRAM, *given, paths=(HERE,), log=self.log)

    def finish(self, jobs: int = 2) -> dict[str, str]:
        """Run to the end and return the rows."""
        assert self.start(jobs=jobs).wait() == 0, self.log.read_text()
        return self.rows()

    def cells(self) -> list[Path]:
        """Return the cells that are there."""
        return sorted((self.folder / "cells").glob("*.json"))

    def kill(self, driver: subprocess.Popen[bytes], ready: Callable[[], object]) -> None:
        """Kill a run once something is true, and see that all of it ends."""
        wait_until(lambda: ready() or driver.poll() is not None)
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        wait_until(lambda: not alive(self.family))

    def rows(self) -> dict[str, str]:
        """Return the rows' texts without times, host and date."""
        found = {}
        for path in rows.files(self.folder / "out"):
            row = read_json(path)
            del row["volatile"]
            found[path.name] = json.dumps(row)
        return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The rows of a run in one process that nothing disturbs."""
    rows = Driver(tmp_path_factory.mktemp("whole")).finish(jobs=1)
    assert len(rows) == len(NAMES)
    return rows


@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_run_with_killed_driver_resumes_to_the_same_bytes(backend, whole, tmp_path, request, gate):
    address = request.getfixturevalue("dask").address if backend == "dask" else ""
    driver = Driver(tmp_path, address)
    gate.touch()
    driver.kill(driver.start(), driver.cells)
    gate.unlink()
    before = {path: path.read_bytes() for path in driver.cells()}
    assert 1 <= len(before) < 2 * len(NAMES)
    assert driver.finish() == whole
    assert all(path.read_bytes() == content for path, content in before.items())
    wait_until(lambda: not alive(driver.family))


def test_two_drivers_on_one_folder_give_the_rows_of_one(whole, tmp_path):
    driver = Driver(tmp_path)
    first, second = driver.start(jobs=1), driver.start(jobs=1)
    assert first.wait() == second.wait() == 0, driver.log.read_text()
    assert driver.rows() == whole
    assert {path.suffix for path in (tmp_path / "cells").iterdir()} == {".json"}
    assert len(driver.cells()) == 2 * len(NAMES)


# --- the command line ----------------------------------------------------------------------------


@pytest.fixture
def ask(track, folder, monkeypatch):
    """Return what runs the command on the short track."""
    monkeypatch.setattr(scenarios, "available", lambda *_: {track.name: track})
    places = ("--out", str(folder / "out"), "--cells", str(folder / "cells"), "--jobs", "1")

    def run(*arguments: str) -> int:
        return main(["run", *places, "--controller", "low", *arguments])

    return run


def test_dry_run_lists_cells_and_runs_none(ask, folder, capsys):
    assert ask("--dry-run") == 0
    listed = capsys.readouterr().out.splitlines()
    assert listed[0].startswith("to run  low in short/maxwell_slip_steps")
    assert listed[-1] == "2 cells, 2 to run"
    assert not (folder / "cells").exists()
    assert ask() == 0
    damaged, _ = sorted((folder / "cells").glob("*.json"))
    damaged.write_text("{}")
    capsys.readouterr()
    assert ask("--dry-run") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "2 cells, 1 to run"
    assert damaged.read_text() == "{}"
    assert ask("--dry-run", "--force") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "2 cells, 2 to run"


def test_exit_code_and_message_state_the_kind_of_failure(ask, monkeypatch, capsys):
    def wrong(*_: object) -> None:
        raise ArithmeticError("no number")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    assert ask("--controller", "lowest") == 2
    assert "no controller named 'lowest'" in capsys.readouterr().err
    assert ask("--backend", "dask") == 2
    assert "needs both" in capsys.readouterr().err
    with monkeypatch.context() as patch:
        patch.setattr(cells, "compute", wrong)
        assert ask() == 1
        said = capsys.readouterr().err
        assert "MISSING low in short/maxwell_slip_steps" in said
        assert "ArithmeticError: no number" in said
    with monkeypatch.context() as patch:
        patch.setattr(rows, "assemble", interrupted)
        assert ask() == 130
        assert "the same command resumes" in capsys.readouterr().err
    assert ask() == 0
    assert "0 cells computed, 2 were there already" in capsys.readouterr().out


def test_leaderboard_is_written_after_a_complete_run(ask, folder, monkeypatch):
    def wrong(*_: object) -> None:
        raise ArithmeticError("no number")

    board = folder / "out" / "LEADERBOARD.md"
    with monkeypatch.context() as patch:
        patch.setattr(cells, "compute", wrong)
        assert ask("--pages") == 1
    assert not board.exists()
    assert ask("--pages") == 0
    assert any("`low`" in page.read_text() for page in board.parent.rglob("*.md"))


def test_closed_output_is_no_error():
    command = [sys.executable, "-m", "benchmarks", "cite", "positioning_nominal--inverse"]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=HERE.parents[1], **streams) as asked:
        asked.stdout.close()  # as `head` does
        said = asked.stderr.read().decode()
    assert asked.returncode == 141
    assert "Traceback" not in said
    assert "Broken" not in said


def test_cell_removed_by_another_run_is_reported(track, folder, monkeypatch):
    options = Options(jobs=1, out=folder / "out", cells=folder / "cells")
    pairs = [(find("low"), track), (find("middle"), track)]
    assert len(run(pairs, options).rows) == 2
    assemble = rows.assemble

    def removing(*given: object) -> object:
        for path in (folder / "cells").glob("*.json"):
            path.unlink()
        return assemble(*given)

    monkeypatch.setattr(rows, "assemble", removing)
    report = run(pairs, options)
    assert len(report.rows) == 1
    assert len(report.missing) == 2
    assert all("removed meanwhile" in line for line in report.missing)


def test_row_is_written_once_its_cells_are_there(track, folder, monkeypatch):
    written = []

    def looking(act: object, groups: Iterable[cells.Group], cluster: object) -> Iterator[Done]:
        for group in groups:
            yield Done(group.key, cells.compute(group))
            written.append([rows.name_of(path) for path in rows.files(folder / "out")])

    monkeypatch.setattr(engine, "run", looking)
    options = Options(jobs=1, out=folder / "out", cells=folder / "cells")
    report = run([(find("middle"), track), (find("low"), track)], options)
    assert [len(names) for names in written] == [1, 2]
    assert written[0] == ["short--middle"]
    assert [rows.name_of(path) for path in report.rows] == ["short--middle", "short--low"]
