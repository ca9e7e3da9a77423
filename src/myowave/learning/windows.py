"""Windows of trials for training and validation, and noise on what a network sees of them.

The last part of every training trial is kept for validation and never trained on. A training window begins anywhere in
the rest: `history` samples with a known angle, then the samples to predict.

Shapes: S seeds (1 where all seeds share the motion), T trials, N samples, X inputs, B windows, K samples of a window.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.network import Network
from myowave.learning.prediction import run_free

BLOCK = 16  # windows of an epoch are a multiple of this: a few more than a multiple cost a whole vector register


@dataclass(frozen=True)
class Pieces:
    """Pieces of equal length of some trials: trial and first sample of each, (B,), and their number of samples K."""

    trial: Tensor
    start: Tensor
    length: int

    @classmethod
    def draw(cls, usable: Tensor, count: int, length: int, random: torch.Generator) -> "Pieces":
        """In the first samples of trials, of which so many are `usable` (T,): of each trial in proportion to these, at
        any place within it alike; by numbers of the CPU, so that a seed means the same on every device. A piece of a
        trial that is shorter begins where it does, see `within`."""
        counts = usable.cpu()
        ends, places = counts.cumsum(0), (counts - length + 1).clamp(min=1)
        at = torch.rand(count, generator=random).double() * ends[-1]
        trial = torch.searchsorted(ends, at, right=True)
        share = (at - (ends - counts)[trial]) / counts[trial]
        start = (share * places[trial]).long()
        return cls(trial.to(usable.device), start.to(usable.device), length)

    def within(self, usable: Tensor) -> Tensor:
        """Which of their samples are usable, (B, K)."""
        step = torch.arange(self.length, device=self.start.device)
        return step < (usable[self.trial] - self.start)[:, None]

    def of(self, values: Tensor, *, seeds: bool = False) -> Tensor:
        """Pieces (B, K, ...) of values (T, N, ...), or (S, B, K, ...) of (S, T, N, ...) where these have seeds; beyond
        the record the last sample is repeated."""
        sample = self.start[:, None] + torch.arange(self.length, device=self.start.device)
        sample, trial = sample.clamp(max=values.shape[1 + seeds] - 1), self.trial[:, None]
        return values[:, trial, sample] if seeds else values[trial, sample]


@dataclass(frozen=True)
class Corpus:
    """Trials as the network sees them: inputs (T, N, X), standardised angle and step (S or 1, T, N), and how many of
    the first samples of each windows may be cut from, (T,)."""

    x: Tensor
    z: Tensor
    v: Tensor
    usable: Tensor

    @classmethod
    def of(cls, network: Network, inputs: Tensor, angle: Tensor, dt: float, usable: Tensor) -> "Corpus":
        """From inputs (T, N, C + K), see `given_inputs`, and angles (S or 1, T, N) [rad], on their device."""
        z, v = network.encode_angle(angle)
        return cls(network.encode_inputs(inputs, dt), z, v, usable.to(inputs.device))

    def cut(self, pieces: Pieces) -> tuple[Tensor, Tensor, Tensor]:
        """Windows as x (B, K, X), z and v (S or 1, B, K)."""
        return pieces.of(self.x), pieces.of(self.z, seeds=True), pieces.of(self.v, seeds=True)


def count_windows(usable: Tensor, steps: int) -> int:
    """Windows of an epoch: together they predict about as many samples as there are, (T,) in all."""
    return BLOCK * max(1, round(int(usable.sum()) / steps / BLOCK))


def count_training_samples(trials: Trials, fraction: float, history: int) -> list[int]:
    """Samples of each trial to train on; the `fraction` after them is for validation, none of them where it is 0. A
    ValueError where a trial is too short for both."""
    counts = []
    for name, length in zip(trials.names, trials.lengths, strict=True):
        validation = max(2, round(fraction * length)) if fraction else 0
        if length - validation < history + 2:
            raise ValueError(
                f"dataset {trials.dataset!r}, trial {name!r}: {length} samples are too few to keep {validation} for "
                f"validation and to train with {history} history steps. Use longer trials, or lower history_steps or "
                "validation_fraction."
            )
        counts.append(length - validation)
    return counts


class Validation:
    """One window per trial of a corpus, from the end of its usable samples to that of all; `variance` [rad^2] is of
    its angles."""

    def __init__(self, corpus: Corpus, network: Network, lengths: tuple[int, ...]) -> None:
        self._network, m = network, network.history
        trial, ends = torch.arange(len(lengths)).to(corpus.usable), torch.tensor(lengths).to(corpus.usable)
        pieces = Pieces(trial, corpus.usable - m, m + int((ends - corpus.usable).max()))
        x, z, v = corpus.cut(pieces)
        self.windows = x, *(given[..., :m].expand(network.seeds, -1, -1) for given in (z, v))
        self.angle = network.to_rad(z[0, :, m:])  # of the predicted samples (B, K - m), of which `valid` count
        self.valid = pieces.within(ends)[:, m:]
        self.variance = float(self.angle[self.valid].var(correction=0))

    @torch.no_grad()
    def mse(self) -> Tensor:
        """Mean square error of a free run of the network as it is now, (S,) [rad^2]."""
        return self.score(self._network.to_rad(run_free(self._network, *self.windows)))

    def score(self, predicted: Tensor) -> Tensor:
        """Mean square error [rad^2] of predictions (S, B, K - m) [rad], (S,)."""
        return (predicted - self.angle)[:, self.valid].square().mean(1)


class Noise:
    """Normal numbers to disturb what a network sees, from a generator for each seed, with a standard deviation in the
    unit of what is disturbed; each level of the scales has noise of its own, and each stream that is disturbed."""

    def __init__(self, std: float, seeds: Sequence[int], level: int, stream: int = 0) -> None:
        self.std = std
        self._random = [torch.Generator().manual_seed(stream * 1_000_000 + seed * 100 + level) for seed in seeds]

    def draw(self, *shape: int, like: Tensor) -> Tensor:
        """(S, *shape), with the type and on the device of `like`."""
        noise = torch.stack([torch.randn(*shape, generator=random) for random in self._random])
        return (self.std * noise).to(like)
