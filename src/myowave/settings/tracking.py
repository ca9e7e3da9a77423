"""The section `tracking`: where MLflow shows the results."""

from myowave.settings.section import Address, Section, setting


class Tracking(Section):
    """Where MLflow shows the results; they are on disk with or without it."""

    uri: Address = setting(
        "MLflow store: sqlite:///FILE, or the http(s) address of a server",
        "",
        "sqlite:///results/mlflow.db",
        pattern=r"^(sqlite:///.+|https?://\S+)$",
    )
