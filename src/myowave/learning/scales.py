"""Whether more scales help, judged by the scatter of seeds, for every dataset, model and recipe.

Seeds see one draw of the data: a finding may be another in the next (docs/multiresolution.md judged over draws).
"""

import numpy as np
import pandas as pd

CLEAR = 2.0  # standard errors from 0 from which a difference is more than the scatter of seeds
COLUMNS = [
    *("dataset", "model", "recipe", "scales", "gain_r2", "standard_error", "seeds_that_gain", "finding"),
]


def judge_scales(summary: pd.DataFrame) -> pd.DataFrame:
    """Whether more scales help: test R2 of the most scales less that of the fewest, seed by seed.

    Args:
        summary: rows of evaluation.csv.

    Returns:
        One row per dataset, model and recipe that was trained with several numbers of scales, in `COLUMNS`: mean
        difference, its standard error over seeds, seeds that gain, and finding.
    """
    rows = []
    for (dataset, model, recipe), group in summary.groupby(["dataset", "model", "recipe"]):
        wide = group.pivot(index="seed", columns="scales", values="test_r2")
        most, fewest = wide.columns.max(), wide.columns.min()
        if most == fewest:
            continue
        gain = (wide[most] - wide[fewest]).dropna().to_numpy()
        mean = gain.mean() if len(gain) else np.nan
        error = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.nan
        clear = abs(mean) > CLEAR * error
        finding = f"{'helps' if mean > 0 else 'harms'} in this draw" if clear else "not more than the scatter of seeds"
        counted = f"{(gain > 0).sum()} of {len(gain)}"
        rows.append((dataset, model, recipe, f"{most} against {fewest}", mean, error, counted, finding))
    return pd.DataFrame(rows, columns=COLUMNS)
