"""Train the network at one scale, starting where the next coarser scale stopped."""


wildcards, params = snakemake.wildcards, snakemake.params
