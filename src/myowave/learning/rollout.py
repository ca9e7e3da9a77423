"""Rollouts: the network fed by its own predictions, with the hidden state carried along (Fig. 4b, Fig. 5).

A window has `history` samples where the angle is given, then samples where it is predicted. The hidden state starts at
0 and is carried from sample to sample: the history cell and the current cell of a sample share W_h h_(n-1) and W_x x_n
and differ by W_q q_n alone, so a step costs one product with W_h instead of one for each sample of history.

`roll_out` is the definition, in plain torch. `GRURollout` is the same map for the GRU with a backward pass written by
hand: in place, on preallocated memory, and the gradients of the weights as one large product after the loop.

Shapes: S seeds, B windows, K samples of a window of which m are history, X inputs, Q features, H hidden, G gates.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.learning.network import Architecture, Scaling, Weights, angle_features, apply_cell, read_out


@dataclass(frozen=True)
class Units:
    """How a standardised output moves the standardised angle: v += bend * output, z += step * v."""

    bend: float
    step: float

    @classmethod
    def of(cls, scaling: Scaling) -> "Units":
        return cls(bend=scaling.bend_std / scaling.step_std, step=scaling.step_std / scaling.angle_std)


def drive(weights: Weights, x: Tensor) -> Tensor:
    """W_x x + b for every sample, (S, B, K, G), from inputs (B, K, X) or (S, B, K, X)."""
    flat = x.flatten(-3, -2)
    seeds = weights["input"].shape[0]
    flat = flat.expand(seeds, *flat.shape[-2:])
    return torch.baddbmm(weights["bias"], flat, weights["input"]).unflatten(1, x.shape[-3:-1])


def advance(
    architecture: Architecture, units: Units, weights: Weights, hidden: Tensor, z: Tensor, v: Tensor, driven: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """One predicted sample: the current cell gives the angle, the history cell takes it in.

    Args:
        hidden: (S, B, H).
        z, v: standardised angle and step of the last sample, (S, B).
        driven: `drive` of this sample, (S, B, G).

    Returns:
        hidden, z, v of this sample.
    """
    recurrent = torch.bmm(hidden, weights["hidden"])
    output = read_out(weights, apply_cell(architecture.cell, weights, hidden, driven, recurrent))
    if architecture.increments:
        v = v + units.bend * output
        z = z + units.step * v
    else:
        v, z = (output - z) / units.step, output
    seen = driven + torch.matmul(angle_features(architecture, z, v), weights["angle"])
    return apply_cell(architecture.cell, weights, hidden, seen, recurrent), z, v


def warm_up(architecture: Architecture, weights: Weights, driven: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Hidden state (S, B, H) after history cells over samples where the angle is known.

    Args:
        driven: (S, B, m, G).
        z, v: (S, B, m).
    """
    seen = driven + torch.matmul(angle_features(architecture, z, v), weights["angle"].unsqueeze(1))
    hidden = seen.new_zeros(*seen.shape[:2], architecture.hidden)
    for driven_i in seen.unbind(2):
        hidden = apply_cell(architecture.cell, weights, hidden, driven_i)
    return hidden


def roll_out(
    architecture: Architecture, units: Units, weights: Weights, x: Tensor, z: Tensor, v: Tensor
) -> Tensor:
    """Predict windows from their history.

    Args:
        x: inputs of all samples, (B, K, X) or (S, B, K, X).
        z, v: standardised angle and step of the history, (S, B, m).

    Returns:
        Standardised predictions, (S, B, K - m).
    """
    history = z.shape[-1]
    driven = drive(weights, x)
    hidden = warm_up(architecture, weights, driven[:, :, :history], z, v)
    z, v = z[..., -1], v[..., -1]
    predicted = []
    for driven_n in driven[:, :, history:].unbind(2):
        hidden, z, v = advance(architecture, units, weights, hidden, z, v, driven_n)
        predicted.append(z)
    return torch.stack(predicted, dim=-1)


class Workspace:
    """Memory that rollouts of one shape use again and again; allocating it each time costs more than the arithmetic."""

    def __init__(self) -> None:
        self._buffers: dict[str, Tensor] = {}

    def take(self, name: str, shape: tuple[int, ...], like: Tensor) -> Tensor:
        """An uninitialised tensor; the one given out before under this name must no longer be in use."""
        kept = self._buffers.get(name)
        if kept is None or kept.shape != shape or kept.dtype != like.dtype or kept.device != like.device:
            kept = self._buffers[name] = torch.empty(shape, dtype=like.dtype, device=like.device)
        return kept


def rollout_gradients(
    units: Units,
    weights: Weights,
    x: Tensor,
    z: Tensor,
    v: Tensor,
    target: Tensor,
    weight: Tensor,
    workspace: Workspace,
) -> tuple[Tensor, dict[str, Tensor]]:
    """Weighted mean square error of rollouts of an increment GRU, and its gradients, by hand.

    Args:
        x, z, v: as for `roll_out`.
        target: standardised angle at the predicted samples, (S, B, L).
        weight: of each squared error, (S, B, 1) or (S, B, L); the loss is their weighted sum.

    Returns:
        Loss of each seed (S,), and the gradient of its sum by every weight.
    """
    w_h, w_q, w_o = weights["hidden"], weights["angle"], weights["output"]
    b_h, b_o = weights["state_bias"], weights["output_bias"]
    (s, b, m), k, h = z.shape, x.shape[-2], w_h.shape[1]
    take = workspace.take
    flat = x.movedim(-2, -3).flatten(-3, -2)  # (..., K B, X): samples outside, so that a step is contiguous
    flat = flat.expand(s, *flat.shape[-2:])
    driven = take("driven", (s, k * b, 3 * h), w_h)
    torch.baddbmm(weights["bias"], flat, weights["input"], out=driven)
    driven = driven.view(s, k, b, 3 * h)
    states = take("states", (s, k + 1, b, h), w_h)  # h_(n-1) at place n
    recurrent = take("recurrent", (s, k, b, 3 * h), w_h)
    gates1, gates2 = take("gates1", (s, k, b, 2 * h), w_h), take("gates2", (s, k, b, 2 * h), w_h)
    cand1, cand2 = take("cand1", (s, k, b, h), w_h), take("cand2", (s, k, b, h), w_h)
    current = take("current", (s, k, b, h), w_h)
    features = take("features", (s, k, b, 2), w_h)
    features[:, :m, :, 0], features[:, :m, :, 1] = z.transpose(1, 2), v.transpose(1, 2)
    states[:, 0] = 0
    seen = take("seen", (s, b, 3 * h), w_h)
    output = take("output", (s, b, 1), w_h)
    zn, vn = z[..., -1].clone(), v[..., -1].clone()

    for n in range(k):
        hidden, g, d = states[:, n], recurrent[:, n], driven[:, n]
        torch.bmm(hidden, w_h, out=g)
        gru, gc = g[..., : 2 * h], g[..., 2 * h :]
        pre = seen[..., : 2 * h]
        if n >= m:
            ru, c, new = gates1[:, n], cand1[:, n], current[:, n]
            torch.add(gru, d[..., : 2 * h], out=pre)
            torch.sigmoid(pre, out=ru)
            torch.addcmul(d[..., 2 * h :], ru[..., :h], gc, out=c).tanh_()
            torch.lerp(c, hidden, ru[..., h:], out=new).add_(b_h)
            torch.baddbmm(b_o, new, w_o, out=output)
            vn.add_(output[..., 0], alpha=units.bend)
            zn.add_(vn, alpha=units.step)
            features[:, n, :, 0], features[:, n, :, 1] = zn, vn
        torch.baddbmm(d, features[:, n], w_q, out=seen)
        ru, c, new = gates2[:, n], cand2[:, n], states[:, n + 1]
        pre.add_(gru)
        torch.sigmoid(pre, out=ru)
        torch.addcmul(seen[..., 2 * h :], ru[..., :h], gc, out=c).tanh_()
        torch.lerp(c, hidden, ru[..., h:], out=new).add_(b_h)

    error = features[:, m:, :, 0] - target.transpose(1, 2)  # (S, L, B)
    weighted = weight.transpose(1, 2) * error
    loss = (weighted * error).sum((1, 2))
    dpredicted = 2 * weighted

    dseen = take("dseen", (s, k, b, 3 * h), w_h)
    ddriven = take("ddriven", (s, k, b, 3 * h), w_h)
    drecurrent = take("drecurrent", (s, k, b, 3 * h), w_h)
    dstates = take("dstates", (s, k, b, h), w_h)
    doutput = take("doutput", (s, k, b, 1), w_h)
    doutput[:, :m] = 0
    dcurrent = take("dcurrent", (s, k, b, h), w_h)
    dhidden = torch.zeros_like(dstates[:, 0])
    dz, dv = torch.zeros_like(zn), torch.zeros_like(vn)
    scratch = (take("scratch1", (s, b, h), w_h), take("scratch2", (s, b, h), w_h), take("scratch3", (s, b, 2 * h), w_h))
    w_ht, w_qt, w_ot = w_h.mT, w_q.mT, w_o.mT
    dfeatures = take("dfeatures", (s, b, 2), w_h)

    for n in reversed(range(k)):
        hidden, gc, dg = states[:, n], recurrent[:, n, :, 2 * h :], drecurrent[:, n]
        dstates[:, n] = dhidden
        carried = _cell_backward(dhidden, hidden, gates2[:, n], cand2[:, n], gc, dseen[:, n], dg[..., 2 * h :], scratch)
        dg[..., : 2 * h] = dseen[:, n, :, : 2 * h]
        if n >= m:
            torch.bmm(dseen[:, n], w_qt, out=dfeatures)
            dz += dfeatures[..., 0]
            dz += dpredicted[:, n - m]
            dv += dfeatures[..., 1]
            dv.add_(dz, alpha=units.step)
            torch.mul(dv, units.bend, out=doutput[:, n, :, 0])
            dnew = dcurrent[:, n]
            torch.mul(doutput[:, n], w_ot, out=dnew)
            dd, dgc = ddriven[:, n], take("dgc", (s, b, h), w_h)
            carried = carried.add_(
                _cell_backward(dnew, hidden, gates1[:, n], cand1[:, n], gc, dd, dgc, scratch, name=1)
            )
            dg[..., 2 * h :] += dgc
            dg[..., : 2 * h] += dd[..., : 2 * h]
        dhidden = torch.baddbmm(carried, dg, w_ht)
    ddriven[:, :m] = 0
    ddriven += dseen

    def flatten(t: Tensor) -> Tensor:
        return t.flatten(1, 2)

    return loss, {
        "hidden": torch.bmm(states[:, :k].flatten(1, 2).mT, flatten(drecurrent)),
        "input": torch.bmm(flat.mT, flatten(ddriven)),
        "angle": torch.bmm(flatten(features).mT, flatten(dseen)),
        "bias": flatten(ddriven).sum(1, keepdim=True),
        "state_bias": flatten(dstates).sum(1, keepdim=True) + flatten(dcurrent[:, m:]).sum(1, keepdim=True),
        "output": torch.bmm(flatten(current[:, m:]).mT, flatten(doutput[:, m:])),
        "output_bias": flatten(doutput).sum(1, keepdim=True),
    }


def _cell_backward(dnew, hidden, ru, c, gc, dpre, dgc, scratch, name=0):
    h = hidden.shape[-1]
    r, u = ru[..., :h], ru[..., h:]
    a, _, wide = scratch
    # c part: dc = dnew (1 - u), through tanh
    dc = dpre[..., 2 * h :]
    carried = torch.mul(dnew, u)
    torch.sub(dnew, carried, out=dc)
    torch.mul(c, c, out=a)
    dc.addcmul_(dc, a, value=-1)
    torch.mul(dc, r, out=dgc)
    dgates = dpre[..., : 2 * h]
    torch.mul(dc, gc, out=dgates[..., :h])
    torch.sub(hidden, c, out=a)
    torch.mul(dnew, a, out=dgates[..., h:])
    torch.addcmul(ru, ru, ru, value=-1, out=wide)
    dgates.mul_(wide)
    return carried
