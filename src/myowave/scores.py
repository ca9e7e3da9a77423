"""The one definition of the scores that tables, pictures, pages and MLflow show, and what these call baselines."""

import numpy as np
import pandas as pd

# Of the baselines of config.yaml, on pages and in pictures; tables keep their names, and others have no title.
TITLES = {
    "hold": "hold the first angle",
    "ridge": "ridge on lagged EMG",
    "trees": "boosted trees",
    "gru_plain": "plain GRU",
    "cnn": "causal convolution",
}
WORST = {"test_rmse_deg": np.inf, "test_mse": np.inf, "test_nmse": np.inf, "test_r2": -np.inf}


def median_over_seeds(evaluation: pd.DataFrame) -> pd.Series:
    """The numbers that are shown of a network, from its rows of evaluation.csv: medians over its seeds; one whose
    prediction is not finite counts as the worst."""
    numbers = evaluation.select_dtypes("number")
    return numbers.fillna({name: worst for name, worst in WORST.items() if name in numbers}).median()
