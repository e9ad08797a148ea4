"""``python -m agents``: train, enter and look at policies, measure the speed of training."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console

from agents.settings import presets as configs
from agents.settings.settings import SettingsError
from pam_envs.envs.registration import full_id
from sweeps.command_line import answered

Algo = Literal["ppo", "sac", "tqc", "recurrent_ppo"]
DEFAULT_ENV = "PAM/MusclePositioning-v0"
LOOKS = ("value", "rms", "return", "travel", "failures")


def train(
    env: Annotated[str | None, tyro.conf.Positional] = None,
    /,
    algo: Algo | None = None,
    variant: str = "",
    steps: int | None = None,
    seed: int | None = None,
    out: Path | None = None,
    resume: bool = False,
    config: Path | None = None,
    set: tuple[str, ...] = (),
) -> None:
    """Train a policy and write it as ONNX.

    Parameters
    ----------
    env
        Environment id, with or without PAM/; default: PAM/MusclePositioning-v0.
    algo
        Algorithm; default: ppo.
    variant
        Of the preset, for example "residual": a policy that corrects a classical controller.
    steps
        Control periods of all rows together; default: the preset's.
    seed
        Of weights, exploration and episodes; default: 0.
    out
        Folder of the run; default: runs/ENV/ALGO-seedSEED.
    resume
        Go on with the run in that folder; its settings are kept, only --steps may change.
    config
        A YAML file or a policy.onnx whose settings replace the preset.
    set
        Single settings, for example: --set ppo.gamma=0.95 network.hidden=[32,32]
    """
    from agents.training import train as training

    console = Console(stderr=True)
    given_env = full_id(env) if env else None
    name, kind, number = given_env or DEFAULT_ENV, algo or "ppo", seed or 0
    if resume:
        folder = out or training.default_folder(name, kind, number, variant)
        run = training.saved_run(folder, steps)
        _refuse_other_settings(config, set)
        for given, own in ((given_env, run.config.env), (algo, run.config.algo), (seed, run.seed)):
            if given not in (None, own):
                raise SettingsError(f"{folder} holds a run of {own}: leave {given} out")
        model = training.resume(run)
        console.print(f"going on at {model.num_timesteps:,} of {run.config.steps:,} steps")
    else:
        wanted = _wanted(name, kind, variant, config)
        changes = [*set, *([] if steps is None else [f"steps={steps}"])]
        wanted = configs.changed(wanted, changes)
        folder = out or training.default_folder(name, kind, number, variant)
        _check_counts(seed=(number, 0))
        run = training.Run(wanted, number, folder)
        model = training.start(run)
    print(training.train(run, model, console))


def _wanted(env: str, algo: str, variant: str, file: Path | None) -> configs.Config:
    """Return the settings of a preset, or of a file for the same environment and algorithm."""
    if file is None:
        return configs.preset(env, algo, variant)
    if file.suffix == ".onnx":
        from agents.policies.policy_file import read

        wanted = configs.from_mapping(read(file).card.get("config"))
    else:
        wanted = configs.read(file)
    if (wanted.env, wanted.algo) != (env, algo):
        raise SettingsError(
            f"{file} is for {wanted.env} with {wanted.algo}; say so: {wanted.env} --algo "
            f"{wanted.algo}"
        )
    return wanted


def _check_counts(**counts: tuple[int | None, int]) -> None:
    """Refuse numbers below their least, before anything is written."""
    for name, (value, least) in counts.items():
        if value is not None and value < least:
            raise SettingsError(f"{name} = {value} is below {least}; give {least} or more")


def _refuse_other_settings(file: Path | None, assignments: tuple[str, ...]) -> None:
    if file is not None or assignments:
        raise SettingsError(
            "--resume keeps the settings of the run (only --steps may change); leave --config and "
            "--set out, or start a new run with another --out"
        )


def sweep(
    env: Annotated[tuple[str, ...], tyro.conf.Positional] = (DEFAULT_ENV,),
    /,
    algo: Algo = "ppo",
    variant: str = "",
    seeds: int = 5,
    first_seed: int = 0,
    steps: int | None = None,
    set: tuple[str, ...] = (),
    jobs: int = os.cpu_count() or 1,
    backend: Literal["loky", "dask"] = "loky",
    address: str = "",
    out: Path = Path("runs"),
    dry_run: bool = False,
) -> int:
    """Train several seeds side by side; an interrupted sweep goes on.

    Exit code 0 if every policy is there, 1 if one is missing.

    Parameters
    ----------
    env
        Environment ids, with or without PAM/.
    algo
        Algorithm.
    variant
        Of the preset.
    seeds
        How many training seeds.
    first_seed
        The first of them.
    steps
        Control periods of all rows together; default: the preset's.
    set
        Single settings, for example: --set ppo.gamma=0.95
    jobs
        Trainings at a time on this machine.
    backend
        Processes of this machine, or a running Dask cluster.
    address
        Of the Dask scheduler, like tcp://host:8786.
    out
        Folder of the runs.
    dry_run
        List the trainings and whether their policies are there, and stop.
    """
    from agents.training import sweep as sweeping
    from sweeps.engine import Cluster
    from sweeps.progress import progress

    _check_counts(seeds=(seeds, 1), first_seed=(first_seed, 0))
    cluster = Cluster(jobs, backend, address)
    changes = [*set, *([] if steps is None else [f"steps={steps}"])]
    ids = map(full_id, env)
    wanted = [configs.changed(configs.preset(name, algo, variant), changes) for name in ids]
    kind = f"{algo}-{variant}" if variant else algo
    trainings = sweeping.trainings(wanted, range(first_seed, first_seed + seeds), out, kind)
    if dry_run:
        for training in trainings:
            print(f"{'there ' if training.finished() else 'to run'}  {training.folder}")
        return 0
    with progress("trainings") as start:
        report = sweeping.run(trainings, cluster, start)
    for place in (*report.found, *report.trained):
        print(place)
    for line in report.missing:
        print(f"MISSING {line}", file=sys.stderr)
    return 1 if report.missing else 0


def enter(
    runs: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    author: str = "",
) -> None:
    """Copy finished runs to agents/pretrained, where the board finds them.

    They are training seeds 0 to n - 1 of one preset, and take the place of its older files.

    Parameters
    ----------
    runs
        Folders of the runs, each with policy.onnx and policy.json.
    author
        Who trained them, as BibTeX wants it; default: the authors of this package.
    """
    from agents.policies.entering import enter as put

    made = put(runs, author)
    for path in made.replaced:
        print(f"replaced {path}")
    for path in made.files:
        print(path)
    print(f"{made.controller}: training seeds {', '.join(map(str, range(len(made.files))))}")


def show(policy: Annotated[Path, tyro.conf.Positional], /) -> None:
    """Print the card of a policy file, after the checks that loading it makes."""
    from agents.policies.policy import OnnxPolicy

    made = OnnxPolicy.load(policy)
    print(json.dumps({**made.card, "digest": made.digest()}, indent=1, sort_keys=True))


def looks(policies: Annotated[tuple[Path, ...], tyro.conf.Positional], /) -> None:
    """Print what was found on tuning seeds while policies were trained, and which was shipped.

    ``value`` is what policies are chosen by; ``kinds`` are the RMS of the kinds of rows as
    multiples of the first evaluation's, which is the controller's where a policy corrects one.
    """
    from agents.policies.policy import OnnxPolicy

    if not policies:
        raise SettingsError("name policies, for example runs/*/policy.onnx")
    for place in policies:
        card = OnnxPolicy.load(place).card
        found, chosen = card.get("evaluation", []), card.get("chosen", {})
        print(f"{place}: {len(found)} evaluations")
        for entry in found:
            first = found[0].get("kinds", [])
            pairs = zip(entry.get("kinds", []), first, strict=True)
            kinds = " ".join(f"{rms / was:.3f}" if rms and was else "-" for rms, was in pairs)
            mark = " <- shipped" if entry["steps"] == chosen.get("steps") else ""
            told = [f"{n} {entry[n]:.5g}" for n in LOOKS if entry.get(n) is not None]
            print(f"{entry['steps']:>12,}  {', '.join(told)}, kinds {kinds}{mark}")


def tune(
    env: Annotated[str, tyro.conf.Positional],
    /,
    algo: Algo = "ppo",
    variant: str = "",
    trials: int = 20,
    steps: int | None = None,
    seed: int = 0,
    storage: Path | None = None,
    write: bool = False,
) -> None:
    """Search settings on tuning seeds; killed, the same command goes on.

    Parameters
    ----------
    env
        Environment id, with or without PAM/.
    algo
        Algorithm.
    variant
        Of the preset.
    trials
        Settings to try, those that the storage holds counted in.
    steps
        Control periods of each of a trial's two trainings; default: the preset's.
    seed
        Of the search.
    storage
        SQLite file; default: runs/tune/ENV.ALGO.db. Several processes may share it.
    write
        Put the best settings and the budget into the preset's file.
    """
    from agents.training import tune as tuning

    _check_counts(trials=(trials, 1), steps=(steps, 1), seed=(seed, 0))
    path = configs.preset_path(full_id(env), algo, variant)
    config = configs.read(path)
    place = storage or Path("runs/tune") / f"{path.stem}.db"
    job = tuning.Job(config, trials, steps or config.steps, seed, place)
    study = tuning.search(job, Console(stderr=True))
    print(json.dumps({"value": study.best_value, **study.best_params}, indent=1))
    if write:
        tuning.write(job, study, path)
        print(path)


def classical(
    env: Annotated[str, tyro.conf.Positional],
    /,
    algo: Algo = "ppo",
    variant: str = "residual",
) -> None:
    """Evaluate the classical controllers of an environment on tuning seeds, the best first.

    Which one a residual corrects is chosen by this, never by the board. The first number is what
    the preset's evaluation.objective goes by.

    Parameters
    ----------
    env
        Environment id, with or without PAM/.
    algo
        Algorithm of the preset that says on which plants and references.
    variant
        Of that preset.
    """
    from agents.policies.controllers import names_for
    from agents.training.evaluation import evaluate, value_of

    config = configs.preset(full_id(env), algo, variant)
    scores = {name: evaluate(name, config) for name in names_for(config.env)}
    values = {name: value_of(score, config) for name, score in scores.items()}
    for name in sorted(values, key=lambda name: values[name]):
        made = scores[name]
        print(
            f"{values[name]:.5g}  {name}  RMS {made.rms:.5g}, return {made.mean_return:.5g}, "
            f"failures {made.failures}, travel {made.travel:.4g} Pa"
        )


def presets() -> None:
    """List the presets."""
    for env, algo, variant in configs.presets():
        wanted = configs.preset(env, algo, variant)
        kind = f"{algo} --variant {variant}" if variant else algo
        trials = wanted.search.trials
        how = wanted.search.note if trials is None else f"{trials} trials of search"
        print(f"{env}  {kind}  {wanted.steps:,} steps, {how}")


def speed(seconds: float = 20.0) -> None:
    """Measure training steps a second, beside stable-baselines3's default on Pendulum-v1."""
    from agents.training.speed import measure

    print(json.dumps(measure(seconds), indent=1))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    commands: dict[str, Any] = {
        "train": train,
        "sweep": sweep,
        "tune": tune,
        "classical": classical,
        "enter": enter,
        "show": show,
        "looks": looks,
        "presets": presets,
        "speed": speed,
    }
    ask = tyro.extras.subcommand_cli_from_dict
    try:
        return answered(
            lambda: ask(commands, prog="python -m agents", args=arguments),
            "interrupted; what was done is kept: a sweep goes on where it was",
        )
    except ModuleNotFoundError as error:
        print(f"error: training needs {error.name}; install the extra 'agents'", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
