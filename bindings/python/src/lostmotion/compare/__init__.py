"""Model against measurement: how well the baseline model fits, and where it fails.

The baseline model of `lostmotion.fit`, from which `diagnose` also starts, is fitted to a campaign,
cross-validated (`comparison`), and compared with the repeatability of the recordings
(`repeatability`). The dependence of the residual on every recorded quantity is then quantified
(`failures`) and tested (`chance`).
"""

from lostmotion.callable_module import make_callable
from lostmotion.compare.comparison import Comparison, compare
from lostmotion.compare.failures import Failure
from lostmotion.compare.loops import zero_widths
from lostmotion.compare.repeatability import REPEATABILITY, Repeatability

__all__ = ["REPEATABILITY", "Comparison", "Failure", "Repeatability", "compare", "zero_widths"]

make_callable(__name__)
