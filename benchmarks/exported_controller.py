"""Export of controllers and policies, by their names on the board."""

import hashlib
from pathlib import Path
from typing import Any

import gymnasium as gym

from agents.policies.emission import policy_model
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import ResidualPolicy
from baselines.emission import structured_text
from baselines.emission.catalogue import controller_model
from benchmarks.runs import controllers
from pam_envs.export import command
from pam_envs.export.model import Model
from pam_envs.files import write_text


def made_for(
    name: str,
    env_id: str,
    plant: Path | None = None,
    si: bool = False,
    training_seed: int | None = None,
) -> tuple[Any, Any]:
    """Return a controller and its environment.

    Raises
    ------
    ValueError
        If there is no such controller, or it does not run in the environment.
    """
    entrant = controllers.find(name)
    if not entrant.runs_in(env_id):
        raise ValueError(f"{name} is for {', '.join(entrant.envs)}, not for {env_id}")
    given: dict[str, Any] = {} if plant is None else {"plant": plant}
    if si:
        given["normalize"] = False
    env: Any = gym.make(env_id, **given).unwrapped
    seed = entrant.training_seeds[0] if training_seed is None else training_seed
    return controllers.make(entrant, env.plant, env, seed), env


def model_of(name: str, controller: Any, env: Any) -> Model:
    """Return the model of a controller; of a policy that corrects one, that of the policy."""
    if isinstance(controller, ResidualPolicy):
        controller = controller.policy
    if isinstance(controller, OnnxPolicy):
        return policy_model(name, controller, env.control_period)
    return controller_model(name, controller, env.signals, env.action_signals, env.control_period)


def write(
    name: str,
    env_id: str,
    target: str,
    folder: Path,
    plant: Path | None = None,
    si: bool = False,
    training_seed: int | None = None,
) -> str:
    """Write the artefact of a controller into a folder; return its digest."""
    made, env = made_for(name, env_id, plant, si, training_seed)
    if target == "st":
        text = structured_text.function_block(name, made, env.signals, env.action_signals)
        write_text(folder / f"{name}.st", text)
        return hashlib.sha256(text.encode()).hexdigest()
    model = model_of(name, made, env)
    command.export(model, target, folder)  # type: ignore[arg-type]
    return model.digest
