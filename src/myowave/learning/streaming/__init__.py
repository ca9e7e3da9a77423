"""`myowave predict`: `reading` takes samples from lines, `predictor` predicts from each, `command` joins them."""
