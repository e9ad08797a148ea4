"""The command line from the user's side."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pam_envs
from pam_envs import doctor
from pam_envs.__main__ import env_id, env_ids, main
from pam_envs.kernels.build import COMPILED


def test_list_shows_every_environment_in_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in env_ids())
    assert "pressure_set_point (Pa)" in out
    assert max(map(len, out.splitlines())) <= 80


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"pam-envs {pam_envs.__version__}\n"


def test_doctor_reports_a_sound_installation(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    topics = {line[7:21].strip() for line in out.splitlines()[:-1]}
    assert {"package", "versions", "extra", "compiler", "cache", "first step", "GPU"} <= topics
    assert f"numpy {np.__version__}" in out
    assert out.endswith("no faults\n")


def test_doctor_names_the_remedy_of_a_cache_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("pam_envs.kernels.cache.FOLDER", tmp_path / "file" / "cache")
    monkeypatch.setattr(doctor, "CHECKS", (doctor.versions, doctor.stored))
    assert main(["doctor"]) == 1
    printed = capsys.readouterr()
    assert "FAULT  cache" in printed.out
    assert "set PAM_ENVS_CACHE to a folder that can be written" in printed.out
    assert printed.err == "1 fault\n"


@pytest.mark.skipif(not COMPILED, reason="there is no machine code")
def test_doctor_compares_machine_code_with_plain_python(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {finding.topic: finding for finding in doctor.first_step()}
    assert found["machine code"].ok
    other = iter((np.zeros(3), np.ones(3)))
    monkeypatch.setattr(doctor, "_episode", lambda env: next(other))
    found = {finding.topic: finding for finding in doctor.first_step()}
    assert not found["machine code"].ok
    assert "differs from plain Python; delete" in found["machine code"].text


@pytest.mark.parametrize(
    ("cuda", "gpu", "said"),
    [
        ("13.0", False, "the CPU build takes a tenth of the space"),
        ("13.0", True, "Accelerator 1"),
        (None, False, "training runs on the CPU"),
    ],
)
def test_doctor_recommends_the_cpu_build_of_torch_without_a_gpu(
    cuda: str | None, gpu: bool, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch = SimpleNamespace(
        __version__="2.13.0",
        version=SimpleNamespace(cuda=cuda),
        cuda=SimpleNamespace(is_available=lambda: gpu, get_device_name=lambda _: "Accelerator 1"),
    )
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.setattr(doctor, "find_spec", lambda _: object())
    monkeypatch.setattr("shutil.which", lambda _: None)
    (found,) = doctor.gpu()
    assert found.ok
    assert said in found.text


def test_doctor_reports_a_check_that_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> Iterator[doctor.Finding]:
        raise OSError("no room")
        yield

    monkeypatch.setattr(doctor, "CHECKS", (broken,))
    assert list(doctor.examine()) == [doctor.Finding("broken", "OSError: no room", ok=False)]


@pytest.mark.parametrize(
    "given", ["PAM/MusclePositioning-v0", "MusclePositioning-v0", "MusclePositioning"]
)
def test_ids_may_be_short(given: str) -> None:
    assert env_id(given) == "PAM/MusclePositioning-v0"


def test_mistyped_id_names_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"did you mean PAM/MusclePositioning-v0\?"):
        env_id("MusclePositionin")
    with pytest.raises(ValueError, match="There are: PAM/"):
        env_id("PAM/MusclePositioning-v7")


@pytest.mark.parametrize("name", env_ids())
def test_every_environment_can_be_filmed(name: str, tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v2")
    film = tmp_path / "film.gif"
    assert main(["render", name, "--video", str(film), "--seconds", "0.3", "--fps", "10"]) == 0
    with imageio.get_reader(film) as reader:
        assert len(list(reader)) == 4


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_render_writes_a_film(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v2")
    film = tmp_path / f"film{suffix}"
    options = ["--video", str(film), "--seconds", "0.6", "--fps", "10", "--load", "4.55"]
    assert main(["render", "MusclePositioning", *options]) == 0
    assert list(tmp_path.iterdir()) == [film]
    with imageio.get_reader(film) as reader:
        pictures = [picture for picture in reader]
    assert len(pictures) == 7  # the start, and one every 0.1 s
    assert pictures[0].shape[:2] == (600, 800)
    assert (pictures[0] != pictures[-1]).any()


def test_film_lasts_as_long_as_the_episode(tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    imageio = pytest.importorskip("imageio.v2")
    film = tmp_path / "film.gif"
    options = ["--video", str(film), "--seconds", "1.0"]
    assert main(["render", "MusclePositioning", *options, "--fps", "30"]) == 0
    with imageio.get_reader(film) as reader:
        assert len(list(reader)) == 31  # 30 a second, although that is no whole number of periods


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["Muscles"], "no environment named"),
        (["MusclePositioning", "--video", "film.txt"], "must end in .mp4 or .gif"),
        (["MusclePositioning", "--load", "99"], "from 0 to 5 kg"),
        (["KneeWalk", "--load", "2"], "--load is for MusclePositioning"),
        (["MusclePositioning", "--fps", "0"], "from 1 to 100"),
        (["MusclePositioning", "--reference", "stairs"], "choose one of"),
    ],
)
def test_user_errors_are_one_sentence(
    options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert len(error.splitlines()) == 1
