"""Tables of a diagnosis as text for its page."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from myowave.diagnosis.report.ladder import PHYSICS
from myowave.diagnosis.report.words import LEAST_DEG, titled

RANKING_COLUMNS = {
    "effect": "effect",
    "status": "status",
    "delta_bic": "delta BIC",
    "rmse_deg": "RMSE [deg]",
    "folds": "folds won",
    "estimate": "estimate",
    "smallest_detectable": "smallest detectable",
    "confused_with": "like",
    "reason": "why not",
}
LADDER_COLUMNS = [
    "model",
    "what",
    "training RMSE [deg]",
    "held-out RMSE [deg]",
    "held-out R2",
    "missing torque [N m]",
]
Z95 = 1.96  # half a 95 % interval in standard errors
ANYWHERE = (-np.inf, np.inf)
NOTHING = 1e-9  # a smaller share of a value is no scatter but rounding
Rows = list[tuple[str, ...]]


def number(value: float) -> str:
    """Three digits; empty where there is none."""
    if value is None or pd.isna(value):
        return ""
    return f"{value:.3g}" if np.isfinite(value) else "runs away"


def named(model: str) -> Markup:
    """A model's name that may break after each +."""
    return Markup("+<wbr>").join(escape(part) for part in model.split("+"))


def ranking_table(rows: pd.DataFrame, titles: Mapping[str, str]) -> tuple[list[str], Rows]:
    """The catalogue at one model: columns, those of `RANKING_COLUMNS` in which something stands, and rows."""
    shown = rows.assign(
        folds=[f"{won} of {folds}" for won, folds in zip(rows["folds_won"], rows["folds"], strict=True)],
        confused_with=[
            f"absorbed by {by.replace(' ', ', ') or 'parameters together'}"
            if status == "absorbed"
            else like.replace(" ", ", ")
            for status, by, like in zip(rows["status"], rows["absorbed_by"], rows["confused_with"], strict=True)
        ],
    )[list(RANKING_COLUMNS)]
    texts = [
        [v.replace("+-", "±") if isinstance(v, str) else number(v) for v in row]
        for row in shown.itertuples(index=False)
    ]
    filled = [i for i in range(len(RANKING_COLUMNS)) if any(row[i] for row in texts)]
    columns = [list(RANKING_COLUMNS.values())[i] for i in filled]
    return columns, [tuple(titled(row[i], titles) if i == 0 else row[i] for i in filled) for row in texts]


def ladder_rows(ladder: pd.DataFrame) -> Rows:
    """Every model, the physics and the networks, in the order of `LADDER_COLUMNS`."""
    return [
        (
            named(r.model),
            _what(r.source),
            _error(r.train_rmse_deg),
            _error(r.heldout_rmse_deg),
            "" if pd.isna(r.heldout_r2) else f"{r.heldout_r2:.5f}",
            number(r.missing_torque_Nm),
        )
        for r in ladder.itertuples()
    ]


def parameter_columns(parameters: pd.DataFrame) -> list[str]:
    """The scatter over the seeds of networks and the true error have a column where they are known."""
    columns = ["parameter", "model", "what", "value ± SE", "unit"]
    columns += ["scatter of seeds"] if parameters["scatter"].notna().any() else []
    return [*columns, "true error [%]"] if parameters["error_pct"].notna().any() else columns


def parameter_rows(parameters: pd.DataFrame) -> Rows:
    """Every estimated parameter of every model, in the order of `parameter_columns`."""
    columns = parameter_columns(parameters)
    cells = [
        {
            "parameter": r.parameter,
            "model": named(r.model),
            "what": _what(r.source) + ", were it right" * bool(r.if_right),
            "value ± SE": estimate(r.value, r.se, (r.low, r.high)),
            "unit": "" if pd.isna(r.unit) else r.unit,
            "scatter of seeds": "0" if r.scatter <= NOTHING * abs(r.value) else number(r.scatter),
            "true error [%]": number(r.error_pct),
        }
        for r in parameters.itertuples()
    ]
    return [tuple(row[column] for column in columns) for row in cells]


def proposal_rows(proposals: pd.DataFrame) -> Rows:
    """Trials to record next."""
    return [
        (p.trial, f"{p.separation:.3g}", f"{p.now:.3g}", "yes" if p.separates else "no") for p in proposals.itertuples()
    ]


def interval_of(value: float, se: float, bounds: tuple[float, float]) -> tuple[float, float]:
    """95 % interval of a value with a standard error, within its bounds; all of these where it is not known."""
    low, high = bounds
    return max(value - Z95 * se, low), min(value + Z95 * se, high)


def estimate(value: float, se: float | None, bounds: tuple[float, float] = ANYWHERE) -> str:
    """A value with its standard error, if there is one, to the digits that this leaves; one that may be anywhere within
    its bounds is not known."""
    if se is None or pd.isna(se) or not np.isfinite(se) or se <= 0:
        return f"{value:.4g}"
    if interval_of(value, se, bounds) == bounds:
        return f"{value:.4g}, not known"
    if se < NOTHING * abs(value):
        return f"{value:.6g}"
    digits = max(0, 1 - int(np.floor(np.log10(se))))
    return f"{value:.{digits}f} ± {se:.{digits}f}" if digits <= 6 else f"{value:.6g} ± {se:.1g}"


def _error(value: float) -> str:
    """An error [deg]; no power of ten for one that nobody could measure."""
    return f"under {LEAST_DEG}" if value < LEAST_DEG else number(value)


def _what(source: str) -> str:
    return "physical model" if source == PHYSICS else source


RANKING_TEXTS = ("absorbed_by", "confused_with", "reason", "estimate")


def with_texts(table: pd.DataFrame, columns: Iterable[str] = RANKING_TEXTS) -> pd.DataFrame:
    """A table that was read from its file, where a column without any text holds numbers that are not there."""
    return table.assign(**{name: table[name].astype(object).fillna("") for name in columns if name in table})
