"""Checks of recordings: each says where, what was found, what was expected and what to do, and changes nothing.

A problem (`signals`, `values`) makes an answer wrong: it stops the import, and all are told at once. A finding (`emg`,
`motion`, `cause`, `session`) is a doubt: it is told beside the results, with the likely cause and the setting that
mends it. A new one is a function that says what it found, or nothing, and a line in the table of its module.
"""
