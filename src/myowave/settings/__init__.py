"""Every setting of config.yaml: its type, bounds, unit and meaning. There is no other schema.

One module per section, `configuration` for what they ask of one another. `parse_settings` turns the parsed YAML into
frozen objects or says, one line per problem, which key is wrong, what was found and what is allowed. `myowave
settings` lists the keys. Nothing heavy is imported here: the Snakefile reads this package at every start.
"""

from myowave.settings.configuration import Settings, parse_settings, read_settings
from myowave.settings.data import Identify, MeasuredDataset, RecordedDataset, SimulatedDataset, Wavelet, public
from myowave.settings.diagnosis import DiagnosisSettings, Scatter
from myowave.settings.learning import (
    SEARCHABLE,
    Baseline,
    Dimension,
    Inputs,
    PaperRecipe,
    Recipe,
    RolloutRecipe,
    Sweep,
    parse_recipe,
)
from myowave.settings.physics import CurveSettings, MuscleSettings, PathTable, Physics
from myowave.settings.recording import Processing, RawSignal, TextLayout
from myowave.settings.section import Section, dump
