"""ROS 2 bags: one joint at a time, joined on request, in whole nanoseconds, within bounds."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import DATA

pytest.importorskip("rosbags", reason="no rosbags: pip install 'lostmotion[ros]'")

from bag_files import (
    RATIO,
    START_NS,
    Message,
    arm,
    header,
    joint_state,
    lost_at,
    message,
    stamps,
    store,
    torque_at,
    wrench,
    write_bag,
)
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2.storage_mcap import zstd

from lostmotion.cli import main
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, read_campaign
from lostmotion.recordings.bags import IDENTIFIER, list_columns
from lostmotion.recordings.compressed import INFLATED_LEAST

DRIVE = DATA / "drives" / "size_25.toml"
OUTPUT = {"/joint_states/position/elbow": "output_angle_rad"}
INPUT = {"/motor_states/position/elbow": "input_angle_rad"}
EFFORT = {"/joint_states/effort/elbow": "torque_Nm"}
SENSOR = {"/ft/wrench/torque/z": "torque_Nm"}
LINEAR_MS = 1.0
"""Step of the torque sensor, which is twice as fast as the joints."""


def read(bag: Path, *maps: dict[str, str], **more: Any) -> Campaign:
    mapping = {column: name for one in maps for column, name in one.items()}
    return read_campaign(bag, ratio=RATIO, mapping=mapping, **more)


def sensor(count: int, hertz: float, offset_ns: int = 137_000) -> list[Message]:
    """Torque sensor with its own clock."""
    found = []
    for stamp_ns in stamps(count, hertz, START_NS + offset_ns):
        seconds = (stamp_ns - START_NS) * 1e-9
        found.append((stamp_ns, "/ft", wrench(stamp_ns, float(torque_at(seconds)))))
    return found


@pytest.mark.parametrize(
    ("storage", "mode"),
    [
        (storage, mode)
        for storage in StoragePlugin
        for mode in CompressionMode
        # A .db3 has no compression of its own.
        if (storage, mode) != (StoragePlugin.SQLITE3, CompressionMode.STORAGE)
    ],
)
def test_a_joint_is_read_whatever_the_storage_and_its_compression(
    tmp_path: Path, storage: StoragePlugin, mode: CompressionMode
) -> None:
    bag = write_bag(tmp_path / "bag", arm(), storage, mode)
    run = read(bag, OUTPUT, INPUT, EFFORT).runs[0]
    assert run.label == "bag"
    seconds = run.time_s
    np.testing.assert_allclose(seconds, np.arange(1000) / 500, atol=1e-12)
    np.testing.assert_allclose(run.torque_Nm, torque_at(seconds), atol=1e-9)
    lost = run.lost_motion_rad - run.lost_motion_rad[0]
    np.testing.assert_allclose(lost, lost_at(seconds) - lost_at(0.0), atol=1e-9)


def test_a_storage_alone_and_a_folder_of_bags_are_read(tmp_path: Path) -> None:
    first = write_bag(tmp_path / "runs" / "run_2", arm(300))
    write_bag(tmp_path / "runs" / "run_10", arm(200), StoragePlugin.SQLITE3)
    alone = read(first / "run_2.mcap", OUTPUT, INPUT, EFFORT)
    assert [len(run) for run in alone.runs] == [300]
    both = read(tmp_path / "runs", OUTPUT, INPUT, EFFORT)
    assert [(run.label, len(run)) for run in both.runs] == [("run_2", 300), ("run_10", 200)]


def test_without_a_map_topics_fields_and_joints_are_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", [*arm(), *sensor(2000, 1000)])
    assert main(["check", str(bag)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    for part in (
        "a ROS 2 bag, and no map that names its columns",
        "/joint_states/{position,effort}/{shoulder,elbow} (sensor_msgs/msg/JointState, 500 Hz)",
        "/motor_states/position/{elbow,wrist} (sensor_msgs/msg/JointState, 500 Hz)",
        "/ft/wrench/{force,torque}/{x,y,z} (geometry_msgs/msg/WrenchStamped, 1000 Hz)",
    ):
        assert part in said
    # The message states the missing column and the existing ones.
    words = [f"{column}={name}" for column, name in OUTPUT.items()]
    assert main(["check", str(bag), "--map", *words]) == 2
    said = capsys.readouterr().err
    assert "torque_Nm" in said
    assert "/ft/wrench/{force,torque}/{x,y,z}" in said


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("/joint_states/position/elbwo", "did you mean '/joint_states/position/elbow'?"),
        ("/joint_state/position/elbow", "no such column (there are /motor_states/position/elbow"),
    ],
)
def test_a_missing_column_is_refused_with_the_list_of_columns(
    tmp_path: Path, column: str, expected: str
) -> None:
    bag = write_bag(tmp_path / "bag", arm(50))
    with pytest.raises(InputError) as error:
        read(bag, {column: "output_angle_rad"}, INPUT, EFFORT)
    assert expected in str(error.value)


def test_signs_divisors_and_units_of_a_map_hold_for_bags(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", arm(100))
    plain = read(bag, OUTPUT, INPUT, EFFORT).runs[0]
    turned = read(bag, OUTPUT, INPUT, {"/joint_states/effort/elbow": "-torque_mNm/2"}).runs[0]
    np.testing.assert_allclose(turned.torque_Nm, -plain.torque_Nm / 2000, rtol=1e-12)


def test_topics_of_other_rates_are_refused_until_they_are_to_be_joined(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", [*arm(), *sensor(2100, 1000)])
    words = [f"{c}={n}" for one in (OUTPUT, INPUT, SENSOR) for c, n in one.items()]
    command = ["check", str(bag), "--ratio", "100", "--map", *words]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert "2 clocks: /joint_states at 500 Hz, /ft at 1000 Hz, expected --join" in said
    assert main([*command, "--join", "linear"]) == 0
    out = capsys.readouterr().out
    assert "linear from 1000 Hz to the rows of /joint_states at 500 Hz; largest gap 1 ms" in out
    assert main(["compare", str(DRIVE), str(bag), "--map", *words, "--join", "nearest"]) == 0
    assert "nearest from 1000 Hz" in capsys.readouterr().out


@pytest.mark.parametrize(("how", "wrong_Nm"), [("linear", 1e-4), ("nearest", 0.07)])
def test_joined_rows_are_those_of_the_slowest_and_hold_the_torque_of_their_moment(
    tmp_path: Path, how: Any, wrong_Nm: float
) -> None:
    bag = write_bag(tmp_path / "bag", [*arm(), *sensor(2100, 1000)])
    campaign = read(bag, OUTPUT, INPUT, SENSOR, join=how)
    run = campaign.runs[0]
    assert len(run) == 999  # the torque begins after the first row
    seconds = run.time_s + 1 / 500
    # nearest: half a step of the sensor at 40 pi N m/s
    assert np.max(np.abs(run.torque_Nm - torque_at(seconds))) < wrong_Nm
    kinds = {finding.kind: finding for finding in campaign.findings}
    assert kinds["outside"].count == 1
    assert kinds["joined"].count == 999


def test_a_slow_temperature_does_not_thin_the_rows_and_is_no_other_clock(tmp_path: Path) -> None:
    warm = [
        (stamp_ns, "/temp", message("std_msgs/msg/Float64", data=25.0 + 0.5 * k))
        for k, stamp_ns in enumerate(stamps(4, 1.0))
    ]
    bag = write_bag(tmp_path / "bag", [*arm(), *warm])
    campaign = read(bag, OUTPUT, INPUT, EFFORT, {"/temp/data": "temperature_C"}, join="linear")
    run = campaign.runs[0]
    assert len(run) == 1000
    np.testing.assert_allclose(run.columns["temperature"], 25 + 0.5 * run.time_s, atol=1e-6)
    clock = next(finding for finding in campaign.findings if finding.kind == "clock")
    assert "times of receipt minus 0.2 ms" in clock.action
    # Jitter of the receipt does not affect messages with stamps.
    np.testing.assert_allclose(np.diff(run.time_s), 1 / 500, atol=1e-12)


def test_where_a_topic_pauses_there_is_no_value(tmp_path: Path) -> None:
    quiet = [one for one in sensor(2100, 1000) if not 500 <= (one[0] - START_NS) / 1e6 < 900]
    bag = write_bag(tmp_path / "bag", [*arm(), *quiet])
    campaign = read(bag, OUTPUT, INPUT, SENSOR, join="linear")
    joined = next(finding for finding in campaign.findings if finding.kind == "joined")
    assert "largest gap 1 ms; no value in 201 rows where it pauses" in joined.action
    assert len(campaign.runs[0]) == 798


def test_an_encoder_that_begins_anew_is_not_read_between(tmp_path: Path) -> None:
    messages: list[Message] = []
    for stamp_ns in stamps(1000, 500):
        seconds = (stamp_ns - START_NS) * 1e-9
        at = joint_state(stamp_ns, ["elbow"], [0.2 * seconds + float(lost_at(seconds))])
        messages.append((stamp_ns, "/joint_states", at))
    for stamp_ns in stamps(4200, 2000, START_NS - 50_111):
        angle = np.remainder(20.0 * (stamp_ns - START_NS) * 1e-9, 2 * np.pi)
        messages.append((stamp_ns, "/motor_states", joint_state(stamp_ns, ["elbow"], [angle])))
    bag = write_bag(tmp_path / "bag", [*messages, *sensor(2100, 1000, -1_000_000)])
    run = read(bag, OUTPUT, INPUT, SENSOR, join="linear").runs[0]
    lost = run.lost_motion_rad - run.lost_motion_rad[0]
    # A row beside the wrap has the nearest sample: 0.25 ms of 20 rad/s divided by the ratio.
    assert np.max(np.abs(lost - lost_at(run.time_s) + lost_at(run.time_s[0]))) < 6e-5


def test_several_publishers_of_one_topic_are_distinguished_by_their_joints(tmp_path: Path) -> None:
    hand = [
        (stamp_ns, "/joint_states", joint_state(stamp_ns, ["finger"], [0.5]))
        for stamp_ns in stamps(40, 20, START_NS + 333)
    ]
    bag = write_bag(tmp_path / "bag", [*arm(), *hand])
    assert len(read(bag, OUTPUT, INPUT, EFFORT).runs[0]) == 1000


def test_states_of_controllers_are_read_joint_by_joint(tmp_path: Path) -> None:
    messages: list[Message] = []
    for stamp_ns in stamps(100, 100):
        seconds = (stamp_ns - START_NS) * 1e-9
        angle, torque = float(lost_at(seconds)), float(torque_at(seconds))
        values = [
            message(
                "control_msgs/msg/InterfaceValue",
                interface_names=["position", "effort"],
                values=np.array(pair),
            )
            for pair in ([0.0, 0.0], [angle, torque])
        ]
        state = message(
            "control_msgs/msg/DynamicJointState",
            header=header(stamp_ns),
            joint_names=["shoulder", "elbow"],
            interface_values=values,
        )
        point = message(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=np.array([0.0, 7.0]),
            velocities=np.zeros(0),
            accelerations=np.zeros(0),
            effort=np.zeros(0),
            time_from_start=message("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
        )
        controller = message(
            "control_msgs/msg/JointTrajectoryControllerState",
            header=header(stamp_ns),
            joint_names=["shoulder", "elbow"],
            actual=point,
        )
        messages += [(stamp_ns, "/dynamic", state), (stamp_ns, "/controller", controller)]
    for storage in StoragePlugin:
        bag = write_bag(tmp_path / storage.name, messages, storage)
        listed = list_columns(bag)
        assert "/dynamic/interface_values/{shoulder,elbow}/{position,effort}" in listed
        assert "/controller/actual/positions/{shoulder,elbow}" in listed
        run = read(
            bag,
            {"/dynamic/interface_values/elbow/position": "output_angle_rad"},
            {"/controller/actual/positions/elbow": "input_angle_rad"},
            {"/dynamic/interface_values/elbow/effort": "torque_Nm"},
        ).runs[0]
        np.testing.assert_allclose(run.torque_Nm, torque_at(run.time_s), atol=1e-9)
        np.testing.assert_array_equal(run.columns["input_angle"], 7.0)


def test_the_clock_is_the_headers_until_the_time_of_receipt_is_asked_for(tmp_path: Path) -> None:
    def late(stamp_ns: int) -> int:
        return stamp_ns + 5_000_000 + 400_000 * (stamp_ns // 1000 % 3)

    bag = write_bag(tmp_path / "bag", arm(200), received_ns=late)
    by_header = read(bag, OUTPUT, INPUT, EFFORT).runs[0]
    np.testing.assert_allclose(np.diff(by_header.time_s), 1 / 500, atol=1e-12)
    received = read(bag, OUTPUT, INPUT, EFFORT, {"receive_time": "time_s"}).runs[0]
    assert np.ptp(np.diff(received.time_s)) > 1e-4


def test_stamps_of_another_clock_are_reported(tmp_path: Path) -> None:
    def received(stamp_ns: int) -> int:
        return stamp_ns + 200_000

    shifted = []
    for stamp_ns, topic, _ in sensor(2100, 1000):
        seconds = (stamp_ns - START_NS) * 1e-9
        shifted.append((stamp_ns, topic, wrench(stamp_ns - 40_000_000, float(torque_at(seconds)))))
    bag = write_bag(tmp_path / "bag", [*arm(), *shifted], received_ns=received)
    campaign = read(bag, OUTPUT, INPUT, SENSOR, join="linear")
    delay = next(finding for finding in campaign.findings if finding.kind == "delay")
    assert (delay.column, delay.action.split(":")[0]) == (
        "/ft",
        "stamps 40 ms older at receipt than those of /joint_states",
    )
    apart = [
        (ns, topic, wrench(ns - 10**12, 1.0)) for ns, topic, _ in sensor(100, 1000)
    ]  # a clock that was set by hand
    bag = write_bag(tmp_path / "apart", [*arm(), *apart])
    with pytest.raises(InputError, match=r"no common time: .*--map receive_time=time_s"):
        read(bag, OUTPUT, INPUT, SENSOR, join="linear")


def test_a_nanosecond_survives(tmp_path: Path) -> None:
    messages = [
        (START_NS + k, "/joint_states", joint_state(START_NS + k, ["elbow"], [0.1], [1.0]))
        for k in (0, 1, 3, 1_000_000_007, 3_000_000_000_000_001)
    ]
    bag = write_bag(tmp_path / "bag", messages)
    mapping = {"/joint_states/position/elbow": "lost_motion_rad", **EFFORT}
    found = read(bag, mapping).runs[0].time_s
    assert found.tolist() == [0.0, 1e-9, 3e-9, 1.000000007, 3000000.000000001]


def test_without_rosbags_one_line_states_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", arm(10))
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    assert main(["check", str(bag)]) == 2
    assert "the package rosbags is not installed, expected pip install 'lostmotion[ros]'" in (
        capsys.readouterr().err
    )


def test_what_a_bag_inflates_to_is_bounded(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", arm(50), StoragePlugin.MCAP, CompressionMode.FILE)
    storage = next(bag.glob("*.zstd"))
    storage.write_bytes(zstd.compress(b"\0" * (1 << 28)))
    assert storage.stat().st_size < 1 << 20
    with pytest.raises(InputError, match=f"contains more than {INFLATED_LEAST >> 20} MiB"):
        read(bag, OUTPUT, INPUT, EFFORT)
    shutil.rmtree(bag)
    big = message("std_msgs/msg/UInt8MultiArray", layout=empty_layout(), data=zeros(1 << 27))
    one = [(START_NS, "/picture", big), *arm(50)]
    bag = write_bag(tmp_path / "chunks", one, StoragePlugin.MCAP, CompressionMode.STORAGE)
    assert sum(file.stat().st_size for file in bag.iterdir()) < 1 << 20
    with pytest.raises(InputError, match=f"contains more than {INFLATED_LEAST >> 20} MiB"):
        list_columns(bag)
    bag = write_bag(tmp_path / "messages", one, StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    with pytest.raises(InputError, match=f"contains more than {INFLATED_LEAST >> 20} MiB"):
        list_columns(bag)


def empty_layout() -> Any:
    return message("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)


def zeros(size: int) -> Any:
    return np.zeros(size, dtype=np.uint8)


@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_damaged_bags_are_one_line(
    tmp_path: Path, storage: StoragePlugin, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", arm(100), storage)
    file = next(name for name in bag.iterdir() if name.suffix in (".mcap", ".db3"))
    whole = file.read_bytes()
    rng = np.random.default_rng(7)
    words = [f"{c}={n}" for one in (OUTPUT, INPUT, EFFORT) for c, n in one.items()]
    refused = 0
    for number in range(40):
        damaged = bytearray(whole)
        if number % 4 == 0:
            damaged = damaged[: int(rng.integers(0, len(whole)))]
        else:
            for place in rng.integers(0, len(whole), 1 + 20 * (number % 4)):
                damaged[place] = int(rng.integers(0, 256))
        file.write_bytes(bytes(damaged))
        status = main(["check", str(bag), "--ratio", "100", "--map", *words])
        said = capsys.readouterr().err
        assert status in (0, 2), said
        if status == 2:
            refused += 1
            assert said.count("\n") == 1
    assert refused > 5


def test_a_definition_of_messages_is_no_program(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    evil = f"own_msgs/msg/X:\n    open({str(trace)!r}, 'w')\nclass Y"
    bag = write_bag(tmp_path / "bag", arm(10))
    file = next(bag.glob("*.mcap"))
    odd = file.read_bytes().replace(b"sensor_msgs/msg/JointState", b"own_msgs/msg/X:\n open('t')")
    file.write_bytes(odd)
    with pytest.raises(InputError, match="unreadable bag"):
        list_columns(bag)
    assert not trace.exists()
    assert IDENTIFIER.fullmatch(evil) is None


def test_a_topic_without_a_definition_is_named(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", arm(10), StoragePlugin.SQLITE3)
    import sqlite3

    with sqlite3.connect(next(bag.glob("*.db3"))) as base:
        base.execute("DELETE FROM message_definitions")
        base.execute("UPDATE topics SET type='own_msgs/msg/Odd' WHERE name='/motor_states'")
    base.close()
    assert "not readable without their definitions: own_msgs/msg/Odd" in list_columns(bag)


def test_the_commands_take_a_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_bag(tmp_path / "bag", arm(600))
    words = [f"{c}={n}" for one in (OUTPUT, INPUT, EFFORT) for c, n in one.items()]
    drive, fitted = str(DRIVE), str(tmp_path / "fitted.toml")
    for command in (
        ["compare", drive, str(bag), "--map", *words],
        ["diagnose", drive, str(bag), "--map", *words],
        ["fit", drive, str(bag), "-o", fitted, "--map", *words],
        ["replay", drive, str(bag), "--map", *words],
        ["characterize", str(bag), "--ratio", "100", "--map", *words],
    ):
        assert main([*command, "--json", "-"]) == 0, capsys.readouterr().err
        json.loads(capsys.readouterr().out)
    assert main(["forecast", drive, str(bag)]) == 2
    assert "a plan as CSV or Parquet" in capsys.readouterr().err
    assert store is not None
