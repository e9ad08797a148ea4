"""``python -m agents``: train, search, evaluate and enter policies."""

import json
import math
import os
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from pam_envs.envs.registration import full_id
from sweeps.command_line import run_cli
from sweeps.files import database_named

ID_HELP = "Environment id, with or without PAM/."
Env = Annotated[str, tyro.conf.Positional, tyro.conf.arg(help=ID_HELP)]
AlgoName = Literal["ppo", "sac", "tqc", "recurrent_ppo"]
Algo = Annotated[AlgoName, tyro.conf.arg(help="Algorithm of the preset.")]
Variant = Annotated[str, tyro.conf.arg(help="Variant of the preset, for example residual.")]
Steps = Annotated[
    int | None, tyro.conf.arg(help="Control periods of all rows together; default: the preset's.")
]
Changes = Annotated[
    tuple[str, ...],
    tyro.conf.arg(help="Single settings, for example: --set ppo.gamma=0.95 network.hidden=[32,32]"),
]
Processor = Annotated[
    Literal["cpu", "cuda"],
    tyro.conf.arg(help="Where networks learn; cuda needs a GPU and PyTorch's build for it."),
]
DEFAULT_ENV = "PAM/MusclePositioning-v0"
COLUMNS = ("value", "rms", "return", "travel", "failures")


def train(
    env: Annotated[
        str | None, tyro.conf.Positional, tyro.conf.arg(help=f"{ID_HELP} Default: {DEFAULT_ENV}.")
    ] = None,
    /,
    algo: Annotated[AlgoName | None, tyro.conf.arg(help="Algorithm; default: ppo.")] = None,
    variant: Variant = "",
    steps: Steps = None,
    seed: int | None = None,
    out: Path | None = None,
    resume: bool = False,
    config: Path | None = None,
    set: Changes = (),
    device: Processor | None = None,
) -> None:
    """Train a policy and export it as ONNX.

    Args:
        seed: Seed of weights, exploration and episodes; default: 0.
        out: Folder of the run; default: runs/ENV/ALGO-seedSEED.
        resume: Continue the run in that folder with its settings; only --steps and --device may
            change. A run that ended before its first checkpoint starts again, with the settings of
            this command.
        config: YAML file or policy.onnx whose settings replace the preset.
    """
    from rich.console import Console

    from agents.training import sweep as sweeping
    from agents.training import train as training
    from agents.training.record import CHECKPOINT, Run

    console = Console(stderr=True)
    given_env = full_id(env) if env else None
    name, kind, number = given_env or DEFAULT_ENV, algo or "ppo", seed or 0
    preset = f"{kind}-{variant}" if variant else kind
    folder = out or sweeping.folder_of(Path("runs"), name, preset, number)
    _check_counts(seed=(number, 0))

    def fresh() -> Run:
        settings = _settings(name, kind, variant, config)
        changes = [*set, *([] if steps is None else [f"steps={steps}"])]
        return Run(configs.changed(settings, changes), number, folder, device or "cpu")

    if not resume:
        run = fresh()
        folder.mkdir(parents=True, exist_ok=True)
    elif not folder.is_dir():
        training.saved_run(folder)  # raises
    with training.alone(folder):
        if resume and not (folder / CHECKPOINT).exists():
            run, resume = fresh(), False
            console.print(
                f"{folder} has no checkpoint yet: the training starts again, with the settings of "
                f"this command: {run.command()}"
            )
        if resume:
            run = training.saved_run(folder, steps, device)
            if config is not None or set:
                raise SettingsError(
                    "--resume keeps the settings of the run (only --steps and --device may "
                    "change); leave --config and --set out, or start a new run with another --out"
                )
            own = run.config
            for given, there in ((given_env, own.env), (algo, own.algo), (seed, run.seed)):
                if given not in (None, there):
                    raise SettingsError(f"{folder} holds a run of {there}: leave {given} out")
            model = training.resume(run)
            done = f"{model.num_timesteps:,} of {run.config.steps:,}"
            console.print(f"continues at {done} steps on {run.device}")
        else:
            model = training.start(run)
        print(training.train(run, model, console))


def _settings(env: str, algo: str, variant: str, file: Path | None) -> configs.Config:
    """Return the settings of a preset, or of a file for the same environment and algorithm."""
    if file is None:
        return configs.preset(env, algo, variant)
    if file.suffix == ".onnx":
        from agents.policies.policy_file import read

        found = configs.from_mapping(read(file).card.get("config"))
    else:
        found = configs.read(file)
    if (found.env, found.algo) != (env, algo):
        raise SettingsError(
            f"{file} is for {found.env} with {found.algo}; name them: {found.env} --algo "
            f"{found.algo}"
        )
    return found


def _check_counts(**counts: tuple[int | None, int]) -> None:
    """Refuse numbers below their minimum, before anything is written."""
    for name, (value, least) in counts.items():
        if value is not None and value < least:
            raise SettingsError(f"{name} = {value} is below {least}; give {least} or more")


def sweep(
    env: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(help=ID_HELP)] = (
        DEFAULT_ENV,
    ),
    /,
    algo: Algo = "ppo",
    variant: Variant = "",
    seeds: int = 5,
    first_seed: int = 0,
    steps: Steps = None,
    set: Changes = (),
    device: Processor = "cpu",
    jobs: int = os.cpu_count() or 1,
    backend: Literal["loky", "dask"] = "loky",
    address: str = "",
    out: Path = Path("runs"),
    dry_run: bool = False,
) -> int:
    """Train several seeds in parallel; the same command continues an interrupted sweep.

    Exit code 0 if every policy exists, 1 if one is missing.

    Args:
        seeds: Number of training seeds.
        first_seed: The first training seed.
        jobs: Parallel training runs on this machine.
        backend: Processes on this machine (loky), or a running Dask cluster.
        address: Address of the Dask scheduler, for example tcp://host:8786.
        out: Folder of the runs.
        dry_run: Only list the training runs and whether their policies exist.
    """
    from agents.training import sweep as sweeping
    from sweeps.engine import Cluster
    from sweeps.progress import progress

    _check_counts(seeds=(seeds, 1), first_seed=(first_seed, 0))
    cluster = Cluster(jobs, backend, address)
    changes = [*set, *([] if steps is None else [f"steps={steps}"])]
    found = [configs.preset(name, algo, variant) for name in map(full_id, env)]
    trainings = sweeping.trainings(
        [configs.changed(config, changes) for config in found],
        range(first_seed, first_seed + seeds),
        out,
        f"{algo}-{variant}" if variant else algo,
        device,
    )
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
    """Copy finished runs to agents/pretrained, the folder that the leaderboard reads.

    The runs are training seeds 0 to n - 1 of one preset, and replace its older files.

    Args:
        runs: Folders of the runs, each with policy.onnx and policy.json.
        author: Author of the policies in BibTeX form; default: the authors of this package.
    """
    from agents.policies.entering import enter as copy

    made = copy(runs, author)
    for path in made.replaced:
        print(f"replaced {path}")
    for path in made.files:
        print(path)
    print(f"{made.controller}: training seeds {', '.join(map(str, range(len(made.files))))}")


def show(policy: Annotated[Path, tyro.conf.Positional], /) -> None:
    """Check a policy file and print its card: training, signals, settings, versions.

    Args:
        policy: ONNX file of a policy.
    """
    from agents.policies.policy import OnnxPolicy

    made = OnnxPolicy.load(policy)
    print(json.dumps({**made.card, "digest": made.digest()}, indent=1, sort_keys=True))


def watch(
    policy: Annotated[Path, tyro.conf.Positional],
    /,
    video: Path = Path("policy.mp4"),
    seconds: float | None = None,
    seed: int = 0,
    fps: int = 25,
) -> None:
    """Write a film of a policy in the environment of its training.

    Args:
        policy: ONNX file of a policy.
        video: Output file, .mp4 or .gif.
        seconds: Length of the episode [s]; default: that of the training, at most 10 s.
        seed: Seed of the episode.
        fps: Frames per second.
    """
    from agents.training import own_policy

    if seconds is not None and not seconds > 0.0:
        raise SettingsError(f"seconds = {seconds:g} is not above 0; give the length in seconds")
    arguments = own_policy.watch(policy, video, seconds, seed, fps)
    print(f"wrote {video}: {', '.join(f'{k} {v}' for k, v in sorted(arguments.items()))}")


def evaluate(
    policies: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    controllers: tuple[str, ...] = (),
    episodes: int | None = None,
) -> None:
    """Print a table of scores of policies and classical controllers on the same episodes.

    The episodes have tuning seeds and the plants of the training of the first policy. RMS is the
    error of the output in SI units, travel the mean change of the pressure setpoints in a control
    period [Pa], failures the number of episodes that a limit ended.

    Args:
        policies: ONNX files of policies of one environment.
        controllers: Classical controllers to compare with, for example inverse_pid.
        episodes: Number of episodes; default: that of the training's evaluations.
    """
    from agents.training import own_policy

    if not policies:
        raise SettingsError("name policies, for example runs/*/*/policy.onnx")
    _check_counts(episodes=(episodes, 1))
    print(f"{'RMS':>11} {'return':>11} {'travel':>11} {'failures':>8}  name")
    for name, score in own_policy.scores(policies, controllers, episodes):
        numbers = (score.rms, score.mean_return, score.travel)
        cells = [f"{'-' if math.isnan(n) else format(n, '.5g'):>11}" for n in numbers]
        print(*cells, f"{score.failures:>8}  {name}", flush=True)


def evaluations(policies: Annotated[tuple[Path, ...], tyro.conf.Positional], /) -> None:
    """Print the evaluations during training (tuning seeds) and the exported policy.

    "value" is the selection criterion. "kinds" lists the RMS error of each kind of rows, relative
    to the first evaluation (of the controller alone, for a residual policy).

    Args:
        policies: ONNX files of policies.
    """
    from agents.policies.policy import OnnxPolicy

    if not policies:
        raise SettingsError("name policies, for example runs/*/*/policy.onnx")
    for place in policies:
        card = OnnxPolicy.load(place).card
        found, chosen = card.get("evaluation", []), card.get("chosen", {})
        print(f"{place}: {len(found)} evaluations")
        for entry in found:
            first = found[0].get("kinds", [])
            pairs = zip(entry.get("kinds", []), first, strict=True)
            kinds = " ".join(f"{rms / was:.3f}" if rms and was else "-" for rms, was in pairs)
            mark = " <- exported" if entry["steps"] == chosen.get("steps") else ""
            numbers = [f"{n} {entry[n]:.5g}" for n in COLUMNS if entry.get(n) is not None]
            print(f"{entry['steps']:>12,}  {', '.join(numbers)}, kinds {kinds}{mark}")


def tune(
    env: Env,
    /,
    algo: Algo = "ppo",
    variant: Variant = "",
    trials: int = 20,
    steps: Steps = None,
    seed: int = 0,
    storage: Path | None = None,
    write: bool = False,
) -> None:
    """Search hyper-parameters on tuning seeds; the same command resumes a killed search.

    Each trial is two trainings of --steps control periods.

    Args:
        trials: Number of settings to try, including those in the storage.
        seed: Seed of the search.
        storage: SQLite file; default: runs/tune/ENV.ALGO.db. Several processes may share it.
        write: Write the best settings and the budget into the preset's file.
    """
    from rich.console import Console

    from agents.search import tune as tuning

    _check_counts(trials=(trials, 1), steps=(steps, 1), seed=(seed, 0))
    path = configs.preset_path(full_id(env), algo, variant)
    config = configs.read(path)
    place = storage or Path("runs/tune") / f"{path.stem}.db"
    job = tuning.Job(config, trials, steps or config.steps, seed, place)
    with database_named(place):
        study = tuning.search(job, Console(stderr=True))
        print(json.dumps({"value": study.best_value, **study.best_params}, indent=1))
    if write:
        tuning.write(job, study, path)
        print(path)


def classical(env: Env, /, algo: Algo = "ppo", variant: Variant = "residual") -> None:
    """Evaluate the classical controllers of an environment on tuning seeds, the best first.

    Use the result to choose the controller that a residual policy corrects; the leaderboard does
    not use it. The preset defines plants, references and the criterion (evaluation.objective), the
    first number.
    """
    from agents.training.evaluation import evaluate, value_of
    from baselines.core.catalogue import CONTROLLERS

    config = configs.preset(full_id(env), algo, variant)
    names = [name for name, entry in CONTROLLERS.items() if config.env in entry.envs]
    scores = {name: evaluate(name, config) for name in names}
    values = {name: value_of(score, config) for name, score in scores.items()}
    for name in sorted(values, key=lambda name: values[name]):
        made = scores[name]
        print(
            f"{values[name]:.5g}  {name}  RMS {made.rms:.5g}, return {made.mean_return:.5g}, "
            f"failures {made.failures}, travel {made.travel:.4g} Pa"
        )


def presets() -> None:
    """List the presets with their training steps and search budget."""
    for env, algo, variant in configs.presets():
        config = configs.preset(env, algo, variant)
        kind = f"{algo} --variant {variant}" if variant else algo
        trials = config.search.trials
        how = config.search.note if trials is None else f"{trials} trials of search"
        print(f"{env}  {kind}  {config.steps:,} steps, {how}")


def offline(
    data: Annotated[Path, tyro.conf.Positional],
    /,
    algo: Literal["bc", "iql"] = "bc",
    steps: int = 20_000,
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Learn a policy from a data set by behaviour cloning or implicit Q-learning.

    Args:
        data: Folder of a data set, for example datasets/PAM/KneeWalk/expert-v0.
        algo: bc: behaviour cloning; iql: implicit Q-learning.
        steps: Steps of the gradient.
        seed: Seed of weights and batches.
        out: Folder of the policy; default: runs/offline/ENV/KIND/ALGO-seedSEED.
    """
    from agents.offline.learners import Settings
    from agents.offline.train import train as learn
    from sweeps.progress import progress

    _check_counts(steps=(steps, 1), seed=(seed, 0))
    folder = out or Path("runs/offline", *data.resolve().parts[-2:], f"{algo}-seed{seed}")
    with progress("gradient steps") as start:
        print(learn(data, Settings(algo, steps, seed), folder, start))


COMMANDS: dict[str, Any] = {
    "train": train,
    "sweep": sweep,
    "tune": tune,
    "classical": classical,
    "enter": enter,
    "show": show,
    "watch": watch,
    "evaluate": evaluate,
    "offline": offline,
    "evaluations": evaluations,
    "presets": presets,
}


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    ask = tyro.extras.subcommand_cli_from_dict
    try:
        return run_cli(
            lambda: ask(COMMANDS, prog="python -m agents", args=arguments),
            "interrupted; finished results and checkpoints are kept; the same command continues, "
            "for train with --resume",
        )
    except ModuleNotFoundError as error:
        extra = "data" if error.name == "minari" else "agents"
        print(
            f"error: this command needs {error.name}, which is not installed: "
            f'pip install "pam-envs[{extra}]"',
            file=sys.stderr,
        )
        return 2


if __name__ == "__main__":
    sys.exit(main())
