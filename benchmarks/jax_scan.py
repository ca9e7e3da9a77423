"""The same network and loss in JAX: the steps in `lax.scan`, an epoch with its Adam jitted, on one core.

An optional row of `benchmarks/learning.py`: JAX is no requirement of myowave.

Shapes: S seeds, B windows, K samples of a window of which m are history, X inputs, H hidden units.
"""

import importlib.util
import os
from collections.abc import Callable, Mapping

import numpy as np
from torch import Tensor

from myowave.learning.network import Network

HOW_TO = "JAX is not installed, so its row is left out; `pip install jax` into the environment adds it."
ONE_CORE = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


def is_there() -> bool:
    """Whether JAX can be imported."""
    return importlib.util.find_spec("jax") is not None


class JaxScan:
    """Epochs of the network in JAX, all seeds at once.

    Args:
        network: where its weights start.
        draw: windows of an epoch, x (B, K, X), z and v (1, B, K).
        rate: step of Adam.
    """

    def __init__(self, network: Network, draw: Callable[[], tuple[Tensor, Tensor, Tensor]], rate: float) -> None:
        os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {ONE_CORE}"  # read as JAX starts
        import jax
        import jax.numpy as jnp

        self._draw = draw
        self.weights = {name: jnp.asarray(w.detach().numpy()) for name, w in network.weights.items()}
        zeros = {name: jnp.zeros_like(w) for name, w in self.weights.items()}
        self._moments, self._count = (zeros, zeros), jnp.zeros(())
        loss = build_loss(network)
        self.losses = jax.jit(loss)

        def step(weights, moments, count, windows):
            gradients = jax.grad(lambda w: loss(w, *windows).sum())(weights)
            norm = jnp.sqrt(sum(jnp.square(g).sum((1, 2)) for g in gradients.values()))
            factor = (1.0 / jnp.maximum(norm, 1.0))[:, None, None]
            gradients = {name: factor * g for name, g in gradients.items()}
            first, second, count = dict(moments[0]), dict(moments[1]), count + 1
            for name, g in gradients.items():
                first[name] = 0.9 * first[name] + 0.1 * g
                second[name] = 0.99 * second[name] + 0.01 * g * g
                size = jnp.sqrt(second[name] / (1 - 0.99**count)) + 1e-8
                weights = weights | {name: weights[name] - rate * first[name] / (1 - 0.9**count) / size}
            return weights, (first, second), count

        self._step = jax.jit(step)

    def epoch(self) -> None:
        """One step of Adam; the first call compiles."""
        windows = tuple(values.numpy() for values in self._draw())
        self.weights, self._moments, self._count = self._step(self.weights, self._moments, self._count, windows)
        self.weights["bias"].block_until_ready()


def build_loss(network: Network) -> Callable:
    """Mean square error of each seed (S,), standardised, by weights and windows x (B, K, X), z and v (1, B, K)."""
    import jax
    import jax.numpy as jnp

    m, h = network.history, network.architecture.hidden
    bend, pace = network.scaling.bend, network.scaling.step

    def cell(w: Mapping, hidden, driven):
        recurrent = hidden @ w["hidden"]
        gates = jax.nn.sigmoid(recurrent[..., : 2 * h] + driven[..., : 2 * h])
        reset, update = gates[..., :h], gates[..., h:]
        candidate = jnp.tanh(driven[..., 2 * h :] + reset * recurrent[..., 2 * h :])
        return candidate + update * (hidden - candidate) + w["state_bias"]

    def loss(w: Mapping, x, z, v):
        driven = jnp.moveaxis(jnp.einsum("bkx,sxg->sbkg", x, w["input"]) + w["bias"][:, None], 2, 0)  # K first
        seeds = (w["hidden"].shape[0], *z.shape[1:])
        z, v = (jnp.moveaxis(jnp.broadcast_to(values, seeds), 2, 0) for values in (z, v))

        def see(driven_n, z_n, v_n):
            return driven_n + jnp.stack((z_n, v_n), axis=-1) @ w["angle"]

        def given(hidden, sample):
            return cell(w, hidden, see(*sample)), None

        def predict(carried, driven_n):
            hidden, z_n, v_n = carried
            output = (cell(w, hidden, driven_n) @ w["output"] + w["output_bias"])[..., 0]
            v_n = v_n + bend * output
            z_n = z_n + pace * v_n
            return (cell(w, hidden, see(driven_n, z_n, v_n)), z_n, v_n), z_n

        hidden, _ = jax.lax.scan(given, jnp.zeros((*seeds[:2], h)), (driven[:m], z[:m], v[:m]))
        _, predicted = jax.lax.scan(predict, (hidden, z[m - 1], v[m - 1]), driven[m:])
        return jnp.square(predicted - z[m:]).mean((0, 2))

    return loss


def compare_with_definition(scan: JaxScan, network: Network) -> float:
    """Largest difference of the loss of a seed from that of `prediction.run_free`, which defines it."""
    from myowave.learning.prediction import run_free

    x, z, v = scan._draw()
    history = [values[..., : network.history].expand(network.seeds, -1, -1) for values in (z, v)]
    expected = (run_free(network, x, *history) - z[..., network.history :]).square().mean((1, 2)).detach().numpy()
    return float(np.abs(np.asarray(scan.losses(scan.weights, x.numpy(), z.numpy(), v.numpy())) - expected).max())
