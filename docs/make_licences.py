"""Inventory of licences: the table of the pinned packages in ``docs/licences.md``."""

import re
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "docs/licences.md"
PIN = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s;]+)", re.MULTILINE)
LONGEST = 250
HEAD = """# Licences

The package is under the [MIT licence](../LICENSE). Sources and licences of the shipped data are in
[PROVENANCE](../pam_envs/data/PROVENANCE.md). Nothing of another package is shipped. The table lists
the pinned packages that `make venv` installs, with the licence that each states in its metadata
(`make licences` writes it again).

| package | version | licence |
|:--|:--|:--|
"""


def licence(name: str) -> str:
    """Return the licence that a package states in a few words; empty if it is not installed."""
    try:
        said = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        return ""
    short = said.get("License-Expression") or said.get("License") or ""
    found = [c.rpartition(" :: ")[2] for c in said.get_all("Classifier") or () if "License ::" in c]
    first = short.strip().splitlines()[0].strip() if short.strip() else ""
    if not first or len(first) > LONGEST:
        files = ", ".join(said.get_all("License-File") or ())
        first = ", ".join(found) or f"see its {files}"
    return first.replace("|", "\\|")


def table() -> str:
    """Return the page."""
    pins = PIN.findall((ROOT / "constraints.txt").read_text(encoding="utf-8"))
    found = [(name, version, licence(name)) for name, version in pins]
    lines = [f"| {' | '.join(entry)} |" for entry in found if entry[2]]
    return HEAD + "\n".join(lines) + "\n"


if __name__ == "__main__":
    OUT.write_text(table(), encoding="utf-8")
