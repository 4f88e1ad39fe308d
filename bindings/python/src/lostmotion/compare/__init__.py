"""Model against measurement: how well the baseline model fits, and where it fails.

The baseline model of `lostmotion.fit`, the one that `diagnose` starts from, is fitted to a
campaign, cross-validated (`comparison`), and set against the repeatability
of the recordings (`repeatability`). The residual is then tested against every recorded quantity:
how much of it depends on that quantity (`failures`), and could that be chance (`chance`)?
"""

from lostmotion.callable_module import make_callable
from lostmotion.compare.comparison import Comparison, compare
from lostmotion.compare.failures import Failure
from lostmotion.compare.loops import zero_widths
from lostmotion.compare.repeatability import REPEATABILITY, Repeatability

__all__ = ["REPEATABILITY", "Comparison", "Failure", "Repeatability", "compare", "zero_widths"]

make_callable(__name__)
