"""The workbench: the functions of the library in a local web page for one user.

`bench` has the loaded data and results and calls the library; `work` runs long tasks in the
background; `page` shows them with the panels of `measured`, `missing`, `handing_out` and `designs`.
It contains no analysis.
"""
