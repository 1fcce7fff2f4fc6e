"""Muon against torch's own, against singular values, and kernel against matrix."""

import pytest
import torch

from baselines.training.optimizer import WARM_UP, Muon, Schedule, optimisation_of, orthogonalised


@pytest.mark.parametrize("shape", [(7, 5, 30), (3, 40, 8), (1, 16, 16)])
def test_steps_have_the_gradients_singular_vectors_and_values_near_one(shape):
    torch.manual_seed(0)
    gradients = torch.randn(shape, dtype=torch.float64)
    steps = orthogonalised(gradients)
    u, s, vh = torch.linalg.svd(gradients, full_matrices=False)
    inside = u.mT @ steps @ vh.mT
    values = inside.diagonal(dim1=1, dim2=2)
    off_diagonal = inside - torch.diag_embed(values)
    assert off_diagonal.abs().max() < 1e-12
    kept = s / s.norm(dim=1, keepdim=True) > 0.02  # smaller ones need more iterations
    assert values[kept].min() > 0.6
    assert values.max() < 1.25


def test_a_matrix_goes_where_torchs_own_muon_takes_it_and_kernels_step_as_matrices():
    torch.manual_seed(1)
    start, target = torch.randn(24, 40), torch.randn(24, 40)
    ours, theirs = (torch.nn.Parameter(start.clone()) for _ in range(2))
    settings = {"lr": 0.02, "momentum": 0.95, "weight_decay": 0.1}
    optimizers = (Muon([ours], **settings), torch.optim.Muon([theirs], **settings))
    for _ in range(10):
        for parameter, optimizer in zip((ours, theirs), optimizers, strict=True):
            optimizer.zero_grad()
            (parameter - target).square().sum().backward()
            optimizer.step()
    moved = (ours - start).norm()
    # torch iterates in bfloat16, which has three digits.
    assert (ours - theirs).norm() / moved < 0.02
    torch.manual_seed(2)
    kernels = [torch.nn.Parameter(torch.randn(6, 4, 3, 3)) for _ in range(3)]
    matrices = [torch.nn.Parameter(k.detach().reshape(6, 36).clone()) for k in kernels]
    together = Muon(kernels, lr=0.1, weight_decay=0.01)
    alone = [Muon([m], lr=0.1, weight_decay=0.01) for m in matrices]
    for _ in range(3):
        for kernel, matrix in zip(kernels, matrices, strict=True):
            kernel.grad = torch.randn(kernel.shape)
            matrix.grad = kernel.grad.reshape(6, 36)
        for optimizer in (together, *alone):
            optimizer.step()
    for kernel, matrix in zip(kernels, matrices, strict=True):
        torch.testing.assert_close(kernel.reshape(6, 36), matrix)


def test_rates_rise_then_fall_to_nothing_and_outputs_are_left_to_adamw():
    from baselines.training.pretrain import RoomsNetwork

    network = RoomsNetwork("googlenet", 0.125, 2)
    optimisation = optimisation_of("muon", network, Schedule(6400, 64, 0.3, 0.0))
    muon, adamw = optimisation._optimizers
    in_muon = {id(p) for group in muon.param_groups for p in group["params"]}
    assert id(network.heads.poses.weight) not in in_muon
    assert id(network.feature[2].weight) in in_muon
    n_all = sum(len(g["params"]) for o in (muon, adamw) for g in o.param_groups)
    assert n_all == len(list(network.parameters()))
    rates = []
    for _ in range(100):
        rates.append(optimisation.learning_rate)
        optimisation.step(network.heads.poses.bias.sum())
    rise = round(100 * WARM_UP)
    assert rates[: rise + 1] == pytest.approx([0.3 * (k + 1) / rise for k in range(rise)] + [0.3])
    assert rates[rise:] == pytest.approx([0.3 * (100 - k) / (100 - rise) for k in range(rise, 100)])
