"""Draw sentences at random from pages, messages, headers, docstrings and comments, to be read.

``python tests/docs/sentences.py [--seed N] [--count 100] [--pages]`` prints the seed, and one
sentence per line with its place. Without a seed it uses a new one. ``--pages`` draws only from
pages and notebooks.
"""

from __future__ import annotations

import argparse
import random
import re

from prose import Passage, files, passages

WORDS_LEAST = 5
"""Least number of words of a sentence; fewer words are a label or a name."""

PAGES = (".md", ".ipynb")

END = re.compile(r"(?<=[.:?!;])\s+(?=[A-Z(])|\n\s*\n|\n\s*[-*|]\s|\|")

MARKS = re.compile(r"^[\s\"'#/*|`-]+|[\s\"'/*|`]+$")


def sentences(passage: Passage) -> list[str]:
    """Split a passage into its sentences, without the marks of comments and tables."""
    text = re.sub(r"\n[ \t]*[#*]+ ?", "\n", passage.text)
    parts = (MARKS.sub("", " ".join(part.split())) for part in END.split(text))
    return [part for part in parts if len(re.findall(r"[A-Za-z]{2,}", part)) >= WORDS_LEAST]


def draw(seed: int, count: int, *, pages: bool = False) -> list[tuple[str, str]]:
    """Draw place and text of sentences; a seed gives the same sentences for the same files."""
    every = [
        (one.place, said)
        for file in files()
        if not pages or file.suffix in PAGES
        for one in passages(file)
        for said in sentences(one)
    ]
    return random.Random(seed).sample(every, count)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Draw sentences at random.")
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**6))
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--pages", action="store_true", help="only pages and notebooks")
    options = parser.parse_args()
    print(f"seed {options.seed}")
    for place, said in draw(options.seed, options.count, pages=options.pages):
        print(f"{place}: {said}")
