"""Run-to-run scatter by REML, and the contest of candidates under it.

The unit of evidence is the run. With the scattering columns B and their variances omega, the
covariance of a run is ``I + B omega B'`` in whitened units; Woodbury reduces every run to a small
matrix. A candidate is judged under its own variances: with those of the base alone, effects that
act between runs would be taken for scatter.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import special
from scipy.optimize import minimize

from lostmotion import rules
from lostmotion.evidence.gram import Evidence

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

LOG_OMEGA = (-30.0, 25.0)
"""Bounds of the logarithm of a variance of a scaled column."""

SLOPE_LEAST = 1e-2
"""Slope of the objective over the logarithm of a variance at which REML stops, nats."""

STUCK = 0.05
"""Nats that a variance could still gain by its score, from which on REML is stuck ..."""

LIFTED = 1.0
"""... and the variance from which it goes on."""

RANK = 1e-7
"""Directions of a block with less than this of its largest projected square are left out."""

VISIBLE = 1e-9
"""A column of which the base leaves less than this (of its square) is not visible."""

DAMPED_MAX = 17
"""Powers of ten of the diagonal that normal equations are damped by, one after the other. What the
scatter leaves can be all rounding; beyond the precision's inverse the diagonal outweighs any."""

REDUCED = 1e-12
"""Share of a column's square below which what the deviations of the runs leave of it is rounding:
some thousand times the precision of the sums that are taken from each other."""

FLIPS = 4095
"""Random sign patterns; all of them where there are no more runs than `ALL_FLIPS_RUNS`."""

ALL_FLIPS_RUNS = 12

SEED = 20


@dataclass
class Result:
    """One candidate in the contest.

    Attributes
    ----------
    wald : float
        Fall of the quadratic form.
    rank : int
        Directions that the candidate has beside the base.
    p : float
        Of the run-level F test, before Bonferroni.
    flip_p : float
        Share of sign patterns of the runs that do at least as well, the true one among them.
    flip_limit : float
        Largest `flip_p` that speaks for the candidate with this plan; what it has more than the
        level, the F test has to make up for.
    gain : float
        Leave-one-run-out gain in log predictive density, nats.
    gain_by_run : ndarray
    coefficients : ndarray
        Of the scaled columns.
    covariance : ndarray
    omega : ndarray
    fixed_step : ndarray
        Of the base's scaled columns.
    block : str
        The columns that were judged: all of the candidate's, or those of one start.
    """

    name: str
    wald: float
    rank: int
    p: float
    flip_p: float
    flip_limit: float
    gain: float
    gain_by_run: FloatArray
    coefficients: FloatArray
    covariance: FloatArray
    omega: FloatArray
    fixed_step: FloatArray
    block: str


@dataclass
class Reduced:
    """A hypothesis reduced to its fixed columns: per run, and what the scatter costs."""

    matrix: FloatArray
    log_det: FloatArray


def without_scatter(
    gram: FloatArray, omega: FloatArray, sides: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve ``(I + gram omega) x = sides`` for every run, and the logarithms of the determinants.

    Where the variances are so large that the identity is lost beside them (the first step of a
    descent goes to their bounds), the elimination may meet a pivot of zero. The same in the
    eigenvectors of the symmetric ``omega^1/2 gram omega^1/2`` loses nothing.

    Parameters
    ----------
    gram : ndarray, (runs, n, n)
        Of the scattering columns, positive semidefinite.
    omega : ndarray, (n,)
        Variance of each scattering column, above 0.
    sides : ndarray, (runs, n, m) or (n, m)
        Right sides, of each run or of all.

    Returns
    -------
    solved : ndarray, (runs, n, m)
    log_det : ndarray, (runs,)
    """
    k = np.eye(omega.size) + gram * omega
    # One right side for all runs is spread out: NumPy 1 took (n, m) for vectors of n runs.
    sides = np.broadcast_to(sides, (*k.shape[:-2], *sides.shape[-2:]))
    try:
        return np.asarray(np.linalg.solve(k, sides)), np.asarray(np.linalg.slogdet(k)[1])
    except np.linalg.LinAlgError:
        root = np.sqrt(omega)
        value, vector = np.linalg.eigh(root[:, None] * gram * root)
        value = np.maximum(value, 0.0)
        turned = vector.transpose(0, 2, 1) @ (root[:, None] * sides)
        solved = vector @ (turned / (1.0 + value)[:, :, None]) / root[:, None]
        return solved, np.log1p(value).sum(axis=1)


def factored(h: FloatArray) -> FloatArray:
    """Cholesky factor of normal equations; where roundoff has left them indefinite, damped."""
    try:
        return np.asarray(np.linalg.cholesky(h))
    except np.linalg.LinAlgError:
        unit = np.abs(np.diag(h)) + 1.0
    for power in range(-6, DAMPED_MAX):
        try:
            return np.asarray(np.linalg.cholesky(h + 10.0**power * np.diag(unit)))
        except np.linalg.LinAlgError:
            continue
    raise np.linalg.LinAlgError("normal equations are not finite")


def reduce(evidence: Evidence, index: IntArray, omega: FloatArray) -> Reduced:
    """Take the scatter out of every run's Gram matrix (Woodbury)."""
    b = evidence.scatter
    sbb = evidence.gram[:, b[:, None], b]
    sbx = evidence.gram[:, b[:, None], index]
    c, log_det = without_scatter(sbb, omega, sbx)
    taken = (sbx * omega[:, None]).transpose(0, 2, 1) @ c
    matrix = evidence.gram[:, index[:, None], index] - taken
    return Reduced(matrix, log_det)


def held_out(reduced: Reduced, ridge: FloatArray) -> FloatArray:
    """Log predictive density of every run under a fit to the others, uncertain as that fit is.

    The coefficients that the other runs leave add ``X inv(H) X'`` to the covariance of the run:
    where they say little of it, as of the one run at the most cycles, it may well lie far off.
    """
    own = reduced.matrix
    total = own.sum(axis=0)
    rest = total - own
    whole = total[:-1, :-1] + np.diag(ridge)
    others = rest[:, :-1, :-1] + np.diag(ridge)
    delta = np.linalg.solve(others, rest[:, :-1, -1:])
    slope = own[:, :-1, -1:] - own[:, :-1, :-1] @ delta
    error = own[:, -1, -1] - np.sum(delta * (own[:, :-1, -1:] + slope), axis=(1, 2))
    taken = np.sum(slope * np.linalg.solve(whole, slope), axis=(1, 2))
    spread = np.linalg.slogdet(whole)[1] - np.linalg.slogdet(others)[1]
    return np.asarray(-0.5 * (error - taken + reduced.log_det + spread))


class Contest:
    """The contest over one body of evidence."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        self.runs = evidence.runs
        rng = np.random.default_rng(SEED)
        if self.runs <= ALL_FLIPS_RUNS:
            codes = np.arange(2 ** (self.runs - 1))
            signs = 1.0 - 2.0 * ((codes[:, None] >> np.arange(self.runs)) & 1)
        else:
            signs = rng.choice([-1.0, 1.0], (FLIPS + 1, self.runs))
            signs[0] = 1.0
        self.signs = signs
        self.total = evidence.gram.sum(axis=0)
        self.null_omega, self.null_objective = self.reml(
            evidence.index(), np.full(evidence.scatter.size, 1e-2)
        )
        self.null = reduce(evidence, evidence.index(), self.null_omega)

    # --- variances -------------------------------------------------------------------------------

    def ridge(self, index: IntArray) -> FloatArray:
        """Prior precision of the columns of a hypothesis, without the residual."""
        out = np.zeros(index.size - 1)
        out[: self.evidence.fixed.size] = self.evidence.precision
        return out + 1e-10 * np.maximum(np.diag(self.total)[index[:-1]], 1.0)

    def reml(self, index: IntArray, start: FloatArray) -> tuple[FloatArray, float]:
        """Variances of the scattering columns by REML, and the objective (nats) that they reach."""
        e = self.evidence
        b = e.scatter
        sbb = e.gram[:, b[:, None], b]
        sbx = np.ascontiguousarray(e.gram[:, b[:, None], index])
        sxx = self.total[np.ix_(index, index)]
        ridge = np.diag(self.ridge(index))
        both = np.concatenate((sbx, sbb), axis=2)
        n = index.size

        def objective(log_omega: FloatArray) -> tuple[float, FloatArray]:
            omega = np.exp(log_omega)
            solved, log_det = without_scatter(sbb, omega, both)
            c, a = solved[:, :, :n], solved[:, :, n:]
            flat = (sbx * omega[:, None]).reshape(-1, n)
            x = sxx - flat.T @ c.reshape(-1, n)
            h = x[:-1, :-1] + ridge
            factor = factored(h)
            half = np.linalg.solve(factor, x[:-1, -1])
            delta = np.linalg.solve(factor.T, half)
            q = x[-1, -1] - half @ half
            value = 0.5 * (float(log_det.sum()) + q + 2.0 * np.log(np.diag(factor)).sum())
            rest = c[:, :, -1] - c[:, :, :-1] @ delta
            inverse = np.linalg.inv(factor)
            spread = c[:, :, :-1] @ inverse.T
            slope = 0.5 * (np.einsum("rkk->k", a) - (spread**2).sum((0, 2)) - (rest**2).sum(0))
            return float(value), slope * omega

        def descend(start: FloatArray) -> tuple[FloatArray, float, FloatArray]:
            found = minimize(
                objective,
                np.clip(np.log(np.maximum(start, 1e-12)), *LOG_OMEGA),
                jac=True,
                method="L-BFGS-B",
                bounds=[LOG_OMEGA] * b.size,
                options={"maxiter": 40, "ftol": 1e-9, "gtol": SLOPE_LEAST},
            )
            return np.exp(found.x), float(found.fun), np.asarray(found.jac)

        omega, value, slope = descend(start)
        # Close to nothing the logarithm hides the slope: a step too far stays there. The score says
        # what is to be gained (Rao's test), and from above the way down is even.
        score = -slope / omega
        own, _ = without_scatter(sbb, omega, sbb)
        information = 0.5 * (np.einsum("rkk->rk", own) ** 2).sum(axis=0)
        idle = (score > 0) & (score**2 > 2.0 * STUCK * information)
        if idle.any():
            again, lower, _ = descend(np.where(idle, np.maximum(omega, LIFTED), omega))
            if lower < value:
                omega, value = again, lower
        return np.asarray(omega, dtype=np.float64), value

    def deviations(self, index: IntArray, omega: FloatArray, delta: FloatArray) -> FloatArray:
        """Predicted deviations of every run (BLUP), in scaled units."""
        e = self.evidence
        b = e.scatter
        sbb = e.gram[:, b[:, None], b]
        sbx = e.gram[:, b[:, None], index]
        rest = sbx[:, :, -1] - sbx[:, :, :-1] @ delta
        return np.asarray(omega * without_scatter(sbb, omega, rest[:, :, None])[0][:, :, 0])

    def solve(self, matrix: FloatArray, index: IntArray) -> tuple[FloatArray, float]:
        """Fixed coefficients and the quadratic form that they leave."""
        h = matrix[:-1, :-1] + np.diag(self.ridge(index))
        delta = np.linalg.solve(h, matrix[:-1, -1])
        return np.asarray(delta), float(matrix[-1, -1] - matrix[:-1, -1] @ delta)

    # --- judging ---------------------------------------------------------------------------------

    def basis(self, block: IntArray, reduced: Reduced, index: IntArray, n0: int) -> FloatArray:
        """Directions of a block that the rest of the hypothesis leaves."""
        total = reduced.matrix.sum(axis=0)
        ridge = np.diag(self.ridge(index))[:n0, :n0]
        cross = total[n0:-1, :n0]
        left = total[n0:-1, n0:-1] - cross @ np.linalg.solve(total[:n0, :n0] + ridge, cross.T)
        raw = np.diag(total)[n0:-1]
        # In units of what each column has before the base takes its part. Of what is all deviation
        # of the runs, nothing but rounding is there.
        seen = raw > REDUCED * np.diag(self.total)[index[n0:-1]]
        unit = np.where(seen, 1.0 / np.sqrt(np.where(seen, raw, 1.0)), 0.0)
        value, vector = np.linalg.eigh(left * np.outer(unit, unit))
        keep = value > max(VISIBLE, RANK * max(float(value[-1]), 0.0))
        return np.asarray(vector[:, keep] * unit[:, None])

    def test(self, name: str, *, refit_scatter: bool = True) -> Result | None:
        """Judge a candidate; None when these recordings cannot show it."""
        e = self.evidence
        block = e.blocks[name]
        index = e.index(name)
        n0 = e.fixed.size
        omega = self.reml(index, self.null_omega)[0] if refit_scatter else self.null_omega
        reduced = reduce(e, index, omega)
        turn = self.basis(block, reduced, index, n0)
        rank = turn.shape[1]
        if rank == 0:
            return None
        # Rotate the block into its visible directions.
        change = np.zeros((index.size, n0 + rank + 1))
        change[:n0, :n0] = np.eye(n0)
        change[n0:-1, n0:-1] = turn
        change[-1, -1] = 1.0
        matrix = change.T @ reduced.matrix @ change
        small = np.concatenate((index[:n0], block[:rank], index[-1:]))
        return self._judge(name, Reduced(matrix, reduced.log_det), small, n0, rank, turn, omega)

    def _judge(
        self,
        name: str,
        reduced: Reduced,
        index: IntArray,
        n0: int,
        rank: int,
        turn: FloatArray,
        omega: FloatArray,
    ) -> Result:
        total = reduced.matrix.sum(axis=0)
        ridge = np.zeros(n0 + rank)
        ridge[:n0] = self.ridge(index)[:n0]
        ridge[n0:] = 1e-10
        h = total[:-1, :-1] + np.diag(ridge)
        g = total[:-1, -1]
        inverse = np.linalg.inv(h)
        delta = inverse @ g
        h0 = h[:n0, :n0]
        k = np.linalg.solve(h0, total[:n0, n0:-1])
        delta0 = np.linalg.solve(h0, g[:n0])
        wald = float(g @ delta - g[:n0] @ delta0)
        # With and without, each under its own variances.
        gain = held_out(reduced, ridge) - self.null_held_out
        own = reduced.matrix
        # Scores of the runs under the base, with this candidate's variances.
        score = (
            own[:, n0:-1, -1]
            - own[:, :n0, -1] @ k
            - np.einsum("rkn,n->rk", own[:, n0:-1, :n0], delta0)
            + (own[:, :n0, :n0] @ delta0) @ k
        )
        # The prior pulls at the base's parameters; its share of the score belongs to no run.
        left = total[n0:-1, n0:-1] - total[n0:-1, :n0] @ k + np.diag(ridge[n0:])
        weight = np.linalg.inv(left)
        sums = self.signs @ score
        statistic = ((sums @ weight) * sums).sum(axis=1)
        flip_p = float(np.mean(statistic >= statistic[0] * (1 - 1e-12)))
        # The same flips, if every run said exactly what the candidate as fitted makes of it.
        cross = own[:, n0:-1, :n0] @ k
        seen = own[:, n0:-1, n0:-1] - cross - cross.transpose(0, 2, 1)
        seen += k.T @ own[:, :n0, :n0] @ k
        ideal = self.signs @ (seen @ delta[n0:])
        reach = ((ideal @ weight) * ideal).sum(axis=1)
        # Runs that show next to nothing have their signs from the noise: a deviation of the whole.
        least = max(1.0 - 1.0 / np.sqrt(max(wald, 1.0)), 0.0) ** 2
        best = float(np.mean(reach >= reach[0] * least * (1 - 1e-9)))
        flip_limit = float(np.clip(rules.FLIP_ROOM * best, rules.FLIP_LEVEL, 1.0))
        # Under REML every direction of a candidate costs the variances a run.
        freedom = max(self.runs - 2 - rank, 1)
        p = float(special.fdtrc(rank, freedom, max(wald, 0.0) / rank))
        coefficients = turn @ delta[n0:]
        covariance = turn @ inverse[n0:, n0:] @ turn.T
        return Result(
            name,
            wald,
            rank,
            p,
            flip_p,
            flip_limit,
            float(gain.sum()),
            gain,
            coefficients,
            covariance,
            omega,
            delta[:n0],
            name,
        )

    @property
    def null_held_out(self) -> FloatArray:
        """Log predictive density of every run under the base alone."""
        if not hasattr(self, "_null_held_out"):
            self._null_held_out = held_out(self.null, self.ridge(self.evidence.index()))
        return self._null_held_out

    def projected(self, names: list[str], omega: FloatArray | None = None) -> FloatArray:
        """Gram matrix of blocks after the base and the scatter have taken their part."""
        e = self.evidence
        index = e.index(*names)
        reduced = reduce(e, index, self.null_omega if omega is None else omega).matrix.sum(axis=0)
        n0 = e.fixed.size
        cross = reduced[n0:-1, :n0]
        h0 = reduced[:n0, :n0] + np.diag(self.ridge(index)[:n0])
        return np.asarray(reduced[n0:-1, n0:-1] - cross @ np.linalg.solve(h0, cross.T))

    def taken_up(self, block: str, coefficients: FloatArray, places: IntArray) -> float:
        """Share (of its square) of what a block does that some of the base's columns could do.

        Parameters
        ----------
        block : str
        coefficients : ndarray
            Of the block's scaled columns.
        places : ndarray
            The columns, among those of the evidence.
        """
        e = self.evidence
        kept = ~np.isin(e.fixed, places)
        freed = copy(self)
        freed.evidence = replace(
            e,
            fixed=e.fixed[kept],
            precision=e.precision[kept],
            blocks={block: e.blocks[block], "freed": places},
        )
        m = freed.projected([block, "freed"])
        n = e.blocks[block].size
        whole = float(coefficients @ m[:n, :n] @ coefficients)
        cross = m[n:, :n] @ coefficients
        taken = float(cross @ np.linalg.pinv(m[n:, n:], rcond=RANK, hermitian=True) @ cross)
        return taken / whole if whole > 0 else 1.0

    def angles(self, a: str, b: str, omega: FloatArray | None = None) -> FloatArray:
        """Principal angles between two candidates beside the base, degrees, least first."""
        m = self.projected([a, b], omega)
        na = self.evidence.blocks[a].size
        halves = []
        for part in (m[:na, :na], m[na:, na:]):
            value, vector = np.linalg.eigh(part)
            keep = value > RANK * max(float(value[-1]), 1e-300)
            halves.append(vector[:, keep] / np.sqrt(value[keep]))
        cosine = np.linalg.svd(halves[0].T @ m[:na, na:] @ halves[1], compute_uv=False)
        return np.asarray(np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))))
