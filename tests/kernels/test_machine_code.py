"""Machine code by address: in the background, cached, free of foreign functions."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.envs.core import plant_env
from pam_envs.kernels import emission, intermediate, machine_code, notice
from pam_envs.kernels.build import COMPILED, address_book
from pam_envs.kernels.machine_code import MachineCode, intermediate_of
from tests.envs.cases import trajectory
from tests.kernels.address_kernels import OnlyIn, Scale, sine_by_address

pytestmark = pytest.mark.skipif(not COMPILED, reason="compares with machine code")
VALUES = np.array([1.0, 4.0, 9.0])


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Provide an empty cache."""
    monkeypatch.setattr(machine_code, "FOLDER", tmp_path / "cache")
    yield tmp_path / "cache"


@pytest.fixture
def background(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile in the background."""
    monkeypatch.setenv("PAM_ENVS_COMPILE", "1")


def called(run: Any, mode: int = 0) -> list[float]:
    """Return what the code of ``Scale`` writes."""
    out = np.zeros(3)
    book = address_book([VALUES, out])
    run(book.ctypes.data, mode)
    return out.tolist()


def test_child_process_compiles_while_the_caller_continues(cache: Path, background: None) -> None:
    code = MachineCode(Scale(2.0))
    assert code.ready() is None
    assert code.ready() is None or code._child is not None
    assert code._child is not None
    assert code._child.wait() == 0
    assert called(code.ready(), 1) == [3.0, 5.0, 7.0]
    assert sorted(p.suffix for p in cache.iterdir()) == [".o", ".xz"]  # and no mark


def test_cached_code_is_used_at_once(cache: Path, background: None) -> None:
    assert called(MachineCode(Scale(2.0)).wait()) == [2.0, 4.0, 6.0]
    assert called(MachineCode(Scale(2.0)).ready()) == [2.0, 4.0, 6.0]
    assert MachineCode(Scale(5.0)).ready() is None  # another value is other code


def test_no_second_process_compiles_the_same_kernel(cache: Path, background: None) -> None:
    kernel = Scale(7.0).by_address
    cache.mkdir()
    kernel.busy_file.touch()
    code = MachineCode(Scale(7.0))
    assert code.ready() is None
    assert code._child is None
    os.utime(kernel.busy_file, (0.0, 0.0))  # left by a process that died long ago
    assert code.ready() is None
    assert code._child is not None
    assert code._child.wait() == 0
    assert called(code.ready()) == [7.0, 14.0, 21.0]


def test_kernel_that_no_child_can_build_is_compiled_here(cache: Path, background: None) -> None:
    code = MachineCode(OnlyIn(os.getpid()))
    assert code.ready() is None
    assert code._child is not None
    assert code._child.wait() != 0
    assert called(code.ready()) == [3.0, 6.0, 9.0]
    with pytest.raises(RuntimeError, match="importable"):
        intermediate_of(OnlyIn(os.getpid()))


def test_waiting_compiles_at_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PAM_ENVS_COMPILE", "wait")
    assert called(MachineCode(Scale(2.0)).ready()) == [2.0, 4.0, 6.0]


def test_folder_that_cannot_be_written_is_no_obstacle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(machine_code, "FOLDER", tmp_path / "file" / "cache")
    assert called(MachineCode(Scale(2.0)).wait()) == [2.0, 4.0, 6.0]
    assert "PAM_ENVS_CACHE" in capsys.readouterr().err


def test_long_compilation_is_announced(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(notice, "PATIENCE", 0.0)
    over = threading.Event()
    notice._show("batch_positioning", over)
    assert "compiling batch_positioning" in capsys.readouterr().err
    over.set()
    notice._show("batch_positioning", over)
    assert capsys.readouterr().err == ""


def test_call_of_libm_is_refused() -> None:
    text = intermediate.intermediate(sine_by_address, {}, 8)
    with pytest.raises(RuntimeError, match=r"would need .*sin"):
        emission.emit(text, emission.host())


def test_intermediate_form_is_the_same_in_every_process(tmp_path: Path) -> None:
    code = (
        "import hashlib\n"
        "from tests.kernels.address_kernels import Scale\n"
        "from pam_envs.kernels.machine_code import intermediate_of\n"
        "print(hashlib.sha256(intermediate_of(Scale(2.0)).encode()).hexdigest())"
    )
    root = Path(__file__).resolve().parents[2]
    found = set()
    for name in ("a", "b"):
        variables = {"PYTHONPATH": str(root), "PAM_ENVS_CACHE": str(tmp_path / name)}
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, **variables},
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        )
        found.add(done.stdout)
    assert len(found) == 1


def test_steps_continue_in_plain_python_until_the_code_is_ready(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    name, asked = "PAM/MusclePositioning-v0", []
    first = gym.make(name)
    reference = trajectory(first, 5, 130)
    monkeypatch.setattr(code_of(first), "run", None)
    real = MachineCode.ready

    def late(self: MachineCode) -> Any:
        asked.append(1)
        return None if len(asked) < 2 else real(self)

    monkeypatch.setattr(MachineCode, "ready", late)
    env = gym.make(name)
    assert trajectory(env, 5, 130) == reference
    assert len(asked) == 130 // plant_env.INTERPRETED_CALLS
    assert env.unwrapped._compiled  # type: ignore[attr-defined]


def test_environment_starts_with_machine_code_that_another_one_uses() -> None:
    name = "PAM/MusclePositioning-v0"
    first = gym.make(name)
    reference = trajectory(first, 5, 130)
    assert code_of(first).run is not None
    second = gym.make(name)
    assert second.unwrapped._compiled  # type: ignore[attr-defined]
    assert trajectory(second, 5, 130) == reference


def code_of(env: Any) -> MachineCode:
    return env.unwrapped.setup.kernels.single  # type: ignore[no-any-return]
