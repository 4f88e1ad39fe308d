"""What results have in common: a table of parameters, data frames, and figures.

`parameter_table` prints values with their errors and bounds; `data_frame` makes a table of columns
a pandas one; `figures` draws with Plotly, whose figures a notebook, a page and a report show.
"""

from lostmotion.results.data_frame import data_frame
from lostmotion.results.parameter_table import Parameter, ParameterTable

__all__ = ["Parameter", "ParameterTable", "data_frame"]
