"""Model against measurement: how well the base model fits, and where it fails.

The baseline model of `lostmotion.fit`, the one that `diagnose` starts from, is fitted to a
campaign, tested on runs that the fit has not seen (`comparison`), and set against the repeatability
of the recordings (`repeatability`). What is left is then asked of every recorded quantity: how much
of it hangs on that quantity (`failures`), and could that be chance (`chance`)?
"""

from lostmotion.callable_module import make_callable
from lostmotion.compare.comparison import Comparison, compare
from lostmotion.compare.failures import Failure
from lostmotion.compare.loops import zero_widths
from lostmotion.compare.repeatability import REPEATABILITY, Repeatability

__all__ = ["REPEATABILITY", "Comparison", "Failure", "Repeatability", "compare", "zero_widths"]

make_callable(__name__)
