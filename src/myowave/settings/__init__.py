"""Every setting of config.yaml: its type, bounds, unit and meaning. There is no other schema.

A module for each section, `configuration` for what they ask of one another. `parse_settings` turns the parsed YAML into
frozen objects or says, a line for each problem, which key is wrong, what was found and what is allowed. `myowave
settings` prints the keys as a table. Nothing heavy is imported here: the Snakefile reads this package at every start.
"""

from myowave.settings.configuration import Settings
from myowave.settings.data import Data, Dataset, Identify, MeasuredDataset, SimulatedDataset, Wavelet, public
from myowave.settings.diagnosis import Diagnosis, Study
from myowave.settings.learning import SEARCHABLE, Dimension, Learning, Recipe, Sweep
from myowave.settings.parsing import KEYS, check_effects, parse_section, parse_settings
from myowave.settings.physics import Curves, Joint, Muscle, Physics, StraightPath, TablePath
from myowave.settings.section import Section, dump
from myowave.settings.targets import Targets
from myowave.settings.tracking import Tracking

__all__ = [
    "KEYS",
    "SEARCHABLE",
    "Curves",
    "Data",
    "Dataset",
    "Diagnosis",
    "Dimension",
    "Identify",
    "Joint",
    "Learning",
    "MeasuredDataset",
    "Muscle",
    "Physics",
    "Recipe",
    "Section",
    "Settings",
    "SimulatedDataset",
    "StraightPath",
    "Study",
    "Sweep",
    "TablePath",
    "Targets",
    "Tracking",
    "Wavelet",
    "check_effects",
    "dump",
    "parse_section",
    "parse_settings",
    "public",
]
