"""Object code in the wheel: made for every platform, chosen by platform, verified, never needed."""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest

from pam_envs.kernels import emission, machine_code, shipped
from pam_envs.kernels.build import COMPILED, address_book
from pam_envs.kernels.cache import read_whole
from pam_envs.kernels.intermediate import ENTRY
from pam_envs.kernels.machine_code import MachineCode, intermediate_of
from tests.kernels.address_kernels import Scale

pytestmark = pytest.mark.skipif(not COMPILED, reason="is about machine code")
VALUES = np.array([1.0, 4.0, 9.0])
TRIPLES = {
    "x86_64-unknown-linux-gnu": "linux-x86_64",
    "x86_64-conda-linux-gnu": "linux-x86_64",
    "aarch64-unknown-linux-gnu": "linux-arm64",
    "x86_64-apple-darwin23.6.0": "macos-x86_64",
    "arm64-apple-darwin24.1.0": "macos-arm64",
    "arm64-apple-macosx14.0.0": "macos-arm64",
    "x86_64-pc-windows-msvc": "windows-x86_64",
    "aarch64-pc-windows-msvc": "windows-arm64",
    "x86_64-w64-windows-gnu": None,
    "i686-pc-windows-msvc": None,
    "armv7l-unknown-linux-gnueabihf": None,
    "aarch64_be-unknown-linux-gnu": None,
    "riscv64-unknown-linux-gnu": None,
    "x86_64-unknown-freebsd14": None,
}
HEADERS = {
    "linux-x86_64": b"\x7fELF\x02\x01\x01" + bytes(9) + struct.pack("<HH", 1, 62),
    "linux-arm64": b"\x7fELF\x02\x01\x01" + bytes(9) + struct.pack("<HH", 1, 183),
    "macos-x86_64": struct.pack("<II", 0xFEEDFACF, 0x01000007),
    "macos-arm64": struct.pack("<II", 0xFEEDFACF, 0x0100000C),
    "windows-x86_64": struct.pack("<H", 0x8664),
    "windows-arm64": struct.pack("<H", 0xAA64),
}
"""First bytes of a relocatable file: ELF, Mach-O and COFF with the processor's number."""


def called(run: Any) -> list[float]:
    """Return what the code of ``Scale`` writes."""
    out = np.zeros(3)
    book = address_book([VALUES, out])
    run(book.ctypes.data, 0)
    return out.tolist()


def here() -> str:
    """Return the platform of this process."""
    platform = shipped.platform_of(llvm.get_process_triple())
    assert platform is not None
    return platform


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Provide an empty folder of object code and an empty cache; any processor is supported."""
    monkeypatch.setattr(machine_code, "FOLDER", tmp_path / "cache")
    monkeypatch.setattr(shipped, "FOLDER", tmp_path / "objects")
    monkeypatch.setattr(shipped, "supported", lambda platform: True)
    shipped._codes.cache_clear()
    yield tmp_path / "objects"
    shipped._codes.cache_clear()


def ship(folder: Path, codes: dict[str, bytes]) -> None:
    """Write code of ``Scale(2.0)`` for each platform."""
    kernel = Scale(2.0).by_address
    shipped.write({name: {kernel.name: data} for name, data in codes.items()}, [kernel], folder)


@pytest.fixture
def package(folder: Path) -> Path:
    """Provide a folder with code of one kernel for this processor."""
    ship(folder, {here(): emission.emit(intermediate_of(Scale(2.0)), emission.host())})
    return folder


@pytest.mark.parametrize("platform", shipped.PLATFORMS)
def test_code_of_every_platform_has_its_format(platform: str) -> None:
    triple, cpu, _ = shipped.PLATFORMS[platform]
    assert shipped.platform_of(triple) == platform
    text = intermediate_of(Scale(2.0))
    data = emission.emit(text, emission.Target(triple, cpu, jit=True))
    assert data.startswith(HEADERS[platform])
    prefix = b"_" if "macos" in platform else b"\0"
    assert prefix + ENTRY.encode() + b"\0" in data


@pytest.mark.parametrize(("triple", "platform"), TRIPLES.items())
def test_platform_of_a_process(triple: str, platform: str | None) -> None:
    assert shipped.platform_of(triple) == platform


def test_code_is_chosen_by_platform(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ship(folder, {name: name.encode() for name in shipped.PLATFORMS})
    for triple, platform in TRIPLES.items():
        monkeypatch.setattr(llvm, "get_process_triple", lambda triple=triple: triple)
        shipped._codes.cache_clear()
        found = shipped.find(Scale(2.0).by_address)
        assert found == (None if platform is None else platform.encode())


def test_processor_without_a_feature_is_not_supported(monkeypatch: pytest.MonkeyPatch) -> None:
    features = dict.fromkeys(shipped.AVX2, True)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    assert all(map(shipped.supported, shipped.PLATFORMS))
    for feature in shipped.AVX2:
        for lacking in (features | {feature: False}, {k: True for k in features if k != feature}):
            monkeypatch.setattr(llvm, "get_host_cpu_features", lambda lacking=lacking: lacking)
            assert [p for p in shipped.PLATFORMS if shipped.supported(p)] == [
                p for p in shipped.PLATFORMS if p.endswith("arm64")
            ]


def test_code_for_a_lesser_processor_is_not_used(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped, "supported", lambda platform: False)
    assert shipped.find(Scale(2.0).by_address) is None


def test_platform_that_was_not_built_gets_no_code(folder: Path) -> None:
    ship(folder, {name: b"code" for name in shipped.PLATFORMS if name != here()})
    assert shipped.find(Scale(2.0).by_address) is None


def test_shipped_code_is_used(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = shipped.find(Scale(2.0).by_address)
    assert data is not None
    assert called(machine_code.load(data)) == [2.0, 4.0, 6.0]
    written = list((package.parent / "cache").iterdir())
    assert called(MachineCode(Scale(2.0)).wait()) == [2.0, 4.0, 6.0]
    assert list((package.parent / "cache").iterdir()) == written  # nothing was compiled
    assert capsys.readouterr().err == ""


def test_shipped_code_of_other_values_is_not_used(package: Path) -> None:
    assert shipped.find(Scale(2.5).by_address) is None


def test_shipped_code_of_other_sources_is_not_used(package: Path) -> None:
    path = package / shipped.MANIFEST
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps({**manifest, "sources": "0" * 64}))
    assert shipped.find(Scale(2.0).by_address) is None


def test_damaged_code_is_not_used(package: Path) -> None:
    path = package / here() / "scale.o"
    path.write_bytes(path.read_bytes()[:-1])
    assert shipped.find(Scale(2.0).by_address) is None


@pytest.mark.parametrize("damage", ["no object file", "no entry", "no manifest"])
def test_code_that_cannot_be_loaded_is_compiled(
    folder: Path, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = "define void @other() {\n  ret void\n}\n"
    no_entry = emission.emit(other, emission.host())
    ship(folder, {here(): no_entry if damage == "no entry" else b"not code"})
    if damage == "no manifest":
        (folder / shipped.MANIFEST).write_text("{")
    assert called(MachineCode(Scale(2.0)).wait()) == [2.0, 4.0, 6.0]
    assert "shipped code of scale cannot be used and is compiled here" in capsys.readouterr().err


def test_digest_of_sources_is_that_of_the_checkout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels/step.py").write_text("a = 1\n")
    monkeypatch.setattr(shipped, "PACKAGE", tmp_path)
    checkout = shipped.sources()
    for name in shipped.BESIDE:
        (tmp_path / name).mkdir()
        (tmp_path / name / "added.py").write_text("b = 1\n")
    assert shipped.sources() == checkout
    (tmp_path / "kernels/step.py").write_text("a = 2\n")
    assert shipped.sources() != checkout


@pytest.mark.parametrize("good", [True, False])
def test_code_of_a_platform_that_nobody_has_tried_is_loaded_by_a_child_first(
    folder: Path,
    good: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    foreign = next(p for p in shipped.PLATFORMS.values() if p.triple.endswith("windows-msvc"))
    target = emission.host() if good else emission.Target(foreign.triple, foreign.cpu, jit=True)
    ship(folder, {here(): emission.emit(intermediate_of(Scale(2.0)), target)})
    monkeypatch.setattr(shipped, "TRIED", ())
    for _ in range(2):  # the second time by the note
        assert called(MachineCode(Scale(2.0)).wait()) == [2.0, 4.0, 6.0]
    notes = [read_whole(path) for path in (folder.parent / "cache").glob("loads_*")]
    assert notes == [b"yes" if good else b"no"]
    assert ("a process that loaded it has failed" in capsys.readouterr().err) != good
