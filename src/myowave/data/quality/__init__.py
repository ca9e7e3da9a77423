"""Quality of raw recordings: findings that do not stop a preparation, each with what to do about it.

What makes a recording unusable is an error and belongs to `data.checks`, `data.session` or `data.preparing`.
"""
