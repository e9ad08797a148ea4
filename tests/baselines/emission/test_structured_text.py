"""Structured Text: syntax by blark, and 1,000 calls compared with the Python controllers.

No compiler for IEC 61131-3 can be installed from the package index: the statements are evaluated by
``structured_text_evaluator``.
"""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from baselines.emission.structured_text import function_block, number

pytest.importorskip("blark")
from structured_text_evaluator import FunctionBlock

pytestmark = pytest.mark.xdist_group("structured_text")  # a text is parsed once
MUSCLE = "PAM/MusclePositioning-v0"
INPUTS = {
    "Contraction": "contraction",
    "Pressure": "pressure",
    "SetPoint": "set_point",
    "Load": "load",
    "DesiredContraction": "reference",
}


def compared(name: str, env: Any, steps: int = 1000) -> np.ndarray[Any, Any]:
    """Return the differences of the setpoints [Pa] in closed loop, shape (steps,)."""
    controller = make_controller(name, env.plant, env.signals, env.action_signals)
    block = FunctionBlock(function_block(name, controller, env.signals, env.action_signals))
    names = {key: signal for key, signal in INPUTS.items() if key in block.values}
    observation, _ = env.reset(seed=5)
    state, start, errors = None, True, []
    for _ in range(steps):
        action, state = controller.predict(observation, state, start)
        given = {key: float(env.signals.decode(observation, s)) for key, s in names.items()}
        found = block(Restart=start, **given)["PressureSetPoint"]
        errors.append(found - float(action[0]))
        observation, _, terminated, truncated, _ = env.step(action)
        start = bool(terminated or truncated)
    return np.array(errors)


def env_of(load: float, reference: str = "mixed") -> Any:
    return gym.make(
        MUSCLE, normalize=False, load=load, reference=reference, episode_seconds=60.0
    ).unwrapped


def test_pid_gives_the_setpoints_of_python_in_float32() -> None:
    env = env_of(2.55)
    errors = compared("pid", env)
    assert np.abs(errors).max() <= 0.5 * np.spacing(np.float32(6e5))


@pytest.mark.parametrize("load", [0.0, 1.3, 2.55, 3.9, 4.55])
@pytest.mark.parametrize("name", ["plc_as_printed", "plc_refitted", "one_cubic"])
def test_polynomials_give_the_setpoints_of_python(name: str, load: float) -> None:
    errors = compared(name, env_of(load))  # Python interpolates a fine table
    assert np.abs(errors).max() < 0.1  # Pa


def test_restart_forgets_the_past() -> None:
    env = env_of(2.55, "steps")
    controller = make_controller("pid", env.plant, env.signals, env.action_signals)
    block = FunctionBlock(function_block("pid", controller, env.signals, env.action_signals))
    given = {"Contraction": 0.004, "Pressure": 2e5, "SetPoint": 2.1e5, "DesiredContraction": 0.005}
    first = block(Restart=True, **given)["PressureSetPoint"]
    for _ in range(20):
        later = block(Restart=False, **given)["PressureSetPoint"]
    assert later != first
    assert block(Restart=True, **given)["PressureSetPoint"] == first


def test_controllers_without_structured_text_are_refused() -> None:
    env = env_of(2.55)
    for name in ("table", "inverse"):
        controller = make_controller(name, env.plant, env.signals, env.action_signals)
        with pytest.raises(ValueError, match=f"{name} cannot be written in Structured Text"):
            function_block(name, controller, env.signals, env.action_signals)


def test_wrong_syntax_is_found() -> None:
    with pytest.raises(ValueError, match="No terminal matches"):
        FunctionBlock("FUNCTION_BLOCK A\nVAR x : LREAL; END_VAR\nx := 1.0 + ;\nEND_FUNCTION_BLOCK")


@pytest.mark.parametrize("value", [0.0, 1e-5, -2.5e-7, 1e22, 0.1, 14028587.524452845])
def test_literals_keep_every_bit_and_have_a_point(value: float) -> None:
    text = number(value)
    assert float(text) == value
    assert "." in text.partition("E")[0]
