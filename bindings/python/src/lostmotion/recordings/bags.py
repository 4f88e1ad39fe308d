"""ROS 2 bags: what a robot recorded, by topic, field and joint.

A bag is a folder with ``metadata.yaml`` and one or more storages (``.mcap``, ``.db3``), or a
storage alone. It is read through `rosbags`, which is optional. A number of a message is a column
named by its path: ``/joint_states/position/elbow`` is the element of ``position`` that belongs to
the joint ``elbow`` in the messages of the topic ``/joint_states``.

Bags are untrusted: compressed data are inflated within a known bound, and any other fault of the
bytes is one error.
"""

from __future__ import annotations

import posixpath
import re
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, WholeArray
from lostmotion.errors import InputError, did_you_mean, one_line
from lostmotion.recordings.compressed import INFLATED_LEAST, INFLATION_MAX, inflation_bound
from lostmotion.recordings.layout import COLUMNS_MAX
from lostmotion.units import plain_number

METADATA = "metadata.yaml"
"""File that marks a folder as a bag."""

STORAGES = (".mcap", ".db3")
"""File names of a bag's storages."""

PACKED = ".zstd"
"""Suffixes of compressed storages."""

MESSAGE_MODE = re.compile(rb"^\s*compression_mode:\s*[\"']?message\b", re.MULTILINE | re.IGNORECASE)
"""Line of the metadata that states compression of single messages."""

METADATA_MAX = 1 << 20
"""Bytes of the metadata that are examined, sufficient for a thousand topics."""

MESSAGES_LEAST = 500_000
"""Number of messages up to which no bag is refused."""

MESSAGE_BYTES = 8
"""Bytes on disk per message beyond that: a compressed message with a time and one sensor value has
at least as many.
"""

LABELLED_MAX = 1024
"""Largest number of names for an array of numbers."""

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
"""A name in a definition of messages, from which `rosbags` makes Python code."""

UNLABELLED_MAX = 64
"""Longest array without names that becomes columns: longer ones are scans or pictures."""

SHOWN_MESSAGES = 20
"""Messages of each topic that are examined to list its columns ..."""

SCANNED_MESSAGES = 20_000
"""... among this number of messages at the beginning of the bag."""

TOPICS_LISTED = 12
"""More topics than this are not listed one by one."""

RECEIVE_TIME = "receive_time"
"""Column of the time at which the recorder received a message."""

HEADER_STAMP = "header_stamp"
"""Column of the time that a message's header states."""

INSTALL = "pip install 'lostmotion[ros]'"

SUPPLIED = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "control_msgs/InterfaceValue[] interface_values\n"
    ),
}
"""Message definitions that neither `rosbags` nor older storages contain."""


@dataclass(frozen=True)
class Channel:
    """A column of a bag: the numbers of one path, message by message.

    Attributes
    ----------
    column, topic : str
    header_ns : ndarray or None
        Stamps of the headers, ns since the epoch; None where a message has none.
    received_ns : ndarray
        When the recorder received the messages.
    values : ndarray
    """

    column: str
    topic: str
    header_ns: WholeArray | None
    received_ns: WholeArray
    values: FloatArray


@dataclass(frozen=True)
class Topic:
    """A topic of a bag."""

    name: str
    kind: str
    messages: int
    seconds: float


def is_bag(path: Path) -> bool:
    """Whether a path is a ROS 2 bag: by its name, or as a folder by its metadata."""
    if path.is_dir():
        return (path / METADATA).is_file()
    return path.name.lower().endswith(STORAGES)


class _Budget:
    """Bytes that may still be inflated."""

    def __init__(self, file: Path, bound: int) -> None:
        self.file = file
        self.bound = bound
        self.left = bound

    def spend(self, size: int) -> None:
        """Subtract inflated bytes.

        Raises
        ------
        InputError
            If the bound is exceeded.
        """
        self.left -= size
        if self.left < 0:
            raise InputError(
                self.file,
                "",
                f"a bag that contains more than {self.bound >> 20} MiB",
                f"at most {INFLATED_LEAST >> 20} MiB, or {INFLATION_MAX} times its size on disk",
            )

    def inflate(self, packed: bytes, decompressor: Callable[[], Any]) -> bytes:
        """Inflate frames that follow each other.

        Raises
        ------
        InputError
            If they hold more than the bound allows.
        ValueError
            When the last one is cut off.
        """
        found: list[bytes] = []
        while packed:
            frame = decompressor()
            piece = frame.decompress(packed, max_length=self.left + 1)
            found.append(piece)
            self.spend(len(piece))
            if not frame.eof:
                raise ValueError("compressed data is cut off")
            packed = frame.unused_data or b""
        return b"".join(found)


@dataclass
class Bag:
    """A bag that is open."""

    file: Path
    readers: list[Any]
    size: int
    """Bytes on disk."""
    unpack: Callable[[bytes], bytes]
    stores: Mapping[str, Any]

    def topics(self) -> list[Topic]:
        """Topics with their types and number of messages."""
        found: dict[str, Topic] = {}
        for reader in self.readers:
            seconds = max(reader.end_time - reader.start_time, 0) * 1e-9
            for connection in reader.connections:
                before = found.get(connection.topic)
                messages, passed = (before.messages, before.seconds) if before else (0, 0.0)
                found[connection.topic] = Topic(
                    connection.topic,
                    connection.msgtype,
                    messages + connection.msgcount,
                    passed + (seconds if connection.msgcount else 0.0),
                )
        return [found[name] for name in sorted(found)]

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
        """Messages of topics with the time of their receipt, in the order of the bag.

        Messages of undefined types are left out.

        Raises
        ------
        InputError
            If there are more than a recording of that size can hold.
        """
        bound = max(MESSAGES_LEAST, self.size // MESSAGE_BYTES)
        read = 0
        for reader in self.readers:
            wanted = [
                c for c in reader.connections if c.topic in topics and c.msgtype in self.stores
            ]
            if not wanted:
                continue
            for connection, received_ns, raw in reader.messages(connections=wanted):
                read += 1
                if read > bound:
                    found = f"more than {bound:,} messages in {self.size >> 10} KiB"
                    expected = f"at most {MESSAGES_LEAST:,}, or one for {MESSAGE_BYTES} bytes"
                    raise InputError(self.file, "", found, expected)
                store = self.stores[connection.msgtype]
                yield (
                    connection.topic,
                    received_ns,
                    store.deserialize_cdr(self.unpack(raw), connection.msgtype),
                )


@contextmanager
def open_bag(file: Path) -> Iterator[Bag]:
    """Open a bag for reading.

    Raises
    ------
    InputError
        If `rosbags` is not installed, or the bag is damaged, also while messages are read.
    """
    try:
        from lz4.frame import LZ4FrameDecompressor
        from rosbags.rosbag2 import Reader, storage_mcap
    except ImportError:
        raise InputError(
            file, "", "a ROS 2 bag, but the package rosbags is not installed", INSTALL
        ) from None
    zstd: Any = vars(storage_mcap)["zstd"]  # of the standard library or its backport
    names = _storages(file)
    size = sum(name.stat().st_size for name in names)
    budget = _Budget(file, inflation_bound(size))

    def of_zstd(packed: bytes, _: int = 0) -> bytes:
        return budget.inflate(packed, zstd.ZstdDecompressor)

    def of_lz4(packed: bytes, _: int = 0) -> bytes:
        return budget.inflate(packed, LZ4FrameDecompressor)

    bounded = {**storage_mcap.DECOMPRESSORS, "zstd": of_zstd, "lz4": of_lz4}
    unbounded = dict(storage_mcap.DECOMPRESSORS)
    with ExitStack() as stack:
        # The reader inflates a chunk before it checks its size.
        storage_mcap.DECOMPRESSORS.update(bounded)
        stack.callback(storage_mcap.DECOMPRESSORS.update, unbounded)
        try:
            readers = []
            for name in names:
                if name.name.endswith(PACKED):
                    folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
                    whole = folder / name.name.removesuffix(PACKED)
                    whole.write_bytes(of_zstd(name.read_bytes()))
                    name = whole
                readers.append(stack.enter_context(Reader(name)))
            by_message = _compressed_by_message(file)
            yield Bag(file, readers, size, of_zstd if by_message else bytes, _stores(readers))
        except (InputError, GeneratorExit):
            raise
        except Exception as error:  # of a parser of untrusted bytes
            said = one_line(str(error)) or type(error).__name__
            raise InputError(file, "", f"an unreadable bag ({said})", "a ROS 2 bag") from None


def _storages(file: Path) -> list[Path]:
    """Storages of a bag, in the order in which they were written."""
    if not file.is_dir():
        return [file]
    endings = (*STORAGES, *(ending + PACKED for ending in STORAGES))
    found = [name for name in file.iterdir() if name.name.lower().endswith(endings)]
    if not found:
        raise InputError(file, "", f"a {METADATA}, but no storage", "files in .mcap or .db3")

    def number(name: Path) -> list[Any]:
        parts = re.split(r"([0-9]+)", name.name)
        return [int(part) if i % 2 else part for i, part in enumerate(parts)]

    return sorted(found, key=number)


def _compressed_by_message(file: Path) -> bool:
    metadata = file / METADATA
    if not file.is_dir() or not metadata.is_file():
        return False
    with metadata.open("rb") as opened:
        return MESSAGE_MODE.search(opened.read(METADATA_MAX)) is not None


def _stores(readers: list[Any]) -> dict[str, Any]:
    """Find the decoder of each defined message type.

    The definition in the bag takes precedence over those of `rosbags`.
    """
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    shipped = get_typestore(Stores.LATEST)
    supplied: dict[str, Any] = {}
    for kind, text in SUPPLIED.items():
        if kind not in shipped.fielddefs:
            supplied.update(get_types_from_msg(text, kind))
    shipped.register(supplied)

    def register(types: dict[str, Any]) -> Any:
        for kind, (constants, parts) in types.items():
            require_identifiers((kind, [constant[:2] for constant in constants], parts))
        own = get_typestore(Stores.EMPTY)
        own.register(types)
        return own

    found: dict[str, Any] = {}
    for reader in readers:
        for connection in reader.connections:
            kind, held = connection.msgtype, connection.msgdef
            if kind in found:
                continue
            if kind in shipped.fielddefs:
                found[kind] = shipped
            elif held.format is MessageDefinitionFormat.MSG:
                require_identifiers(kind)
                found[kind] = register(get_types_from_msg(held.data, kind))
            elif held.format is MessageDefinitionFormat.IDL:
                types: dict[str, Any] = {}
                for part in re.split(r"^=+\nIDL: .*\n", held.data, flags=re.MULTILINE):
                    types.update(get_types_from_idl(part) if part.strip() else {})
                found[kind] = register(types)
    return found


def require_identifiers(part: Any) -> None:
    """Refuse a definition of messages whose names are no identifiers.

    Raises
    ------
    ValueError
        Names the first.
    """
    if isinstance(part, str):
        if part and not IDENTIFIER.fullmatch(part):
            raise ValueError(f"the name {part!r} in a definition of messages")
    elif isinstance(part, (list, tuple)):
        for inner in part:
            require_identifiers(inner)


def numbers_in(message: Any, path: str, labels: list[str]) -> Iterator[tuple[str, float]]:
    """Numbers of a message with their paths; array elements by the names in the message.

    Parameters
    ----------
    message : object
    path : str
        Of the message.
    labels : list of str
        Names in the enclosing message.
    """
    parts = [(one.name, getattr(message, one.name)) for one in fields(message)]
    for _, value in parts:
        if isinstance(value, list) and value and isinstance(value[0], str):
            labels = value
            break
    # For a message of only names and their values, the path is that of the values.
    bare = [name for name, value in parts if not isinstance(value, (str, list))]
    alone = len(bare) == 1 and len(parts) > 1 and bare[0] == "values"
    for name, value in parts:
        at = path if alone else f"{path}/{name}"
        if isinstance(value, (int, float, np.number)):
            yield at, float(value)
        elif isinstance(value, np.ndarray):
            if value.size == len(labels) <= LABELLED_MAX:
                yield from zip((f"{at}/{one}" for one in labels), map(float, value), strict=True)
            elif value.size <= UNLABELLED_MAX and value.dtype.kind in "fiub":
                yield from ((f"{at}/{i}", float(one)) for i, one in enumerate(value))
        elif isinstance(value, list):
            if value and hasattr(value[0], "__dataclass_fields__"):
                named = labels if len(labels) == len(value) else [str(i) for i in range(len(value))]
                if len(value) <= (LABELLED_MAX if named is labels else UNLABELLED_MAX):
                    for label, inner in zip(named, value, strict=True):
                        yield from numbers_in(inner, f"{at}/{label}", labels)
        elif name != "header" and _is_message(value):
            yield from numbers_in(value, at, labels)


def _is_message(value: Any) -> bool:
    """Whether a field has fields itself; times and durations do not count."""
    return hasattr(value, "__dataclass_fields__") and not hasattr(value, "nanosec")


def _stamp_ns(message: Any) -> int:
    """Stamp of a message's header in ns; 0 where there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def topic_of(column: str, topics: Collection[str]) -> str | None:
    """Topic of a column; None if it is unknown."""
    found = [topic for topic in topics if column.startswith(f"{topic}/")]
    return max(found, key=len, default=None)


def bag_columns(file: Path, columns: Collection[str]) -> list[str]:
    """Columns that belong to a topic of a bag."""
    with open_bag(file) as bag:
        names = [topic.name for topic in bag.topics()]
    return [column for column in columns if topic_of(column, names) is not None]


def bag_header(file: Path, columns: Collection[str]) -> list[str]:
    """Columns for a map: those named in existing topics, times, and topics."""
    with open_bag(file) as bag:
        names = [topic.name for topic in bag.topics()]
    mapped = [column for column in columns if topic_of(column, names) is not None]
    return [*mapped, RECEIVE_TIME, HEADER_STAMP, *names]


def read_channels(file: Path, columns: Collection[str]) -> list[Channel]:
    """Read columns of a bag.

    Raises
    ------
    InputError
        For a column that the bag does not have.
    """
    header: dict[str, list[int]] = {column: [] for column in columns}
    received: dict[str, list[int]] = {column: [] for column in columns}
    values: dict[str, list[float]] = {column: [] for column in columns}
    seen: dict[str, dict[str, None]] = {}
    with open_bag(file) as bag:
        names = [topic.name for topic in bag.topics()]
        home = {column: topic_of(column, names) for column in columns}
        wanted = {topic for topic in home.values() if topic is not None}
        for topic, received_ns, message in bag.messages(wanted):
            stamp_ns = _stamp_ns(message)
            known = seen.setdefault(topic, {})
            for column, value in numbers_in(message, topic, []):
                if len(known) < COLUMNS_MAX:
                    known[column] = None
                if column in values:
                    header[column].append(stamp_ns)
                    received[column].append(received_ns)
                    values[column].append(value)
    found = []
    for column, topic_name in home.items():
        if topic_name is None or not values[column]:
            there = list(seen.get(topic_name or "", ())) or names
            raise InputError(
                file,
                column,
                f"no such column (there are {', '.join(there)})",
                "a column of the bag" + did_you_mean(column, there),
            )
        stamps = np.array(header[column], dtype=np.int64)
        found.append(
            Channel(
                column,
                topic_name,
                stamps if np.all(stamps > 0) else None,
                np.array(received[column], dtype=np.int64),
                np.array(values[column]),
            )
        )
    return found


def list_columns(file: Path) -> str:
    """List the topics of a bag that hold numbers, as words that a shell expands to columns."""
    found: dict[str, dict[str, None]] = {}
    counts: dict[str, int] = {}
    with open_bag(file) as bag:
        topics = {topic.name: topic for topic in bag.topics()}
        for number, (name, _, message) in enumerate(bag.messages(topics)):
            if number >= SCANNED_MESSAGES:
                break
            counts[name] = counts.get(name, 0) + 1
            if counts[name] <= SHOWN_MESSAGES:
                there = found.setdefault(name, {})
                for column, _ in numbers_in(message, name, []):
                    if len(there) < COLUMNS_MAX:
                        there[column] = None
            if all(
                counts.get(one.name, 0) >= min(SHOWN_MESSAGES, one.messages)
                for one in topics.values()
            ):
                break
        unknown = sorted({t.kind for t in topics.values() if t.kind not in bag.stores})
    told = [
        f"{_folded(name, list(found[name]))} ({topics[name].kind}, {rate_text(topics[name])})"
        for name in sorted(found)
        if found[name]
    ]
    more = len(told) - TOPICS_LISTED
    if more > 0:
        told = [*told[:TOPICS_LISTED], f"{more} more topics"]
    if unknown:
        told.append(f"not readable without their definitions: {', '.join(unknown)}")
    return "; ".join(told) or "no numbers"


def rate_text(topic: Topic) -> str:
    """Message rate of a topic."""
    if topic.messages < 2 or topic.seconds <= 0:
        return f"{topic.messages} message{'s' * (topic.messages != 1)}"
    return f"{plain_number((topic.messages - 1) / topic.seconds)} Hz"


def _folded(topic: str, columns: list[str]) -> str:
    """Write columns of a topic as ``topic/{field,field}/{joint,joint}``."""
    ends: dict[str, list[str]] = {}
    for column in columns:
        path, _, last = column.removeprefix(f"{topic}/").rpartition("/")
        ends.setdefault(path, []).append(last)
    groups: dict[tuple[str, ...], list[str]] = {}
    for path, lasts in ends.items():
        groups.setdefault(tuple(lasts), []).append(path)
    words = []
    for names, paths in groups.items():
        middle = "" if paths == [""] else f"{_braces(paths)}/"
        words.append(f"{topic}/{middle}{_braces(names)}")
    return ", ".join(words)


def _braces(words: Collection[str]) -> str:
    """Write words as a shell brace expression with their common prefix."""
    if len(words) == 1:
        return next(iter(words))
    common = posixpath.commonpath(words)
    before = f"{common}/" if common and common not in words else ""
    return before + "{" + ",".join(word.removeprefix(before) for word in words) + "}"
