"""Controllers of folders outside the package: equal answers; scores, salts and files unreached."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baselines.core import catalogue, isolated
from baselines.core.catalogue import CONTROLLERS, PUBLISHED
from benchmarks.runs import cells, controllers
from benchmarks.runs.controllers import ROOT
from benchmarks.scenarios import scenario as scenarios

AGAIN = """
from dataclasses import replace

from baselines.core.catalogue import PUBLISHED

ENTRIES = {f"again_{name}": replace(PUBLISHED[name], author="Another") for name in (%r,)}
"""
EVIL = """
import ctypes, os, resource, socket, subprocess
from pathlib import Path

import numpy as np

from baselines.core.entry import Entry

ROOT = Path(%r)


def outcome(act):
    try:
        return str(act() or "done")
    except PermissionError:
        return "denied"
    except BaseException as error:
        return type(error).__name__


def forked():
    if os.fork() == 0:
        os._exit(0)


def connected(family, kind):
    with socket.socket(family, kind):
        return "opened"


def shared():
    number = ctypes.CDLL(None, use_errno=True).shmget(0, ctypes.c_size_t(4096), 0o1600)
    if number < 0:
        raise OSError(ctypes.get_errno(), "shmget")


ATTEMPTS = {
    "salts": lambda: (ROOT / "benchmarks/rounds.json").read_bytes()[:9],
    "history": lambda: (ROOT / ".git").read_bytes() if (ROOT / ".git").is_file()
    else (ROOT / ".git/HEAD").read_bytes(),
    "metrics": lambda: __import__("benchmarks.scoring.metrics"),
    "rewriting": lambda: (ROOT / "baselines/core/entry.py").open("a"),
    "writing": lambda: (Path(__file__).parent / "more.txt").write_text("x"),
    "permissions": lambda: os.chmod(__file__, 0o600),
    "times": lambda: os.utime(__file__, (1, 1)),
    "memory": lambda: open(f"/proc/{os.getppid()}/mem", "rb"),
    "environment": lambda: open(f"/proc/{os.getppid()}/environ", "rb"),
    "password": lambda: os.environ["A_PASSWORD"],
    "signal": lambda: os.kill(os.getppid(), 0),
    "priority": lambda: os.setpriority(os.PRIO_PROCESS, os.getppid(), 19),
    "limit": lambda: resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE),
    "shared": shared,
    "network": lambda: connected(socket.AF_INET, socket.SOCK_STREAM),
    "datagram": lambda: connected(socket.AF_INET, socket.SOCK_DGRAM),
    "bus": lambda: connected(socket.AF_UNIX, socket.SOCK_STREAM),
    "terminal": lambda: open("/dev/tty"),
    "child": lambda: subprocess.run(
        ["cat", str(ROOT / "benchmarks/rounds.json")], check=True, capture_output=True
    ),
    "fork": forked,
}


class Evil:
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        print("printed", flush=True)
        raise ValueError(" ".join(f"{name}={outcome(act)}" for name, act in ATTEMPTS.items()))


class Answers:
    def __init__(self, answer):
        self.answer = answer

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.answer() if callable(self.answer) else self.answer, None


BAD = {
    "masked": np.ma.masked_array([0.1], [True]),
    "objects": np.array([object()]),
    "text": "0.5",
    "times": np.array(["2020-01-01"], "datetime64[D]"),
    "ends": lambda: os._exit(0),
    "exits": lambda: exit(),
}
ENTRIES = {"evil": Entry("", "nothing", lambda spec: Evil())} | {
    name: Entry("", "nothing", lambda spec, answer=answer: Answers(answer))
    for name, answer in BAD.items()
}
"""


def confined() -> bool:
    """Return whether this system confines processes."""
    program = "from baselines.core.confinement import confine; print(confine((), ()))"
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout == "True\n"


def entries(folder: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return a folder's entries, registered for one test."""
    (folder / "theirs.py").write_text(text)
    found = isolated.entries(folder)
    for name in found:
        for catalogued in (CONTROLLERS, PUBLISHED):
            monkeypatch.setitem(catalogued, name, found[name])
    return found


def group(name: str, track: str, seeds: tuple[int, ...]) -> cells.Group:
    scenario_set = scenarios.load(scenarios.FOLDER / f"{track}.yaml")
    scenario = scenario_set.scenarios()[0]
    cell = cells.Cell(controllers.find(name), scenario_set, scenario, None, "public", seeds, True)
    return cells.Group((cell,))


# with a state, preview and a linear design; stateless; with a model whose output is scored
@pytest.mark.parametrize(
    ("name", "track"),
    [
        ("inverse_pid", "positioning_nominal"),
        ("zero", "positioning_nominal"),
        ("joint_mfc_hinf", "joint_nominal"),
    ],
)
def test_isolated_run_equals_the_run_in_this_process_bit_for_bit(
    name: str, track: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries(tmp_path, AGAIN % name, monkeypatch)
    records = []
    for each in (name, f"again_{name}"):
        (record,) = cells.compute(group(each, track, (1, 2))).values()
        records.append({k: v for k, v in record.items() if k not in ("controller", "volatile")})
    assert records[0] == records[1]
    assert not any(episode["failed"] for episode in records[0]["episodes"])


@pytest.fixture
def evil(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("A_PASSWORD", "secret")
    entries(tmp_path, EVIL % str(ROOT), monkeypatch)
    return tmp_path


def played(name: str) -> dict[str, Any]:
    """Return the first episode of a controller, as it is recorded."""
    (record,) = cells.compute(group(name, "positioning_nominal", (1,))).values()
    episode: dict[str, Any] = record["episodes"][0]
    return episode


@pytest.mark.skipif(not confined(), reason="no Landlock or seccomp")
def test_confined_controller_reaches_nothing(evil: Path) -> None:
    process = isolated.Process(str(evil))
    process.ask("make", "evil", None, None, None, {}, 0)
    with pytest.raises(isolated.ControllerError) as raised:
        process.ask("predict", np.zeros(1), True, None, True)
    said = dict(re.findall(r"(\w+)=(\w+)", str(raised.value)))
    assert len(said) == 20
    assert said.pop("metrics") in ("denied", "ModuleNotFoundError")
    assert said == dict.fromkeys(said, "denied") | {"password": "KeyError"}
    assert [path.name for path in evil.iterdir()] == ["theirs.py"]


@pytest.mark.parametrize("name", ["masked", "objects", "text", "times", "ends", "exits"])
def test_answer_without_numbers_fails_the_episode(name: str, evil: Path) -> None:
    episode = played(name)
    assert episode["failed"]
    expected = "gives no answer" if name in ("ends", "exits") else "is no array of numbers"
    assert expected in episode["failure"]


@pytest.mark.parametrize(
    ("kind", "shape", "data"),
    [("|O8", [1], bytes(8)), ("<f8", [2], bytes(8)), ("<f8", [1], bytes(9)), ("<U1", [2], b"8")],
)
def test_answer_in_another_format_is_an_error(
    kind: str, shape: list[int], data: bytes, monkeypatch: pytest.MonkeyPatch, evil: Path
) -> None:
    process = isolated.Process(str(evil))
    header = json.dumps({"arrays": [[kind, shape]]}).encode()
    monkeypatch.setattr(isolated, "received", lambda pipe: [header, data])
    with pytest.raises(isolated.ControllerError, match="gives no answer"):
        process.ask("list")


def test_folder_of_the_variable_is_not_imported_in_this_process(evil: Path) -> None:
    (evil / "theirs.py").write_text(AGAIN % "pid" + "import os\nPLACE = os.getpid()\n")
    program = (
        "import sys, baselines.core.catalogue as c; from benchmarks.runs import controllers as b;"
        "print('pam_envs_controllers_theirs' in sys.modules, b.find('again_pid').author)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PAM_ENVS_CONTROLLERS": str(evil)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "False Another\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1/0", "ZeroDivisionError: division by zero"),
        ("raise ValueError('\\x1b[2J')", r"ValueError: \\x1b\[2J"),
        ((AGAIN % "pid").replace("again_", "../"), "a name has at most"),
        (
            "from baselines.core import isolated_server\n"
            "isolated_server.Server.list = lambda self: ({'entries': {'x': {}}}, [])\n"
            + AGAIN
            % "pid",
            "KeyError",
        ),
    ],
)
def test_error_in_a_folder_is_one_sentence(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "theirs.py").write_text(text)
    with pytest.raises(ValueError, match=rf"controllers of .*{message}"):
        isolated.entries(tmp_path)


def test_name_of_a_controller_is_no_path() -> None:
    with pytest.raises(ValueError, match="a name has at most 100 letters"):
        catalogue.register("../rows", CONTROLLERS["pid"])
