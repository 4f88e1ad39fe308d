"""Pandas data frames, if pandas is installed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lostmotion.errors import InputError


def data_frame(columns: Mapping[str, Any]) -> Any:
    """Make a pandas data frame from columns.

    Raises
    ------
    InputError
        When pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise InputError("to_dataframe", "", "no pandas", "pip install pandas") from None
    return pd.DataFrame(dict(columns))
