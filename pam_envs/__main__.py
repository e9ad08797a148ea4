"""Command line of ``pam-envs``; ``pam-envs --help`` lists the commands."""

from __future__ import annotations

import difflib
import itertools
import re
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import gymnasium as gym
import tyro

from pam_envs.doctor import doctor
from pam_envs.envs.registration import full_id, register_all
from pam_envs.envs.rendering import film
from pam_envs.envs.rendering.scene import view_of
from pam_envs.export import command as exporting
from pam_envs.files import write_text
from pam_envs.hysteresis.protocol import kinds
from pam_envs.parameters import Signals
from pam_envs.wording import package, printable

if TYPE_CHECKING:
    Kind: TypeAlias = str
else:
    Kind = Literal[kinds()]  # the registered models

WIDTH = 80
"""Columns of the list of environments."""


def env_ids() -> list[str]:
    """Return the ids of the registered environments."""
    return sorted(name for name in gym.registry if name.startswith("PAM/"))


def env_id(given: str) -> str:
    """Return the id of a name; ValueError with the nearest one if there is none."""
    known = env_ids()
    short = {name.removeprefix("PAM/").rsplit("-v", 1)[0].lower(): name for name in known}
    key = given.removeprefix("PAM/").rsplit("-v", 1)[0].lower()
    if full_id(given) in known:
        return full_id(given)
    if key in short and "-v" not in given:
        return short[key]
    near = difflib.get_close_matches(key, short, n=1, cutoff=0.4)
    hint = f"; did you mean {short[near[0]]}?" if near else "."
    raise ValueError(f"no environment named {given!r}{hint} There are: {', '.join(known)}")


def list_environments() -> None:
    """List the registered environments with their signals."""
    for name in env_ids():
        env: Any = gym.make(name).unwrapped
        print(f"{name:{WIDTH - 24}}{1e3 * env.control_period:>6g} ms control period")
        for word, signals in (("action", env.action_signals), ("observation", env.signals)):
            indent = f"  {word:13}"
            print(
                textwrap.fill(
                    _names(signals),
                    WIDTH,
                    initial_indent=indent,
                    subsequent_indent=" " * len(indent),
                    break_long_words=False,
                    break_on_hyphens=False,
                )
            )
        env.close()
    print(f"hysteresis models: {', '.join(kinds())}")


def _names(signals: Signals) -> str:
    """Return names and units, first and last of those of each joint, and the preview horizon."""
    coming, names = sum(s.ahead > 0.0 for s in signals), []
    now = [s for s in signals if s.ahead == 0.0]
    for _, alike in itertools.groupby(now, lambda s: (re.sub(r"\d+[ab]?", "#", s.name), s.unit)):
        first, *rest = alike
        names.append(" .. ".join([first.name, *(s.name for s in rest[-1:])]) + f" ({first.unit})")
    return ", ".join([*names, f"{coming} references to come"] if coming else names)


def render(
    env: tyro.conf.Positional[str],
    video: Path = Path("out.mp4"),
    seconds: float = 10.0,
    hysteresis: Kind = "maxwell_slip",
    reference: str | None = None,
    load: float | None = None,
    seed: int = 0,
    fps: int = 25,
) -> None:
    """Write a video of an environment controlled by the inverse of its plant.

    Parameters
    ----------
    env : str
        Id, with or without PAM/ and -v0.
    video : Path
        Output file, .mp4 or .gif.
    seconds : float
        Length of the episode [s].
    hysteresis : str
        Hysteresis model.
    reference : str
        Family of references; default: the environment's, a staircase for MusclePositioning.
    load : float
        Load [kg], for MusclePositioning; default: 2.55.
    seed : int
        Seed of the episode.
    fps : int
        Frames per second.
    """
    name = env_id(env)
    film.check(video, fps)
    given: dict[str, Any] = {"hysteresis": hysteresis, "episode_seconds": seconds}
    if name == "PAM/MusclePositioning-v0":
        given |= {"reference": "staircase", "load": 2.55, "start": "rest"}
    elif load is not None:
        raise ValueError(f"--load is for MusclePositioning; {name} has no hanging load")
    chosen = {"reference": reference, "load": load}
    given |= {key: value for key, value in chosen.items() if value is not None}
    made = gym.make(name, render_mode="rgb_array", **given)
    inner: Any = made.unwrapped
    film.write(made, view_of(inner).demonstrator(inner), video, seconds, seed, fps)
    made.close()
    print(f"wrote {video}")


def identify(out: Path = Path("identified"), members: int = 8) -> None:
    """Identify the shipped muscle from the shipped readings (takes a few minutes).

    Parameters
    ----------
    out : Path
        Folder for the plant files and the report.
    members : int
        Number of equally good fits to find in addition to the best one.
    """
    from pam_envs.identification.mas10 import identify_all

    out.mkdir(parents=True, exist_ok=True)
    report = identify_all(out, members, lambda line: print(line, flush=True))
    write_text(out / "identification.md", report)
    print(report)


def diagnose(
    recording: tyro.conf.Positional[Path],
    rig: Path | None = None,
    out: Path = Path("diagnosis"),
    plant: Path | None = None,
    causes: Path | None = None,
    seed: int = 0,
    quiet: bool = False,
) -> None:
    """Diagnose model error from a recording and write the extended plant.

    Parameters
    ----------
    recording : Path
        CSV file: a recording in time, or a table of settled readings (docs/recording.md);
        ``example`` is a shipped recording with a hidden effect.
    rig : Path
        YAML file with the known properties of the rig.
    out : Path
        Folder for report.json, report.html and plant.yaml.
    plant : Path
        Plant file of the simulation; default: the shipped muscle, scaled to the rig.
    causes : Path
        Folder of additional causes, one per file (docs/diagnosis_causes.md).
    seed : int
        Seed of all random draws.
    quiet : bool
        Show no progress.
    """
    from pam_envs.data import example
    from pam_envs.data.recording.recording import Recording, read_input
    from pam_envs.data.rig_file import Rig

    if str(recording) == example.NAME and not recording.exists():
        recording, shipped = example.recording_and_rig()
        rig = shipped if rig is None else rig
    declared = Rig() if rig is None else Rig.from_yaml(rig)
    data = read_input(recording, declared)
    if isinstance(data, Recording):
        from pam_envs.diagnosis.causes import catalogue, causes_in
        from pam_envs.diagnosis.diagnosis import diagnose as run
        from pam_envs.plants.single_muscle.plant import SingleMuscle

        if declared.plant != SingleMuscle.family:
            raise ValueError(
                f"plant: {declared.plant!r} cannot be diagnosed; there is: {SingleMuscle.family}"
            )
        model = None if plant is None else SingleMuscle.from_yaml(plant)
        every = (*catalogue(), *(causes_in(causes) if causes else ()))
        found = run(data, model, rig=declared, causes=every, seed=seed, progress=not quiet)
        print(f"{found.verdict}: {found.text}")
        for warning in found.report["warnings"]:
            print(f"warning: {warning}")
        found.write(out)
    else:
        from types import SimpleNamespace

        from pam_envs.diagnosis.report.report import write
        from pam_envs.diagnosis.static.diagnosis import diagnose_readings

        report = diagnose_readings(data, seed=seed)
        print(f"{report['verdict']}: {report['text']}")
        write(SimpleNamespace(report=report, traces=None, plant=None), out)
    print(f"wrote {out}")


def reveal(recording: tyro.conf.Positional[Literal["example"]] = "example") -> None:
    """Print the effect that is hidden in a shipped recording; diagnose it first.

    Parameters
    ----------
    recording : str
        Name of the recording.
    """
    from pam_envs.data import example

    truth = example.reveal()
    print(f"{', '.join(truth['names'])}: {truth['text']}")


def export(
    what: tyro.conf.Positional[str],
    target: exporting.Format = "c",
    out: Path = Path("exported"),
    plant: Path | None = None,
    hysteresis: Kind | None = None,
    air: Literal["regulator", "flow"] | None = None,
    reference: str | None = None,
    si: bool = False,
    platforms: tuple[str, ...] = (),
) -> None:
    """Export an environment or a plant as C, WebAssembly, FMU or PTX (docs/export.md).

    Parameters
    ----------
    what : str
        Id of an environment, with or without PAM/ and -v0; name of a plant; a plant file; or
        "muscle", an actuator with imposed length for multibody simulators.
    target : str
        "c", "wasm", "fmu" (FMI 3.0 and 2.0) or "ptx".
    out : Path
        Folder; the artefact gets a folder in it, by name and target.
    plant : Path
        Plant file of the environment.
    hysteresis : str
        Hysteresis model of the environment.
    air : str
        Air supply of the environment.
    reference : str
        Family of references of the environment.
    si : bool
        Observation and action in SI, not scaled to [-1, 1].
    platforms : tuple of str
        Further platforms of an FMU: x86_64-windows, aarch64-darwin, ... (needs zig).
    """
    model = exporting.model_of(what, plant, hysteresis, air, reference, si)
    folder = exporting.export(model, target, out / f"{model.name}_{target}", platforms)
    print(f"wrote {folder}, digest {model.digest[:16]}")


def warmup(
    ids: tyro.conf.Positional[tuple[str, ...]] = (),
    hysteresis: Kind | None = None,
    air: Literal["regulator", "flow"] | None = None,
    batch: bool = True,
) -> None:
    """Compile environments ahead of their first use.

    Parameters
    ----------
    ids : tuple of str
        Ids of environments; all by default.
    hysteresis : str
        Hysteresis model.
    air : str
        Air supply.
    batch : bool
        Whether to compile the batch (gym.make_vec) too.
    """
    for line, seconds in exporting.warm_up(ids, hysteresis, air, batch):
        print(f"{line}: {seconds:.1f} s", flush=True)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    register_all()
    commands: dict[str, Callable[..., Any]] = {
        "list": list_environments,
        "render": render,
        "identify": identify,
        "diagnose": diagnose,
        "reveal": reveal,
        "export": export,
        "warmup": warmup,
        "doctor": doctor,
    }
    if (sys.argv[1:] if arguments is None else arguments) == ["--version"]:
        print(package())
        return 0
    try:
        status = tyro.extras.subcommand_cli_from_dict(
            commands,
            args=arguments,
            prog="pam-envs",
            description="Environments for the control of pneumatic artificial muscles. "
            "--version prints the version.",
        )
    except OSError as error:
        known = error.filename and error.strerror
        text = f"{error.filename}: {error.strerror}; give another place" if known else str(error)
        print(f"pam-envs: {printable(text)}", file=sys.stderr)
        return 2
    except (ValueError, ImportError, RuntimeError) as error:
        print(f"pam-envs: {printable(str(error))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("pam-envs: interrupted; no file is half-written", file=sys.stderr)
        return 130
    return int(status or 0)


if __name__ == "__main__":
    sys.exit(main())
