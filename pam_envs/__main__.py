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
    if declared.plant != Rig().plant:
        from pam_envs.diagnosis.families.kinds import kind_named

        kind_named(declared.plant)  # before the columns of another plant are refused
    data = read_input(recording, declared)
    if isinstance(data, Recording):
        from pam_envs.diagnosis.causes import causes_in
        from pam_envs.diagnosis.diagnosis import diagnose as run
        from pam_envs.diagnosis.families.kinds import kind_named, plant_from

        model = plant_from(plant, declared)
        every = (*kind_named(declared.plant).catalogue, *(causes_in(causes) if causes else ()))
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


def calibrate(
    recording: tyro.conf.Positional[Path],
    rig: Path,
    out: Path = Path("plant.yaml"),
    plant: Path | None = None,
    seed: int = 0,
    quiet: bool = False,
) -> None:
    """Calibrate a base plant from a recording, or a muscle from a table of forces.

    Parameters
    ----------
    recording : Path
        Recording in time, or table of static forces (docs/base_plant.md).
    rig : Path
        YAML file with the plant, the size of its muscles and other known properties of the rig.
    out : Path
        Plant file to write.
    plant : Path
        Plant file to start from. Default: the shipped plant with the sizes of the rig file; of a
        single muscle the family of that file, or the nearest.
    seed : int
        Seed of all random draws.
    quiet : bool
        Show no progress.
    """
    from pam_envs.data.force_table import is_force_table, load_force_table
    from pam_envs.data.recording.recording import Recording, read_input
    from pam_envs.data.rig_file import Rig
    from pam_envs.diagnosis import calibration
    from pam_envs.diagnosis.families.kinds import plant_from

    declared = Rig.from_yaml(rig)
    if out.is_dir():
        raise ValueError(f"{out} is a folder; give the name of the plant file, --out plant.yaml")
    if is_force_table(recording, declared):
        found = calibration.calibrate_forces(load_force_table(recording, declared), declared)
    else:
        data = read_input(recording, declared)
        if not isinstance(data, Recording):
            raise ValueError(
                f"{recording} is a table of settled readings, which shows no force; give a "
                "recording in time, or a table of pressure_bar, contraction_mm and force_N"
            )
        start = plant_from(plant, declared)
        found = calibration.calibrate(data, declared, start, seed=seed, progress=not quiet)
    found.write(out)
    print(found.summary())
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


def compare_rig(
    table: tyro.conf.Positional[Path],
    plant: Path,
    model: Path | None = None,
    reference: Path | None = None,
    holds: int = 60,
    hold_seconds: float = 4.0,
    range_mm: tuple[float, float] | None = None,
    settled_seconds: float = 1.0,
    runs: int = 8,
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Compare measured closed-loop figures of a rig with those that a plant predicts.

    Parameters
    ----------
    table : Path
        CSV file of measured figures: controller, load_kg, rms_mm, ... (docs/rig_comparison.md).
    plant : Path
        Plant file of the rig, for example a calibrated one.
    model : Path
        Plant file from which the controllers are designed; default: the plant.
    reference : Path
        CSV file of the reference on the rig: time_s, reference_mm; default: random holds.
    holds : int
        Number of random holds of each run; give as many as on the rig.
    hold_seconds : float
        Duration of a hold [s].
    range_mm : (float, float)
        Lowest and highest level of the holds [mm]; default: 10 to 90 % of the plant's reach.
    settled_seconds : float
        Time at the end of each hold that counts as settled, for bias_mm [s].
    runs : int
        Number of simulated runs of each line.
    seed : int
        Seed of the first run.
    out : Path
        Folder for comparison.json and comparison.png.
    """
    from pam_envs.plants.single_muscle.plant import SingleMuscle
    from pam_envs.rig.comparison import table as tables
    from pam_envs.rig.comparison.comparison import compare
    from pam_envs.rig.comparison.prediction import Settings
    from pam_envs.rig.comparison.references import Holds

    simulated = SingleMuscle.from_yaml(plant)
    nominal = simulated if model is None else SingleMuscle.from_yaml(model)
    span = None if range_mm is None else (1e-3 * range_mm[0], 1e-3 * range_mm[1])
    given = Holds(holds, hold_seconds, span)
    settings = Settings(simulated, nominal, given, settled_seconds, runs, seed)
    measured = tables.read(table, simulated.mass.load, reference)
    found = compare(settings, measured, lambda line: print(line, file=sys.stderr, flush=True))
    print(found.table())
    print(found.text)
    for path in () if out is None else found.write(out):
        print(f"wrote {path}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    register_all()
    commands: dict[str, Callable[..., Any]] = {
        "list": list_environments,
        "render": render,
        "identify": identify,
        "diagnose": diagnose,
        "calibrate": calibrate,
        "reveal": reveal,
        "compare-rig": compare_rig,
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
