"""Attack the package and count what passed: ``python -m tests.reliability WHAT``.

Exit code 1 if anything passed that should not.
"""

import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

for name, value in (
    *(("PAM_ENVS_COMPILE", "wait"), ("OMP_NUM_THREADS", "1"), ("MPLBACKEND", "Agg")),
):
    os.environ.setdefault(name, value)

import tyro  # noqa: E402

from tests.reliability.forgeries import FORGERIES  # noqa: E402

TESTS = Path(__file__).parents[1]
DEFAULTS = {
    **{"actions": 10_000, "files": 11_000, "states": 1000, "board": 1000, "cache": 1000},
    "commands": 100,
}
FINE = ("read", "refused", "accepted", "shown, not as verified", "digest made anew, accepted")
"""Outcomes of a file, state or action that are as they should be."""
What = Literal["actions", "files", "states", "board", "forgeries", "cache", "commands"]


def main(
    what: tyro.conf.Positional[What],
    number: Annotated[int, tyro.conf.arg(help="Number of attacks; default: that of the page.")] = 0,
    only: tuple[str, ...] = (),
) -> int:
    """Attack the package and count what passed.

    Args:
        only: Only these long commands.
    """
    sys.path[:0] = [str(TESTS / "benchmarks"), str(TESTS / "agents")]
    number = number or DEFAULTS.get(what, 0)
    if what == "commands":
        return _commands(number, only)
    if what == "forgeries":
        for k, (forgery, outcome, test) in enumerate(FORGERIES, 1):
            print(f"{k:2} {forgery}: {outcome}: {test.partition('::')[2]}", flush=True)
        tests = [test for _, _, test in FORGERIES]
        command = [sys.executable, "-m", "pytest", "-q", *tests]
        return subprocess.run(command, cwd=TESTS.parent, check=False).returncode
    from tests.reliability import hostile

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if what == "cache":
            return _counted([("compile cache", number, hostile.cache(number, folder))])
        if what == "files":
            return _counted(hostile.files(folder, number))
        if what == "actions":
            return _counted(hostile.actions(number))
        act = hostile.board if what == "board" else hostile.states
        return _counted(act(number, folder))


def _counted(found: Iterable[tuple[str, int, Counter[str]]]) -> int:
    """Print the outcomes; return 1 if one is not as it should be."""
    every: Counter[str] = Counter()
    for name, number, counts in found:
        every += counts
        print(f"{name}: {number:,}: " + _words(counts), flush=True)
    wrong = {k: n for k, n in every.items() if k not in FINE}
    print(f"{every.total():,} attacks: {_words(every)}")
    print(f"{sum(wrong.values())} not as they should be")
    return int(bool(wrong))


def _words(counts: Counter[str]) -> str:
    return ", ".join(f"{number:,} {outcome}" for outcome, number in sorted(counts.items()))


def _commands(number: int, only: tuple[str, ...]) -> int:
    """Print trials of long commands; return 1 if a result was lost or read half-written."""
    import torch

    from tests.reliability import long_commands

    torch.set_num_threads(1)
    bad = count = 0
    for tried in long_commands.trials(number, only):
        count += 1
        bad += bool(tried.wrong)
        state = "; ".join(tried.wrong) or "held"
        print(f"{tried.command}, {tried.fault} at operation {tried.at}: {state}", flush=True)
    print(f"{bad} of {count} with a lost or half-read result, a traceback or no path")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
