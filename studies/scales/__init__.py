"""Where training from coarse to fine helps: ways that differ in one thing, on draws of several kinds of data, in pairs.

Read in this order: `draws` (the trials of a draw), `ways` (what each way trains on), `compete` (all ways of a draw, and
their errors), `judge` (differences in pairs, with intervals over draws), `figures`, `page`.
"""
