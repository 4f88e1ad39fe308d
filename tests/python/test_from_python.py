"""Typical input from a notebook works, or one line states what to write."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_campaigns import DRIVE, RATED_NM, RATIO, campaign, gap

import lostmotion as lm
from lostmotion.catalogue import Catalogue
from lostmotion.compare import compare
from lostmotion.discover import Diagnosis, FittedModel, diagnose, fit_model
from lostmotion.drives import Drive, parse_drive, read_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError, LibraryError, TerminatedError
from lostmotion.fit.drive_file import make_base
from lostmotion.model import make_torsion_curve
from lostmotion.on_progress import OnProgress
from lostmotion.predict import predict
from lostmotion.recordings import QUANTITIES, Campaign
from lostmotion.torsion_curve import TorsionCurve

LINE = 400
"""Longest repr in characters: it appears in a cell of a notebook and in messages."""


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    file = tmp_path_factory.mktemp("drive") / "drive.toml"
    file.write_text(DRIVE)
    return read_drive(file)


@pytest.fixture(scope="module")
def warm() -> Campaign:
    return campaign(add=gap)


@pytest.fixture(scope="module")
def found(drive: Drive, warm: Campaign) -> Diagnosis:
    return diagnose(drive, warm)


@pytest.fixture(scope="module")
def fitted(drive: Drive, warm: Campaign) -> FittedModel:
    return fit_model(drive, warm, add="thermal_gap")


def test_the_package_lists_what_is_meant_to_be_used_and_nothing_else() -> None:
    assert dir(lm) == sorted(lm.__all__)
    for name in lm.__all__:
        assert callable(getattr(lm, name)) or name == "__version__", name
    with pytest.raises(AttributeError, match=r"no attribute 'nothing_like_it'$"):
        _ = lm.nothing_like_it


def test_a_drive_comes_first_and_recordings_second() -> None:
    for function in (lm.characterize, lm.compare, lm.diagnose, lm.fit):
        assert list(inspect.signature(function).parameters)[:2] == ["drive", "campaign"]


def test_progress_is_the_number_of_steps_in_every_function(drive: Drive, tmp_path: Path) -> None:
    warm = campaign(runs=6, rows=80, add=gap)
    spec = tmp_path / "spec.toml"
    spec.write_text(
        '[search]\nobjectives = ["lost_motion"]\nevaluations = 300\nworkers = 1\n'
        '[search.fixed]\n"teeth.module_mm" = 0.25\n'
        '[search.range]\n"generator.deflection_mm" = [0.21, 0.28]\n'
    )
    calls: dict[str, Callable[[OnProgress], object]] = {
        "compare": lambda tell: lm.compare(drive, warm, progress=tell),
        "fit": lambda tell: lm.fit(drive, warm, add="thermal_gap", progress=tell),
        "diagnose": lambda tell: lm.diagnose(drive, warm, progress=tell),
        "design": lambda tell: lm.design(spec, tmp_path / "run", progress=tell),
    }
    for name, call in calls.items():
        seen: list[tuple[int, int, str]] = []
        call(lambda *step, seen=seen: seen.append(step))  # type: ignore[misc]
        assert len(seen) > 1, name
        assert all(0 <= done <= of for done, of, _ in seen), name
        assert [done for done, _, _ in seen] == sorted(done for done, _, _ in seen), name
        assert seen[-1][0] == seen[-1][1], name
        assert all(step for done, of, step in seen if done < of), name


def test_a_module_that_is_called_as_a_function_stays_a_module(drive: Drive) -> None:
    import lostmotion.fit.baseline
    import lostmotion.predict

    assert lm.fit.baseline is lostmotion.fit.baseline
    torque = [0.0, 10.0]
    assert lm.predict(drive, torque) == lostmotion.predict.predict(drive, torque)


def test_recordings_in_memory_are_those_of_the_file(drive: Drive, warm: Campaign) -> None:
    table = warm.table()
    again = lm.read_campaign(table, ratio=drive.ratio)
    assert again.fingerprint() == warm.fingerprint()
    frame = pd.DataFrame(table)
    assert lm.read_campaign(frame, ratio=drive.ratio).fingerprint() == warm.fingerprint()


def test_a_drive_replaces_its_single_values(
    drive: Drive, warm: Campaign, found: Diagnosis, fitted: FittedModel
) -> None:
    torsion_curve = make_torsion_curve(drive, warm.largest_torque_Nm)
    other = diagnose(
        None,
        warm,
        ratio=drive.ratio,
        rated_torque_Nm=drive.rated_torque_Nm,
        torsion_curve=torsion_curve,
        base=make_base(drive, warm, torsion_curve, library()),
    )
    assert found.answer() == other.answer()
    again = fit_model(drive, warm, ["thermal_gap"], torsion_curve=torsion_curve)
    np.testing.assert_array_equal(fitted.values, again.values)
    # From its torsion curve alone the rated torque is unknown, which determines the operators.
    by_drive, by_curve = compare(drive, warm).answer(), compare(torsion_curve, warm).answer()
    assert by_drive["rms_arcsec"] == pytest.approx(by_curve["rms_arcsec"], rel=1e-3)
    assert by_drive["rms_arcsec"] == pytest.approx(found.ladder[0]["rms_arcsec"], rel=1e-12)


def test_what_a_fitted_drive_has_is_in_the_model(
    drive: Drive, warm: Campaign, fitted: FittedModel
) -> None:
    assert [term.effect.name for term in fitted.base.terms] == ["thermal_gap"]
    file = parse_drive(fitted.document(drive))
    assert diagnose(file, warm).verdict == "complete"
    assert compare(file, warm).answer()["effects"] == ["thermal_gap"]


def test_the_arguments_in_the_wrong_order_are_named(drive: Drive, warm: Campaign) -> None:
    with pytest.raises(InputError, match="diagnose: campaign: found a Drive, expected a Campaign"):
        diagnose(warm, drive)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="compare: drive: found a Campaign, expected a Drive"):
        compare(warm, drive)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="fit: drive: found a Campaign, expected a Drive"):
        fit_model(warm, drive)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="characterize: drive: found a Campaign, expected a D"):
        lm.characterize(warm, drive)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="characterize: campaign: found nothing, expected a C"):
        lm.characterize(drive)
    with pytest.raises(InputError, match="predict: drive: found a Campaign, expected a Drive"):
        lm.predict(warm, [1.0])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="diagnose: drive: found nothing, expected a Drive, or"):
        diagnose(None, warm)


def test_every_repr_is_a_few_lines(
    drive: Drive, warm: Campaign, found: Diagnosis, fitted: FittedModel
) -> None:
    for thing in (found, fitted, found.base, compare(drive, warm), warm):
        assert len(repr(thing)) < LINE, repr(thing)
    assert "missing-effect" in repr(found)
    assert "thermal_gap" in repr(found)
    assert "thermal_gap" in repr(fitted)
    assert "creep" in repr(library()["creep"])
    assert len(repr(library()["creep"])) < LINE
    assert "small" in repr(drive)
    assert len(repr(drive)) < LINE


def test_the_columns_of_a_campaign_make_a_table(warm: Campaign) -> None:
    table = warm.table()
    assert list(table)[:3] == ["run", "time_s", "torque_Nm"]
    assert {"lost_motion_rad", "temperature_C"} <= table.keys()
    assert {len(column) for column in table.values()} == {warm.rows}
    np.testing.assert_array_equal(table["torque_Nm"], warm.column("torque"))
    labels = [run.label for run in warm.runs]
    np.testing.assert_array_equal(np.unique(table["run"]), np.unique(labels))


def test_a_column_by_its_name_in_the_file_or_a_line_that_states_which(warm: Campaign) -> None:
    np.testing.assert_array_equal(warm.column("torque_Nm"), warm.column("torque"))
    with pytest.raises(InputError, match=r"torqe.*expected one of time, torque.*did you mean"):
        warm.column("torqe")
    absent = next(name for name in QUANTITIES if name not in (*warm.quantities(), "run"))
    with pytest.raises(InputError, match=f"{absent}: found no such column"):
        warm.column(absent)


def test_a_torque_that_is_no_number_is_refused() -> None:
    sheet = Drive("drive", "joint", RATIO, RATED_NM, Catalogue(7.0, 25.0, 16e3, 25e3, 29e3))
    for torque in ([np.nan], [0.0, np.inf], np.nan):
        with pytest.raises(InputError, match=r"predict: torque_Nm: found (nan|inf), expected"):
            predict(sheet, torque)
    with pytest.raises(InputError, match="predict: torque_Nm: found no torque"):
        predict(sheet, [])


def test_a_torsion_curve_takes_lists() -> None:
    line = TorsionCurve(np.array([-1.0, 0.0, 1.0]), np.array([-2.0, 0.0, 2.0]))
    np.testing.assert_allclose(line([0.5, 3.0]), [1.0, 6.0])


@pytest.mark.parametrize(
    "error",
    [
        InputError("drive.toml", "drive.ratio", "-100", "a number above 1"),
        LibraryError(3, "a value is out of range", "ratio", -100.0, 1.0, 1000.0),
        LibraryError(4, "not finished"),
        TerminatedError(15),
    ],
)
def test_an_error_passes_between_processes(error: BaseException) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)
