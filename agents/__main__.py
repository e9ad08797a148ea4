"""``python -m agents``: train, look at a policy, measure the speed of training."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console

from agents import configs
from agents.settings import SettingsError


def train(
    env: Annotated[str, tyro.conf.Positional] = "PAM/MusclePositioning-v0",
    /,
    algo: Literal["ppo", "sac"] = "ppo",
    steps: int | None = None,
    seed: int = 0,
    out: Path | None = None,
    resume: bool = False,
    config: Path | None = None,
    set: tuple[str, ...] = (),
) -> None:
    """Train a policy and write it as ONNX.

    Parameters
    ----------
    env
        Environment id.
    algo
        Algorithm.
    steps
        Control periods of all rows together; default: the preset's.
    seed
        Of weights, exploration and episodes.
    out
        Folder of the run; default: runs/ENV/ALGO-seedSEED.
    resume
        Go on with the run in that folder; its settings are kept, only --steps may change.
    config
        A YAML file instead of the preset (see agents/configs/).
    set
        Single settings, for example: --set ppo.gamma=0.95 network.hidden=[32,32]
    """
    from agents import train as training

    wanted = configs.read(config) if config else configs.preset(env, algo)
    if (wanted.env, wanted.algo) != (env, algo):
        raise SettingsError(
            f"{config} is for {wanted.env} with {wanted.algo}; say so: {wanted.env} --algo "
            f"{wanted.algo}"
        )
    changes = [*set, *([] if steps is None else [f"steps={steps}"])]
    wanted = configs.changed(wanted, changes)
    folder = out or training.default_folder(wanted, seed)
    console = Console(stderr=True)
    if resume:
        _refuse_other_settings(config, set)
        run = training.saved_run(folder, steps)
        model = training.resume(run)
        console.print(f"going on at {model.num_timesteps:,} of {run.config.steps:,} steps")
    else:
        run = training.Run(wanted, seed, folder)
        model = training.start(run)
    place = training.train(run, model, console)
    print(place)


def _refuse_other_settings(config: Path | None, assignments: tuple[str, ...]) -> None:
    if config is not None or assignments:
        raise SettingsError(
            "--resume keeps the settings of the run (only --steps may change); leave --config and "
            "--set out, or start a new run with another --out"
        )


def show(policy: Annotated[Path, tyro.conf.Positional], /) -> None:
    """Print the card of a policy file, after the checks that loading it makes."""
    from agents.policy import OnnxPolicy

    made = OnnxPolicy.load(policy)
    print(json.dumps({**made.card, "digest": made.digest()}, indent=1, sort_keys=True))


def presets() -> None:
    """List the presets."""
    for env, algo in configs.presets():
        print(f"{env}  {algo}  {configs.preset(env, algo).steps:,} steps")


def speed(seconds: float = 20.0) -> None:
    """Measure training steps a second, beside stable-baselines3's default on Pendulum-v1."""
    from agents.speed import measure

    print(json.dumps(measure(seconds), indent=1))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    commands: dict[str, Any] = {"train": train, "show": show, "presets": presets, "speed": speed}
    try:
        tyro.extras.subcommand_cli_from_dict(commands, prog="python -m agents", args=arguments)
    except ValueError as error:  # settings, checkpoints and policy files say what to do
        print(f"error: {error}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as error:
        print(f"error: training needs {error.name}; install the extra 'agents'", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
