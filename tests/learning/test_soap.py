"""SOAP, beside Adam where they must agree, and by what only SOAP has: it moves alike in any basis."""

import pytest
import torch

from myowave.learning.optimisers import EVERY, Adam, Soap

BETAS, STEPS = (0.9, 0.99), 3 * EVERY
STIFF = torch.tensor([1.0, 10.0, 100.0])


def bowl(x):
    """A loss that is bent unevenly, in the coordinates it is given in, for each of the leading axis."""
    return (STIFF[:, None] * (x - 1.0).square()).sum((-2, -1)) + x.sin().sum((-2, -1))


def start(seeds=2):
    return torch.randn(seeds, 3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)


def moved(optimiser, loss, steps=STEPS, rate=0.01):
    for _ in range(steps):
        optimiser.zero_grad()
        loss().sum().backward()
        optimiser.move(rate)


def run(x, loss, steps=STEPS, kind=Soap):
    x = x.clone().requires_grad_()
    moved(kind([x], BETAS), lambda: loss(x), steps)
    return x.detach()


def test_of_a_single_number_it_is_adam():
    x = start()[:, :1, :1]
    torch.testing.assert_close(run(x, lambda x: x**4), run(x, lambda x: x**4, kind=Adam), rtol=1e-4, atol=0)


def test_where_the_gradient_is_uncorrelated_it_is_adam():
    x = torch.diag(torch.tensor([0.5, -1.0, 2.0], dtype=torch.float64))[None]
    diagonal = torch.eye(3, dtype=torch.float64)
    soap, adam = (run(x, lambda x: diagonal * x**4, kind=kind) for kind in (Soap, Adam))
    torch.testing.assert_close(soap, adam, rtol=1e-3, atol=1e-9)


def test_it_moves_alike_in_any_basis():
    random = torch.Generator().manual_seed(2)
    left, right = (torch.linalg.qr(torch.randn(3, 3, generator=random, dtype=torch.float64)).Q for _ in range(2))
    turned = run(left @ start() @ right, lambda y: bowl(left.T @ y @ right.T))
    torch.testing.assert_close(turned, left @ run(start(), bowl) @ right, rtol=1e-6, atol=1e-8)


def test_weights_with_as_many_outputs_are_one_layer():
    whole = run(start(), bowl)
    parts = [start()[:, :2].clone().requires_grad_(), start()[:, 2:].clone().requires_grad_()]
    moved(Soap(parts, BETAS), lambda: bowl(torch.cat(parts, 1)))
    torch.testing.assert_close(torch.cat(parts, 1).detach(), whole)


def test_seeds_do_not_see_each_other_even_one_that_is_no_number():
    alone = run(start()[:1], bowl)
    beside = start()
    beside[1] = torch.nan
    torch.testing.assert_close(run(beside, bowl)[:1], alone)


def test_what_has_no_gradient_stays():
    x, idle = start().requires_grad_(), torch.ones(2, 3, 3, requires_grad=True)
    moved(Soap([x, idle], BETAS), lambda: bowl(x))
    torch.testing.assert_close(x.detach(), run(start(), bowl))
    assert torch.equal(idle.detach(), torch.ones(2, 3, 3))


@pytest.mark.parametrize("betas", [(0.9, 0.99), (0.5, 0.9)])
def test_its_first_step_is_as_long_as_the_rate_along_each_direction_of_the_gradient(betas):
    x = start(1).requires_grad_()
    before = x.detach().clone()
    moved(Soap([x], betas), lambda: bowl(x), 1, rate=0.01)
    torch.testing.assert_close(
        torch.linalg.svdvals(before - x.detach()), torch.full((1, 3), 0.01, dtype=torch.float64), rtol=0.02, atol=0
    )


def test_a_small_gradient_moves_as_a_large_one():
    small = run(start(), lambda x: 1e-6 * bowl(x))
    torch.testing.assert_close(small, run(start(), bowl), rtol=1e-6, atol=1e-8)


def test_its_basis_follows_the_gradient():
    """A bowl that turns after some steps: a basis of the time before makes another path."""
    random = torch.Generator().manual_seed(4)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=random, dtype=torch.float64)).Q
    x, y = (start(1).requires_grad_() for _ in range(2))
    early, fresh = Soap([x], BETAS), Soap([y], BETAS)
    moved(early, lambda: bowl(x), EVERY)
    with torch.no_grad():
        x.copy_(start(1))
    for optimiser, w in ((early, x), (fresh, y)):
        moved(optimiser, lambda w=w: bowl(turn @ w), 150 * EVERY, rate=1e-9)  # it only looks
    bases = [optimiser._layers[3].of_inputs for optimiser in (early, fresh)]
    torch.testing.assert_close(bases[0].abs(), bases[1].abs(), rtol=0, atol=0.05)
