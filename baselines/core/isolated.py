"""Controllers of a folder outside the package, each in a confined process of its own.

The process that scores never imports their files. It sends observations through a pipe and gets
arrays of numbers, which the environment checks as any action: a controller sees neither seeds nor
salts nor the functions that score. Requests are pickled, since the controller's process trusts
them; answers are JSON and raw numbers, which cannot run code.
"""

import importlib.util
import json
import os
import pickle
import re
import struct
import subprocess
import sys
import warnings
import weakref
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from baselines.core import confinement
from baselines.core.entry import Entry, Spec
from pam_envs.kernels import cache
from pam_envs.wording import printable

MOST = 2**26  # bytes of an answer
LONGEST = 1000  # characters of a message
NUMBERS = re.compile(r"[<|][biuf](1|2|4|8|16)")
SERVER = f"{__name__}_server"
LIBRARIES = (
    *("/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/share", "/usr/bin", "/lib", "/lib64"),
    *("/bin", "/etc", "/sys", "/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat"),
    *("/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"),
)
"""What interpreter and libraries read of the system: no devices, and no other processes."""
VARIABLES = re.compile(
    r"PATH|HOME|TZ|LANG|LC_\w+|LD_LIBRARY_PATH|XDG_CACHE_HOME|(PYTHON|PAM_ENVS_|NUMBA_)\w+"
    r"|\w+_(NUM_THREADS|CORETYPE)|MKL_\w+"
)
"""Environment variables that a controller sees; others may hold passwords."""
PACKAGES = ("pam_envs", "sweeps", "baselines", "agents")
SHOWN = (
    *("summary", "knowledge", "preview", "feedback", "citation", "envs", "seeded", "kind"),
    *("tuning", "trials", "knobs", "found", "author"),
)
"""Attributes of an entry that describe it."""


class ControllerError(Exception):
    """An error in a controller's process; its class has the name of the original one."""


@dataclass(frozen=True)
class Handle:
    """State of a controller that its process holds, and its model's output."""

    followed: NDArray[Any]


class IsolatedController:
    """Controller in a process of its own, with the answers of the same one in this process."""

    def __init__(self, folder: str, name: str, spec: Spec[Any]) -> None:
        self._process = Process(folder)
        given = (spec.plant, spec.signals, spec.actions, dict(spec.knobs), spec.seed)
        said, _ = self._process.ask("make", name, *given)
        if said.get("models"):
            self.model_output = lambda state: state.followed

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: Any = 1
    ) -> tuple[Any, Handle]:
        """Return the action for an observation or a batch, and the state for the next call."""
        given = (np.asarray(observation), state is None, episode_start, bool(deterministic))
        _, (action, followed) = self._process.ask("predict", *given)
        return action, Handle(followed)


class Process:
    """Process of the controllers of a folder."""

    def __init__(self, folder: str) -> None:
        path = [os.path.abspath(place) for place in sys.path]
        given = {"module": SERVER, "path": path, **_readable(folder, path)}
        self._child = subprocess.Popen(
            [sys.executable, "-P", confinement.__file__, json.dumps(given)],
            env={k: v for k, v in os.environ.items() if VARIABLES.fullmatch(k)}
            | {"PAM_ENVS_CONTROLLERS": ""},
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._end = weakref.finalize(self, _end, self._child)
        if not self.ask("load", str(folder), whole=True)[0].get("confined"):
            warnings.warn(
                f"this system has no Landlock or seccomp: controllers of {folder} have a process "
                "of their own, which may read and write the files of this user",
                stacklevel=2,
            )

    def ask(self, *request: Any, whole: bool = False) -> tuple[dict[str, Any], list[NDArray[Any]]]:
        """Return the answer to a request: a header and arrays.

        Raises
        ------
        ControllerError
            If the controller raises an error, or its process has ended.
        """
        try:
            send(self._child.stdin, pickle.dumps(request))
            header, *parts = received(self._child.stdout)
            said = json.loads(header)
            shapes = [(str(kind), [int(n) for n in shape]) for kind, shape in said["arrays"]]
            if not all(NUMBERS.fullmatch(kind) for kind, _ in shapes):
                raise ValueError("not an array of numbers")
            arrays = [
                np.frombuffer(part, kind).reshape(shape).copy()
                for part, (kind, shape) in zip(parts, shapes, strict=True)
            ]
        except Exception as error:
            self._end()
            raise ControllerError(
                f"the controller's process gives no answer: {type(error).__name__}"
            ) from error
        if "error" in said:
            kind, text = str(said["error"]), printable(str(said["message"])[:LONGEST])
            kind = kind if kind.isidentifier() and len(kind) < 100 else "Exception"
            raise type(kind, (ControllerError,), {})(text)
        return said, arrays


def entries(folder: str | Path) -> dict[str, Entry]:
    """Return the entries of a folder's controllers, read and made in processes of their own."""
    place, found = str(Path(folder).resolve()), {}
    try:
        said, _ = Process(place).ask("list")
        for name, about in said["entries"].items():
            made = partial(IsolatedController, place, str(name))
            found[str(name)] = Entry(make=made, **_described(about))
    except (ControllerError, OSError, LookupError, TypeError, AttributeError) as error:
        raise ValueError(f"controllers of {folder}: {type(error).__name__}: {error}") from error
    return found


def _described(about: Any) -> dict[str, Any]:
    """Return the description of an entry, with printable texts."""
    known = {key: about[key] for key in SHOWN}
    known = {key: printable(v) if isinstance(v, str) else v for key, v in known.items()}
    known["envs"] = tuple(known["envs"])
    known["knobs"] = {key: (low, high) for key, (low, high) in known["knobs"].items()}
    return known


def _readable(folder: str, paths: list[str]) -> dict[str, list[str]]:
    """Return what a controller's process may read: libraries, the package, and the folder."""
    found = [importlib.util.find_spec(name) for name in PACKAGES]
    packages = [place for one in found if one for place in one.submodule_search_locations or ()]
    home = str(Path.home())
    listed = [
        path
        for path in paths
        if os.path.exists(os.path.join(path, "benchmarks"))
        or os.path.commonpath([path, home]) == path  # of a script in the home folder
    ]
    files = [*LIBRARIES, sys.prefix, sys.base_prefix, str(cache.FOLDER), *packages, folder]
    files += [path for path in paths if path not in listed]
    return {"files": files, "folders": listed}


def _end(child: Any) -> None:
    child.kill()
    child.wait()
    for pipe in (child.stdin, child.stdout):
        with suppress(OSError):  # a request that was not sent
            pipe.close()


def send(pipe: IO[bytes] | None, *parts: bytes) -> None:
    """Write parts with their number and lengths before them."""
    assert pipe is not None
    sizes = struct.pack(f"<{len(parts) + 1}Q", len(parts), *map(len, parts))
    pipe.write(sizes + b"".join(parts))
    pipe.flush()


def received(pipe: IO[bytes] | None) -> list[bytes]:
    """Return the parts that :func:`send` wrote."""
    assert pipe is not None
    (number,) = struct.unpack("<Q", pipe.read(8))
    if not 0 < number <= 3:
        raise ValueError(f"{number} parts")
    sizes = struct.unpack(f"<{number}Q", pipe.read(8 * number))
    if sum(sizes) > MOST:
        raise ValueError(f"{sum(sizes)} bytes")
    return [pipe.read(size) for size in sizes]
