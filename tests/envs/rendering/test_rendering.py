"""Pictures have the right size and content, and do not affect the simulation."""

import copy
import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from tests.envs.cases import IDS, actions_for

pytest.importorskip("pygame")
from pam_envs.envs.rendering.renderer import Canvas
from pam_envs.envs.rendering.scene import INK, PRESSURE, Axes, round_ticks, signed

EVERY = pytest.mark.parametrize("name", IDS)


@EVERY
def test_picture_shows_the_state(name: str) -> None:
    env = gym.make(name, render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (600, 800, 3)
    assert first.dtype == np.uint8
    assert np.all(first[-1] == first[-1, 0])  # no text is cut off at the lower edge
    assert np.array_equal(first, env.render())  # looking changes nothing
    for _ in range(60):
        env.step(env.action_space.high)
    later = env.render()
    assert np.mean(first != later) > 0.01
    left = np.any(first[:, :280] != later[:, :280], axis=2)
    assert left.sum() > 2000  # the plant itself has moved
    env.close()
    env.close()


@EVERY
def test_drawing_changes_no_bit(name: str) -> None:
    plain, drawn = gym.make(name), gym.make(name, render_mode="rgb_array")
    plain.reset(seed=3)
    drawn.reset(seed=3)
    for action in actions_for(plain.action_space, 40):
        a, b = plain.step(action), drawn.step(action)
        drawn.render()
        assert np.array_equal(a[0], b[0])
        assert a[1:4] == b[1:4]
        assert dict(a[4]) == dict(b[4])
    drawn.close()


@EVERY
def test_human_mode_opens_a_window(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gym.make(name, render_mode="human")
    env.reset(seed=0)
    for action in actions_for(env.action_space, 12):
        env.step(action)
    assert env.render() is None
    env.close()


@EVERY
def test_window_stays_closed_after_its_close_button(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gym.make(name, render_mode="human")
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (800, 600)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for _ in range(4):  # the episode continues without frames
        _, _, terminated, _, _ = env.step(env.action_space.high)
        assert not terminated
        assert not pygame.display.get_init()
    env.close()


HEADLESS = """
import os, sys
import gymnasium as gym
import pam_envs
assert "pygame" not in sys.modules
before = dict(os.environ)
for name in sys.argv[1:]:
    env = gym.make(name, render_mode="rgb_array")
    env.reset(seed=0)
    assert env.render().shape == (600, 800, 3)
import pygame
assert not pygame.display.get_init()
assert dict(os.environ) == before
"""


def test_pictures_need_no_display_and_change_no_environment_variable() -> None:
    variables = {k: v for k, v in os.environ.items() if not k.startswith("SDL_")}
    variables["DISPLAY"] = ":none"  # a display that cannot be opened
    subprocess.run([sys.executable, "-c", HEADLESS, *IDS], env=variables, check=True)


@EVERY
def test_rendering_warns_without_a_mode_and_raises_before_reset(name: str) -> None:
    env = gym.make(name).unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None
    env = gym.make(name, render_mode="rgb_array").unwrapped
    with pytest.raises(gym.error.ResetNeeded):
        env.render()


@EVERY
def test_copy_and_closed_environment_draw_the_current_state(name: str) -> None:
    env = gym.make(name, render_mode="rgb_array").unwrapped
    env.reset(seed=0)
    for action in actions_for(env.action_space, 80):
        env.step(action)
    twin = copy.deepcopy(env)
    picture = twin.render()
    assert np.array_equal(picture[:, :280], env.render()[:, :280])  # the plant as it is now
    env.close()
    assert np.array_equal(env.render(), picture)


@EVERY
def test_rows_of_a_batch_are_drawn_as_single_environments(name: str) -> None:
    arguments = {"episode_seconds": 0.2, "render_mode": "rgb_array"}
    batch = gym.make_vec(name, 2, vectorization_mode="vector_entry_point", **arguments)
    with pytest.raises(gym.error.ResetNeeded):
        batch.render()
    single = gym.make(name, **arguments)
    batch.reset(seed=6)
    single.reset(seed=7)
    for action in actions_for(single.action_space, 30):  # through the end of an episode
        batch.step(np.stack([0.5 * action, action]))
        _, _, terminated, truncated, _ = single.step(action)
        if terminated or truncated:
            single.reset()
    first, second = batch.render()
    assert np.array_equal(second, single.render())
    assert not np.array_equal(first, second)
    batch.close()


def test_batch_has_no_window_and_needs_info_for_pictures() -> None:
    name = "PAM/MusclePositioning-v0"
    with pytest.raises(ValueError, match="'human' is not known"):
        gym.make_vec(name, 2, vectorization_mode="vector_entry_point", render_mode="human")
    with pytest.raises(ValueError, match="leave info=True"):
        gym.make_vec(
            name, 2, vectorization_mode="vector_entry_point", render_mode="rgb_array", info=False
        )


@pytest.mark.parametrize("load", [0.0, 0.3, 5.0])
def test_every_load_can_be_drawn(load: float) -> None:
    pictures = []
    for action in (-1.0, 1.0):
        env = gym.make("PAM/MusclePositioning-v0", render_mode="rgb_array", load=load)
        env.reset(seed=1)
        for _ in range(100):
            _, _, terminated, _, info = env.step(np.array([2 * action], np.float32))
            assert not terminated
        assert info["saturated"] == 1.0
        pictures.append(env.render())
        env.close()
    assert (pictures[0][60:, :320] != pictures[1][60:, :320]).any(axis=2).sum() > 5000


def test_torque_beyond_the_scale_has_a_tip() -> None:
    from pam_envs.envs.rendering import renderer, scene

    pictures = []
    for torque in (30.0, 30.1, -30.1):
        canvas = renderer.Canvas()
        canvas.clear()
        scene.torque_bars(canvas, [("", torque, scene.INK)], 30.0, 100.0, "")
        picture = canvas.pygame.surfarray.array3d(canvas.picture())
        pictures.append([np.any(picture[x, 100:112] == scene.INK[0]) for x in (117, 274)])
    assert pictures == [[False, False], [False, True], [True, False]]


def test_number_that_rounds_to_zero_has_no_sign() -> None:
    assert [signed(v, 2) for v in (-0.004, 0.004, -0.006, 12.0)] == [
        "0.00",
        "0.00",
        "-0.01",
        "+12.00",
    ]


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0.0, 8.0, [0.0, 2.0, 4.0, 6.0, 8.0]),
        (0.0, 5.0, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]),
        (3.5, 11.5, [4.0, 6.0, 8.0, 10.0]),
        (0.0, 0.5, [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]),
    ],
)
def test_ticks_are_round(low: float, high: float, ticks: list[float]) -> None:
    assert round_ticks(low, high) == ticks


def test_curve_outside_its_plot_is_cut_off() -> None:
    canvas = Canvas()
    canvas.clear()
    box = (100, 100, 200, 100)
    Axes(canvas, box, (0.0, 1.0), (0.0, 1.0)).curve([(0.0, 0.5), (0.5, 1e9), (2.0, 0.5)], INK, 2)
    drawn = np.argwhere(canvas.pygame.surfarray.array3d(canvas.picture())[..., 0] < 200)
    assert len(drawn) > 50
    assert drawn.min(axis=0).tolist() >= [98, 98]
    assert drawn[:, 0].max() < 302
    along_edge = (drawn[:, 1] < 103).sum()
    assert along_edge < 20


@pytest.mark.parametrize(("seconds", "share"), [(5.0, 1.0), (20.0, 0.625)])
def test_time_axis_is_not_longer_than_the_episode(seconds: float, share: float) -> None:
    env = gym.make("PAM/KneeWalk-v0", render_mode="rgb_array", episode_seconds=seconds).unwrapped
    env.reset(seed=0)
    for _ in range(round(5.0 / env.control_period)):
        env.step(np.zeros(env.action_space.shape, np.float32))
    picture = env.render()
    left, top, width, height = 360, 524, 410, 36  # the pressure strip
    green = np.all(np.abs(picture[top : top + height].astype(int) - PRESSURE) < 40, axis=2)
    reached = np.flatnonzero(green.any(axis=0)).max()
    assert reached == pytest.approx(left + share * width, abs=3)
    env.close()
