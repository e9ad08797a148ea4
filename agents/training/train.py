"""Training: a policy from settings, a seed and a folder; a killed run continues.

The folder holds ``checkpoint.pt`` (:mod:`agents.training.snapshot`), ``tensorboard/`` and, at the
end, ``policy.onnx`` with its record ``policy.json``. The exported policy is the best of those that
were evaluated (:mod:`agents.training.best`), or the last without evaluations.

Exactness: a checkpoint is taken at the start of a rollout. A run that was killed and resumed ends
with the same bits and the same ``policy.onnx`` as an uninterrupted one, for every algorithm,
recurrent or not, with history and controller, given the same package versions and type of
processor. Torch uses one thread, since sums depend on the number of threads. Only the log
differs: it holds the steps between the last checkpoint and the kill twice.
"""

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from rich.console import Console
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import configure

from agents.export.export import export_policy, facts, layer, plants_of
from agents.policies.policy_file import POLICY, finished
from agents.settings import presets as configs
from agents.settings.parts import Evaluation
from agents.training import adaptation, callbacks, checkpoint, snapshot
from agents.training.best import Best
from agents.training.building import make_env, make_model
from agents.training.callbacks import Checkpoints, Evaluations
from agents.training.checkpoint import CheckpointError
from agents.training.record import CHECKPOINT, LOCK, Clock, Run, cost
from agents.vec_envs.widening import WideningVecEnv
from sweeps.progress import progress


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the lock of a run's folder; raise while another process trains in it."""
    lock = FileLock(folder / LOCK, timeout=0.0)
    try:
        lock.acquire()
    except Timeout as error:
        raise CheckpointError(
            f"another process trains in {folder}; wait for it, or give another --out"
        ) from error
    try:
        yield
    finally:
        lock.release()


def start(run: Run) -> BaseAlgorithm:
    """Return the model of a new run; raise if the folder holds a run or export is impossible."""
    if run.checkpoint.exists():
        raise CheckpointError(
            f"{run.folder} already holds a training; continue it (--resume) or give another --out"
        )
    run.folder.mkdir(parents=True, exist_ok=True)
    checkpoint.sweep(run.folder)
    model = make_model(run.config, run.seed, make_env(run.config), run.device)
    if run.config.residual.controller:
        facts(model)
    return model


def saved_run(folder: Path, steps: int | None = None, device: str | None = None) -> Run:
    """Return the run of a folder's checkpoint, with other steps or another device if given."""
    settings = _settings(checkpoint.load(folder / CHECKPOINT))
    given = settings["config"]
    if steps is not None:
        given = {**given, "steps": steps}
    return Run(configs.from_mapping(given), settings["seed"], folder, device or settings["device"])


def _settings(content: dict[str, Any]) -> dict[str, Any]:
    try:
        settings: dict[str, Any] = json.loads(content["settings"])
        if type(settings["seed"]) is not int or settings["seed"] < 0:
            raise ValueError("seed")
        if settings["device"] not in ("cpu", "cuda"):
            raise ValueError("device")
        return {key: settings[key] for key in ("config", "seed", "device", "plants")}
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise CheckpointError(f"{CHECKPOINT} lacks the settings of its training") from error


def resume(run: Run) -> BaseAlgorithm:
    """Return the model of a run at its checkpoint, unless the plants have changed since."""
    checkpoint.sweep(run.folder)
    content = checkpoint.load(run.checkpoint)
    env = make_env(run.config)
    then, now = _settings(content)["plants"], plants_of(env)
    if then != now:
        raise CheckpointError(
            f"the run was trained on the plants {then}, which are now {now}; train anew"
        )
    model = make_model(run.config, run.seed, env, run.device)
    model.ep_info_buffer = None
    try:
        snapshot.restore(model, content["snapshot"])
    except (LookupError, TypeError, RuntimeError, ValueError, ArithmeticError, AttributeError) as e:
        raise CheckpointError(f"{run.checkpoint.name} does not fit its settings: {e}") from e
    return model


def train(run: Run, model: BaseAlgorithm, console: Console) -> Path:
    """Train to the end of the run, write its policy and return the policy's path."""
    with _naming(run.folder):
        return _train(run, model, console)


@contextmanager
def _naming(folder: Path) -> Iterator[None]:
    """Name the folder in an OSError of the log, which names no file where the disk is full."""
    try:
        yield
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(folder)) from error


def _train(run: Run, model: BaseAlgorithm, console: Console) -> Path:
    sinks = ["tensorboard"] if find_spec("tensorboard") else []
    model.set_logger(configure(str(run.folder / "tensorboard"), sinks))
    clock, evaluations = _so_far(run, model)
    checkpoints = Checkpoints(run, clock, evaluations)
    left = run.config.steps - model.num_timesteps
    if left > 0:
        with progress("steps", console) as begin:
            watched = [
                evaluations,
                checkpoints,
                callbacks.TrainingProgress(run.config.steps, begin),
            ]
            model.learn(
                left,
                callback=[callbacks.Cancellation(), callbacks.WarmUp(run.config), *watched],
                reset_num_timesteps=model.num_timesteps == 0,
                log_interval=1 if run.config.algo in configs.ON_POLICY else 100,
            )
        evaluations.last()
        checkpoints.act()
    card: dict[str, Any] = {"seed": run.seed, "command": run.command()}
    card["config"] = run.config.as_dict()
    ranges = layer(model.get_env(), WideningVecEnv)
    if run.config.adaptation.steps:
        model, evaluations, card["imitation_error"] = _adapted(run, model, console)
    model.logger.close()
    if evaluations.found:
        card["evaluation"] = evaluations.found
        card["chosen"] = evaluations.best.chosen(len(evaluations.found))
        evaluations.best.restore(model)
    record = cost(run, clock.spent(), model.num_timesteps)
    if ranges is not None:
        record["ranges"] = ranges.ranges()
    export_policy(model, run.folder / POLICY, card, record)
    return run.folder / POLICY


def _adapted(
    run: Run, teacher: BaseAlgorithm, console: Console
) -> tuple[BaseAlgorithm, Evaluations, list[float]]:
    """Return the student of a trained teacher, its evaluations and its errors while it learned."""
    settings = run.config.adaptation
    student = adaptation.untrained(teacher, run.config, run.seed)
    evaluations = Evaluations(run.config, [], Best())
    evaluations.init_callback(student)
    evaluations.last()
    with progress("steps of the student", console) as begin:
        advance = begin(settings.steps)
        errors = adaptation.learn(student, teacher, settings, run.seed, advance)
    evaluations.last()
    return student, evaluations, errors


def train_to_the_end(run: Run, console: Console) -> Path:
    """Start or continue a run unless its policy is finished; return the policy's path."""
    if not run.checkpoint.exists():
        return train(run, start(run), console)
    if saved_run(run.folder, device=run.device) != run:
        raise CheckpointError(
            f"{run.folder} holds a training with other settings; give another --out"
        )
    done = run.folder / POLICY
    return done if finished(done) else train(run, resume(run), console)


def _so_far(run: Run, model: BaseAlgorithm) -> tuple[Clock, Evaluations]:
    """Return the time spent and the evaluations recorded up to the checkpoint.

    A teacher is not evaluated: its file would assume the nominal plant.
    """
    config = run.config
    if config.adaptation.steps:
        config = dataclasses.replace(config, evaluation=Evaluation())
    if not model.num_timesteps:
        return Clock(), Evaluations(config, [], Best())
    content = checkpoint.load(run.checkpoint)
    try:
        spent, best = content["spent"], Best(**content["best"])
        snapshot.check({k: spent[k] for k in ("wall", "cpu")}, {"wall": 0.0, "cpu": 0.0}, "spent")
        if best.steps >= 0:
            snapshot.check(best.weights, checkpoint.tensors(model.policy.state_dict()), "best")
        best.moments = {name: moment.numpy() for name, moment in best.moments.items()}
        evaluations = Evaluations(config, list(content["evaluations"]), best)
        return Clock(spent["wall"], spent["cpu"]), evaluations
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise CheckpointError(f"{run.checkpoint.name} lacks its evaluations: {error}") from error
