"""Where training from coarse to fine helps: arms that differ in one thing, on draws of several kinds of data, in pairs.

Read in this order: `draws` (the trials of a draw), `arms` (what each arm trains on), `compete` (all arms of a draw, and
their errors), `judge` (differences in pairs, with intervals over draws), `figures`, `page`.
"""
