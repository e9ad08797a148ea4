"""Check of the policy-predictor contract, also for third-party controllers."""

import copy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Controller
from pam_envs.arrays import Array
from pam_envs.parameters import Signals


def check_controller(
    controller: Controller,
    observations: ArrayLike,
    action_signals: Signals,
) -> None:
    """Raise unless a controller satisfies the contract of a policy predictor.

    Parameters
    ----------
    controller : Controller
    observations : array_like, shape (n_steps, n_env, n_obs)
        As returned by an environment; at least four steps and two rows that differ.
    action_signals : Signals
        Those of the environment.

    Raises
    ------
    AssertionError
        If an action has another shape, type or range than the action space; a row depends on the
        other rows; ``episode_start`` does not reset its rows, or resets others; or the state that
        was passed in is changed.
    """
    seen = np.asarray(observations)
    _check_form(controller, seen, action_signals)
    _check_rows(controller, seen)
    _check_reset(controller, seen)


def _check_form(controller: Controller, seen: Any, action_signals: Signals) -> None:
    low, high = np.array([(s.encode(s.low), s.encode(s.high)) for s in action_signals]).T
    for sequence in (seen, seen[:, 0]):
        state = None
        for observation in sequence:
            action, state = controller.predict(observation, state)
            shape = (*np.shape(observation)[:-1], len(action_signals))
            assert action.shape == shape, f"the action has shape {action.shape}, not {shape}"
            assert action.dtype == np.float32, f"the action is of {action.dtype}, not float32"
            inside = (action >= low.astype("f4")) & (action <= high.astype("f4"))
            assert inside.all(), f"the action {action} is outside of its space"


def _check_rows(controller: Controller, seen: Any) -> None:
    starts = np.zeros(seen.shape[:2], bool)
    starts[0] = True
    starts[len(seen) // 2, -1] = True
    state, alone = None, [None] * seen.shape[1]
    for batch, start in zip(seen, starts, strict=True):
        actions, state = controller.predict(batch, state, start)
        for i, observation in enumerate(batch):
            action, alone[i] = controller.predict(observation, alone[i], start[i])
            assert np.array_equal(action, actions[i]), f"row {i} depends on the other rows"
    states = [_arrays(part) for part in alone]
    for whole, *parts in zip(_arrays(state), *states, strict=True):
        np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-12)


def _check_reset(controller: Controller, seen: Any) -> None:
    state, last = None, seen[-1]
    for batch in seen[:-1]:
        _, state = controller.predict(batch, state)
    before = copy.deepcopy(_arrays(state))
    start = np.arange(len(last)) == 1
    actions, _ = controller.predict(last, state, start)
    kept, _ = controller.predict(last, state)
    fresh, _ = controller.predict(last)
    assert np.array_equal(actions[start], fresh[start]), "episode_start does not reset its rows"
    assert np.array_equal(actions[~start], kept[~start]), "episode_start resets other rows"
    same = [np.array_equal(a, b) for a, b in zip(before, _arrays(state), strict=True)]
    assert all(same), "the controller changes the state that was passed in"


def _arrays(state: Any) -> list[Array]:
    if state is None:
        return []
    return [a for part in state for a in (_arrays(part) if isinstance(part, tuple) else [part])]
