"""Merge evidence of several campaigns at the linearisation of one of them.

Moving a campaign from its own baseline model to a common one adds a combination of the baseline's
columns to the residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.errors import InputError
from lostmotion.evidence.file import Body
from lostmotion.evidence.gram import Evidence


def merge_bodies(bodies: Sequence[Body], files: Sequence[str | Path]) -> Body:
    """Combine evidence of several campaigns; their order changes only the labels of the runs.

    Raises
    ------
    InputError
        If a part is of a different drive or grid, or has recordings of another part.
    """
    refuse_other_grid(bodies, files)
    seen = refuse_twice(bodies, files)
    labels = [
        {run: run if len(bodies) == 1 else f"{i + 1}:{run}" for run in body.about["runs"]}
        for i, body in enumerate(bodies)
    ]
    events = [
        {**event, "run": names[event["run"]]}
        for body, names in zip(bodies, labels, strict=True)
        for event in body.about["events"]
    ]
    alone = [
        {"file": str(file), "runs": len(body.about["runs"]), **said}
        for body, file in zip(bodies, files, strict=True)
        for said in body.about["alone"]
    ]
    # Independent of the order: the same linearisation, and bit-identical sums.
    order = sorted(range(len(bodies)), key=lambda i: str(bodies[i].about["data_fingerprints"]))
    bodies, labels = [bodies[i] for i in order], [labels[i] for i in order]
    first = bodies[0]
    confounded = [{k["name"] for k in b.about["candidates"] if k["of_form"]} for b in bodies]
    of_form = set.intersection(*confounded)
    sizes = [{n: p.size for n, p in body.white.blocks.items()} for body in bodies]
    common = [name for name, size in sizes[0].items() if all(s.get(name) == size for s in sizes)]
    closed = {k: v for body in bodies for k, v in body.about["closed"].items()}
    for body in bodies:
        for name in body.white.blocks:
            if name not in common:
                closed[name] = "not in all of the evidence"
    white, plain = (
        merge_grams([getattr(body, kind) for body in bodies], [b.point for b in bodies], common)
        for kind in ("white", "plain")
    )
    return Body(
        white,
        plain,
        first.point,
        np.concatenate([body.spread for body in bodies]),
        np.concatenate([body.rows for body in bodies]),
        {
            **first.about,
            "candidates": [
                {**k, "of_form": k["name"] in of_form}
                for k in first.about["candidates"]
                if k["name"] in common
            ],
            "closed": closed,
            "runs": [name for names in labels for name in names.values()],
            "swing_arcsec": [x for body in bodies for x in body.about["swing_arcsec"]],
            "given_arcsec": {
                name: max(body.about["given_arcsec"][name] for body in bodies)
                for name in first.about["effects"]
            },
            "events": events,
            "data_fingerprints": sorted(seen),
            "alone": alone,
        },
    )


def refuse_other_grid(bodies: Sequence[Body], files: Sequence[str | Path]) -> None:
    """Refuse a part of a different drive, grid or model than the first."""
    first = bodies[0]
    for body, file in zip(bodies[1:], files[1:], strict=True):
        found, wanted = (len(b.about["radius_Nm"]) for b in (body, first))
        if found != wanted:
            expected = f"{wanted} as in {files[0]}: the same --friction for every part"
            raise InputError(file, "friction", f"{found} operators", expected)
        for key in ("rated_torque_Nm", "ratio", "knots_Nm", "radius_Nm"):
            one, two = np.array(body.about[key]), np.array(first.about[key])
            if one.shape != two.shape or not np.allclose(one, two, rtol=1e-9):
                raise InputError(
                    file, key, f"{np.ravel(one)[0]:.6g}", f"{np.ravel(two)[0]:.6g} as in {files[0]}"
                )
        if body.about["effects"] != first.about["effects"]:
            names, known = (", ".join(b.about["effects"]) or "no effect" for b in (body, first))
            raise InputError(file, "effects", names, f"{known} as in {files[0]}")
        if body.point.size != first.point.size:
            sizes = [f"{b.point.size} values of the baseline model" for b in (body, first)]
            raise InputError(file, "point", sizes[0], f"{sizes[1]}, as in {files[0]}")
        if body.white.fixed.size != first.white.fixed.size:
            more = body.white.fixed.size > first.white.fixed.size
            one_side = ("in parallel with the spring alone", "outside it as well")
            expected = f"{one_side[not more]}, as in {files[0]}"
            raise InputError(file, "friction", one_side[more], expected)


def refuse_twice(bodies: Sequence[Body], files: Sequence[str | Path]) -> set[str]:
    """Refuse campaigns or runs that would count twice; returns the campaigns."""
    seen: set[str] = set()
    known: dict[str, str] = {}
    for body, file in zip(bodies, files, strict=True):
        for fingerprint in body.about["data_fingerprints"]:
            if fingerprint in seen:
                raise InputError(file, "data_fingerprints", "the same recordings twice", "others")
            seen.add(fingerprint)
        prints = body.about["run_fingerprints"]
        for run, fingerprint in zip(body.about["runs"], prints, strict=True):
            if fingerprint in known:
                raise InputError(file, f"run {run}", known[fingerprint], "each recording once")
        known |= {
            fingerprint: f"the recording of run {run} in {file}"
            for run, fingerprint in zip(body.about["runs"], prints, strict=True)
        }
    return seen


def merge_grams(
    parts: Sequence[Evidence], points: Sequence[FloatArray], common: Sequence[str]
) -> Evidence:
    """Convert Gram matrices to the same columns, units and linearisation, and join them."""
    first = parts[0]
    grams = []
    for part, point in zip(parts, points, strict=True):
        keep = np.concatenate(
            [part.fixed, part.scatter, *(part.blocks[n] for n in common), [part.response]]
        ).astype(np.intp)
        gram = part.gram[:, keep[:, None], keep]
        ratio = part.scale[keep] / first.scale[places(first, common)]
        gram = gram * np.outer(ratio, ratio)
        # Residual at the first point: the change of the baseline model between the points is added
        # back.
        step = (point - points[0]) * first.scale[first.fixed][: point.size]
        change = np.eye(keep.size)
        change[: step.size, -1] = step
        grams.append(np.einsum("ai,rab,bj->rij", change, gram, change, optimize=True))
    n, m = first.fixed.size, first.scatter.size
    blocks, at = {}, n + m
    for name in common:
        blocks[name] = np.arange(at, at + first.blocks[name].size, dtype=np.intp)
        at += first.blocks[name].size
    return Evidence(
        np.concatenate(grams),
        first.scale[places(first, common)],
        np.arange(n, dtype=np.intp),
        np.arange(n, n + m, dtype=np.intp),
        blocks,
        at,
        first.precision,
    )


def places(evidence: Evidence, common: Sequence[str]) -> IntArray:
    """Places of the baseline, scattering and residual columns, and of those of some blocks."""
    parts = [evidence.fixed, evidence.scatter, *(evidence.blocks[name] for name in common)]
    return np.concatenate([*parts, [evidence.response]]).astype(np.intp)
