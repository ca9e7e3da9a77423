"""Fast rollouts of an increment GRU: three times as fast as `prediction.run_free`, which says what they compute.

The backward pass is written by hand (tested against autograd), on memory that is used again and again. Arrays of a step
have the windows innermost, (S, rows, B): the rows of a gate are then one block, which element-wise operations run
through fastest, above all where B is a multiple of 16. Both cells of a sample share one product with [h, x, 1], and one
more gives the next angle, so that a step is a dozen operations.

Shapes: S seeds, B windows, K samples of a window of which m are history, X inputs, H hidden units.
"""

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import torch
import torch.nn.functional as F
from torch import Tensor

from myowave.learning.network import Network


class Workspace:
    """Memory of rollouts of one shape, with views of every step; making them anew costs more than the arithmetic.

    Holds one rollout at a time: its backward pass must come before the next rollout.
    """

    def __init__(self) -> None:
        self._made_for: tuple[Any, ...] | None = None
        self.turn = 0

    def fit(self, x: Tensor, z: Tensor, gates: Tensor) -> None:
        """Be ready for a rollout with inputs like `x`, a history like `z` and packed weights like `gates`."""
        self.turn += 1
        (k, inputs), (s, b, m), rows = x.shape[-2:], z.shape, gates.shape[1]
        made_for = (s, b, k, m, inputs, rows, gates.dtype, gates.device)
        if made_for == self._made_for:
            return
        self._made_for, h = made_for, rows - inputs - 1

        def empty(*shape: int) -> Tensor:
            return torch.empty(shape, dtype=gates.dtype, device=gates.device)

        self.states = empty(k + 1, s, rows, b)  # rows [h_(n-1), x_n, 1] at place n
        self.recurrent = empty(k, s, h, b)  # W_h h_(n-1) of the candidate
        self.current = empty(k - m, s, h + 3, b)  # rows [state of the current cell, z_(n-1), v_(n-1), 1]
        self.features = empty(k, s, 2, b)  # rows [z_n, v_n]
        self.states[0, :, :h], self.states[:, :, -1], self.current[:, :, -1] = 0, 1, 1
        hidden, driven, now = self.states[:, :, :h], empty(k, s, 3 * h, b), empty(k - m, s, 3 * h, b)
        of_history = driven, driven, self.recurrent, hidden[:-1], hidden[1:]
        of_current = driven[m:], now, self.recurrent[m:], hidden[m:-1], self.current[:, :, :h]
        self.history_cells, self.current_cells = (
            [_Cell(*step) for step in zip(*(part.unbind(0) for part in parts), strict=True)]
            for parts in (of_history, of_current)
        )
        self.gradients = _Gradient(empty(s, 4 * h, b)), _Gradient(empty(s, 4 * h, b))


class _Cell:
    """A cell at one step, as views (S, rows, B) of what it works on: what reset, update and candidate see, in whose
    place their `values` may come; W_h h_(n-1) of the candidate; h_(n-1); and the new state, without its bias."""

    def __init__(self, driven: Tensor, values: Tensor, recurrent: Tensor, hidden: Tensor, new: Tensor) -> None:
        h = hidden.shape[1]
        self.driven, self.recurrent, self.hidden, self.new = driven, recurrent, hidden, new
        self.driven_gates, self.driven_candidate = driven.split((2 * h, h), dim=1)
        self.gates, self.candidate = values.split((2 * h, h), dim=1)
        self.reset, self.update = self.gates.split(h, dim=1)

    def run(self) -> None:
        torch.sigmoid(self.driven_gates, out=self.gates)
        torch.addcmul(self.driven_candidate, self.reset, self.recurrent, out=self.candidate)
        self.candidate.mul_(2).sigmoid_().mul_(2).sub_(1)  # tanh, for which torch takes up to three times as long
        torch.lerp(self.candidate, self.hidden, self.update, out=self.new)

    def differentiate(self, dnew: Tensor, d: "_Gradient") -> None:
        """The gradient by `driven` and `recurrent`, from that by the new state."""
        torch.addcmul(dnew, dnew, self.update, value=-1, out=d.candidate)
        _tanh_backward(d.candidate, self.candidate, grad_input=d.candidate)
        torch.mul(d.candidate, self.reset, out=d.recurrent)
        torch.mul(d.candidate, self.recurrent, out=d.reset)
        torch.sub(self.hidden, self.candidate, out=d.update).mul_(dnew)
        _sigmoid_backward(d.gates, self.gates, grad_input=d.gates)


class _Gradient:
    """The gradient by the sums of one step, (S, 4 H, B), and views of its parts."""

    def __init__(self, whole: Tensor) -> None:
        h = whole.shape[1] // 4
        self.whole, self.whole_t = whole, whole.mT
        self.driven, self.gates = whole[:, : 3 * h], whole[:, : 2 * h]
        self.driven_t = self.driven.mT
        self.reset, self.update, self.candidate, self.recurrent = whole.split(h, dim=1)


_tanh_backward = torch.ops.aten.tanh_backward.grad_input
_sigmoid_backward = torch.ops.aten.sigmoid_backward.grad_input


class Rollouts:
    """`roll_out_gru` of one network, again and again. A GPU takes longer to be told of the thousands of small products
    of a rollout than to compute them: there the first rollout of each shape is recorded, and played again."""

    def __init__(self, network: Network) -> None:
        self._network, self._weights = network, tuple(network.weights.values())
        self._ready: dict[tuple[torch.Size, ...], Callable[..., Tensor]] = {}

    def __call__(self, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
        """Predictions (S, B, K - m), see `prediction.run_free`."""
        shapes = x.shape, z.shape
        if shapes not in self._ready:
            self._ready[shapes] = self._prepare(x, z, v)
        return self._ready[shapes](x, z, v, *self._weights)

    def _prepare(self, *data: Tensor) -> Callable[..., Tensor]:
        workspace = Workspace()

        def roll_out(x: Tensor, z: Tensor, v: Tensor, *weights: Tensor) -> Tensor:
            named = dict(zip(self._network.weights, weights, strict=True))
            return roll_out_gru(replace(self._network, weights=named), x, z, v, workspace)

        if not data[0].is_cuda:
            return roll_out
        given = *(values.clone() for values in data), *(w.detach().clone().requires_grad_() for w in self._weights)
        with warnings.catch_warnings(action="ignore"):  # of streams, which recording has several of
            return cast(Callable[..., Tensor], torch.cuda.make_graphed_callables(roll_out, given))


def roll_out_gru(network: Network, x: Tensor, z: Tensor, v: Tensor, workspace: Workspace) -> Tensor:
    """`prediction.run_free`, with the derivatives of weights only; a workspace of its own for every shape that rollouts
    alternate between."""
    weights, (gates, readout) = network.weights, pack(network)
    given = gates, weights["angle"], weights["state_bias"], readout, x, z, v, workspace
    predicted: Tensor = _GRURollout.apply(*given)  # type: ignore[no-untyped-call]
    return predicted


def pack(network: Network) -> tuple[Tensor, Tensor]:
    """The weights of the two large products of a step: from [h, x, 1] to what reset, update, candidate by x and
    candidate by h see, (S, H + X + 1, 4 H); and from [state of the current cell without its bias, z, v, 1] to the next
    z and v, (S, H + 3, 2)."""
    weights, scaling = network.weights, network.scaling
    w_h, driven = weights["hidden"], torch.cat((weights["input"], weights["bias"]), dim=1)
    h = w_h.shape[1]
    of_gates = torch.cat((w_h[..., : 2 * h], driven[..., : 2 * h]), dim=1)
    by_x, by_h = F.pad(driven[..., 2 * h :], (0, 0, h, 0)), F.pad(w_h[..., 2 * h :], (0, 0, 0, driven.shape[1]))
    gates = torch.cat((of_gates, by_x, by_h), dim=-1)
    output, output_bias = weights["output"], weights["output_bias"]
    carried = torch.eye(2, dtype=output.dtype, device=output.device)
    carried[1, 0].fill_(scaling.step)
    bend = scaling.bend * torch.cat((output, output_bias + torch.bmm(weights["state_bias"], output)), dim=1)
    moved = torch.cat((scaling.step * bend, bend), dim=-1)
    return gates, torch.cat((moved[:, :-1], carried.expand(len(output), 2, 2), moved[:, -1:]), dim=1)


class _GRURollout(torch.autograd.Function):
    """The steps of `roll_out_gru` and their derivatives by all weights (the data has none)."""

    @staticmethod
    def forward(ctx: Any, *given: Any) -> Tensor:
        gates, angle, state_bias, readout, x, z, v, workspace = given
        workspace.fit(x, z, gates)
        h, m = state_bias.shape[-1], z.shape[-1]
        workspace.states[:-1].transpose(0, 1)[:, :, h:-1] = x.movedim(-3, -1)
        workspace.features[:m, :, 0], workspace.features[:m, :, 1] = z.movedim(-1, 0), v.movedim(-1, 0)
        parts = workspace.states, workspace.recurrent, workspace.features
        states, recurrent, features = (part.unbind(0) for part in parts)
        current, before = workspace.current.unbind(0), workspace.current[:, :, h:-1].unbind(0)
        bias = state_bias.mT.expand_as(recurrent[0]).contiguous()
        to_driven, to_recurrent = gates[..., : 3 * h].mT, gates[..., 3 * h :].mT
        to_seen, to_features = angle.mT, readout.mT
        for n, cell in enumerate(workspace.history_cells):
            torch.bmm(to_driven, states[n], out=cell.driven)
            torch.bmm(to_recurrent, states[n], out=recurrent[n])
            if n >= m:
                workspace.current_cells[n - m].run()
                before[n - m].copy_(features[n - 1])
                torch.bmm(to_features, current[n - m], out=features[n])
            cell.driven.baddbmm_(to_seen, features[n])
            cell.run()
            cell.new.add_(bias)
        ctx.workspace, ctx.turn = workspace, workspace.turn
        ctx.save_for_backward(gates, angle, readout)
        return workspace.features[m:, :, 0].movedim(0, -1).clone()

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, dpredicted: Tensor) -> tuple[Tensor | None, ...]:
        workspace = ctx.workspace
        assert ctx.turn == workspace.turn, "another rollout took the workspace before the backward pass"
        gates, angle, readout = ctx.saved_tensors
        steps = workspace.states, workspace.features, workspace.current
        states, features, current = (part.unbind(0) for part in steps)
        h, m = angle.shape[-1] // 3, len(features) - len(current)
        by_state, (seen, now) = gates[:, :h], workspace.gradients
        dgates, dangle, dreadout = (torch.zeros_like(w) for w in (gates, angle, readout))
        dnew, dbias, carried = torch.zeros((3, *workspace.recurrent[0].shape), dtype=gates.dtype, device=gates.device)
        all_dfeatures = torch.zeros_like(workspace.features[m:])
        all_dfeatures[:, :, 0] = dpredicted.movedim(-1, 0)
        dfeatures, dfeatures_t = all_dfeatures.unbind(0), all_dfeatures.mT.unbind(0)
        dcurrent = torch.zeros_like(current[0])
        dcell, dbefore = dcurrent[:, :h], dcurrent[:, h:-1]
        for n in reversed(range(len(features))):
            cell = workspace.history_cells[n]
            dbias.add_(dnew)
            cell.differentiate(dnew, seen)
            dangle.baddbmm_(features[n], seen.driven_t)
            torch.mul(dnew, cell.update, out=carried)
            if n >= m:
                cell, i = workspace.current_cells[n - m], n - m
                dfeatures[i].baddbmm_(angle, seen.driven).add_(dbefore)
                dreadout.baddbmm_(current[i], dfeatures_t[i])
                torch.bmm(readout, dfeatures[i], out=dcurrent)
                cell.differentiate(dcell, now)
                carried.addcmul_(dcell, cell.update)
                seen.whole.add_(now.whole)
            dgates.baddbmm_(states[n], seen.whole_t)
            torch.baddbmm(carried, by_state, seen.whole, out=dnew)
        return dgates, dangle, dbias.sum(-1).unsqueeze(1), dreadout, None, None, None, None
