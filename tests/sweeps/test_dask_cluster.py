"""Tasks on a Dask cluster with killed workers, schedulers and drivers."""

import signal
import sys
import threading
from pathlib import Path
from types import ModuleType, SimpleNamespace

import psutil
import pytest

from sweeps.engine import Cluster, run
from sweeps.worker import Done
from tests.sweeps.dask_processes import DaskProcesses
from tests.sweeps.processes_of import alive, new_family, start, wait_until
from tests.sweeps.sweep_fakes import Number, square

pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")

pytestmark = pytest.mark.xdist_group("dask_cluster")  # one cluster


def on(dask: DaskProcesses) -> Cluster:
    return Cluster(backend="dask", address=dask.address)


def test_results_are_those_of_one_process(dask, tmp_path):
    kinds = {2: "wrong", 4: "foreign"}
    tasks = [Number(k, kinds.get(k, ""), str(tmp_path)) for k in range(8)]
    done = {d.key: d for d in run(square, tasks, on(dask))}
    assert len(done) == 8
    assert done["2"] == Done("2", error="ValueError: 2 has no square")
    assert "other sources, package versions" in done.pop(tasks[4].key).error
    for k in (0, 1, 3, 5, 6, 7):
        assert done[str(k)] == Done(str(k), k * k)


def test_documented_options_listen_on_the_loopback_alone(dask):
    page = (Path(__file__).parents[2] / "docs/sweeps.md").read_text(encoding="utf-8")
    commands = [line for line in page.splitlines() if line.startswith(("dask sch", "dask work"))]
    assert len(commands) == 4
    assert all("--dashboard-address 127.0.0.1:" in command for command in commands)
    found = [c for p in alive(dask.family) for c in p.net_connections("tcp")]
    listening = {c.laddr.ip for c in found if c.status == psutil.CONN_LISTEN}
    assert listening == {"127.0.0.1"}


def test_killed_worker_loses_no_result(dask, tmp_path):
    tasks = [Number(k, "deadly once" if k == 1 else "slow", str(tmp_path)) for k in range(8)]
    done = list(run(square, tasks, on(dask)))
    assert sorted((d.key, d.value) for d in done) == [(str(k), k * k) for k in range(8)]
    assert tasks[1].begins() == 2


def test_value_lost_with_its_worker_is_recomputed(dask, tmp_path):
    tasks = [
        Number(k, "dies with its value" if k % 3 == 1 else "", str(tmp_path)) for k in range(6)
    ]
    done = list(run(square, tasks, on(dask)))
    assert sorted((d.key, d.value) for d in done) == [(str(k), k * k) for k in range(6)]


def test_task_that_kills_its_workers_is_named_and_others_finish(dask, tmp_path):
    tasks = [Number(k, "deadly" if k == 1 else "", str(tmp_path)) for k in range(5)]
    done = {d.key: d for d in run(square, tasks, on(dask))}
    assert "its worker died again and again" in done.pop("1").error
    assert sorted((d.key, d.value) for d in done.values()) == [
        ("0", 0),
        ("2", 4),
        ("3", 9),
        ("4", 16),
    ]


def test_worker_without_the_code_names_the_remedy(dask, tmp_path, monkeypatch):
    elsewhere = ModuleType("only_here")
    exec("def act(task): return task.number", vars(elsewhere))
    monkeypatch.setitem(sys.modules, "only_here", elsewhere)
    tasks = [Number(1, "", str(tmp_path))]
    (done,) = run(elsewhere.act, tasks, on(dask))
    assert "No module named 'only_here'" in done.error
    assert "start `dask worker` in the checkout" in done.error


PROGRAM = """
import sys
from tests.sweeps.sweep_fakes import Number, square
from sweeps.engine import Cluster, run
folder, kind, address = sys.argv[1:]
tasks = [Number(k, kind, folder) for k in range(100)]
for done in run(square, tasks, Cluster(backend="dask", address=address)):
    print(done)
"""


def test_tasks_of_a_killed_driver_stop(dask, tmp_path):
    family = new_family()
    driver = start(family, "-c", PROGRAM, str(tmp_path), "endless", dask.address)
    wait_until(lambda: len(list(tmp_path.glob("begun_*"))) == 2)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    wait_until(lambda: len(list(tmp_path.glob("ended_*"))) == 2, 30.0)
    assert not alive(family)
    after = [Number(k, "", str(tmp_path)) for k in range(200, 204)]  # the cluster is free again
    assert sorted(d.value for d in run(square, after, on(dask))) == [k * k for k in range(200, 204)]
    assert len(list(tmp_path.glob("begun_*"))) == 2 + len(after)


def test_missing_workers_are_reported_and_awaited(tmp_path, monkeypatch):
    monkeypatch.setattr("sweeps.dask_cluster.LOOK", 0.1)
    said: list[str] = []  # two threads look at it
    monkeypatch.setattr(sys, "stderr", SimpleNamespace(write=said.append, flush=lambda: None))
    with DaskProcesses(tmp_path, workers=1) as dask:
        tasks = [Number(k, "slow", str(tmp_path)) for k in range(8)]
        found = run(square, tasks, on(dask))
        done = [next(found)]
        dask.end_workers()
        message = f"no worker is at {dask.address}; waiting for one"

        def times() -> int:
            return sum(message in text for text in list(said))

        def join_again() -> None:
            try:
                wait_until(times)
            finally:
                dask.join(1)

        helper = threading.Thread(target=join_again, daemon=True)
        helper.start()
        done += found
        helper.join()
        assert 1 <= times() <= 2  # not at each look; a late value begins a new wait
        assert sorted(d.value for d in done) == [k * k for k in range(8)]


def test_missing_scheduler_raises_an_error(monkeypatch):
    monkeypatch.setattr("sweeps.dask_cluster.SECONDS", 1.0)
    with pytest.raises(ValueError, match=r"no Dask scheduler answers at .tcp://127\.0\.0\.1:9."):
        list(run(square, [Number(1)], Cluster(backend="dask", address="tcp://127.0.0.1:9")))


def test_lost_scheduler_raises_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr("sweeps.dask_cluster.SECONDS", 6.0)
    with DaskProcesses(tmp_path, workers=1) as dask:
        tasks = [Number(k, "slow", str(tmp_path)) for k in range(100)]
        found = run(square, tasks, on(dask))
        assert next(found).error is None
        dask.scheduler.kill()
        with pytest.raises(ValueError, match="went away; what was done is kept"):
            list(found)
