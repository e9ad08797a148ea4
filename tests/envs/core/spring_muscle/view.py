"""View of a muscle and a spring."""

from typing import Any

import numpy as np

from pam_envs.envs.rendering import scene as S


def draw(canvas: Any, env: Any, info: Any) -> None:
    """Draw the muscle above the spring, and the pressure."""
    end = 300.0 - 5000.0 * info["state/contraction"]
    canvas.rectangle((130, 60, 24, end - 60), S.COLD)
    canvas.line([(142, end), (142, 420)], S.STEEL, 4)
    S.pressure_scale(canvas, info["state/pressure"], 6e5)


def demonstrate(env: Any) -> S.Policy:
    """Return the policy that sets the pressure of the reference at rest."""

    def policy(observation: Any) -> Any:
        reference = env.signals.decode(observation, "reference")
        pressure = env.action_signals[0].encode(reference / env.plant.gain)
        return np.array([pressure], np.float32)

    return policy


LINES = (("state/pressure", S.PRESSURE, 2.0),)
VIEW = S.View(
    draw,
    (
        S.Strip("contraction", "mm", 1e3, S.LINES, 350, 116, (0.0, 30.0), (0, 15, 30)),
        S.Strip("pressure", "bar", 1e-5, LINES, 498, 60, (0.0, 6.0), (0, 3, 6)),
    ),
    demonstrate,
    panel=lambda canvas, env, info, points: None,
)
