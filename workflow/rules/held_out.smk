# Other trials of a dataset held out in turn, by number of scales: `snakemake held_out --cores 2`. Its table stands in docs/.
HELD_OUT = SETTINGS.learning.held_out

if HELD_OUT is not None:
    HELD_OUT_FOLDER = f"results/held_out/{HELD_OUT.dataset}/{HELD_OUT.recipe}"
    HELD_OUT_PHYSICS = SETTINGS.physics_of(HELD_OUT.dataset)

    localrules:
        held_out,

    rule held_out:
        input:
            f"docs/{HELD_OUT.dataset}_scales.md",

    rule score_held_out:
        input:
            trials=f"results/data/{HELD_OUT.dataset}/trials.parquet",
            physics=HELD_OUT_PHYSICS.files,
        output:
            scores=f"{HELD_OUT_FOLDER}/{{scales}}-scale/{{choice}}.csv",
        log:
            f"results/logs/score_held_out/{HELD_OUT.dataset}/{HELD_OUT.recipe}/{{scales}}-scale/{{choice}}.log",
        wildcard_constraints:
            choice=r"\d+",
        threads: 1
        params:
            physics=dump(HELD_OUT_PHYSICS),
            contents=digest_files(HELD_OUT_PHYSICS.files),
            identify=public(DATASETS[HELD_OUT.dataset])["identify"],
            recipe=dump(SETTINGS.learning.recipes[HELD_OUT.recipe]),
            name=HELD_OUT.recipe,
            test=lambda wildcards: list(HELD_OUT.test[int(wildcards.choice)]),
            wavelet=dump(SETTINGS.data.wavelet),
            seeds=SETTINGS.learning.seeds,
            code=digest("score_held_out"),
        script:
            "../scripts/score_held_out.py"

    rule tabulate_held_out:
        input:
            scores=expand(
                f"{HELD_OUT_FOLDER}/{{scales}}-scale/{{choice}}.csv",
                scales=HELD_OUT.scales,
                choice=range(len(HELD_OUT.test)),
            ),
        output:
            table=f"{HELD_OUT_FOLDER}/scales.csv",
            page=f"docs/{HELD_OUT.dataset}_scales.md",
        log:
            f"results/logs/tabulate_held_out/{HELD_OUT.dataset}/{HELD_OUT.recipe}.log",
        params:
            code=digest("tabulate_held_out"),
        script:
            "../scripts/tabulate_held_out.py"
