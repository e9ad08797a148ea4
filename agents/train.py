"""Training: a preset, a seed and a folder give a policy; a killed run goes on where it was.

The folder holds ``checkpoint.pt`` (everything the future depends on, see
:mod:`agents.snapshot`), ``tensorboard/``, and at the end ``policy.onnx`` with ``policy.json``.

Exactness. Checkpoints are taken at the start of a rollout, where nothing is half done. A run that
was killed and resumed ends with the same bits, and the same ``policy.onnx``, as one that was not:
for PPO and for SAC, with the same package versions on the same type of processor. Torch uses one
thread; with several, sums depend on their number. What differs is the log: the steps between the
last checkpoint and the kill are in it twice.
"""

from __future__ import annotations

import dataclasses
import json
import random
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from rich.console import Console
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents import checkpoint, configs, snapshot
from agents.checkpoint import CheckpointError
from agents.configs import Config
from agents.export import export_policy
from agents.networks import policy_arguments
from agents.progress import TrainingProgress
from agents.sb3_vec_env import make_batch_vec_env

POLICY = "policy.onnx"
FIRST_SEED = 1_000_000
"""Environment seeds of training seed ``s`` start at ``FIRST_SEED * (s + 1)``, far from those that
benchmarks and tests use, so that no scored episode is ever trained on."""


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
        """Return the command that gives the same policy, run beside its card if need be."""
        config = self.config
        words = ["python -m agents train", config.env, "--algo", config.algo]
        words += ["--steps", str(config.steps), "--seed", str(self.seed)]
        shipped = (config.env, config.algo) in configs.presets()
        preset = configs.preset(config.env, config.algo) if shipped else None
        if preset is None or dataclasses.replace(preset, steps=config.steps) != config:
            words += ["--config", POLICY.replace(".onnx", ".json")]
        return " ".join(words)


def default_folder(config: Config, seed: int) -> Path:
    """Return ``runs/<environment>/<algo>-seed<seed>``."""
    return Path("runs") / config.env.replace("/", "-") / f"{config.algo}-seed{seed}"


def make_env(config: Config, seed: int) -> VecEnv:
    """Return the environment of a run: batched, monitored, normalised."""
    env: VecEnv = make_batch_vec_env(config.env, config.num_envs, **config.env_kwargs)
    env = VecMonitor(env)
    wanted = config.normalize
    if wanted.observation or wanted.reward:
        env = VecNormalize(
            env,
            norm_obs=wanted.observation,
            norm_reward=wanted.reward,
            clip_obs=wanted.clip_observation,
            clip_reward=wanted.clip_reward,
            gamma=getattr(config, config.algo).gamma,
        )
    return env


def make_model(config: Config, seed: int, env: VecEnv) -> BaseAlgorithm:
    """Return the untrained model of a run, with all random numbers seeded."""
    torch.set_num_threads(1)
    random.seed(seed)
    chosen: Any = config.ppo if config.algo == "ppo" else config.sac
    arguments = {k: v for k, v in vars(chosen).items() if k != "learning_rate"}
    arguments |= policy_arguments(config, *_signals(env))
    start, end = chosen.learning_rate
    algorithm: type[BaseAlgorithm] = PPO if config.algo == "ppo" else SAC
    model = algorithm(
        env=env,
        learning_rate=lambda remaining: end + (start - end) * remaining,
        seed=seed,
        device="cpu",
        **arguments,
    )
    env.seed(FIRST_SEED * (seed + 1))
    return model


def _signals(env: VecEnv) -> tuple[Any, Any]:
    return env.get_attr("signals")[0], env.get_attr("action_signals")[0]


class Checkpoints(BaseCallback):
    """Writes a checkpoint at the first rollout's start after every ``interval`` steps."""

    def __init__(self, run: Run, interval: int) -> None:
        super().__init__()
        self.run = run
        self.interval = interval

    def _on_training_start(self) -> None:
        self.due = self._next()

    def _next(self) -> int:
        return (self.model.num_timesteps // self.interval + 1) * self.interval

    def _on_rollout_start(self) -> None:
        if self.model.num_timesteps >= self.due:
            self.write()
            self.due = self._next()

    def _on_step(self) -> bool:
        return True

    def write(self) -> None:
        """Write the checkpoint now; only between rollouts."""
        env = self.model.get_env()
        assert env is not None
        settings = {
            "config": self.run.config.as_dict(),
            "seed": self.run.seed,
            "plant": env.get_attr("plant")[0].digest(),
        }
        content = {"settings": json.dumps(settings), "snapshot": snapshot.take(self.model)}
        checkpoint.save(self.run.checkpoint, content)


def start(run: Run) -> BaseAlgorithm:
    """Return the model of a new run.

    Raises
    ------
    CheckpointError
        If the folder already holds a run.
    """
    if run.checkpoint.exists():
        raise CheckpointError(
            f"{run.folder} already holds a training; go on with it (--resume) or give another --out"
        )
    run.folder.mkdir(parents=True, exist_ok=True)
    checkpoint.sweep(run.folder)
    return make_model(run.config, run.seed, make_env(run.config, run.seed))


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
        return {key: settings[key] for key in ("config", "seed", "plant")}
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError("the checkpoint does not say how it was trained") from error


def resume(run: Run) -> BaseAlgorithm:
    """Return the model of a run as its checkpoint left it.

    Raises
    ------
    CheckpointError
        If there is no sound checkpoint, or the plant has changed since.
    """
    checkpoint.sweep(run.folder)
    content = checkpoint.load(run.checkpoint)
    env = make_env(run.config, run.seed)
    was, now = _settings(content)["plant"], env.get_attr("plant")[0].digest()
    if was != now:
        raise CheckpointError(
            f"the run was trained on the plant {was}, which is now {now}; train anew"
        )
    model = make_model(run.config, run.seed, env)
    model.ep_info_buffer = None
    try:
        snapshot.put_back(model, content["snapshot"])
    except (KeyError, RuntimeError, ValueError, AttributeError) as error:
        raise CheckpointError(
            f"{run.checkpoint.name} does not fit its settings: {error}"
        ) from error
    return model


def train(run: Run, model: BaseAlgorithm, console: Console) -> Path:
    """Train to the end of the run and write its policy; return the policy's place."""
    sinks = ["tensorboard"] if find_spec("tensorboard") else []
    model.set_logger(configure(str(run.folder / "tensorboard"), sinks))
    checkpoints = Checkpoints(run, run.config.checkpoint_steps)
    left = run.config.steps - model.num_timesteps
    if left > 0:
        model.learn(
            left,
            callback=[checkpoints, TrainingProgress(run.config.steps, console)],
            reset_num_timesteps=model.num_timesteps == 0,
            log_interval=1 if run.config.algo == "ppo" else 100,
        )
        checkpoints.write()
    place = run.folder / POLICY
    export_policy(model, place, {"seed": run.seed, **_record(run)})
    return place


def _record(run: Run) -> dict[str, Any]:
    return {"command": run.command(), "config": run.config.as_dict()}
