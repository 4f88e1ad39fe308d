"""Bags for the tests, written by rosbags itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_123_456_789
"""An epoch in ns: a float64 cannot represent it."""

RATIO = 100.0

CONTROL = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "control_msgs/InterfaceValue[] interface_values\n"
    ),
    "control_msgs/msg/JointTrajectoryControllerState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint actual\n"
    ),
}

store = get_typestore(Stores.ROS2_JAZZY)
for kind, text in CONTROL.items():
    store.register(get_types_from_msg(text, kind))

Message = tuple[int, str, Any]
"""Stamp in ns, topic, message."""


def message(kind: str, **parts: Any) -> Any:
    return store.types[kind](**parts)


def header(stamp_ns: int) -> Any:
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    stamp = message("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id="")


def joint_state(stamp_ns: int, names: list[str], position: Any, effort: Any = ()) -> Any:
    return message(
        "sensor_msgs/msg/JointState",
        header=header(stamp_ns),
        name=names,
        position=np.array(position, dtype=np.float64),
        velocity=np.zeros(0),
        effort=np.array(effort, dtype=np.float64),
    )


def wrench(stamp_ns: int, torque_Nm: float) -> Any:
    def vector(z: float) -> Any:
        return message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=z)

    both = message("geometry_msgs/msg/Wrench", force=vector(0.0), torque=vector(torque_Nm))
    return message("geometry_msgs/msg/WrenchStamped", header=header(stamp_ns), wrench=both)


def write_bag(
    folder: Path,
    messages: Iterable[Message],
    storage: StoragePlugin = StoragePlugin.MCAP,
    mode: CompressionMode = CompressionMode.NONE,
    received_ns: Callable[[int], int] = lambda stamp_ns: stamp_ns + 200_000,
) -> Path:
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for stamp_ns, topic, one in sorted(messages, key=lambda each: received_ns(each[0])):
            kind = one.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], received_ns(stamp_ns), store.serialize_cdr(one, kind))
    return folder


def torque_at(seconds: npt.NDArray[np.float64] | float) -> Any:
    return 40.0 * np.sin(np.pi * np.asarray(seconds))


def lost_at(seconds: npt.NDArray[np.float64] | float) -> Any:
    torque = torque_at(seconds)
    return torque / 4e4 + 1e-4 * np.tanh(torque / 4)


def stamps(count: int, hertz: float, first_ns: int = START_NS) -> list[int]:
    return [first_ns + round(k * 1e9 / hertz) for k in range(count)]


def arm(count: int = 1000, hertz: float = 500.0) -> list[Message]:
    """Two joints whose output and motor sides are stated with the same stamps, torque as effort."""
    found: list[Message] = []
    for stamp_ns in stamps(count, hertz):
        seconds = (stamp_ns - START_NS) * 1e-9
        out = 0.2 * seconds
        angle, torque = out + float(lost_at(seconds)), float(torque_at(seconds))
        found += [
            (
                stamp_ns,
                "/joint_states",
                joint_state(stamp_ns, ["shoulder", "elbow"], [0.1, angle], [1.0, torque]),
            ),
            (
                stamp_ns,
                "/motor_states",
                joint_state(stamp_ns, ["elbow", "wrist"], [out * RATIO, 0.0]),
            ),
        ]
    return found
