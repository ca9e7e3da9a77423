"""What changed between two groups of trials of one arm: before and after, with and without.

All that both groups share is integrated out, so errors of the model that repeat in both cancel. Each candidate is a
number of every trial, and the evidence of torque says which one the groups differ by, how much, and whether any.
"""
