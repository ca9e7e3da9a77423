"""Validation data cut from the training trials."""

from myowave.data.trials import Trials

TAIL = "-end"  # a trial's held-out part is called after it


def hold_out_ends(trials: Trials, share: float) -> Trials:
    """Cut the end off each training trial and keep it for testing; the real test trials are not in the result.

    ASSUME: the end of a trial, started from its own first angles, stands for a trial that was not seen.

    Args:
        trials: with at least one training trial.
        share: of each training trial that is cut off, in (0, 1).

    Returns:
        Twice as many trials as there are training trials: their beginnings under their own names, which train, and
        their ends as `{name}-end`, which test. Conditions and constants are those of the trial.

    Raises:
        ValueError: if a part would have fewer than 2 samples.
    """
    train = trials.select(trials.train)
    cuts = [length - round(share * length) for length in train.lengths]
    for name, cut, length in zip(train.names, cuts, train.lengths, strict=True):
        if min(cut, length - cut) < 2:
            raise ValueError(
                f"dataset {trials.dataset!r}, trial {name!r}: holding out {share:g} of its {length} samples leaves "
                f"{cut} and {length - cut}; expected at least 2 in each part. Change the share or use longer trials."
            )
    parts = [(name, i, slice(0, cut)) for i, (name, cut) in enumerate(zip(train.names, cuts, strict=True))]
    parts += [(name + TAIL, i, slice(cuts[i], train.lengths[i])) for i, name in enumerate(train.names)]
    return Trials.from_sequences(
        dataset=trials.dataset,
        dt=trials.dt,
        names=[name for name, _, _ in parts],
        channels=trials.channels,
        emg=[train.emg[i, samples] for _, i, samples in parts],
        angle=[train.angle[i, samples] for _, i, samples in parts],
        test=[name for name, _, _ in parts if name.endswith(TAIL)],
        conditions={
            name: train.conditions[train.names[i]] for name, i, _ in parts if train.names[i] in train.conditions
        },
        constants=trials.constants,
        signals={key: [values[i, samples] for _, i, samples in parts] for key, values in train.signals.items()},
        over_time=trials.over_time,
        provenance={"held out": f"the last {share:g} of each training trial", "of": trials.provenance},
    )
