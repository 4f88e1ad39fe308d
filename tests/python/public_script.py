"""A script over the whole public API of the package, for `mypy --strict` and for the tests."""

from __future__ import annotations

import sys
from pathlib import Path

import lostmotion as lm


def main(folder: Path) -> None:
    """Read a drive and recordings, compare, diagnose, fit and predict."""
    drive: lm.Drive = lm.read_drive(folder / "joint.toml")
    campaign: lm.Campaign = lm.read_campaign(folder / "joint.csv.gz", ratio=drive.ratio)
    compared: lm.Comparison = lm.compare(drive, campaign)
    found: lm.Diagnosis = lm.diagnose(drive, campaign)
    fitted: lm.FittedModel = lm.fit(drive, campaign, add=found.effects)
    for result in (compared, found, fitted):
        print(result.params.valuesdict())
        print(float(abs(result.residuals).max()), float(abs(result.predict(campaign)).max()))
    own: lm.Effect = lm.formula(
        "own", "a_rad * sin(input_turns)", values=[lm.Value("a_rad", "linear", 1e-5, -1e-3, 1e-3)]
    )
    print(own, fitted.fit_report(), lm.predict(drive, [0.0, 10.0])["total_arcmin"])
    print(lm.characterize(drive, campaign))
    steps: list[tuple[int, int, str]] = []
    lm.compare(drive, campaign, progress=lambda *step: steps.append(step))
    print(steps, lm.predict(drive, 10.0)._repr_html_())
    lm.write_drive(drive, folder / "copy.toml")


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except lm.InputError as error:
        sys.exit(str(error))
