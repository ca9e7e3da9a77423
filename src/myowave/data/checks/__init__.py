"""Checks of recordings: each a generator of problems, so that a user sees all of them at once.

A problem is a sentence with the file and row, what was found, what was expected and what to do. No check changes
anything, and none stops at the first problem of its kind in another file.
"""
