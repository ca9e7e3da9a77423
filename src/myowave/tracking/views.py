"""How an experiment looks when it is opened: columns, grouping and charts.

MLflow keeps such a view as a tag of the experiment, `mlflow.sharedViewState.{key}`, plain JSON in a private format
(that of MLflow 3.17), and opens it with `?viewStateShareKey={key}`. Where it cannot read one, it opens its usual page.
`make test-browser` opens the real page.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from myowave.settings import SEARCHABLE
from myowave.tracking.contents import BY_SCALES, DIAGNOSIS, LEARNING, SWEEPS

VIEW = "overview"  # key of the view that is opened first
TABLE = "table"  # of networks, a row for each number of scales
_SECTION = "charts"
_NAME = "attributes.`Run Name`"
_COLUMNS, _CARD_HEIGHT = 2, 420  # wide enough for a title, which is the name of the metric
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
        "compareRunSections": [
            {
                "uuid": _SECTION,
                "name": "At a glance",
                "display": True,
                "isReordered": False,
                "columns": min(len(charts), _COLUMNS),
                "cardHeight": _CARD_HEIGHT,
            }
        ],
        "isAccordionReordered": True,
        "runsHiddenMode": "SHOWALL",
        "hideEmptyCharts": True,
        **more,
    }


def _bar(metric: str, name: str) -> View:
    return {"type": "BAR", "metricKey": metric, "dataAccessKey": metric, "displayName": name, "runsCountToCompare": 30}


def _line(metrics: Sequence[str], name: str, scale: str = "log") -> View:
    return {
        "type": "LINE",
        "metricKey": metrics[0],
        "selectedMetricKeys": list(metrics),
        "xAxisKey": "step",
        "lineSmoothness": 0,
        "scaleType": scale,
        "displayName": name,
        "runsCountToCompare": 30,
    }


def _grouped(tag: str) -> View:
    """Grouped by one tag, whose value then names the group; of several keys the page shows the first letters."""
    return {
        "groupBy": {"aggregateFunction": "average", "groupByKeys": [{"mode": "tag", "groupByData": tag}]},
        "useGroupedValuesInCharts": True,
    }


_TEST_COLUMNS = [
    *(_column("metrics", name) for name in ("test_rmse_deg", "test_r2", "val_r2")),
    _column("params", "scales"),  # the other coordinates are in the names
]
_MEDIANS = "tags.kind = 'median over seeds'"  # the page itself could only take means over the seeds' runs
VIEWS: Mapping[str, Mapping[str, View]] = {
    LEARNING: {
        VIEW: _view(
            _TEST_COLUMNS,
            [_line([BY_SCALES], "Test error [deg] against number of scales, median over seeds")],
            order=_column("metrics", "test_rmse_deg"),
            ascending=True,
            searchFilter=_MEDIANS,
            **_grouped("line"),
        ),
        TABLE: _view(
            _TEST_COLUMNS,
            [
                _bar("test_rmse_deg", "Test error [deg], median over seeds"),
                _bar("test_r2", "Test R2, median over seeds"),
                _line(["curve/loss"], "Training loss against epoch, through all scales"),
            ],
            order=_column("metrics", "test_rmse_deg"),
            ascending=True,
            searchFilter=_MEDIANS,
            **_grouped("group"),
        ),
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
    DIAGNOSIS: {
        VIEW: _view(
            [
                *(_column("params", name) for name in ("verdict", "missing")),
                *(_column("metrics", name) for name in ("base_heldout_rmse_deg", "heldout_rmse_deg", "noise_deg")),
                *(_column("metrics", name) for name in ("missing_deg", "missing_Nm")),
            ],
            [
                _bar("base_heldout_rmse_deg", "Held-out error [deg] of the base model"),
                _bar("heldout_rmse_deg", "Held-out error [deg] with what was found"),
                _bar("missing_deg", "What is still missing [deg]"),
            ],
            order=_column("metrics", "base_heldout_rmse_deg"),
            ascending=False,
            searchFilter="tags.kind = 'verdict'",  # the models that were fitted stand on the page of the verdict's run
        )
    },
}


def views_of(experiment: str) -> Mapping[str, View]:
    """The views of an experiment."""
    return VIEWS.get(experiment, {})
