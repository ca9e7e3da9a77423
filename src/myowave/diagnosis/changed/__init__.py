"""What changed between two groups of trials of one arm: before and after, with and without.

All that both groups share is fitted to both, so errors of the model that repeat in both cancel. Each candidate acts in
the second group alone, and the evidence of torque says which one, how much, and whether any.
"""
