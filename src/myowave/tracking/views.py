"""How an experiment looks when it is opened: columns, grouping and charts.

MLflow keeps such a view as a tag of the experiment, `mlflow.sharedViewState.{key}`, plain JSON in a private format
(that of MLflow 3.17), and opens it with `?viewStateShareKey={key}`. Where it cannot read one, it opens its usual page.
`make test-browser` opens the real page.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from myowave.settings import SEARCHABLE
from myowave.tracking.contents import DIAGNOSIS, LEARNING, SWEEPS

VIEW = "overview"  # key of the view that is opened first
_SECTION = "charts"
_NAME = "attributes.`Run Name`"
_NAME_WIDTH = 300  # px; the usual one cuts names off

View = dict[str, Any]


def _column(kind: str, name: str) -> str:
    """A column of the table of runs as MLflow names it; `kind` is metrics, params or tags."""
    return f"{kind}.`{name}`"


def _view(columns: Sequence[str], charts: Sequence[View], *, order: str, ascending: bool, **more: Any) -> View:
    return {
        "selectedColumns": ["attributes.`Duration`", *columns],
        "columnOrder": [_NAME],
        "columnWidths": {_NAME: _NAME_WIDTH},  # applies only to columns in the order
        "orderByKey": order,
        "orderByAsc": ascending,
        "compareRunCharts": [
            {"uuid": f"chart-{i}", "metricSectionId": _SECTION, "deleted": False, "isGenerated": False, **chart}
            for i, chart in enumerate(charts)
        ],
        "compareRunSections": [{"uuid": _SECTION, "name": "At a glance", "display": True, "isReordered": False}],
        "isAccordionReordered": True,
        "runsHiddenMode": "SHOWALL",
        "hideEmptyCharts": True,
        **more,
    }


def _axis(name: str, kind: str = "METRIC") -> View:
    return {"key": name, "type": kind, "dataAccessKey": name}


def _scatter(x: View, y: View, name: str) -> View:
    return {"type": "SCATTER", "xaxis": x, "yaxis": y, "displayName": name, "runsCountToCompare": 100}


def _bar(metric: str, name: str) -> View:
    return {"type": "BAR", "metricKey": metric, "dataAccessKey": metric, "displayName": name, "runsCountToCompare": 30}


def _line(metrics: Sequence[str], name: str) -> View:
    return {
        "type": "LINE",
        "metricKey": metrics[0],
        "selectedMetricKeys": list(metrics),
        "xAxisKey": "step",
        "lineSmoothness": 0,
        "scaleType": "log",
        "displayName": name,
        "runsCountToCompare": 30,
    }


def _grouped(tag: str) -> View:
    """Grouped by one tag, whose value then names the group; of several keys the page shows the first letters."""
    return {
        "groupBy": {"aggregateFunction": "average", "groupByKeys": [{"mode": "tag", "groupByData": tag}]},
        "useGroupedValuesInCharts": True,
    }


VIEWS: Mapping[str, Mapping[str, View]] = {
    LEARNING: {
        VIEW: _view(
            [
                *(_column("metrics", name) for name in ("test_mse", "test_r2", "test_nmse", "val_r2")),
                _column("params", "scales"),  # the other coordinates are in the names
            ],
            [
                _scatter(_axis("scales", "PARAM"), _axis("test_mse"), "Test error against number of scales"),
                _scatter(_axis("scales", "PARAM"), _axis("test_r2"), "Test R2 against number of scales"),
                _bar("test_r2", "Test R2 of each group, mean over seeds"),
                _line(["curve/loss"], "Training loss against epoch, through all scales"),
            ],
            order=_column("metrics", "test_mse"),
            ascending=True,
            searchFilter="tags.kind = 'seed'",  # means over seeds are made here; their parents would count twice
            **_grouped("group"),
        )
    },
    SWEEPS: {
        VIEW: _view(
            [
                _column("metrics", "held_out_error_deg"),
                *(_column("params", name) for name in SEARCHABLE),  # those that no sweep searched are not shown
                _column("tags", "state"),
            ],
            [_bar("held_out_error_deg", "Error on held-out data [deg]")],
            order=_column("metrics", "held_out_error_deg"),
            ascending=True,
        )
    },
}


def views_of(experiment: str) -> Mapping[str, View]:
    """The views of an experiment; each diagnosed dataset has its own, and all look alike."""
    return _DIAGNOSIS if experiment.startswith(DIAGNOSIS.split("{")[0]) else VIEWS.get(experiment, {})


_DIAGNOSIS: Mapping[str, View] = {
    VIEW: _view(
        [
            *(_column("params", name) for name in ("model", "effects")),
            *(_column("metrics", name) for name in ("train_rmse_deg", "heldout_rmse_deg", "missing_torque_Nm")),
        ],
        [
            _line(
                ["curve/heldout_rmse_deg", "curve/train_rmse_deg", "curve/noise_deg"],
                "Error against number of effects [deg]",
            ),
            _line(["curve/missing_torque_Nm"], "Missing torque against number of effects [N m]"),
            _bar("heldout_rmse_deg", "Error on held-out trials of each model"),
        ],
        order=_column("metrics", "heldout_rmse_deg"),
        ascending=False,
    )
}
