"""Channels of ROS 2 bags (MCAP or SQLite): ``/topic/field``, ``/joint_states/position[0]``."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.data.recording.formats.signals import (
    ChannelError,
    Signal,
    check_count,
    column,
    failures_named,
    missing_package,
    unknown,
)
from pam_envs.wording import near, shown

KIND = "ROS 2"
PART = re.compile(r"([A-Za-z_]\w*)((?:\[\d{1,6}\])*)")
NANO = 1e-9


@contextmanager
def open_bag(path: Path) -> Iterator["BagLog"]:
    """Open a bag: a file of MCAP or SQLite, or the folder of a bag."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing_package(str(path), KIND, "rosbags") from error
    with failures_named(str(path), KIND):
        store = get_typestore(Stores.LATEST)  # for bags without definitions of their messages
        with AnyReader([path], default_typestore=store) as reader:
            yield BagLog(reader)


class BagLog:
    """Topics of an open bag."""

    def __init__(self, reader: Any) -> None:
        self.reader = reader
        self.held: dict[str, list[tuple[int, Any]]] = {}

    def names(self) -> Iterable[str]:
        """Return the names of the topics."""
        return sorted(self.reader.topics)

    def read(self, name: str) -> Signal:
        """Return a field of the messages of a topic, with their clock.

        The clock is the stamp of the header where every message has one, otherwise the time at
        which the messages were recorded, from the start of the bag.
        """
        topics = [t for t in self.reader.topics if name == t or name.startswith(f"{t}/")]
        if not topics:
            raise unknown(name, self.names())
        topic = max(topics, key=len)
        path = name[len(topic) + 1 :]
        messages = self._messages(topic)
        if not messages:
            raise ChannelError(f"topic {shown(topic)} has no messages")
        values = column(name, [field_of(m, path, name) for _, m in messages], None, f"{name}[0]")
        stamps = np.array([stamp_of(m) for _, m in messages], np.int64)
        if not stamps.all():
            stamps = np.array([logged for logged, _ in messages], np.int64)
        time = (stamps - self.reader.start_time) * NANO
        order = np.argsort(time, kind="stable")
        return Signal(values[order], "", time[order])

    def _messages(self, topic: str) -> list[tuple[int, Any]]:
        if topic not in self.held:
            of = [c for c in self.reader.connections if c.topic == topic]
            check_count(topic, sum(c.msgcount for c in of))
            self.held[topic] = [
                (time, self.reader.deserialize(raw, connection.msgtype))
                for connection, time, raw in self.reader.messages(connections=of)
            ]
        return self.held[topic]


def field_of(message: Any, path: str, name: str) -> Any:
    """Return a number or a word of a message by the names of fields, with indices from 0."""
    found = message
    for part in path.split("/") if path else ():
        match = PART.fullmatch(part)
        if match is None or match[1] not in fields_of(found):
            names = fields_of(found)
            raise ChannelError(f"no field {shown(part)} in {shown(name)}{near(part, names)}")
        found = getattr(found, match[1])
        for index in re.findall(r"\d+", match[2]):
            if not hasattr(found, "__len__") or not int(index) < len(found):
                raise ChannelError(f"no element [{index}] in {shown(name)}")
            found = found[int(index)]
    if not isinstance(found, (int, float, str, np.generic)):
        inner = fields_of(found)
        what = f"one of its fields: {', '.join(inner)}" if inner else "an element: [0]"
        raise ChannelError(f"channel {shown(name)} is no number; select {what}")
    return found


def fields_of(message: Any) -> list[str]:
    """Return the names of the fields of a message."""
    return [n for n in getattr(message, "__dataclass_fields__", {}) if not n.startswith("__")]


def stamp_of(message: Any) -> int:
    """Return the time stamp of a message's header [ns], 0 without one."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
