"""Command line: ``pam-envs list``, ``render``, ``identify``, ``diagnose``."""

from __future__ import annotations

import difflib
import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import gymnasium as gym
import numpy as np
import tyro
from numpy.typing import NDArray

from pam_envs.envs.registration import full_id, register_all
from pam_envs.envs.rendering.renderer import write_film
from pam_envs.envs.rendering.scene import view_of
from pam_envs.hysteresis.protocol import kinds
from pam_envs.parameters import Signals

if TYPE_CHECKING:
    Kind: TypeAlias = str
else:
    Kind = Literal[kinds()]  # the registered models


@dataclass
class List:
    """List the registered environments."""


@dataclass
class Render:
    """Film an environment under the inverse of its plant."""

    env: tyro.conf.Positional[str]
    """Id, with or without PAM/ and -v0."""
    video: Path = Path("out.mp4")
    """Output file."""
    seconds: float = 10.0
    """Length of the episode [s]."""
    hysteresis: Kind = "maxwell_slip"
    """The muscle's hysteresis."""
    reference: str | None = None
    """Family of references; default: the environment's, a staircase for MusclePositioning."""
    load: float | None = None
    """Load [kg], for MusclePositioning; default: 2.55."""
    seed: int = 0
    """Seed of the episode."""
    fps: int = 25
    """Pictures a second."""
    gif: bool = False
    """Write a .gif instead of a .mp4 (so does --video NAME.gif)."""


@dataclass
class Identify:
    """Identify the shipped muscle again from the shipped readings (some minutes)."""

    out: Path = Path("identified")
    """Folder for the plant files and the report."""
    members: int = 8
    """Number of equally good fits to search for beside the best one."""


@dataclass
class Diagnose:
    """Diagnose model error from a recording and write the extended plant."""

    recording: tyro.conf.Positional[Path]
    """CSV file: a recording in time, or a table of settled readings (docs/recording.md)."""
    rig: Path | None = None
    """YAML file with the known properties of the rig."""
    out: Path = Path("diagnosis")
    """Folder for report.json, report.html and plant.yaml."""
    plant: Path | None = None
    """Plant file of the simulation; default: the shipped muscle, scaled to the rig."""
    causes: Path | None = None
    """Folder of further causes, one a file (docs/diagnosis_causes.md)."""
    seed: int = 0
    """Seed of all random draws."""
    quiet: bool = False
    """Show no progress."""


class Mistake(Exception):
    """Mistake of the user, with its remedy."""


def env_ids() -> list[str]:
    """Return the ids of the registered environments."""
    return sorted(name for name in gym.registry if name.startswith("PAM/"))


def env_id(given: str) -> str:
    """Return the id of a name; Mistake with the nearest one if there is none."""
    known = env_ids()
    short = {name.removeprefix("PAM/").rsplit("-v", 1)[0].lower(): name for name in known}
    key = given.removeprefix("PAM/").rsplit("-v", 1)[0].lower()
    if full_id(given) in known:
        return full_id(given)
    if key in short and "-v" not in given:
        return short[key]
    near = difflib.get_close_matches(key, short, n=1, cutoff=0.4)
    hint = f"; did you mean {short[near[0]]}?" if near else "."
    raise Mistake(f"no environment named {given!r}{hint} There are: {', '.join(known)}")


def list_environments(options: List) -> None:
    """Print a table of the environments."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title="Environments")
    table.add_column("id", no_wrap=True)
    for column in ("action", "observation", "control period", "hysteresis models"):
        table.add_column(column, overflow="fold")
    for name in env_ids():
        env: Any = gym.make(name).unwrapped
        actions, signals = _names(env.action_signals), _names(env.signals)
        period = f"{1e3 * env.control_period:g} ms"
        table.add_row(name, actions, signals, period, ", ".join(kinds()))
        env.close()
    Console().print(table)


def _names(signals: Signals) -> str:
    """Return names and units, first and last of those of each joint, and the preview horizon."""
    coming, names = sum(s.ahead > 0.0 for s in signals), []
    now = [s for s in signals if s.ahead == 0.0]
    for _, alike in itertools.groupby(now, lambda s: (re.sub(r"\d+[ab]?", "#", s.name), s.unit)):
        first, *rest = alike
        names.append(" .. ".join([first.name, *(s.name for s in rest[-1:])]) + f" ({first.unit})")
    return ", ".join([*names, f"{coming} references to come"] if coming else names)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Provide a temporary file beside ``path``, which replaces it on success."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def render(options: Render) -> None:
    """Write a film."""
    name = env_id(options.env)
    video = options.video.with_suffix(".gif") if options.gif else options.video
    if video.suffix not in (".mp4", ".gif"):
        raise Mistake(f"--video {video} must end in .mp4 or .gif")
    if not 1 <= options.fps <= 100:
        raise Mistake(f"--fps {options.fps} must be from 1 to 100")
    env = gym.make(name, render_mode="rgb_array", **_arguments(name, options))
    with whole_file(video) as path:
        write_film(path, _pictures(env, options), options.fps)
    env.close()
    print(f"wrote {video}")


def _arguments(name: str, options: Render) -> dict[str, Any]:
    """Return the keyword arguments of the environment to film."""
    given: dict[str, Any] = {"hysteresis": options.hysteresis, "episode_seconds": options.seconds}
    if name == "PAM/MusclePositioning-v0":
        given |= {"reference": "staircase", "load": 2.55, "start": "rest"}
    elif options.load is not None:
        raise Mistake(f"--load is for MusclePositioning; {name} has no hanging load")
    for key in ("reference", "load"):
        if getattr(options, key) is not None:
            given[key] = getattr(options, key)
    return given


def _pictures(env: Any, options: Render) -> Iterator[NDArray[np.uint8]]:
    """Run an episode under the inverse and yield its pictures."""
    from rich.progress import track

    inner = env.unwrapped
    observation, _ = env.reset(seed=options.seed)
    yield env.render()
    policy, shown = view_of(inner).demonstrator(inner), 1
    steps = round(options.seconds / inner.control_period)
    for step in track(range(1, steps + 1), description="filming"):
        observation, _, terminated, truncated, _ = env.step(policy(observation))
        if step * inner.control_period * options.fps > shown - 1e-6:
            shown += 1
            yield env.render()
        if terminated or truncated:
            return


def identify(options: Identify) -> None:
    """Identify the shipped plants again and write files and report."""
    from pam_envs.identification.mas10 import identify_all

    options.out.mkdir(parents=True, exist_ok=True)
    report = identify_all(options.out, options.members, lambda line: print(line, flush=True))
    with whole_file(options.out / "identification.md") as path:
        path.write_text(report, encoding="utf-8")
    print(report)


def diagnose(options: Diagnose) -> None:
    """Diagnose a recording and write the report."""
    from pam_envs.data.recording.recording import Recording, read_input
    from pam_envs.data.rig_file import Rig

    rig = Rig() if options.rig is None else Rig.from_yaml(options.rig)
    data = read_input(options.recording, rig)
    if not isinstance(data, Recording):
        _diagnose_readings(data, options)
        return
    from pam_envs.diagnosis.causes import catalogue, causes_in
    from pam_envs.diagnosis.diagnosis import diagnose as run
    from pam_envs.plants.single_muscle.plant import SingleMuscle

    if rig.plant != SingleMuscle.family:
        raise Mistake(f"plant: {rig.plant!r} cannot be diagnosed; there is: {SingleMuscle.family}")
    plant = None if options.plant is None else SingleMuscle.from_yaml(options.plant)
    causes = (*catalogue(), *(causes_in(options.causes) if options.causes else ()))
    found = run(data, plant, rig=rig, causes=causes, seed=options.seed, progress=not options.quiet)
    print(f"{found.verdict}: {found.text}")
    for warning in found.report["warnings"]:
        print(f"warning: {warning}")
    found.write(options.out)
    print(f"wrote {options.out}")


def _diagnose_readings(table: Any, options: Diagnose) -> None:
    """Diagnose a table of settled readings."""
    from types import SimpleNamespace

    from pam_envs.diagnosis.report.report import write
    from pam_envs.diagnosis.static.diagnosis import diagnose_readings

    report = diagnose_readings(table, seed=options.seed)
    print(f"{report['verdict']}: {report['text']}")
    write(SimpleNamespace(report=report, traces=None, plant=None), options.out)
    print(f"wrote {options.out}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    register_all()
    commands = {
        "list": List(),
        "render": Render(env=tyro.MISSING),
        "identify": Identify(),
        "diagnose": Diagnose(recording=tyro.MISSING),
    }
    chosen: Any = tyro.cli(
        tyro.extras.subcommand_type_from_defaults(
            commands, descriptions={name: one.__doc__ or "" for name, one in commands.items()}
        ),
        args=arguments,
        prog="pam-envs",
        description="Environments for the control of pneumatic artificial muscles.",
    )
    actions: dict[type, Callable[[Any], None]] = {
        List: list_environments,
        Render: render,
        Identify: identify,
        Diagnose: diagnose,
    }
    try:
        actions[type(chosen)](chosen)
    except (Mistake, ValueError, OSError, ImportError) as error:
        print(f"pam-envs: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
