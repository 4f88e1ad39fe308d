"""The design search: from a spec to drives with the least lost motion.

The search is the C library of the folder ``optimizer``, bound as ``lostmotion._search``; a package
that was built without NLopt lacks only the search.
"""

from lostmotion.callable_module import make_callable
from lostmotion.design.result import SearchResult
from lostmotion.design.running import search

__all__ = ["SearchResult", "search"]

make_callable(__name__)
