# What the diagnosis says where nobody here made the truth: `snakemake reality --cores 2`. It is a study of its own, with
# settings and jobs of its own, so it is called as one.
rule reality:
    log:
        "results/logs/reality.log",
    threads: workflow.cores
    params:
        python=sys.executable,
        study=ROOT / "studies/reality/Snakefile",
    shell:
        "{params.python:q} -m snakemake -s {params.study:q} --cores {threads} 2>&1 | tee {log:q}"
