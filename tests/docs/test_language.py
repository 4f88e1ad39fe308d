"""Texts for readers use the words of the glossary, and avoid a list of idioms.

Both are searched in the pages, in every string of several words, docstring and comment. Text
between backquotes is a name and is not searched.
"""

from __future__ import annotations

import re

import pytest
from prose import FENCED, QUOTED, Passage, blanked, files, passages

REPLACED = {
    "torsion curve": r"(?-i:\bbackbones?\b)(?! :|\(|, elastic)|\bcharacteristics?\b",
    "baseline model": r"\b(the|a|fitted|larger) base(?! (circle|half|tangent|radius|line)| / R)\b"
    r"|\bbase (model\b|\+ )",
    "residual": r"\bwhat is left\b(?! out)|\bleft, arcsec|\bare left;",
    "leave-one-run-out error": r"\bheld[ -]out\b|\bunseen runs\b|\b(has|have) not seen\b",
    "data-sheet model": r"\bdrive \*?as it stands\b",
    "wave generator": r"(?<!wave )(?<!step )(?<!random )(?<!Recipes' )(?<!of the )"
    r"\bgenerators? (angle|turns?|shaft|plug|bearing)\b",
    "in series / in parallel with the spring": r"\b(in|out)side (of )?the (elasticity|spring)\b",
    "hysteresis operator": r"\bplays\b(?! :|\()",
    "confounded with": r"\b(look(s|ing)?|very|all|both) alike\b|\balike\b|\btwins\b|\btold apart\b"
    r"|\b(tell|tells) (\w+ ){0,3}apart\b",
    "depends on, correlates with": r"\b(hang(s|ing)?|hung) on\b",
    "permutation test": r"\bwhat chance gives\b|\btests? for chance\b",
    "identified, absorbed by the baseline": r"\bcarr(y|ies) (a|the|no) name\b|\btakes? it up\b"
    r"|\btakes up whatever\b|\bcan show\b",
    "fixed": r"\ba limit, not fitted\b",
    "session": r"\bsittings?\b",
    "compensates": r"\btakes? out\b|\btaken out of\b",
    "fault": r"\bodd (about|runs?|characters?|values?|rows?|columns?)\b"
    r"|\b(nothing|is|looks) odd\b(?! in)",
}
"""Patterns of words that are not used, by the word that is used instead."""

IDIOMS = {
    "states it": r"\bsays? so\b",
    "is accepted": r"\bwill do\b",
    "within": r"\bin (its|the) midst\b",
    "assumes": r"\btakes? for granted\b",
    "oscillates": r"\bto and fro\b",
    "includes": r"\b(brings?|takes?) along\b",
    "states, contains": r"\b(answer|data|drive|file|model|page|recording|run|sheet)s? "
    r"(says?|knows?|tells?|wants?|remembers?)\b",
    "is not recorded, is unknown": r"\bnobody\b",
    "states to": r"\b(is|are) told\b|\btold by\b",
    "is": r"\bstands? (above|as|at|behind|below|beside|here|in|on|there)\b",
    "continues": r"\bgo(es)? on\b",
    "reverses": r"\bturn(s|ed)? round\b",
}
"""Patterns of idioms that are not used, by the words that are used instead."""

DEFINED = {
    "tests/docs/test_language.py": "the words themselves",
    "CHANGELOG.md": "what earlier versions printed",
}
"""Files that name such a word in order to explain it."""

WORDS = {term: re.compile(found, re.IGNORECASE) for term, found in REPLACED.items()}

FILES = files()


def on_one_line(text: str) -> str:
    """Return the text with its line breaks and marks of comments as one blank each."""
    return re.sub(r"\s*\n[ *#]*", " ", text)


def said_otherwise(passage: Passage) -> list[str]:
    """Return the words of the second column in a passage, with the words to be used instead."""
    return [
        f"{passage.place}: {' '.join(found[0].split())!r}: say {term!r}"
        for term, pattern in WORDS.items()
        for found in pattern.finditer(on_one_line(passage.text))
    ]


def test_the_second_column_of_the_glossary_is_used_nowhere() -> None:
    found = [
        said
        for file in FILES
        if not any(str(file).endswith(name) for name in DEFINED)
        for passage in passages(file)
        for said in said_otherwise(passage)
    ]
    assert not found, "\n".join(found)


def idioms(prose: str) -> list[str]:
    """Return the idioms of a text, with what is said instead."""
    return [
        f"{' '.join(found[0].split())!r}: say {said!r}"
        for said, pattern in IDIOMS.items()
        for found in re.finditer(pattern, on_one_line(prose), re.IGNORECASE)
    ]


def test_no_text_uses_an_idiom_of_the_list() -> None:
    found = []
    for file in FILES:
        if file.name == "test_language.py":
            continue
        if file.suffix == ".md":  # without its code and output
            prose = blanked(FENCED.sub("", file.read_text("utf-8")), QUOTED)
            found += [f"{file}: {said}" for said in idioms(prose)]
        else:
            found += [f"{p.place}: {said}" for p in passages(file) for said in idioms(p.text)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "sentence",
    [
        "It is an estimate, and every answer says so.",
        "Any unit of the dimension will do.",
        "The table stands in the file, and the drive file knows it.",
    ],
)
def test_an_idiom_of_the_list_is_found(sentence: str) -> None:
    assert idioms(sentence)


@pytest.mark.parametrize(
    "sentence",
    [
        "The error hangs on the temperature.",
        "held out by run 6.56",
        "The base takes up whatever it can.",
        "These data cannot tell the two apart.",
        "the plays inside the elasticity",
        "# What is left, arcsec: 3 runs cannot carry a name.",
    ],
)
def test_a_word_of_the_second_column_is_found(sentence: str) -> None:
    assert said_otherwise(Passage(FILES[0], 0, sentence, 1))
