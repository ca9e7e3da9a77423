"""The command `myowave`: what a person asks for outside of the workflow. Heavy imports stay inside the commands."""

import contextlib
import itertools
import json
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from myowave.settings import Settings, dump, parse_settings, read_settings
from myowave.settings.files import lay_over, require_regular
from myowave.settings.keys import find_keys, list_groups, list_keys


class Commands(TyperGroup):
    """Commands that end with a message and status 2, and no traceback, where the user's input is wrong."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:  # who read the answers has enough of them
            raise
        except OSError as error:
            if error.filename is None:  # what was to be written has no place, nor has what is left of it at the end
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            where = error.filename or "the output"
            say_aside(f"{where}: {error.strerror}. Correct the name, or what may be done with it.")
        except ValueError as error:
            say_aside(str(error))
        raise typer.Exit(2)


def say_aside(text: str) -> None:
    """A line beside the answers."""
    typer.echo(text, err=True)


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Elbow motion from EMG and what its physics misses.",
)
ConfigFiles = Annotated[
    list[Path],
    typer.Option(
        "--config",
        default_factory=lambda: [Path("config.yaml")],
        show_default="config.yaml",
        help="configuration to read; given again, it is laid over those before",
    ),
]
MASS = typer.Option(help="of the body, kg")
HEIGHT = typer.Option(help="of the body, m")
SEX = typer.Option(help="f or m: whose table of body segments is taken")


@app.command("settings")
def list_settings(
    words: Annotated[list[str] | None, typer.Argument(help="a group, as learning.sweep, or words, as noise")] = None,
    everything: Annotated[bool, typer.Option("--all", help="every key of config.yaml")] = False,
) -> None:
    """List groups of settings, or the keys of a group or about a word with unit, default, meaning, allowed values."""
    keys = list_keys(Settings)
    if not words and not everything:
        for group, (count, meaning) in list_groups(keys).items():
            typer.echo(f"{typer.style(f'{group:<18}', bold=True)} {count:>3}  {meaning}")
        typer.echo("`myowave settings GROUP` lists the keys of one, `myowave settings WORD` finds some, --all is all.")
        return
    for key in find_keys(keys, words or []):
        typer.echo(f"{typer.style(key.name, bold=True)}  {key.facts}\n    {key.meaning}: {key.allowed}")


@app.command("effects")
def list_effects(config: ConfigFiles) -> None:
    """List the physical effects that a model may have: where they act, their equation and parameters."""
    settings = read_settings(config)
    from myowave.physics.effects import catalogue

    effects = catalogue(settings.physics.effect_files)
    for effect in effects.values():
        where = f"{effect.title}; on {effect.acts_on}"
        typer.echo(f"{typer.style(effect.name, bold=True)}  {where}:  {effect.equation}")
        for name, p in effect.parameters.items():
            typer.echo(f"    {name} [{p.unit}], {p.low:g} to {p.high:g}: {p.meaning}")
        typer.echo(f"    Source: {effect.source}")


@app.command()
def predict(
    config: ConfigFiles,
    dataset: Annotated[str, typer.Option(help="whose trial and network are taken")] = "",
    trial: Annotated[str, typer.Option(help="of the dataset; also one that was recorded since the import")] = "",
    checkpoint: Annotated[Path | None, typer.Option(exists=True, help="scale-0.pt of a trained network")] = None,
    emg: Annotated[str, typer.Option(help="CSV (.gz) or Parquet with the EMG; - is a stream, standard input")] = "",
    seed: Annotated[int | None, typer.Option(help="one seed; else the mean of all, with its spread (1 SD)")] = None,
    start_deg: Annotated[str, typer.Option(help="of rest, or the first measured, with commas; else a column")] = "",
    deg: Annotated[bool, typer.Option("--deg", help="angles in degrees; else in radians")] = False,
    known: Annotated[list[str] | None, typer.Option(help="NAME=VALUE that is no column, as load=2.5")] = None,
    raw: Annotated[bool, typer.Option("--raw", help="raw EMG, in uV at its own rate; for phase: causal")] = False,
    output: Annotated[Path | None, typer.Option(dir_okay=False, help="file to write; else the terminal")] = None,
    picture: Annotated[Path | None, typer.Option(dir_okay=False, help="picture to draw (png, pdf, svg)")] = None,
) -> None:
    """Predict the angle from EMG, a line for each sample of the network, as soon as it is there."""
    from myowave.learning.checkpoint import Checkpoint
    from myowave.learning.streaming import sources
    from myowave.learning.streaming.command import predict_lines, start_angles
    from myowave.learning.streaming.predictor import Predictor
    from myowave.learning.streaming.raw import require_real_time
    from myowave.learning.streaming.reading import read_known

    if not (emg or trial) or not (checkpoint or dataset) or (trial and not dataset):
        raise ValueError("Give --dataset NAME --trial TRIAL, or --checkpoint FILE --emg FILE.")
    if emg and trial:
        raise ValueError(f"--trial {trial} and --emg {emg} are both given; give the one that is to be predicted.")
    if checkpoint is None:
        checkpoint = sources.find_checkpoint(dataset)
        say_aside(f"Network: {checkpoint}; --checkpoint names another.")
    trained = Checkpoint.load(checkpoint)
    if dataset not in ("", trained.dataset):
        say_aside(f"{checkpoint} was trained on {trained.dataset}, not on {dataset}: EMG of 1 may mean something else.")
    angles = start_angles(trained, start_deg)
    real_time = require_real_time(trained, checkpoint) if raw else None
    fixed = read_known(known or [], tuple(trained.architecture.known))
    predictor = Predictor(trained, None if seed is None else [seed])
    if emg not in ("", "-") and dataset and not raw:
        # Prepared as the other trials, so that the same EMG counts as 1.
        trial = sources.trial_of(Path(emg), dataset, config) or ""
    refuse_to_overwrite(output, r"time_s,angle_\w+(,(spread|low|high)_\w+)*\r?\n", "prediction")
    refuse_to_overwrite(picture, r"\x89PNG|%PDF|<\?xml", "picture")
    if output and picture and output.resolve() == picture.resolve():
        raise ValueError(f"--output and --picture are both {output}; name two files.")
    if picture:
        from myowave.plotting import require_format, save

        require_format(picture)
    lines: Iterable[str]
    if trial:
        lines, source = sources.trial_lines(dataset, trial, trained, config), f"{dataset}, trial {trial}"
    elif emg == "-":
        lines, source = sources.standard_input(), "standard input"
    else:
        lines, source = sources.file_lines(Path(emg)), emg
    seen: Iterable[str] = ()
    if picture:
        lines, seen = itertools.tee(lines)
    answers = predict_lines(predictor, lines, source, angles, fixed, say=say_aside, deg=deg, raw=real_time)
    first = next(answers)  # a file from before stays where nothing can be predicted
    predicted: list[str] = []
    with output.open("w", encoding="utf-8") if output else contextlib.nullcontext(sys.stdout) as target:
        for line in itertools.chain([first], answers):
            print(line, file=target, flush=True)
            if picture:
                predicted.append(line)
    if picture:
        from myowave.learning.figures import draw_prediction

        step = 1 / real_time.rate if real_time else trained.dt
        save(draw_prediction(predicted, seen, source, step), picture)


@app.command("plan")
def plan_trials(
    config: ConfigFiles,
    dataset: Annotated[str, typer.Option(help="whose verdict is in results/, or whose trials are being recorded")],
    watch: Annotated[Path | None, typer.Option(help="folder in which trials appear; each is read at once")] = None,
) -> None:
    """Say what to record next, as a person at a table does it, and which question that decides."""
    if watch is not None:
        with contextlib.suppress(KeyboardInterrupt):
            from myowave.watching import watch_session

            for line in watch_session(dataset, config, watch):
                typer.echo(line)
        return
    from myowave.diagnosis.report.tell import tell

    path = Path("results/diagnosis", dataset, "verdict.json")
    if not path.exists():
        there = ", ".join(sorted(p.parent.name for p in Path("results/diagnosis").glob("*/verdict.json")))
        read_settings(config).dataset(dataset)  # tells a name that is none
        raise ValueError(
            f"There is no verdict {path}; there are {there or 'none'}. Name the dataset under targets and run "
            "snakemake with all your files of settings."
        )
    require_regular(path)
    try:
        said = tell(json.loads(path.read_text(encoding="utf-8")))
    except Exception as error:  # whatever its facts make the sentences raise
        reason = f"{type(error).__name__}: {error}"
        raise ValueError(f"{path} is no verdict ({reason}). Remove it, and run again: it is made anew.") from None
    typer.echo(f"{said['headline']}\n{said['plan']}")


@app.command("subject")
def describe_subject(
    mass: Annotated[float, MASS],
    height: Annotated[float, HEIGHT],
    sex: Annotated[str, SEX],
    name: Annotated[str, typer.Option(help="of the arm in the settings")] = "me",
) -> None:
    """Print settings of a person's forearm with hand, each value with its standard deviation and source."""
    from myowave.starting.subject import subject_settings

    typer.echo(subject_settings(mass, height, sex, name), nl=False)


@app.command("geometry")
def sample_geometry(
    model: Annotated[Path, typer.Argument(help="a model of OpenSim, .osim")],
    coordinate: Annotated[str, typer.Option(help="the elbow's angle in it, such as r_elbow_flex")],
    output: Annotated[Path, typer.Option(file_okay=False, help="folder to write into")],
    muscles: Annotated[list[str] | None, typer.Option(help="again for each; else all that move it")] = None,
    name: Annotated[str, typer.Option(help="of the arm in the settings")] = "mine",
    step: Annotated[float, typer.Option(help="largest distance of angles, deg")] = 5.0,
    sign: Annotated[int, typer.Option(help="-1 where the coordinate falls in flexion")] = 1,
) -> None:
    """Write tables of muscle paths, and settings of an arm with them, from a model of OpenSim."""
    from myowave.starting.geometry import write_geometry

    typer.echo(write_geometry(model, coordinate, muscles or [], output, name, step, sign))


@app.command("new")
def begin_dataset(
    name: Annotated[str, typer.Argument(help="of the dataset, such as my_arm")],
    folder: Annotated[Path, typer.Option("--from", help="folder with its recordings")],
    config: ConfigFiles,
    mass: Annotated[float | None, MASS] = None,
    height: Annotated[float | None, HEIGHT] = None,
    sex: Annotated[str | None, SEX] = None,
    arm: Annotated[str | None, typer.Option(help="of the settings; else arm26, with the person's forearm")] = None,
    force: Annotated[bool, typer.Option(help="write over a file that is there")] = False,
) -> None:
    """Write settings for a folder of recordings into NAME.yaml, and say what was guessed and what to fill in."""
    from myowave.starting.new import begin

    typer.echo(begin(name, folder, config, (mass, height, sex), arm, force))


@app.command("changed")
def ask_what_changed(
    dataset: Annotated[str, typer.Argument(help="a dataset of the settings, whose trials are prepared")],
    config: ConfigFiles,
    reference: Annotated[str, typer.Option(help="trials of the first group, with commas; else the settings'")] = "",
    against: Annotated[str, typer.Option(help="trials of the second group; else the settings'")] = "",
    electrodes_stayed: Annotated[bool, typer.Option("--electrodes-stayed", help="the electrodes stayed on")] = False,
) -> None:
    """Say what changed between two groups of trials: before and after, with and without."""
    settings = read_settings(config)
    block = settings.dataset(dataset)
    groups = block.changed
    if reference or against:
        wanted = {"reference": named(reference), "against": named(against)}
        wanted = {side: trials for side, trials in wanted.items() if trials} | {"electrodes_stayed": False}
        asked = {"data": {"datasets": {dataset: {"changed": wanted}}}}
        groups = parse_settings(lay_over(dump(settings), asked)).dataset(dataset).changed
    if groups is None:
        raise ValueError(
            f"data.datasets.{dataset}.changed: found nothing; expected two groups of trials. Add changed: {{reference: "
            "[trials], against: [trials]}, or give --reference and --against."
        )
    from myowave.data.prepared import read_prepared
    from myowave.diagnosis.changed.ask import SIDE_BY_SIDE, what_changed
    from myowave.diagnosis.report.change import changed_facts, tell_change
    from myowave.models import build_model
    from myowave.physics.effects import catalogue

    trials, physics = read_prepared(dataset, block, config), settings.physics_of(dataset)
    say_aside("Each effect is weighed, then a control.")
    found = what_changed(
        trials,
        build_model("base", physics),
        catalogue(physics.effect_files).values(),
        groups.model_copy(update={"electrodes_stayed": True}) if electrodes_stayed else groups,
        settings.diagnosis_of(dataset).scatter,
        workers=SIDE_BY_SIDE,
    )
    typer.echo("\n".join(tell_change(changed_facts(dataset, found))))


def named(texts: str) -> list[str]:
    return [name.strip() for name in texts.split(",") if name.strip()]


def refuse_to_overwrite(target: Path | None, beginning: str, what: str) -> None:
    """Raise a ValueError where a file is there that does not begin as such a one does: a recording, a network."""
    if target is not None and target.is_file():
        with target.open("rb") as file:
            head = file.readline(1000)  # of what may have gigabytes
        if head and not re.match(beginning.encode(), head):
            raise ValueError(f"{target} is there already, and is no {what} to write over; name another file.")


@app.command()
def ui(
    config: ConfigFiles,
    port: Annotated[int, typer.Option(min=1, max=65535, help="port on 127.0.0.1")] = 5000,
) -> None:
    """Browse the results with MLflow, on this machine only."""
    settings = read_settings(config)
    from myowave.tracking.store import serve

    serve(settings.tracking.uri, port)


if __name__ == "__main__":
    app()
