"""Sweeps of training seeds: the same policies as single trainings, even after kills."""

import importlib.metadata
import json
import subprocess
from pathlib import Path

import psutil
import pytest
import yaml
from short_runs import ID, QUIET, tiny

from agents.__main__ import main
from agents.export import export
from agents.policies import policy_file
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training import callbacks, record, sweep, train
from agents.training.record import Run
from sweeps.engine import Cluster
from tests.sweeps.dask_processes import DaskProcesses
from tests.sweeps.processes_of import alive, new_family, start, wait_until

pytestmark = pytest.mark.xdist_group("training_sweep")  # one cluster
SEEDS = (3, 4)
CONFIG = configs.changed(tiny(), ["steps=8_000"])

PROGRAM = """
import json, sys
from pathlib import Path
from agents.settings import presets as configs
from agents.training import sweep
from sweeps.engine import Cluster
folder, jobs, address = sys.argv[1:]
config = configs.read(Path(folder) / "tiny.yaml")
cluster = Cluster(int(jobs), "dask" if address else "loky", address)
report = sweep.run(sweep.trainings([config], (3, 4), Path(folder), "ppo"), cluster)
print(report)
sys.exit(bool(report.missing))
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the policies of undisturbed trainings, by seed."""
    policies = {}
    for seed in SEEDS:
        run = Run(CONFIG, seed, tmp_path_factory.mktemp(f"seed{seed}"))
        policies[seed] = train.train_to_the_end(run, QUIET).read_bytes()
    return policies


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """A scheduler and two workers."""
    pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with DaskProcesses(tmp_path_factory.mktemp("dask")) as made:
        yield made


class Driver:
    """Sweeps into one folder, each in a process of its own."""

    def __init__(self, folder: Path, address: str = "") -> None:
        (folder / "tiny.yaml").write_text(yaml.safe_dump(CONFIG.as_dict()))
        self.folder, self.address, self.family = folder, address, new_family()
        self.log = folder / "log.txt"
        self.trainings = sweep.trainings([CONFIG], SEEDS, folder, "ppo")

    def start(self, jobs: int = 2) -> subprocess.Popen[bytes]:
        """Start a sweep."""
        given = (str(self.folder), str(jobs), self.address)
        return start(self.family, "-c", PROGRAM, *given, log=self.log)

    def under_way(self) -> bool:
        """Return whether both trainings have a checkpoint, and neither its policy."""
        assert not any((each.folder / "policy.onnx").exists() for each in self.trainings), (
            "too late"
        )
        return all((each.folder / "checkpoint.pt").exists() for each in self.trainings)

    def workers(self) -> list[psutil.Process]:
        """Return the processes that train."""
        return alive(self.family, "popen_loky")

    def policies(self) -> dict[int, bytes]:
        """Return the policies by seed."""
        return {
            training.seed: (training.folder / "policy.onnx").read_bytes()
            for training in self.trainings
            if training.finished()
        }


def test_killed_driver_and_worker_leave_the_policies_unchanged(tmp_path, whole):
    driver = Driver(tmp_path)
    running = driver.start()
    wait_until(driver.under_way)
    running.kill()
    running.wait()
    wait_until(lambda: not alive(driver.family))
    assert len(driver.policies()) < len(SEEDS)
    first, second = driver.start(), driver.start(jobs=1)  # one waits for the other's training
    wait_until(driver.workers)
    driver.workers()[0].kill()
    assert first.wait() == second.wait() == 0, driver.log.read_text()
    assert driver.policies() == whole
    wait_until(lambda: not alive(driver.family))


def test_killed_dask_worker_and_driver_lose_no_training(tmp_path, dask, whole):
    driver = Driver(tmp_path, dask.address)
    running = driver.start()
    wait_until(driver.under_way)
    running.kill()
    running.wait()
    assert len(driver.policies()) < len(SEEDS)
    again = driver.start()
    dask.workers()[0].kill()
    assert again.wait() == 0, driver.log.read_text()
    assert driver.policies() == whole


def test_training_of_an_ended_sweep_stops(tmp_path, monkeypatch):
    answers = iter([True, True, False])
    monkeypatch.setattr(callbacks, "is_needed", lambda: next(answers))
    (training,) = sweep.trainings([CONFIG], (3,), tmp_path, "ppo")
    with pytest.raises(RuntimeError, match="the sweep that asked for this training is gone"):
        sweep.train(training)
    assert not training.finished()


def test_policy_of_a_remote_worker_is_stored(tmp_path, monkeypatch):
    files = {"policy.onnx": b"policy", "policy.json": b"{}"}
    monkeypatch.setattr(sweep, "train", lambda training: files)
    (training,) = sweep.trainings([CONFIG], (3,), tmp_path, "ppo")
    ticks: list[int] = []
    report = sweep.run([training], Cluster(), lambda total: lambda: ticks.append(total))
    assert report.trained == [training.folder / "policy.onnx"]
    assert {file.name: file.read_bytes() for file in training.folder.iterdir()} == files
    assert ticks == [1]


def test_policy_of_other_settings_is_refused(tmp_path, ppo):
    def training(config: configs.Config, seed: int) -> Run:
        return Run(config, seed, ppo[1])

    assert training(tiny(), 3).finished()
    assert not Run(tiny(), 3, tmp_path).finished()
    for other in (training(tiny(steps=2048), 3), training(tiny(), 4)):
        with pytest.raises(SettingsError, match="give another --out"):
            other.finished()


def test_policy_without_its_record_is_trained_again(tmp_path, whole):
    """A process may be killed between the two files."""
    training = Run(CONFIG, 3, tmp_path / "there")
    train.train_to_the_end(training, QUIET)
    beside, policy = (training.folder / f"policy.{end}" for end in ("json", "onnx"))
    assert training.finished()
    beside.write_text(json.dumps({**json.loads(beside.read_text()), "sha256": "7"}))
    assert not training.finished()
    for spoil in (beside.unlink, policy.unlink):
        spoil()
        assert not training.finished()
        report = sweep.run([training], Cluster())
        assert (report.trained, report.missing) == ([policy], [])
        assert training.finished()
    assert policy.read_bytes() == whole[3]


def test_record_is_written_before_the_policy(ppo, tmp_path, monkeypatch):
    written: list[str] = []
    monkeypatch.setattr(policy_file, "write_bytes", lambda path, _: written.append(path.name))
    export.export_policy(ppo[0], tmp_path / "policy.onnx")
    assert written == ["policy.json", "policy.onnx"]


@pytest.mark.parametrize("other", ["code", "gymnasium", "scipy", "torch", "stable_baselines3"])
def test_worker_with_other_code_or_versions_refuses_the_training(other, tmp_path, monkeypatch):
    """A worker that computes another key than the driver's refuses the task."""
    training = Run(CONFIG, 3, tmp_path)
    key, known = training.key, importlib.metadata.version
    assert Run(CONFIG, 3, tmp_path).key == key
    if other == "code":
        monkeypatch.setattr(record, "code", lambda: "0")
    else:
        patched = {other: "0.0"}
        monkeypatch.setattr(importlib.metadata, "version", lambda n: patched.get(n) or known(n))
    assert training.key != key


def test_code_is_every_python_file_of_the_packages(tmp_path, monkeypatch):
    assert [path.name for path in record.SOURCES] == ["agents", "baselines", "pam_envs"]
    folders = [tmp_path / path.name for path in record.SOURCES]
    monkeypatch.setattr(record, "SOURCES", folders)

    def digest() -> str:
        record.code.cache_clear()
        return record.code()

    seen = {digest()}
    for folder in folders:
        folder.mkdir()
        (folder / "a.py").write_text("1")
        (folder / "notes.txt").write_text("x")
        seen.add(digest())
    (folders[0] / "notes.txt").write_text("y")
    assert len(seen | {digest()}) == 4
    (folders[0] / "a.py").rename(folders[0] / "b.py")
    assert len(seen | {digest()}) == 5
    record.code.cache_clear()


def test_failed_training_is_missing_with_the_reason(tmp_path):
    wrong = configs.changed(tiny(), ["env_kwargs.load=99.0"])
    (training,) = sweep.trainings([wrong], (3,), tmp_path, "ppo")
    report = sweep.run([training], Cluster())
    (line,) = report.missing
    assert str(training.folder) in line and "99" in line


@pytest.fixture
def ask(tmp_path):
    """Return what runs the command with two seeds."""
    return lambda *arguments: main(
        ["sweep", ID, "--seeds", "2", "--out", str(tmp_path), *arguments]
    )


def test_command_lists_refuses_and_reports(ask, tmp_path, monkeypatch, capsys):
    assert ask("--dry-run", "--first-seed", "7") == 0
    listed = capsys.readouterr().out.splitlines()
    assert [line.split()[-1].rpartition("/")[2] for line in listed] == ["ppo-seed7", "ppo-seed8"]
    assert all(line.startswith("to run") for line in listed)
    assert not list(tmp_path.iterdir())
    assert ask("--backend", "dask") == 2
    assert "needs both" in capsys.readouterr().err
    failing = sweep.Report(missing=["there: no"])
    monkeypatch.setattr(sweep, "run", lambda *_: failing)
    assert ask() == 1
    assert "MISSING there: no" in capsys.readouterr().err
