"""The orthogonal factor by few products, against singular values and Chebyshev's theorem."""

import numpy as np
import pytest
import torch
from scipy.optimize import minimize

from baselines.training.optimizer import ITERATIONS, LOWEST
from baselines.training.polar import best_quintic, inverse_square_root, quintics_for


def value(quintic, x):
    return quintic[0] * x + quintic[1] * x**3 + quintic[2] * x**5


@pytest.mark.parametrize(("low", "high"), [(0.01, 1.0), (0.1, 1.9), (0.5, 1.5)])
def test_the_best_quintic_goes_through_its_largest_error_four_times_and_none_is_better(low, high):
    quintic, error = best_quintic(low, high)
    x = np.linspace(low, high, 200_001)
    off = value(quintic, x) - 1
    assert np.abs(off).max() == pytest.approx(error, rel=1e-6)
    reached = np.sign(off[np.abs(off) > error * (1 - 1e-6)])
    assert 1 + np.count_nonzero(np.diff(reached)) == 4  # alternating: Chebyshev's theorem

    def largest(coefficients):
        return np.abs(value(coefficients, x[::100]) - 1).max()

    found = minimize(largest, quintic, method="Nelder-Mead", options={"maxiter": 2000})
    assert found.fun > error * (1 - 1e-4)


def test_more_quintics_bring_values_nearer_to_one_and_keep_them_in_order_of_the_promise():
    errors = []
    for count in (1, 2, 3, 4, 5):
        x = np.geomspace(0.01, 1, 10_001)
        for quintic in quintics_for(0.01, count):
            x = value(quintic, x)
        errors.append(np.abs(x - 1).max())
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("shape", [(7, 5, 30), (3, 8, 40), (1, 16, 16)])
def test_steps_have_the_gradients_singular_vectors_and_values_near_one(shape):
    torch.manual_seed(0)
    gradients = torch.randn(shape, dtype=torch.float64) * 1e-4
    quintics = quintics_for(LOWEST, ITERATIONS)
    steps = inverse_square_root(gradients @ gradients.mT, quintics) @ gradients
    u, s, vh = torch.linalg.svd(gradients, full_matrices=False)
    inside = u.mT @ steps @ vh.mT
    values = inside.diagonal(dim1=1, dim2=2)
    off_diagonal = inside - torch.diag_embed(values)
    assert off_diagonal.abs().max() < 1e-9
    # The largest is divided by at most the eighth root of the sum of eighth powers: 16^(1/8) < 1.5.
    kept = s / s.amax(dim=1, keepdim=True) > 1.5 * LOWEST
    assert values[kept].min() > 0.7
    assert values.max() < 1.3


def test_single_precision_is_enough_and_rows_of_zeros_change_nothing():
    torch.manual_seed(0)
    u, _, vh = torch.linalg.svd(torch.randn(2, 24, 60, dtype=torch.float64), full_matrices=False)
    gradients = (u * torch.logspace(0, -3, 24, dtype=torch.float64)) @ vh
    quintics = quintics_for(LOWEST, ITERATIONS)
    exact = inverse_square_root(gradients @ gradients.mT, quintics) @ gradients
    single = gradients.float()
    grams = torch.zeros(2, 32, 32)
    grams[:, :24, :24] = single @ single.mT
    found = inverse_square_root(grams, quintics)[:, :24, :24] @ single
    torch.testing.assert_close(found.double(), exact, rtol=0, atol=1e-2)


def test_gradients_of_nothing_give_no_step():
    for scale in (0.0, 1e-25):
        gradients = torch.full((1, 4, 6), scale)
        root = inverse_square_root(gradients @ gradients.mT, quintics_for(LOWEST, ITERATIONS))
        assert (root @ gradients).abs().max() < 1e-3


def test_matrices_of_a_stack_have_nothing_to_do_with_each_other():
    """Matrices of any size; an orthogonal factor does not depend on it at all."""
    torch.manual_seed(1)
    quintics = quintics_for(LOWEST, ITERATIONS)
    gradients = torch.randn(4, 6, 20, dtype=torch.float64)
    scaled = gradients * torch.tensor([1e-6, 1e-2, 1.0, 1e3])[:, None, None].double()
    together = inverse_square_root(scaled @ scaled.mT, quintics) @ scaled
    for alone, found in zip(gradients, together, strict=True):
        root = inverse_square_root((alone @ alone.mT)[None], quintics)[0]
        torch.testing.assert_close(found, root @ alone, rtol=0, atol=1e-9)
