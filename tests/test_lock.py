"""Hashes of the pinned packages."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PIN = re.compile(r"^([A-Za-z0-9._-]+)==([^ ;\n]+)", re.MULTILINE)


def pins(name: str) -> dict[str, str]:
    """Return the versions that a file pins, by normalised name."""
    found = PIN.findall((ROOT / name).read_text(encoding="utf-8"))
    return {re.sub(r"[-_.]+", "-", package).lower(): version for package, version in found}


def test_packages_with_hashes_are_those_of_the_constraints() -> None:
    locked, pinned = pins("requirements.lock"), pins("constraints.txt")
    assert len(locked) > 100
    assert "torch" not in locked
    locked.pop("colorama")  # on Windows alone
    assert {name: pinned.get(name) for name in locked} == locked


def test_every_package_has_hashes_and_no_address() -> None:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    entries = re.split(r"^(?=[A-Za-z0-9])", text, flags=re.MULTILINE)[1:]
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", entry) for entry in entries)
    assert "//" not in text
