"""Simulated torque loops of a known torsion curve and a known hysteresis.

Independent of the library: three straight lines and a loop around them in another form (integrated
slopes), with coloured noise, scatter from loop to loop, offsets of runs and noise of the torque.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

ARCMIN = np.pi / 10_800
ARCSEC = ARCMIN / 60

SIZES = {
    # Torsional stiffness of CSG/CSF gears, ratio above 50 (tests/data/catalogue), Nm and Nm/rad.
    14: (7.8, 2.0, 6.9, 4.7e3, 6.1e3, 7.1e3),
    25: (67.0, 14.0, 48.0, 31e3, 50e3, 57e3),
    40: (265.0, 54.0, 196.0, 13e4, 20e4, 23e4),
}


@dataclass(frozen=True)
class Loop:
    """A drive and how it is measured; angles in rad, torques in Nm."""

    size: int = 25
    amplitude: float = 0.0
    hysteresis: float = 1.0 * ARCMIN
    shape: str = "ellipse"
    gap: float = 0.0
    loops: int = 6
    samples: int = 600
    noise: float = 1.0 * ARCSEC
    memory: float = 0.9
    scatter: float = 0.003
    from_rest: bool = False

    @property
    def rated(self) -> float:
        return SIZES[self.size][0]

    @property
    def truth(self) -> dict[str, float]:
        _, t1, t2, k1, k2, k3 = SIZES[self.size]
        return {"T1": t1, "T2": t2, "K1": k1, "K2": k2, "K3": k3}

    def curve(self, torque: np.ndarray) -> np.ndarray:
        """Deflection by integrating the compliance over a fine grid of torques."""
        _, t1, t2, k1, k2, k3 = SIZES[self.size]
        grid = np.linspace(0.0, 2.0 * self.rated, 200_001)
        compliance = np.where(grid < t1, 1 / k1, np.where(grid < t2, 1 / k2, 1 / k3))
        angle = np.concatenate(([0.0], np.cumsum(0.5 * (compliance[1:] + compliance[:-1]))))
        angle *= grid[1]
        return np.sign(torque) * np.interp(np.abs(torque), grid, angle)

    def lost_motion(self, share: float) -> float:
        """Lost motion by its definition: middles of the loop at plus and minus a share of the rated
        torque."""
        return 2.0 * float(self.curve(np.array([share * self.rated]))[0]) + self.gap

    def torque(self) -> np.ndarray:
        reach = self.amplitude or self.rated
        phase = np.arange(self.samples) / self.samples
        if self.from_rest:
            return reach * np.interp(phase, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
        return reach * np.interp(phase, [0, 0.5, 1], [-1, 1, -1])

    def run(
        self, generator: np.random.Generator, first: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torque and lost motion of one loop as they are recorded.

        Friction is at rest before the first run; its memory continues from run to run.
        """
        torque = self.torque()
        reach = self.amplitude or self.rated
        direction = np.sign(np.diff(torque, prepend=2 * torque[0] - torque[1]))
        if self.shape == "ellipse":
            half = -direction * 0.5 * self.hysteresis * (1 - (torque / reach) ** 2)
        else:
            # Coulomb friction reverses within 8 % of the amplitude after a tip, friction of many
            # contacts within 6, 18 and 36 %.
            contacts = {0.04: 1.0} if self.shape == "coulomb" else {0.03: 0.5, 0.09: 0.3, 0.18: 0.2}
            state = np.empty((torque.size, len(contacts)))
            state[0] = 1.0 if not self.from_rest else 0.0 if first else -1.0
            for i, step in enumerate(np.diff(torque), start=1):
                turned = step / (np.array(list(contacts)) * reach)
                state[i] = np.clip(state[i - 1] - turned, -1, 1)
            half = 0.5 * self.hysteresis * (state @ np.array(list(contacts.values())))
        scale = 1 + self.scatter * generator.normal()
        angle = scale * self.curve(torque) + (1 + self.scatter * generator.normal()) * half
        angle += 0.5 * self.gap * np.clip(torque / (0.005 * self.rated), -1, 1)
        angle += 1e-4 * generator.normal() + self.noise * coloured(
            generator, torque.size, self.memory
        )
        return torque + 2e-4 * reach * generator.normal(size=torque.size), angle

    def runs(self, seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
        generator = np.random.default_rng(seed)
        return [self.run(generator, i == 0) for i in range(self.loops)]

    def write(self, file: Path, seed: int = 1, ratio: float | None = None) -> Path:
        """Write the loops as a recording, of the lost motion or of two angles."""
        names = "run,time_s,torque_Nm,lost_motion_rad"
        if ratio is not None:
            names = "run,time_s,torque_Nm,input_angle_rad,output_angle_rad"
        lines = [names]
        for number, (torque, angle) in enumerate(self.runs(seed), start=1):
            for i, (t, a) in enumerate(zip(torque, angle, strict=True)):
                place = "" if ratio is None else "0.3,"
                shown = a if ratio is None else a + 0.3 / ratio
                lines.append(f"{number},{0.05 * i:.2f},{t:.6g},{place}{shown:.10g}")
        file.write_text("\n".join(lines) + "\n")
        return file


def coloured(generator: np.random.Generator, size: int, memory: float) -> np.ndarray:
    """First-order autoregressive noise of unit variance."""
    fresh = generator.normal(size=size) * np.sqrt(1 - memory**2)
    out = np.empty(size)
    out[0] = generator.normal()
    for i in range(1, size):
        out[i] = memory * out[i - 1] + fresh[i]
    return out
