"""Score of a diagnosis, given the hidden effects."""

from __future__ import annotations

from typing import Any

OF_LOAD = "load_dependent_friction"
"""Effect that a form of the hysteresis contains (`inside+load`, `both+load`)."""

SECONDS = 1.0
"""Permitted error of the position of a sudden event."""


def kind_of(truth: dict[str, Any]) -> str:
    """Kind of the campaign."""
    hidden = list(truth["effects"])
    if not hidden:
        return "clean"
    if any(name.startswith("outside") for name in hidden):
        return "outside"
    if truth["plan"] in ("aliased", "short"):
        return str(truth["plan"])
    return "pair" if len(hidden) > 1 else "single"


def judge(truth: dict[str, Any], found: dict[str, Any]) -> str:
    """Class of the answer in a few words; `right` if it is as required."""
    return {
        "clean": _clean,
        "outside": _outside,
        "pair": _pair,
    }.get(kind_of(truth), _single)(truth, found)


def _clean(truth: dict[str, Any], found: dict[str, Any]) -> str:
    verdict, named = found["verdict"], found["effects"]
    if not truth.get("events"):
        return "right" if verdict == "complete" else f"false alarm ({verdict})"
    if named:
        return f"false alarm ({verdict})"
    if not placed(truth, found):
        return f"event not found ({verdict})"
    return "right" if verdict == "unexplained" else f"event, but {verdict}"


def _outside(truth: dict[str, Any], found: dict[str, Any]) -> str:
    verdict = found["verdict"]
    if truth.get("events"):
        if not placed(truth, found):
            return f"event not found ({verdict})"
        return "right" if verdict == "unexplained" else f"event, but {verdict}"
    if verdict != "unexplained":
        return f"not unexplained ({verdict})"
    wanted = {name for cause in truth["hidden"] for name in (cause.get("depends_on") or [])}
    shown = {entry["covariate"] for entry in found["unexplained"]["depends_on"]}
    return "right" if shown & wanted else "unexplained, other column"


def told(found: dict[str, Any]) -> list[str]:
    """Effects that an answer states: those that it names, then that of its baseline model.

    Limits of friction that grow with the load are the simulator's `load_dependent_friction`.
    """
    named: list[str] = found["effects"]
    of_form = [OF_LOAD] if "load" in found.get("friction", "") and OF_LOAD not in named else []
    return named + of_form


def _pair(truth: dict[str, Any], found: dict[str, Any]) -> str:
    hidden, named = set(truth["effects"]), set(told(found))
    if not hidden & named and found["verdict"] == "complete":
        return "none"
    if hidden <= named:
        return "right" if nothing_left(truth, found) else "both named, a residual remains"
    return "one of two" if hidden & named else f"neither ({found['verdict']})"


def _single(truth: dict[str, Any], found: dict[str, Any]) -> str:
    (hidden,) = truth["effects"]
    verdict, named = found["verdict"], told(found)
    if hangs_on_nothing(truth):
        # Without its column it cannot be named, and nothing else may be named in its place.
        if verdict in truth["verdicts"]:
            return "right" if not named or verdict == "ambiguous" else "another beside the unknown"
        return "none" if verdict == "complete" else "wrong"
    if truth.get("events") and not placed(truth, found):
        return "event not found"
    if verdict == "complete" and hidden not in named:
        return "none"
    if named and named[0] == hidden:
        if not nothing_left(truth, found):
            return "first, a residual remains"
        return "right" if named == [hidden] else "first, with others"
    if hidden in named:
        return "in the set" if verdict == "ambiguous" else "named later"
    if set(named) & set(truth.get("twins") or ()):
        return "twin"
    if named:
        return "wrong"
    return "unexplained"


def placed(truth: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether every sudden event was located by run and second."""
    return all(
        any(
            str(e["run"]) == str(event["run"]) and abs(e["time_s"] - event["time_s"]) <= SECONDS
            for e in found["events"]
        )
        for event in truth["events"]
    )


def nothing_left(truth: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether the named effects leave only true events unexplained."""
    if found["verdict"] != "unexplained":
        return True
    shapes = [d for d in found["unexplained"]["depends_on"] if not d["shape"].startswith("step of")]
    return bool(truth.get("events")) and not shapes


def hangs_on_nothing(truth: dict[str, Any]) -> bool:
    """Whether the column that the hidden effect depends on was left out of the recordings."""
    return bool(truth["effects"]) and truth["verdicts"] == ["unexplained", "ambiguous"]


def good(truth: dict[str, Any], judged: str) -> bool:
    """Whether the answer is as required."""
    asked = {
        "single": ("right", "first, with others", "first, a residual remains"),
        "pair": ("right", "both named, a residual remains"),
        "aliased": ("right", "first, with others", "in the set"),
        "short": ("right", "first, with others", "in the set"),
    }
    return judged in asked.get(kind_of(truth), ("right",))


def wrong_alone(truth: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether effects are named and none of the hidden ones is among them."""
    twins = set(truth.get("twins") or ())
    return bool(found["effects"]) and not set(found["effects"]) & (set(truth["effects"]) | twins)


def condition(truth: dict[str, Any]) -> str:
    """Difference of a campaign from the standard one in a few words."""
    c = truth["conditions"]
    words = []
    if c["noise"] != 1:
        words.append(f"{c['noise']:g} times the noise")
    if c["scatter"] != 1:
        words.append(f"{c['scatter']:g} times the scatter")
    if truth["plan"] == "third":
        words.append("a third of the runs")
    if c["sheet_bias"]:
        words.append(f"sheet {100 * c['sheet_bias']:g} % off")
    if c["outliers"]:
        words.append(f"{100 * c['outliers']:g} % outliers")
    if c["dropped_counts"]:
        words.append(f"{c['dropped_counts']} encoder counts lost")
    if c["dropped_columns"]:
        words.append("without " + ", ".join(c["dropped_columns"]))
    sizes = [e["residual_sigma"] for e in truth["hidden"] if "residual_sigma" in e]
    if sizes and max(sizes) < 0.4:
        words.append("half the effect")
    return ", ".join(words) or "standard"
