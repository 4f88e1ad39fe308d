"""State of the workbench: a drive, its recordings, and results."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.compare import REPEATABILITY, Comparison, compare
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.diagnosis import diagnose
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.discover.next_run import next_runs
from lostmotion.discover.plan_file import read_plan
from lostmotion.drives import Drive, format_toml, read_drive
from lostmotion.effects.columns import missing_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.evidence.overlap import principal_angles
from lostmotion.export import Profile, export, make_controller, read_settings
from lostmotion.files import check_plain, write_whole
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import Campaign, read_campaign, recording_files
from lostmotion.recordings.column_table import Choice, ColumnTable
from lostmotion.recordings.joining import Join
from lostmotion.report import comparison_section, drive_section
from lostmotion.report.maps import Residuals, collect_residuals
from lostmotion.report.wording import NOISE_FLOOR
from lostmotion.threads import one_thread
from lostmotion.units import ARCSEC
from lostmotion.workbench.disclosure import is_known
from lostmotion.workbench.figures import Rendered, render_section


@dataclass(frozen=True)
class Rivals:
    """Two effects side by side.

    Attributes
    ----------
    models : dict
        By name, fitted with the present model and this effect.
    gains : dict
        Evidence of each run, nats; empty if the diagnosis could not test one of them.
    angle_deg : float or None
        Angle between their contributions after projection on the baseline model: small means
        confounded.
    """

    models: dict[str, FittedModel]
    gains: dict[str, np.ndarray[Any, np.dtype[np.float64]]]
    angle_deg: float | None


@dataclass
class Bench:
    """State of the workbench and the calls that change it.

    Every call either changes the state or raises and leaves it unchanged; only `columns` are those
    of the recordings that were named last, so that a map can be corrected.

    Attributes
    ----------
    chosen : list of str
        Effects added to the model, in order; the fits are kept, so that undo and redo cost nothing.
    version : int
        Incremented with every change.
    opened : str
        Panel that was opened last; a reloaded page shows it.
    named : list of path
        Recordings that were named last, which may have been refused.
    columns : ColumnTable or None
        Their columns; None if they are of an unknown kind.
    """

    folder: Path = field(default_factory=lambda: Path(tempfile.mkdtemp(prefix="lostmotion-")))
    effects: dict[str, Effect] = field(default_factory=lambda: dict(library()))
    drive: Drive | None = None
    drive_page: Rendered = field(default_factory=Rendered)
    paths: list[Path] = field(default_factory=list)
    named: list[Path] = field(default_factory=list)
    columns: ColumnTable | None = None
    join: Join | None = None
    campaign: Campaign | None = None
    comparison: Comparison | None = None
    comparison_page: Rendered = field(default_factory=Rendered)
    diagnosis: Diagnosis | None = None
    chosen: list[str] = field(default_factory=list)
    models: dict[tuple[str, ...], FittedModel] = field(default_factory=dict)
    rivals: Rivals | None = None
    ranking: dict[str, Any] | None = None
    version: int = 0
    opened: str = ""

    # --- loading ---------------------------------------------------------------------------------

    def load_drive(self, file: str | Path) -> None:
        """Read a drive file and predict; recordings of another drive are removed."""
        check_plain(file, "a drive file")
        drive = read_drive(file)
        self.drive, self.drive_page = drive, render_section(drive_section(drive))
        self._forget_recordings()

    def load_recordings(
        self,
        paths: Sequence[str | Path],
        mapping: Mapping[str, str] | None,
        tick: OnProgress,
        file: str | Path | None = None,
    ) -> None:
        """Read recordings of the drive, or of that in a file, and compare them with the model.

        Without a map, the entries of the present one are used that name a column of the recordings.
        """
        for path in (*paths, *([] if file is None else [file])):
            check_plain(path, "a drive file" if path == file else "a recording or a folder of them")
        drive = self.need_drive() if file is None else read_drive(file)
        entries = self.read_columns(paths, mapping, drive)
        campaign = read_campaign(
            list(paths),
            ratio=drive.ratio,
            mapping={**drive.columns, **entries},
            protocol=drive.protocol,
            join=self.join,
        )
        with one_thread():
            result = compare(drive, campaign, effects=self.effects, progress=tick)
        page = render_section(comparison_section(drive, result, recording_files(list(paths))))
        if file is not None:
            self.drive, self.drive_page = drive, render_section(drive_section(drive))
        self._forget_recordings()
        self.paths = [Path(path) for path in paths]
        self.campaign, self.comparison, self.comparison_page = campaign, result, page
        self.version += 1

    def read_columns(
        self, paths: Sequence[str | Path], mapping: Mapping[str, str] | None, drive: Drive
    ) -> dict[str, str]:
        """Read the columns of recordings, and return their map."""
        files = recording_files(list(paths))
        entries = dict(mapping or {})
        if mapping is None and self.columns is not None:
            entries = dict(self.columns.entries)
        known = all(is_known(str(file)) for file in files)
        table = (
            ColumnTable.of_files(files, entries, drive.columns, drive.protocol) if known else None
        )
        if mapping is None and table is not None:
            table = table.without_absent()
            entries = table.entries
        self.named, self.columns = [Path(path) for path in paths], table
        self.version += 1
        return entries

    def choose_column(self, column: str, choice: Choice) -> None:
        """Change the map of one column; the recordings are not read again."""
        if self.columns is not None:
            self.columns = self.columns.with_choice(column, choice)
            self.version += 1

    def _forget_recordings(self) -> None:
        self.paths = []
        self.campaign = self.comparison = self.diagnosis = None
        self.comparison_page = Rendered()
        self.chosen, self.models, self.rivals, self.ranking = [], {}, None, None
        self.version += 1

    def need_drive(self) -> Drive:
        """Return the drive, or raise an error if there is none."""
        if self.drive is None:
            raise InputError("DRIVE", "", "none loaded", "a drive file")
        return self.drive

    def need_campaign(self) -> Campaign:
        """Return the recordings, or raise an error if there are none."""
        if self.campaign is None:
            raise InputError("DATA", "", "none loaded", "recordings of the drive")
        return self.campaign

    # --- diagnosis and fits ----------------------------------------------------------------------

    def find_missing(self, tick: OnProgress) -> None:
        """Diagnose: which effect is missing."""
        drive, campaign = self.need_drive(), self.need_campaign()
        with one_thread():
            self.diagnosis = diagnose(drive, campaign, effects=self.effects, progress=tick)
        self.version += 1

    def model_with(self, names: Sequence[str], tick: OnProgress) -> FittedModel:
        """Fit the drive with effects, or return the stored fit."""
        key = tuple(names)
        if key not in self.models:
            drive, campaign = self.need_drive(), self.need_campaign()
            with one_thread():
                self.models[key] = fit_model(
                    drive, campaign, add=list(names), effects=self.effects, progress=tick
                )
        return self.models[key]

    def choose(self, names: Sequence[str], tick: OnProgress) -> None:
        """Set the effects of the model, and fit it."""
        self.model_with(names, tick)
        self.chosen = list(names)
        self.rivals = None
        self.version += 1

    @property
    def model(self) -> FittedModel | None:
        """The fit with the chosen effects, if it exists."""
        return self.models.get(tuple(self.chosen))

    def residuals(self, *, before: bool = False) -> Residuals | None:
        """The residual of the fit with effects, or of the comparison if nothing was fitted.

        Parameters
        ----------
        before : bool
            That of the comparison, without effects, in any case.
        """
        if self.comparison is None:
            return None
        if self.model is not None and not before:
            base = self.model.base
            return collect_residuals(
                base.conditions, base.residual(), self.model.noise_floor_arcsec, NOISE_FLOOR
            )
        return collect_residuals(
            Conditions(self.need_campaign()),
            self.comparison.residual_rad / ARCSEC,
            self.comparison.noise.floor_rad / ARCSEC,
            REPEATABILITY,
        )

    def fittable(self) -> list[str]:
        """Names of the effects whose columns were recorded; of all without recordings."""
        if self.campaign is None:
            return list(self.effects)
        conditions = Conditions(self.campaign)
        return [n for n, one in self.effects.items() if not missing_columns(one, conditions)]

    def compare_effects(self, a: str, b: str, tick: OnProgress) -> None:
        """Compare two effects."""
        if a == b:
            raise InputError("effects", b, "the same effect twice", "two different effects")
        if self.diagnosis is None:
            self.find_missing(tick)
        assert self.diagnosis is not None
        selection = self.diagnosis.need_selection()
        models = {}
        for name in (a, b):
            others = [one for one in self.chosen if one not in (a, b)]
            models[name] = self.model_with([*others, name], tick)
        first = selection.steps[0]
        judged = {result.name: result for result in first.results}
        both = all(name in judged for name in (a, b))
        gains = {name: judged[name].gain_by_run for name in (a, b)} if both else {}
        angle = None
        if both:
            contest = first.round.contest
            blocks = (judged[name].block for name in (a, b))
            angle = float(principal_angles(contest.evidence, contest.null_omega, *blocks)[0])
        self.rivals = Rivals(models, gains, angle)
        self.version += 1

    def rank_options(self, paths: Sequence[str | Path], tick: OnProgress) -> None:
        """Rank planned runs by how well they decide between the open effects."""
        drive = self.need_drive()
        names = drive.columns if self.columns is None else self.columns.mapping
        for path in paths:
            check_plain(path, "a plan")
        options = read_plan(list(paths), drive.ratio, names, drive.protocol)
        if self.diagnosis is None:
            self.find_missing(tick)
        assert self.diagnosis is not None
        with one_thread():
            self.ranking = next_runs(self.diagnosis, options, self.effects, drive.ratio)
        self.version += 1

    # --- export ----------------------------------------------------------------------------------

    def fitted_drive(self) -> str:
        """The drive file with the fit; without a fit, as it was read."""
        drive = self.need_drive()
        return format_toml(drive.document if self.model is None else self.model.document(drive))

    def export(
        self, suffix: str, settings: Sequence[str], profile: Profile, name: str
    ) -> tuple[bytes, Mapping[str, Any]]:
        """Make the controller's parameters: bytes of the file, and the notes of ``export``."""
        drive = self.need_drive()
        given = read_settings(settings)
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            fitted = Path(folder) / Path(drive.file).name
            write_whole(fitted, self.fitted_drive())
            own = {name: one for name, one in self.effects.items() if name not in library()}
            controller = make_controller(read_drive(fitted), given, profile=profile, own=own)
            file = Path(folder) / f"params{suffix}"
            answer = export(controller, file, name=name, title=drive.name)
            return file.read_bytes(), answer

    def close(self) -> None:
        """Delete uploaded files."""
        shutil.rmtree(self.folder, ignore_errors=True)
