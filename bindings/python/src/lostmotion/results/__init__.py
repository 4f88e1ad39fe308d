"""Common parts of results: parameter tables, data frames, and figures.

`parameter_table` prints values with errors and bounds; `data_frame` converts columns to pandas;
`figures` makes Plotly figures for notebooks, pages and reports.
"""

from lostmotion.results.data_frame import data_frame
from lostmotion.results.parameter_table import Parameter, ParameterTable

__all__ = ["Parameter", "ParameterTable", "data_frame"]
