"""Optimisers without torch's compiler take the steps of torch's own, bit for bit."""

import copy

import pytest
import torch

from baselines.training import untraced


@pytest.mark.parametrize("name", ["Adam", "AdamW"])
def test_steps_and_state_are_those_of_torchs_own(name):
    torch.manual_seed(0)
    ours = torch.nn.Linear(5, 3)
    theirs = copy.deepcopy(ours)
    settings = {"lr": 0.1, "weight_decay": 0.1, "fused": True}
    optimizers = [
        getattr(untraced, name)(ours.parameters(), **settings),
        getattr(torch.optim, name)(theirs.parameters(), **settings),
    ]
    for step in range(4):
        inputs = torch.randn(8, 5)
        for network, optimizer in zip((ours, theirs), optimizers, strict=True):
            optimizer.zero_grad()
            network(inputs).square().sum().backward()
            optimizer.step()
        if step == 1:  # goes on from the state of torch's own
            again = getattr(untraced, name)(ours.parameters(), **settings)
            again.load_state_dict(copy.deepcopy(optimizers[1].state_dict()))
            optimizers[0] = again
    for a, b in zip(ours.parameters(), theirs.parameters(), strict=True):
        assert torch.equal(a, b)
