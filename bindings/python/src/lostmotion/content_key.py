"""Keys of values by their content, for tables of what was computed before."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import fields
from hashlib import blake2b
from typing import Any

import numpy as np


def content_key(value: Any) -> Hashable:
    """Key that is equal for equal content.

    Arrays are represented by a digest of their bytes. A dataclass that cannot be a key is
    represented by the fields in which it is compared.

    Parameters
    ----------
    value
        Arrays, mappings, sequences and dataclasses of these, and anything that can be a key.
    """
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, blake2b(value.tobytes(), digest_size=16).digest()
    if isinstance(value, Mapping):
        return tuple((name, content_key(part)) for name, part in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(content_key(part) for part in value)
    key: Hashable = value
    try:
        hash(key)
    except TypeError:
        compared = [one.name for one in fields(value) if one.compare]
        key = type(value), *(content_key(getattr(value, name)) for name in compared)
    return key
