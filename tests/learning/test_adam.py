"""Adam, beside Algorithm 1 of Kingma & Ba 2015, at a rate of its own in each step."""

import numpy as np
import torch

from myowave.learning.optimisers import Adam

BETAS, RATES = (0.9, 0.99), [0.01, 0.02, 0.005, 0.01]


def gradient(x):
    return 4 * x**3


def by_hand(x):
    mean = square = np.zeros_like(x)
    for t, rate in enumerate(RATES, 1):
        g = gradient(x)
        mean, square = BETAS[0] * mean + (1 - BETAS[0]) * g, BETAS[1] * square + (1 - BETAS[1]) * g**2
        x = x - rate * (mean / (1 - BETAS[0] ** t)) / (np.sqrt(square / (1 - BETAS[1] ** t)) + 1e-8)
    return x


def moved(optimizer, x, rates):
    for rate in rates:
        optimizer.zero_grad()
        (x**4).sum().backward()
        optimizer.move(rate)
    return x.detach()


def test_it_is_algorithm_1():
    start = np.array([[0.5, -1.0], [2.0, 1e-3]])
    x = torch.tensor(start, requires_grad=True)
    np.testing.assert_allclose(moved(Adam([x], BETAS), x, RATES).numpy(), by_hand(start), rtol=1e-5)
