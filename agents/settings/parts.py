"""Parts of a training's settings, each with its bounds."""

from dataclasses import dataclass, field
from typing import Any, Literal

from agents.settings.schema import choice, number


@dataclass(frozen=True)
class Network:
    """Network of the policy; ``hidden`` are widths of the layers of policy and critic alike."""

    hidden: tuple[int, ...] = number((64, 64), 1, 4096)
    activation: str = choice("tanh", "tanh", "relu", "elu")
    # PPO: logarithm of the initial standard deviation of the action, in its range [-1, 1]
    log_std_init: float = number(0.0, -10.0, 3.0)
    # "a - b" with names of inputs: fixed extra inputs gain * (a - b), which scale up a tracking
    # error of a few hundredths of the range; inputs are the signals, a residual's
    # controller_<action>, and <signal>@1 for the history one period ago
    differences: tuple[str, ...] = ()
    gain: float = number(10.0, 0.0, 1e4)
    # PPO: a linear path from the inputs to the action beside the layers, as in structured control
    # nets (Srouji, Zhang, Salakhutdinov, ICML 2018)
    linear: bool = False
    # PPO with linear: a signal for each action, whose value the untrained policy returns, so that
    # learning starts from "keep the last setpoint"
    hold: tuple[str, ...] = ()


@dataclass(frozen=True)
class Normalize:
    """Running normalisation during training; the exported policy contains it."""

    observation: bool = False
    reward: bool = True
    clip_observation: float = number(10.0, 0.1, 1e6)
    clip_reward: float = number(10.0, 0.1, 1e6)


@dataclass(frozen=True)
class _OnPolicy:
    """Settings of PPO and recurrent PPO, with the names of stable-baselines3.

    The learning rate changes linearly from its first to its last value over the training. In the
    first ``warm_up`` rollouts the critic learns alone, so that an untrained critic does not spoil a
    policy that starts as a controller (silver2018); in as many rollouts after them the rate rises
    from 0.
    """

    n_steps: int = number(32, 2, 100_000)
    batch_size: int = number(2048, 2, 1_000_000)
    n_epochs: int = number(4, 1, 100)
    learning_rate: tuple[float, float] = number((3e-4, 3e-4), 0.0, 1.0)
    gamma: float = number(0.97, 0.0, 1.0)
    gae_lambda: float = number(0.95, 0.0, 1.0)
    clip_range: float = number(0.2, 1e-3, 10.0)
    ent_coef: float = number(0.0, 0.0, 10.0)
    vf_coef: float = number(0.5, 0.0, 100.0)
    max_grad_norm: float = number(0.5, 1e-3, 1e3)
    target_kl: float | None = number(None, 1e-6, 10.0)
    warm_up: int = number(0, 0, 10_000)


@dataclass(frozen=True)
class PPO(_OnPolicy):
    """Proximal policy optimisation (schulman2017)."""


@dataclass(frozen=True)
class RecurrentPPO(_OnPolicy):
    """PPO with an LSTM before the layers (sb3-contrib).

    Without ``critic_lstm`` the critic has no LSTM of its own and sees the present inputs only.
    """

    n_steps: int = number(64, 2, 100_000)
    lstm_size: int = number(32, 1, 1024)
    critic_lstm: bool = True


@dataclass(frozen=True)
class _OffPolicy:
    """Settings of SAC and TQC, with the names of stable-baselines3."""

    buffer_size: int = number(200_000, 100, 100_000_000)
    learning_starts: int = number(5_000, 0, 100_000_000)
    batch_size: int = number(256, 1, 1_000_000)
    learning_rate: tuple[float, float] = number((1e-3, 1e-3), 0.0, 1.0)
    gamma: float = number(0.97, 0.0, 1.0)
    tau: float = number(0.005, 0.0, 1.0)
    train_freq: int = number(1, 1, 100_000)
    gradient_steps: int = number(8, 1, 100_000)
    ent_coef: float | Literal["auto"] = number("auto", 0.0, 100.0)


@dataclass(frozen=True)
class SAC(_OffPolicy):
    """Soft actor-critic (haarnoja2018)."""


@dataclass(frozen=True)
class TQC(_OffPolicy):
    """Truncated quantile critics (kuznetsov2020)."""

    top_quantiles_to_drop_per_net: int = number(2, 0, 24)


@dataclass(frozen=True)
class History:
    """Past signals as inputs: with hysteresis a single observation is not the full state."""

    frames: int = number(0, 0, 256)  # past values of each signal, 0 for none
    # control periods between them: the oldest value is frames * stride periods old
    stride: int = number(1, 1, 256)
    signals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Gauge:
    """Size of a residual's correction in proportion to the recent error.

    A controller with an exact model errs by less than the exploration noise that other plants
    need; a correction in proportion to the error leaves it as it is. Each error is smoothed over
    ``smooth_seconds``, which removes the sensor's noise, and the mean of its absolute values over
    ``mean_seconds``, as a share of ``full``, multiplies the correction; it is at least ``least``
    and at most 1.
    """

    errors: tuple[str, ...] = ()  # "a - b" with names of signals; none for corrections of any size
    full: float = number(0.05, 1e-6, 2.0)  # mean error, in the signals' range [-1, 1]
    least: float = number(0.02, 0.0, 1.0)
    smooth_seconds: float = number(0.1, 0.0, 10.0)
    mean_seconds: float = number(1.0, 0.0, 100.0)


@dataclass(frozen=True)
class Residual:
    """A policy that corrects a controller: controller's action + ``scale`` * policy, clipped.

    The controller, by its name in :data:`baselines.core.catalogue.CONTROLLERS`, is built from the
    nominal plant, and its action is an input of the policy. ``scale`` is the largest correction, as
    a share of half the action's range.
    """

    controller: str = ""
    scale: float = number(0.1, 1e-4, 1.0)
    gauge: Gauge = field(default_factory=Gauge)


@dataclass(frozen=True)
class Plants:
    """Plants of the training.

    With ``randomize`` every episode draws the assumed parameters within their declared ranges. The
    rows are divided among the models of ``hysteresis``; none for the environment's default.
    """

    randomize: bool = False
    hysteresis: tuple[str, ...] = ()


@dataclass(frozen=True)
class Cost:
    """Reward of the training, from the reward terms of the environment.

    The environments cost an error linearly and the leaderboard scores its RMS. ``quadratic`` makes
    the cost of each error quadratic up to that many of its scales and linear beyond (Huber), with
    the environment's ``reward/ended`` scaled so that ending an episode still never pays.
    """

    quadratic: float = number(0.0, 0.0, 1e4)  # 0: linear everywhere, as in the environment
    # cost of a change of the applied action over its whole range in one period; quadratic
    action_rate: float = number(0.0, 0.0, 1e5)
    # cost of each control period that a limit cut off, where the environment has no reward/ended
    ended: float = number(0.0, 0.0, 1e5)
    # start [s] of each episode without a cost of errors, as on the leaderboard: from there no
    # controller reaches the reference, and its errors outweigh all later ones
    settle_seconds: float = number(0.0, 0.0, 1e4)
    # divide by the mean cost of the errors of each kind of rows so far, so that kinds with large
    # errors do not outweigh those with small ones
    relative: bool = False


@dataclass(frozen=True)
class Privileged:
    """Asymmetric actor-critic (Pinto et al., RSS 2018).

    With ``critic``, the critic of PPO also sees the plant's parameters that differ among episodes,
    normalised by their ranges, and the noise-free state; the actor and its file do not.
    """

    critic: bool = False


@dataclass(frozen=True)
class Widening:
    """Automatic domain randomization (Akkaya et al., arXiv:1910.07113).

    Every drawn parameter starts with the share ``start`` of its range around the nominal value.
    Where the mean cost of ``episodes`` episodes in the outer ``edge`` of the present range is at
    most ``ratio`` times that of the rows with nominal plants, this end moves outwards by ``step``
    of the declared range, up to its end. Ranges never narrow.
    """

    start: float = number(1.0, 0.01, 1.0)  # 1: the whole ranges from the beginning
    step: float = number(0.1, 0.001, 1.0)
    ratio: float = number(2.0, 0.1, 100.0)
    episodes: int = number(32, 2, 1000)
    edge: float = number(0.2, 0.01, 0.5)


@dataclass(frozen=True)
class Adaptation:
    """Rapid motor adaptation (Kumar et al., RSS 2021), in the form of an imitated teacher.

    The policy that PPO trains, the teacher, sees the plant's parameters that differ among episodes.
    After that a student with the settings' history imitates its actions for ``steps`` control
    periods on the states that the student visits (DAgger, Ross et al., AISTATS 2011), and is the
    exported policy.
    """

    steps: int = number(0, 0, 10**12)  # 0: no teacher
    n_steps: int = number(32, 1, 100_000)  # control periods of each row between updates
    n_epochs: int = number(4, 1, 100)
    batch_size: int = number(4096, 2, 1_000_000)
    learning_rate: tuple[float, float] = number((1e-3, 5e-5), 0.0, 1.0)
    # share of the steps in which some rows follow the teacher, from all rows to none
    guided: float = number(0.2, 0.0, 1.0)


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of the policy during training, on tuning seeds (:mod:`agents.settings.seeds`)."""

    # control periods of training between evaluations; 0 for the first and the last only
    interval: int = number(0, 0, 10**12)
    # episodes per evaluation, divided among the kinds of rows, on the same seeds; 0 for no
    # evaluation: then the last policy is exported, otherwise the best
    episodes: int = number(0, 0, 1000)
    settle_seconds: float = number(2.0, 0.0, 1e4)  # start [s] of each episode that is excluded
    gate: tuple[str, ...] = ()  # entries of info that are all 1 at evaluated instants
    # the error's RMS, the geometric mean of the kinds' RMS (which weights ratios), or the return,
    # for tasks with more than one error
    objective: str = choice("rms", "rms", "geometric", "return")
    # arguments of the environment that differ from the training's
    env_kwargs: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Search:
    """Budget of the search that chose the settings, for fair comparisons."""

    # settings tried, None if they were set by hand and not counted
    trials: int | None = number(None, 0, 10**6)
    earlier: int = number(0, 0, 10**6)  # tried by the searches that it started from
    steps: int = number(0, 0, 10**12)  # control periods of each training of a trial
    seed: int = number(0, 0, 2**31)
    note: str = "by hand"  # method
