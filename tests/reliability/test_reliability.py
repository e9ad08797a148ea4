"""Bounded versions of the attacks; ``python -m tests.reliability`` has them in full."""

import subprocess
import sys
from pathlib import Path

import pytest

from pam_envs.files import TEMPORARY, fresh_folder, write_text
from tests.reliability.forgeries import FORGERIES

ROOT = Path(__file__).parents[2]


def attack(*arguments: str) -> str:
    command = [sys.executable, "-m", "tests.reliability", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="forks, and limits of files")
def test_kills_interrupts_and_full_disks_lose_no_result() -> None:
    pytest.importorskip("stable_baselines3")
    said = attack("commands", "--number", "12", "--only", "board", "train", "export")
    assert "0 of 12 with a lost or half-read result" in said


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
@pytest.mark.parametrize("what", ["files", "states", "board"])
def test_hostile_content_is_refused_in_bounded_time(what: str) -> None:
    pytest.importorskip("stable_baselines3")
    assert "\n0 not as they should be" in attack(what, "--number", "90")


def test_every_forgery_has_a_test() -> None:
    assert len({name for name, _, _ in FORGERIES}) == len(FORGERIES) == 33
    for _, _, test in FORGERIES:
        name = test.partition("::")[2].partition("[")[0]
        assert f"def {name}(" in (ROOT / test.partition("::")[0]).read_text(encoding="utf-8")


def test_fresh_folder_replaces_its_own_files_and_keeps_others(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    (folder / "more").mkdir(parents=True)
    for name in ("a", "b", "notes", "more/deep"):
        (folder / name).write_text("old")
    with fresh_folder(folder, ("a", "b")) as fresh:
        write_text(fresh / "a", "new")
        assert (folder / "a").read_text() == "old"
    found = {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}
    assert found == {"a": "new", "notes": "old", "more/deep": "old"}
    assert [path.name for path in tmp_path.iterdir()] == ["made"]


def test_failed_fresh_folder_changes_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    folder.mkdir()
    (folder / "a").write_text("old")
    with pytest.raises(KeyboardInterrupt), fresh_folder(folder) as fresh:
        write_text(fresh / "a", "new")
        raise KeyboardInterrupt
    assert (folder / "a").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["made"]


def test_leftovers_of_ended_processes_are_removed_and_those_of_others_kept(tmp_path: Path) -> None:
    import os
    import socket

    host = socket.gethostname()
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    for number in (ended.pid, os.getppid()):
        (tmp_path / f".a.{host}.{number}{TEMPORARY}").write_text("half")
    (tmp_path / f".a.elsewhere.{ended.pid}{TEMPORARY}").write_text("half")
    write_text(tmp_path / "a", "whole")
    assert {path.name for path in tmp_path.iterdir()} == {
        *("a", f".a.{host}.{os.getppid()}{TEMPORARY}", f".a.elsewhere.{ended.pid}{TEMPORARY}")
    }


def test_folder_that_holds_the_working_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "inner").mkdir()
    monkeypatch.chdir(tmp_path / "inner")
    for place in (Path(), Path("..")):
        with pytest.raises(ValueError, match="contains the working folder"), fresh_folder(place):
            pass


def test_file_in_place_of_a_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with pytest.raises(OSError, match="file"), fresh_folder(tmp_path / "file") as fresh:
        write_text(fresh / "a", "new")
    assert (tmp_path / "file").read_text() == "kept"
