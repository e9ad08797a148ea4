"""Training: a policy from settings, a seed and a folder; a killed run continues.

The folder holds ``checkpoint.pt`` (:mod:`agents.training.snapshot`), ``tensorboard/`` and, at the
end, ``policy.onnx`` with its record ``policy.json``. The exported policy is the best of those that
were evaluated (:mod:`agents.training.best`), or the last without evaluations.

Exactness: a checkpoint is taken at the start of a rollout. A run that was killed and resumed ends
with the same bits and the same ``policy.onnx`` as an uninterrupted one, for every algorithm,
recurrent or not, with history and controller, given the same package versions and type of
processor. Torch uses one thread, since sums depend on the number of threads. The log alone
differs: it holds the steps between the last checkpoint and the kill twice.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rich.console import Console
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import configure

from agents.export.export import export_policy, facts, plants_of
from agents.policies.policy_file import POLICY, finished
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.training import checkpoint, snapshot
from agents.training.best import Best
from agents.training.building import make_env, make_model
from agents.training.callbacks import Cancellation, Checkpoints, Evaluations, WarmUp
from agents.training.checkpoint import CheckpointError
from agents.training.progress import TrainingProgress
from agents.training.record import Clock, cost
from sweeps.progress import progress


@dataclass(frozen=True)
class Run:
    """A training run.

    Attributes
    ----------
    config : Config
    seed : int
        Of weights, exploration and episodes.
    folder : Path
        For its files.
    """

    config: Config
    seed: int
    folder: Path

    @property
    def checkpoint(self) -> Path:
        """Path of the checkpoint."""
        return self.folder / checkpoint.NAME

    def command(self) -> str:
        """Return the command that trains the same policy again.

        Without a preset of these settings it takes them from ``policy.onnx``.
        """
        config = self.config
        words = ["python -m agents train", config.env, "--algo", config.algo]
        words += ["--steps", str(config.steps), "--seed", str(self.seed)]
        variant = self._variant()
        if variant is None:
            words += ["--config", POLICY]
        elif variant:
            words += ["--variant", variant]
        return " ".join(words)

    def _variant(self) -> str | None:
        """Return the variant of the preset with these settings, None without one."""
        config = self.config
        for env, algo, variant in configs.presets():
            if (env, algo) == (config.env, config.algo):
                preset = configs.preset(env, algo, variant)
                if dataclasses.replace(preset, steps=config.steps, search=config.search) == config:
                    return variant
        return None


def default_folder(env: str, algo: str, seed: int, variant: str = "") -> Path:
    """Return ``runs/<environment>/<algo>[-<variant>]-seed<seed>``."""
    kind = f"{algo}-{variant}" if variant else algo
    return Path("runs") / env.replace("/", "-") / f"{kind}-seed{seed}"


def start(run: Run) -> BaseAlgorithm:
    """Return the model of a new run.

    Raises
    ------
    CheckpointError
        If the folder already holds a run.
    ValueError
        If the policy could not be exported at the end.
    """
    if run.checkpoint.exists():
        raise CheckpointError(
            f"{run.folder} already holds a training; continue it (--resume) or give another --out"
        )
    run.folder.mkdir(parents=True, exist_ok=True)
    checkpoint.sweep(run.folder)
    model = make_model(run.config, run.seed, make_env(run.config))
    if run.config.residual.controller:
        facts(model)
    return model


def saved_run(folder: Path, steps: int | None = None) -> Run:
    """Return the run of a folder's checkpoint, with another number of steps if given."""
    settings = _settings(checkpoint.load(folder / checkpoint.NAME))
    given = settings["config"]
    if steps is not None:
        given = {**given, "steps": steps}
    return Run(configs.from_mapping(given), settings["seed"], folder)


def _settings(content: dict[str, Any]) -> dict[str, Any]:
    try:
        settings: dict[str, Any] = json.loads(content["settings"])
        return {key: settings[key] for key in ("config", "seed", "plants")}
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError("the checkpoint lacks the settings of its training") from error


def resume(run: Run) -> BaseAlgorithm:
    """Return the model of a run at its checkpoint.

    Raises
    ------
    CheckpointError
        If there is no sound checkpoint, or the plants have changed since.
    """
    checkpoint.sweep(run.folder)
    content = checkpoint.load(run.checkpoint)
    env = make_env(run.config)
    then, now = _settings(content)["plants"], plants_of(env)
    if then != now:
        raise CheckpointError(
            f"the run was trained on the plants {then}, which are now {now}; train anew"
        )
    model = make_model(run.config, run.seed, env)
    model.ep_info_buffer = None
    try:
        snapshot.restore(model, content["snapshot"])
    except (KeyError, RuntimeError, ValueError, AttributeError) as error:
        raise CheckpointError(
            f"{run.checkpoint.name} does not fit its settings: {error}"
        ) from error
    return model


def train(run: Run, model: BaseAlgorithm, console: Console) -> Path:
    """Train to the end of the run, write its policy and return the policy's path."""
    sinks = ["tensorboard"] if find_spec("tensorboard") else []
    model.set_logger(configure(str(run.folder / "tensorboard"), sinks))
    clock, evaluations = _so_far(run, model.num_timesteps)
    checkpoints = Checkpoints(run.checkpoint, run.config, run.seed, clock, evaluations)
    left = run.config.steps - model.num_timesteps
    if left > 0:
        with progress("steps", console) as begin:
            model.learn(
                left,
                callback=[
                    Cancellation(),
                    WarmUp(run.config),
                    evaluations,
                    checkpoints,
                    TrainingProgress(run.config.steps, begin),
                ],
                reset_num_timesteps=model.num_timesteps == 0,
                log_interval=1 if run.config.algo in configs.ON_POLICY else 100,
            )
        evaluations.last()
        checkpoints.act()
    model.logger.close()
    command = run.command()
    card = {"seed": run.seed, "command": command, "config": run.config.as_dict()}
    if evaluations.found:
        card["evaluation"] = evaluations.found
        card["chosen"] = evaluations.best.chosen(len(evaluations.found))
        evaluations.best.restore(model)
    record = cost(run.config, run.seed, command, clock.spent(), model.num_timesteps)
    export_policy(model, run.folder / POLICY, card, record)
    return run.folder / POLICY


def train_to_the_end(run: Run, console: Console) -> Path:
    """Start or continue a run unless its policy is finished; return the policy's path.

    Raises
    ------
    CheckpointError
        If the folder holds a run with other settings.
    """
    if not run.checkpoint.exists():
        return train(run, start(run), console)
    if saved_run(run.folder) != run:
        raise CheckpointError(
            f"{run.folder} holds a training with other settings; give another --out"
        )
    done = run.folder / POLICY
    return done if finished(done) else train(run, resume(run), console)


def _so_far(run: Run, steps: int) -> tuple[Clock, Evaluations]:
    """Return the time spent and the evaluations made before the checkpoint."""
    if not steps:
        return Clock(), Evaluations(run.config, [], Best())
    content = checkpoint.load(run.checkpoint)
    try:
        spent, best = content["spent"], Best(**content["best"])
        best.moments = {name: moment.numpy() for name, moment in best.moments.items()}
        evaluations = Evaluations(run.config, list(content["evaluations"]), best)
        return Clock(spent["wall"], spent["cpu"]), evaluations
    except (KeyError, TypeError, AttributeError) as error:
        raise CheckpointError(f"{run.checkpoint.name} lacks its evaluations: {error}") from error
