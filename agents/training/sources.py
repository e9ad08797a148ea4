"""Which code a policy is a result of: a change of it may change every bit of a training."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("agents", "baselines", "pam_envs")
"""Those whose code a training runs."""


@cache
def digests() -> dict[str, str]:
    """Return a digest of each package's code, as it was when this process first asked."""
    return {name: digest_of(ROOT / name) for name in PACKAGES}


def digest_of(folder: Path) -> str:
    """Return a digest of the Python files below a folder."""
    state = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        state.update(path.relative_to(folder).as_posix().encode())
        state.update(path.read_bytes())
    return state.hexdigest()[:16]
