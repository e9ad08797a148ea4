"""Draw the pictures of the documentation (``make images``)."""

import sys
from pathlib import Path

import gymnasium as gym
import pygame

import pam_envs  # noqa: F401 (registers the environments)
from pam_envs.envs.rendering.scene import view_of

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from baselines.core.catalogue import make_controller  # noqa: E402
from benchmarks.effort import pareto_figure  # noqa: E402
from benchmarks.energy import isobaric_figure  # noqa: E402
from benchmarks.papers import elbow as papers_elbow  # noqa: E402
from benchmarks.papers import knee_studies, plots  # noqa: E402
from benchmarks.trapped_air import trapped_air_figure  # noqa: E402


def save(env: gym.Env, path: Path) -> None:
    """Write the present picture of an environment."""
    picture = pygame.surfarray.make_surface(env.render().swapaxes(0, 1))
    path.parent.mkdir(parents=True, exist_ok=True)
    pygame.image.save(picture, str(path))
    env.close()


def muscle_frame(path: Path, seconds: float = 21.0, seed: int = 7) -> None:
    """Run the inverse with PID on a staircase and write the picture after ``seconds``."""
    env = gym.make(
        "PAM/MusclePositioning-v0",
        render_mode="rgb_array",
        reference="staircase",
        load=2.55,
        episode_seconds=60.0,
    )
    inner = env.unwrapped
    controller = make_controller("inverse_pid", inner.plant, inner.signals, inner.action_signals)
    observation, _ = env.reset(seed=seed)
    state, start = None, True
    for _ in range(round(seconds / inner.control_period)):
        action, state = controller.predict(observation, state, start)
        observation, *_ = env.step(action)
        start = False
    save(env, path)


def frame(name: str, path: Path, seconds: float, **arguments: object) -> None:
    """Run what moves a plant in films and write the picture after ``seconds``."""
    env = gym.make(name, render_mode="rgb_array", episode_seconds=60.0, **arguments)
    inner = env.unwrapped
    observation, _ = env.reset(seed=0)
    policy = view_of(inner).demonstrator(inner)
    for _ in range(round(seconds / inner.control_period)):
        observation, *_ = env.step(policy(observation))
    save(env, path)


def stride(path: Path, mismatch: float = 10.0) -> None:
    """Draw the third stride of a walk, with and without bumpless transfer."""
    walks = [knee_studies.stride("walk", mismatch, bumpless) for bumpless in (True, False)]
    records = [plots.cut(walk, 9.2, 15.4) for walk in walks]
    title = (
        "Walking at 5 s per stride with 20 % assistance, inverse + LTR; in swing, the reference of"
        f" the inactive tension controller is wrong by {mismatch:g} N"
    )
    titles = ("I   with bumpless transfer", "II   without")
    plots.stride_figure(records, titles, title).savefig(path, dpi=100)


if __name__ == "__main__":
    images = ROOT / "docs" / "images"
    muscle_frame(images / "muscle_positioning_frame.png")
    frame("PAM/KneeTension-v0", images / "knee_tension_frame.png", 14.0, start="paper")
    frame("PAM/KneeWalk-v0", images / "knee_walk_frame.png", 10.6, start="heel_contact")
    elbow = images / "elbow_orthosis_frame.png"
    frame("PAM/ElbowOrthosis-v0", elbow, 9.4, reference="weight", motion="sines")
    papers_elbow.bundle_figure().savefig(images / "elbow_bundles.png", dpi=100)
    joint = images / "antagonistic_joint_frame.png"
    frame("PAM/AntagonisticJoint-v0", joint, 8.9, reference="sine", payload=0.5, disturbance=1.5)
    arm = images / "redundant_manipulator_frame.png"
    frame("PAM/RedundantManipulator-v0", arm, 23.2, reference="path_3")
    stride(images / "knee_stride.png")
    isobaric_figure().savefig(images / "isobaric_loops.png", dpi=90)
    pareto_figure().savefig(images / "effort_pareto.png", dpi=100)
    plots.step_figure().savefig(images / "joint_step.png", dpi=100)
    trapped_air_figure().savefig(images / "trapped_air.png", dpi=100)
