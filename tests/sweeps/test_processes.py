"""Tasks on processes of this machine: results, lost workers, killed drivers."""

import signal
import threading
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor

from sweeps import worker
from sweeps.engine import Cluster, run
from sweeps.worker import Done
from tests.sweeps.processes_of import alive, new_family, start, wait_until
from tests.sweeps.sweep_fakes import Number, square

TWO = Cluster(jobs=2)


@pytest.fixture(autouse=True)
def fresh_pool():
    """Start with new workers, and end them afterwards."""
    get_reusable_executor().shutdown(wait=True)
    yield
    get_reusable_executor().shutdown(wait=True)


def numbers(folder: Path, count: int, **kinds: str) -> list[Number]:
    """Return tasks 0, 1, ...; ``n3="deadly"`` makes the third one deadly."""
    return [Number(k, kinds.get(f"n{k}", ""), str(folder)) for k in range(count)]


def test_results_are_those_of_one_process(tmp_path):
    tasks = numbers(tmp_path, 7, n2="wrong")
    here = list(run(square, tasks, Cluster()))
    assert [done.key for done in here] == list("0123456")
    assert here[2] == Done("2", error="ValueError: 2 has no square")
    assert here[5] == Done("5", 25)
    apart = list(run(square, tasks, TWO))
    assert sorted(apart, key=lambda done: done.key) == here
    assert [task.begins() for task in tasks] == [2] * 7  # an error is no reason to try again


def test_killed_worker_loses_no_result(tmp_path):
    tasks = numbers(tmp_path, 10, n3="deadly once", n7="deadly once")
    done = list(run(square, tasks, TWO))
    assert sorted((d.key, d.value) for d in done) == [(str(k), k * k) for k in range(10)]


def test_task_that_kills_its_workers_is_named_and_others_finish(tmp_path):
    tasks = numbers(tmp_path, 6, n1="deadly")
    done = {d.key: d for d in run(square, tasks, TWO)}
    assert len(done) == 6
    for task in tasks:
        if task.kind:
            assert "its worker died 3 times" in done[task.key].error
            assert task.begins() == 3
        else:
            assert done[task.key] == Done(task.key, task.number**2)


def test_worker_with_other_sources_refuses_the_task(tmp_path):
    tasks = [Number(1, "foreign", str(tmp_path)), Number(2, "", str(tmp_path))]
    foreign, ours = sorted(run(square, tasks, TWO), key=lambda done: done.error is None)
    assert "other sources, package versions" in foreign.error
    assert ours.value == 4
    assert tasks[0].begins() == 0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"backend": "threads"}, "choose 'loky' or 'dask'"),
        ({"backend": "dask"}, "needs both"),
        ({"address": "tcp://localhost:1"}, "needs both"),
        ({"jobs": 0}, "jobs = 0 is below 1"),
    ],
)
def test_contradictory_arguments_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        Cluster(**given)


def test_a_process_with_threads_does_one_task_at_a_time(tmp_path, monkeypatch):
    inside, most = [], []

    def act(task: Number) -> None:
        inside.append(task)
        most.append(len(inside))
        threading.Event().wait(0.02)
        inside.remove(task)

    tasks = numbers(tmp_path, 6)
    threads = [
        threading.Thread(target=worker.do_in_cluster, args=(act, task, task.key)) for task in tasks
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 6


PROGRAM = """
import sys
from tests.sweeps.sweep_fakes import Number, square
from sweeps.engine import Cluster, run
tasks = [Number(k, "slow", sys.argv[1]) for k in range(100)]
for done in run(square, tasks, Cluster(jobs=2)):
    pass
"""


@pytest.mark.parametrize("moment", ["it begins", "the workers start", "tasks are done"])
def test_killed_driver_leaves_no_process(moment, tmp_path):
    family = new_family()
    driver = start(family, "-c", PROGRAM, str(tmp_path))
    begun = {
        "it begins": lambda: len(alive(family)) > 1,  # what watches over files, perhaps
        "the workers start": lambda: alive(family, "popen_loky"),
        "tasks are done": lambda: len(list(tmp_path.iterdir())) > 3,
    }
    wait_until(begun[moment])
    workers = [process for process in alive(family) if process.pid != driver.pid]
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    assert workers
    wait_until(lambda: not alive(family))
    count = len(list(tmp_path.iterdir()))
    assert count < 100
