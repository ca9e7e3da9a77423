"""Experiments on the core: each folder has code and tests of its own.

A study imports myowave and nothing in myowave imports a study, nor one study another. It is run by its own Snakefile,
`snakemake -s studies/NAME/Snakefile`, which plain `snakemake` does not read, or by `python -m studies.NAME`. A study
that has served is deleted, and what it found stays as a page in docs/.
"""
