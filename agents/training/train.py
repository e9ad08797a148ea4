"""Training: settings, a seed and a folder give a policy; a killed run goes on where it was.

The folder holds ``checkpoint.pt`` (everything the future depends on, see
:mod:`agents.training.snapshot`), ``tensorboard/``, and at the end ``policy.onnx`` with
``policy.json``.

What is shipped is the best policy of those that were evaluated (:mod:`agents.training.best`), or
the last one where none was.

Exactness. Checkpoints are taken at the start of a rollout, where nothing is half done. A run that
was killed and resumed ends with the same bits, and the same ``policy.onnx``, as one that was not:
for every algorithm, with memory, history and controller, with the same package versions on the
same type of processor. Torch uses one thread; with several, sums depend on their number. What
differs is the log: the steps between the last checkpoint and the kill are in it twice.

Seeds. Training and the evaluations during it use the seeds of :mod:`agents.settings.seeds` alone.
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
from agents.training import checkpoint, snapshot, sources
from agents.training.best import Best
from agents.training.building import logs_each_rollout, make_env, make_model
from agents.training.callbacks import Checkpoints, Evaluations, WarmUp
from agents.training.checkpoint import CheckpointError
from agents.training.progress import TrainingProgress
from agents.training.record import Clock, training


@dataclass(frozen=True)
class Run:
    """A training run.

    Attributes
    ----------
    config : Config
    seed : int
        Of weights, exploration and episodes.
    folder : Path
        Where its files go.
    """

    config: Config
    seed: int
    folder: Path

    @property
    def checkpoint(self) -> Path:
        """The checkpoint's place."""
        return self.folder / checkpoint.NAME

    def command(self) -> str:
        """Return the command that gives the same policy, run in its folder if need be."""
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
        """Return the variant of the preset that this is, None if it is none."""
        config = self.config
        for env, algo, variant in configs.presets():
            if (env, algo) == (config.env, config.algo):
                preset = configs.preset(env, algo, variant)
                own = {"steps": config.steps, "search": config.search}
                if dataclasses.replace(preset, **own) == config:
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
        If the policy could not be exported in the end.
    """
    if run.checkpoint.exists():
        raise CheckpointError(
            f"{run.folder} already holds a training; go on with it (--resume) or give another --out"
        )
    run.folder.mkdir(parents=True, exist_ok=True)
    checkpoint.sweep(run.folder)
    model = make_model(run.config, run.seed, make_env(run.config))
    if run.config.residual.controller:
        facts(model)
    return model


def saved_run(folder: Path, steps: int | None = None) -> Run:
    """Return the run that a folder's checkpoint belongs to, perhaps made longer."""
    settings = _settings(checkpoint.load(folder / checkpoint.NAME))
    given = settings["config"]
    if steps is not None:
        given = {**given, "steps": steps}
    return Run(configs.from_mapping(given), settings["seed"], folder)


def _settings(content: dict[str, Any]) -> dict[str, Any]:
    try:
        settings: dict[str, Any] = json.loads(content["settings"])
        return {key: settings[key] for key in ("config", "seed", "plants", "sources")}
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError("the checkpoint does not say how it was trained") from error


def resume(run: Run) -> BaseAlgorithm:
    """Return the model of a run as its checkpoint left it.

    Raises
    ------
    CheckpointError
        If there is no sound checkpoint, or plants or sources have changed since.
    """
    checkpoint.sweep(run.folder)
    content = checkpoint.load(run.checkpoint)
    env = make_env(run.config)
    _check_unchanged(_settings(content), plants_of(env))
    model = make_model(run.config, run.seed, env)
    model.ep_info_buffer = None
    try:
        snapshot.put_back(model, content["snapshot"])
    except (KeyError, RuntimeError, ValueError, AttributeError) as error:
        raise CheckpointError(
            f"{run.checkpoint.name} does not fit its settings: {error}"
        ) from error
    return model


def _check_unchanged(settings: dict[str, Any], plants: list[str]) -> None:
    """Raise if a run would go on with other plants or sources than it began with."""
    if settings["plants"] != plants:
        raise CheckpointError(
            f"the run was trained on the plants {settings['plants']}, which are now {plants}; "
            "train anew"
        )
    then, now = settings["sources"], sources.digests()
    other = sorted(name for name in {*then, *now} if then.get(name) != now.get(name))
    if other:
        raise CheckpointError(
            f"the sources of {', '.join(other)} have changed since the run began, so that it would "
            "end as no other; train anew, or go back to them"
        )


def train(run: Run, model: BaseAlgorithm, console: Console) -> Path:
    """Train to the end of the run and write its policy; return the policy's place."""
    sinks = ["tensorboard"] if find_spec("tensorboard") else []
    model.set_logger(configure(str(run.folder / "tensorboard"), sinks))
    clock, evaluations = _so_far(run, model.num_timesteps)
    checkpoints = Checkpoints(run.checkpoint, run.config, run.seed, clock, evaluations)
    left = run.config.steps - model.num_timesteps
    if left > 0:
        model.learn(
            left,
            callback=[
                WarmUp(run.config),
                evaluations,
                checkpoints,
                TrainingProgress(run.config.steps, console),
            ],
            reset_num_timesteps=model.num_timesteps == 0,
            log_interval=1 if logs_each_rollout(run.config) else 100,
        )
        evaluations.last()
        checkpoints.act()
    card = {"seed": run.seed, "command": run.command(), "config": run.config.as_dict()}
    if evaluations.found:
        card["evaluation"] = evaluations.found
        card["chosen"] = evaluations.best.chosen(len(evaluations.found))
        evaluations.best.put_into(model)
    cost = training(run.config, run.seed, run.command(), clock.spent(), steps=model.num_timesteps)
    export_policy(model, run.folder / POLICY, card, cost)
    return run.folder / POLICY


def train_to_the_end(run: Run, console: Console) -> Path:
    """Start a run, go on with it or, where its policy is there, leave it; return the policy.

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
    """Return the time spent and the evaluations made until the checkpoint."""
    if not steps:
        return Clock(), Evaluations(run.config, [], Best())
    content = checkpoint.load(run.checkpoint)
    try:
        spent, best = content["spent"], Best(**content["best"])
        best.moments = {name: moment.numpy() for name, moment in best.moments.items()}
        evaluations = Evaluations(run.config, list(content["evaluations"]), best)
        return Clock(spent["wall"], spent["cpu"]), evaluations
    except (KeyError, TypeError, AttributeError) as error:
        raise CheckpointError(f"{run.checkpoint.name} lacks what was evaluated: {error}") from error
