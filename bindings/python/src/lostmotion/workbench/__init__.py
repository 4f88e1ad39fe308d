"""The workbench: the library's calls on a local page, for one person at one machine.

`bench` holds what was loaded and found and calls the library; `work` runs what takes long beside
the page; `page` draws it with the panels of `measured`, `missing`, `handing_out` and `designs`.
There is no analysis here.
"""
